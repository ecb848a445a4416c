//! Invariance of the laws under rotation of the world. A throw over a plane of any normal and
//! offset is the rotated motion. Holds for both solvers.

use crate::common;
use crate::common::prelude::*;

use proptest::prelude::*;
use proptest::test_runner::{RngSeed, TestRunner};
use tumble_core::simulation::Interval;

/// Rotation of the world, and a translation.
#[derive(Debug)]
struct Turn {
    quaternion: Vector4<f64>,
    matrix: Matrix3<f64>,
    shift: Vector3<f64>,
}

impl Turn {
    fn state(&self, state: &State) -> State {
        State {
            position: self.matrix * state.position + self.shift,
            attitude: left(&self.quaternion) * state.attitude,
            velocity: self.matrix * state.velocity,
            spin: state.spin,
        }
    }

    /// Rotated version of a world with the plane z = 0.
    fn world(&self, world: &World) -> World {
        let normal = self.matrix * Vector3::z();
        let ground = Plane::new(normal, normal.dot(&self.shift)).unwrap();
        let gravity = self.matrix * world.gravity();
        World::new(Parameters { ground: Some(ground), gravity, ..world.parameters().clone() })
            .unwrap()
    }
}

fn turns() -> impl Strategy<Value = Turn> {
    (common::quaternion(), proptest::array::uniform3(-3.0..3.0)).prop_map(|(q, shift)| {
        let quaternion = q.normalize();
        Turn { quaternion, matrix: rotation(&quaternion), shift: shift.into() }
    })
}

/// Box of 3 kg thrown on the ground under a force that varies in time.
fn throw() -> (World, State, Polyline) {
    let body = RigidBody::solid_box(3.0, Vector3::new(0.5, 0.3, 0.2)).unwrap();
    let usual = common::tutorial_parameters();
    let world = World::new(Parameters { bodies: vec![body], ..usual }).unwrap();
    let state = State {
        position: Vector3::new(0.0, 0.0, 0.8),
        attitude: Vector4::new(0.8, 0.3, -0.4, 0.2).normalize(),
        velocity: Vector3::new(1.0, -2.0, 0.5),
        spin: Vector3::new(1.0, 3.0, -2.0),
    };
    let push = vec![(0.1, Vector3::zeros()), (0.4, Vector3::new(20.0, 10.0, -5.0))];
    (world, state, Polyline::new(push).unwrap())
}

fn records(
    world: &World,
    start: State,
    push: Polyline,
    motion: Motion<'_>,
    steps: usize,
) -> Vec<StepRecord> {
    let mut simulation = Simulation::new(world.clone(), [start], motion).unwrap();
    let point = Vector3::new(0.5, 0.0, 0.1);
    simulation.set_load(0, Load::new(push, Polyline::default(), point).unwrap()).unwrap();
    common::prelude::steps(&mut simulation, steps, |_| true)
}

#[test]
fn a_turned_world_has_the_turned_motion() {
    let (world, start, push) = throw();
    let steps = 600;
    let level = records(&world, start, push.clone(), Motion::native(&world), steps);
    assert!(level.iter().any(|record| record.status() == StepStatus::Converged));
    let config = ProptestConfig { rng_seed: RngSeed::Fixed(19), cases: 30, ..Default::default() };
    TestRunner::new(config)
        .run(&turns(), |turn| {
            let turned_world = turn.world(&world);
            let knots = push.knots().iter().map(|(t, force)| (*t, turn.matrix * force));
            let turned_push = Polyline::new(knots.collect()).unwrap();
            let motion = Motion::native(&turned_world);
            let turned = records(&turned_world, turn.state(&start), turned_push, motion, steps);
            for (a, b) in level.iter().zip(&turned) {
                let (expected, found) = (turn.state(a.state()), b.state());
                // The solver repeats a velocity to 2e-9 m/s (docs/native-solver.md). An impact may
                // amplify it ten times.
                let apart = (expected.position - found.position).amax();
                prop_assert!(apart < 1e-7, "k = {}: {apart} m", a.index);
                prop_assert!((expected.velocity - found.velocity).amax() < 1e-6);
                let force = |record: &StepRecord| record.first().solution.total_force(0);
                let difference = turn.matrix * force(a) - force(b);
                // A force is an impulse over h: 3 kg/2 ms times the velocity's error.
                prop_assert!(difference.amax() < 2e-3, "k = {}: {difference}", a.index);
                prop_assert!(b.residual() < 1e-9);
            }
            Ok(())
        })
        .unwrap();
}

/// Checks that the certificate computed from a record's states, contacts and forces is exactly the
/// recorded one. All of these are in the world frame.
#[test]
fn a_records_certificate_comes_out_again_from_what_is_in_it() {
    let (world, start, _) = throw();
    let ground = Plane::new(Vector3::new(0.3, -0.2, 0.9), -0.4).unwrap();
    let parameters = Parameters { ground: Some(ground), ..world.parameters().clone() };
    let world = World::new(parameters).unwrap();
    let (ground, motion, wrenches) =
        (world.ground().unwrap(), Motion::native(&world), &[Wrench::zero()]);
    let mut touched = 0;
    for record in records(&world, start, Polyline::default(), motion, 600) {
        let Interval { states, solution, contacts, certificate, .. } = record.first();
        let claim =
            Claim { states, next: &solution.states, wrenches, contacts, joints: &[], gears: &[] };
        let again = Certifier::new().contact_step(&world, &claim, solution.forces());
        assert_eq!(again, *certificate, "k = {}", record.index);
        // The normal points to the free side: no corner is below the plane, and no force is
        // tensile.
        let turn = rotation(&record.state().attitude);
        for point in common::body(&world).contact_points() {
            let corner = record.state().position + turn * point.position;
            assert!(ground.normal().dot(&corner) - ground.offset() > -1e-9);
        }
        for contact in &solution.contacts {
            let push = ground.normal().dot(&contact.force);
            assert!(push > -1e-9);
            touched += usize::from(push > 1.0);
        }
    }
    assert!(touched > 100, "{touched}");
}
