//! Rolling: a touching point that moves over its body. Motion of second order against closed forms and
//! conserved energies, with the default integrator.

use crate::common::prelude::*;
use tumble_core::simulation::energy;

const G: f64 = 9.81;

fn world(bodies: Vec<RigidBody>, ground: Option<Plane>, friction: f64, time_step: f64) -> World {
    let gravity = Vector3::new(0.0, 0.0, -G);
    let rotation = Rotation::Momentum;
    World::new(Parameters { bodies, ground, gravity, friction, time_step, rotation }).unwrap()
}

fn state(position: [f64; 3], velocity: [f64; 3], spin: [f64; 3]) -> State {
    State { velocity: velocity.into(), spin: spin.into(), ..State::at_rest(position) }
}

/// Energies of the rows of a run above `rest` (J). All steps are solved as a whole.
fn energies(world: World, start: State, seconds: f64, rest: f64) -> Vec<f64> {
    let motion = Motion::native(&world);
    let steps = (seconds / world.time_step()).round() as usize;
    let mut simulation = Simulation::new(world, [start], motion).unwrap();
    let mut record = StepRecord::new();
    let energy =
        |simulation: &Simulation<'_>| energy::total(simulation.world(), simulation.states()) - rest;
    (0..steps)
        .map(|k| {
            simulation.step(&mut record).unwrap();
            let status = record.status();
            assert!(
                [StepStatus::Converged, StepStatus::Retried].contains(&status),
                "{k}: {status:?}"
            );
            energy(&simulation)
        })
        .collect()
}

fn mean(values: &[f64]) -> f64 {
    values.iter().sum::<f64>() / values.len() as f64
}

/// An ellipsoid rocks on level ground, without friction and without slip. Nothing takes energy, for 27 swings.
/// The mean over many swings differs from the first energy by an error of second order.
#[test]
fn a_rocking_ellipsoid_keeps_its_energy() {
    let inertia = Matrix3::from_diagonal(&Vector3::new(2e-4, 1.6e-3, 1.7e-3));
    let piece = Piece::ellipsoid(Vector3::new(0.1, 0.03, 0.02), 24).unwrap();
    let body = RigidBody::from_pieces(1.0, inertia, vec![piece]).unwrap();
    let start = State {
        attitude: Vector4::new(0.05_f64.cos(), 0.0, 0.05_f64.sin(), 0.0),
        ..state(
            [
                0.0,
                0.0,
                (0.02_f64.powi(2) * 0.1_f64.cos().powi(2) + (0.1 * 0.1_f64.sin()).powi(2)).sqrt(),
            ],
            [0.0; 3],
            [0.0; 3],
        )
    };
    let first = G * (start.position.z - 0.02);
    for friction in [0.0, 10.0] {
        let off = [0.002, 0.001].map(|h| {
            let world = world(vec![body.clone()], Some(Plane::level()), friction, h);
            let found = energies(world, start, 3.0, G * 0.02);
            let (early, late) =
                (mean(&found[..found.len() / 5]), mean(&found[found.len() * 4 / 5..]));
            assert!((late - early).abs() <= 2e-3 * first, "{friction} {h}: {early} {late}");
            late - first
        });
        assert!(
            off[0].abs() <= 8e-3 * first && off[1].abs() <= 0.35 * off[0].abs(),
            "{friction}: {off:?}"
        );
    }
}

/// A disc rolls on its rim without slip, leaning by 20°. The energy of 2 s differs by an error of second order.
#[test]
fn a_rolling_disc_keeps_its_energy() {
    let radius = 0.1;
    let half_width = 0.01;
    let spin = 12.0;
    let (sine, cosine) = 20.0_f64.to_radians().sin_cos();
    let axis = Vector3::new(cosine, 0.0, sine);
    let touched = -half_width * axis - radius * Vector3::new(-sine, 0.0, cosine);
    let half = 35.0_f64.to_radians();
    let start = State {
        attitude: Vector4::new(half.cos(), 0.0, half.sin(), 0.0),
        velocity: -(spin * axis).cross(&touched),
        ..state([0.0, 0.0, -touched.z], [0.0; 3], [0.0, 0.0, spin])
    };
    let piece = Piece::cylinder(half_width, radius, 48).unwrap();
    let body = RigidBody::solid(1.0, &[piece]).unwrap().0;
    let off = [0.002, 0.001].map(|h| {
        let world = world(vec![body.clone()], Some(Plane::level()), 10.0, h);
        let first = energy::total(&world, &[start]);
        let found = energies(world, start, 2.0, 0.0);
        (mean(&found[found.len() * 4 / 5..]) - first).abs() / first
    });
    assert!(off[0] <= 1e-4 && off[1] <= 0.5 * off[0], "{off:?}");
}

/// A ball rolls on a turntable that turns at W: its velocity turns at 2/7 W, so that it runs along a circle.
#[test]
fn a_ball_rolls_on_a_turntable_along_a_circle() {
    const TURN: f64 = 2.0;
    let off = [0.01, 0.005, 0.0025].map(|h| {
        let table = Piece::cylinder(0.05, 4.0, 64).unwrap();
        let table = RigidBody::solid(100.0, &[table]).unwrap().0;
        let ball = RigidBody::solid(0.1, &[Piece::sphere(0.05).unwrap()]).unwrap().0;
        let motor = Motor::Speed { target: TURN, max_force: 1e6 };
        let frames =
            [JointFrame::at(Vector3::zeros()), JointFrame::at(Vector3::new(0.0, 0.0, -0.05))];
        let hinge = Joint::revolute(0, None, frames, Drive { motor: Some(motor), ..Drive::NONE });
        let world = world(vec![table, ball], None, 2.0, h).with_joints(vec![hinge]).unwrap();
        let starts = [
            state([0.0, 0.0, -0.05], [0.0; 3], [0.0, 0.0, TURN]),
            // Without slip: v + ω × (−r e_z) = W × p.
            state([0.5, 0.0, 0.05], [0.0, 0.3, 0.0], [14.0, 0.0, 0.0]),
        ];
        let motion = Motion::native(&world);
        let mut simulation = Simulation::new(world, starts, motion).unwrap();
        for _ in 0..(1.0 / h).round() as usize {
            simulation.step(&mut StepRecord::new()).unwrap();
        }
        // v' = (2/7) W × v.
        let rate = 2.0 / 7.0 * TURN;
        let expected = [0.5 - 0.3 / rate * (1.0 - rate.cos()), 0.3 / rate * rate.sin()];
        let found = simulation.states()[1].position;
        (found.x - expected[0]).hypot(found.y - expected[1])
    });
    assert!(off[0] <= 4e-4, "{off:?}");
    assert!(off[1] <= 0.3 * off[0] && off[2] <= 0.3 * off[1], "{off:?}");
}
