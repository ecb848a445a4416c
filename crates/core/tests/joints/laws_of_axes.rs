//! Stops with restitution and dry friction over the speed, against closed forms in every mode of steps.

use crate::common::prelude::*;
use tumble_core::joint::FrictionCurve;
use tumble_core::world::Impacts;

const H: f64 = 1e-3;
const G: f64 = 9.81;

/// Names of the modes, each with the world in it.
fn modes(world: &World) -> [(&'static str, World); 4] {
    let [euler, world] =
        [Integrator::Euler, Integrator::Leapfrog].map(|of| world.clone().with_integrator(of));
    let located = world.clone().with_impacts(Impacts::Located);
    let accurate = world.clone().with_accuracy(Some(1e-4)).unwrap();
    [("euler", euler), ("steps", world), ("located", located), ("accuracy", accurate)]
}

/// World of a cube of 2 kg on a joint with the world, along z or about it, with gravity along −x, −y or −z.
fn held_cube(joint: impl Fn([JointFrame; 2]) -> Joint, gravity: Vector3<f64>) -> World {
    let frame = JointFrame::along(Vector3::zeros(), Vector3::z()).unwrap();
    let body = RigidBody::solid(2.0, &[Piece::cuboid(Vector3::repeat(0.1)).unwrap()]).unwrap().0;
    let parameters =
        Parameters { ground: None, gravity, time_step: H, ..Parameters::new(vec![body]) };
    World::new(parameters).unwrap().with_joints(vec![joint([frame; 2])]).unwrap()
}

/// States of the only body after each of `steps` steps, all of them solved.
fn run(name: &str, world: &World, start: State, steps: usize) -> Vec<State> {
    let mut simulation = Simulation::new(world.clone(), [start], Motion::native(world)).unwrap();
    let mut record = StepRecord::new();
    let take = |k| {
        simulation.step(&mut record).unwrap();
        assert!(record.status().is_solved(), "{name}, {k}: {}", record.status());
        *simulation.state()
    };
    (0..steps).map(take).collect()
}

/// A cube slides between two stops without friction. After n impacts its velocity is (−e)ⁿ v.
#[test]
fn a_slide_bounces_off_both_stops() {
    for restitution in [1.0, 0.8, 0.3] {
        let drive = Drive { limits: Some([-0.1, 0.1]), restitution, ..Drive::NONE };
        let world = held_cube(|frames| Joint::prismatic(0, None, frames, drive), Vector3::zeros());
        let start = State { velocity: Vector3::z() * 3.0, ..State::at_rest(Vector3::zeros()) };
        for (name, world) in modes(&world) {
            // Place and velocity after the last impact, and its time
            let (mut time, mut at, mut velocity, mut impacts) = (0.0, 0.0, 3.0, 0);
            for (k, state) in run(name, &world, start, 400).iter().enumerate() {
                let end = (k + 1) as f64 * H;
                while time + (f64::copysign(0.1, velocity) - at) / velocity <= end {
                    time += (f64::copysign(0.1, velocity) - at) / velocity;
                    (at, velocity) = (f64::copysign(0.1, velocity), -velocity * restitution);
                    impacts += 1;
                }
                // In whole steps an impact takes place up to a step early or late.
                let late = match name {
                    "located" => 1e-6,
                    "accuracy" => 1e-4,
                    _ => 7.0 * H * f64::from(impacts),
                };
                let (allowed, z) = (late + 1e-9, state.position[2]);
                let exact = at + velocity * (end - time);
                let near_impact = 0.1 - exact.abs() <= allowed + 3.0 * H;
                assert!(
                    (z - exact).abs() <= allowed || near_impact,
                    "{name}, {restitution}, {k}: {z} {exact}"
                );
                assert!(z.abs() < 0.1 + 1e-12, "{name}, {k}: {z}");
                let same = (state.velocity[2] - velocity).abs() < 1e-9;
                assert!(
                    same || near_impact,
                    "{name}, {restitution}, {k}: {} {velocity}",
                    state.velocity[2]
                );
            }
        }
    }
}

/// A cube falls along a vertical slide onto a stop: the bouncing ball. Its greatest height after n impacts is
/// e²ⁿ times the first one.
#[test]
fn a_falling_slide_bounces_to_the_heights_of_a_ball() {
    let drive = Drive { limits: Some([0.0, 2.0]), restitution: 0.8, ..Drive::NONE };
    let joint = |frames| Joint::prismatic(0, None, frames, drive);
    let world = held_cube(joint, Vector3::z() * -G);
    for (name, world) in modes(&world) {
        let states = run(name, &world, State::at_rest(Vector3::z() * 0.5), 3000);
        let heights: Vec<f64> = states.iter().map(|state| state.position[2]).collect();
        let tops = heights.windows(3).filter(|w| w[1] > w[0] && w[1] >= w[2]).map(|w| w[1]);
        for (n, top) in tops.take(5).enumerate() {
            let exact = 0.5 * 0.64_f64.powi(n as i32 + 1);
            let allowed = if ["located", "accuracy"].contains(&name) { 2e-5 } else { 2e-3 };
            assert!((top - exact).abs() < allowed, "{name}: {n}, {top} {exact}");
        }
        let end = states[states.len() - 1];
        assert!(end.position[2].abs() < 1e-9 && end.velocity.norm() < 1e-9, "{name}: {end:?}");
    }
}

/// A pendulum that swings onto a stop at its lowest point leaves it with e times its spin.
#[test]
fn a_pendulum_bounces_off_its_stop() {
    let drive = Drive { limits: Some([0.0, 3.0]), restitution: 0.7, ..Drive::NONE };
    let axis =
        |anchor: f64| JointFrame::along(Vector3::new(0.0, anchor, 0.0), Vector3::z()).unwrap();
    let joint = |_| Joint::revolute(0, None, [axis(0.5), axis(0.0)], drive);
    let world = held_cube(joint, Vector3::y() * -G);
    let turned = UnitQuaternion::from_axis_angle(&Vector3::z_axis(), 1.0);
    let attitude = Vector4::new(turned.w, turned.i, turned.j, turned.k);
    let start = State { attitude, ..State::at_rest(turned * Vector3::y() * -0.5) };
    // 1 − cos of the largest angle after an impact is e² times that before.
    for (name, world) in modes(&world) {
        let states = run(name, &world, start, 3000);
        let angles: Vec<f64> = states.iter().map(|state| 2.0 * state.attitude[3].asin()).collect();
        let tops = angles.windows(3).filter(|w| w[1] > w[0] && w[1] >= w[2]).map(|w| w[1]);
        for (n, top) in tops.take(4).enumerate() {
            let exact = f64::acos(1.0 - (1.0 - 1.0_f64.cos()) * 0.49_f64.powi(n as i32 + 1));
            let allowed = if ["located", "accuracy"].contains(&name) { 1e-4 } else { 0.02 };
            assert!((top - exact).abs() < allowed, "{name}: {n}, {top} {exact}");
        }
    }
}

/// A slide of 2 kg under a friction F (1 − v/v₁) to v₁ and F v/v₁ − F above: its speed follows exponentials.
#[test]
fn friction_follows_its_curve() {
    let curve = FrictionCurve::new(&[[0.0, 1.0], [1.0, 0.5], [2.0, 1.5]]).unwrap();
    let drive = Drive { friction: 4.0, friction_curve: Some(curve), ..Drive::NONE };
    let world = held_cube(|frames| Joint::prismatic(0, None, frames, drive), Vector3::zeros());
    let start = State { velocity: Vector3::z() * 2.0, ..State::at_rest(Vector3::zeros()) };
    // m v' = −F φ: first −4 (v − 0.5), then −4 (1 − v/2); with m = 2, v = 0.5 + 1.5 e^{−2t} to v = 1.
    let first = 3.0_f64.ln() / 2.0;
    let last = first + 2.0_f64.ln();
    let exact = |t: f64| match t {
        t if t < first => 0.5 + 1.5 * (-2.0 * t).exp(),
        t if t < last => 2.0 - (t - first).exp(),
        _ => 0.0,
    };
    for (name, world) in modes(&world) {
        let states = run(name, &world, start, 1500);
        let miss = |k: usize| (states[k].velocity[2] - exact((k + 1) as f64 * H)).abs();
        let worst = (0..1500).map(miss).fold(0.0, f64::max);
        assert!(worst < 4e-3, "{name}: {worst}");
        assert_eq!(states[1499].velocity[2], 0.0, "{name}");
    }
}

/// Checks that curves without meaning and laws that contradict each other are refused.
#[test]
fn wrong_laws_of_axes_are_refused() {
    let wrong: [&[[f64; 2]]; 7] = [
        &[[0.0, 1.0]],
        &[[0.1, 1.0], [1.0, 1.0]],
        &[[0.0, 1.0], [0.0, 2.0]],
        &[[0.0, 1.0], [2.0, 1.0], [1.0, 1.0]],
        &[[0.0, 1.0], [1.0, -0.1]],
        &[[0.0, 1.0], [f64::NAN, 1.0]],
        &[[0.0, 1.0]; 9],
    ];
    for points in wrong {
        assert!(FrictionCurve::new(points).is_err(), "{points:?}");
    }
    let curve = FrictionCurve::new(&[[0.0, 1.0], [1.0, 0.5]]).ok();
    let limits = Some([-0.1, 0.1]);
    let none = Drive::NONE;
    for drive in [
        Drive { limits, restitution: 1.1, ..none },
        Drive { limits, restitution: f64::NAN, ..none },
        Drive { friction: 1.0, friction_curve: curve, static_friction: Some(2.0), ..none },
    ] {
        let frames = [JointFrame::along(Vector3::zeros(), Vector3::z()).unwrap(); 2];
        let world = held_cube(|frames| Joint::prismatic(0, None, frames, none), Vector3::zeros());
        let joint = Joint::prismatic(0, None, frames, drive);
        assert!(world.with_joints(vec![joint]).is_err(), "{drive:?}");
    }
}

/// Checks that derivatives know how near a step is to another decision about a bounce: a cube that would come to its
/// stop with a thousandth of its speed left, or would just not.
#[test]
fn derivatives_know_the_margin_of_a_bounce() {
    let drive = Drive { limits: Some([0.0, 1.0]), restitution: 0.5, ..Drive::NONE };
    let world = held_cube(|frames| Joint::prismatic(0, None, frames, drive), Vector3::zeros());
    let world = world.with_integrator(Integrator::Euler);
    for (share, margin) in [(0.999, 2e-3), (1.001, 2e-3), (0.5, 1.0), (3.0, 4.0)] {
        let start = State {
            velocity: Vector3::z() * -2.0,
            ..State::at_rest(Vector3::z() * (share * 2.0 * H))
        };
        let mut simulation =
            Simulation::new(world.clone(), [start], Motion::native(&world)).unwrap();
        let (mut record, mut derivative) = (StepRecord::new(), StepDerivative::new());
        simulation.step(&mut record).unwrap();
        simulation.linearise(&record, &mut derivative).unwrap();
        let found = derivative.margin();
        assert!((found - margin).abs() < 1e-9, "{share}: {found}");
        let bounces = record.next_states()[0].velocity[2] > 0.0;
        assert_eq!(bounces, share < 1.0, "{share}");
    }
}
