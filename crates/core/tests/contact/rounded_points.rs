//! Points with a radius: each is a ball that touches with its surface. No detection finds such
//! contacts, so the tests construct them for the native solver.

use crate::common;
use crate::common::prelude::*;

use crate::common::{cases, quaternion, vector};
use crate::toss::parameters;
use proptest::prelude::*;
use proptest::test_runner::{RngSeed, TestRunner};
use std::cell::Cell;
use tumble_core::contact::{ContactKey, ContactLaw, Features};

/// Contacts of all points of the body with the ground, each rounded by `radius`.
fn rounded(world: &World, state: &State, radius: f64) -> Vec<Contact> {
    let (body, ground, pose) = (common::body(world), world.ground().unwrap(), state.pose());
    let points = body.contact_points().iter().enumerate();
    let contact = |(point, place): (usize, &tumble_core::geometry::ContactPoint)| {
        let (frame, offset) = (*ground.frame(), ground.offset());
        let features = Features::from_plane(place.position, radius, frame, offset);
        let key = ContactKey { body: 0, point, partner: Partner::Ground, pair: None };
        let law = ContactLaw::plastic(world.friction());
        Contact::new(key, features, law, (body, &pose), None)
    };
    points.map(contact).collect()
}

/// World, radius, and a state whose lowest ball is at most 2 mm above or below the ground.
#[derive(Debug)]
struct Case {
    world: World,
    state: State,
    radius: f64,
}

/// Single ball off the centre, dumbbell, tripod, or box with rounded corners, on level ground or on
/// a slope.
fn any_case() -> impl Strategy<Value = Case> {
    let shapes = vec![
        vec![Vector3::new(0.1, 0.0, 0.05)],
        vec![Vector3::new(0.5, 0.0, 0.0), Vector3::new(-0.5, 0.0, 0.0)],
        vec![
            Vector3::new(0.4, 0.0, -0.3),
            Vector3::new(-0.3, 0.3, -0.3),
            Vector3::new(-0.3, -0.3, -0.3),
        ],
        (0..8_u8)
            .map(|k| Vector3::from_fn(|axis, _| if k >> axis & 1 == 1 { 0.3 } else { -0.3 }))
            .collect(),
    ];
    let ground = prop_oneof![
        1 => Just(Plane::level()),
        1 => (vector(1.0), -1.0..1.0)
            .prop_filter("a normal", |(normal, _)| normal.norm() > 0.1)
            .prop_map(|(normal, offset)| Plane::new(normal, offset).unwrap()),
    ];
    let body = (proptest::sample::select(shapes), 0.02..0.3, 0.05..0.2);
    // The body lies on its balls (a box on one face), or has a random attitude.
    let attitude = prop_oneof![Just(Vector4::new(1.0, 0.0, 0.0, 0.0)), quaternion()];
    let motion = (attitude, vector(3.0), vector(5.0), -2e-3..2e-3);
    (body, ground, 0.0..0.8, motion).prop_map(
        |((points, radius, moment), ground, friction, (q, velocity, spin, gap))| {
            let inertia = Matrix3::from_diagonal(&Vector3::new(1.0, 1.2, 1.5)) * moment;
            let body = RigidBody::new(1.0, inertia, &points).unwrap();
            let normal = *ground.normal();
            let gravity = -9.81 * normal + Vector3::new(1.0, 0.5, 0.0);
            let given = Parameters { ground: Some(ground), gravity, friction, ..parameters(body) };
            let world = World::new(given).unwrap();
            let (position, attitude) = (Vector3::zeros(), q.normalize());
            let velocity = velocity - Vector3::z();
            let state = State { position, attitude, velocity, spin };
            let mut state = world.ground().unwrap().state_to_world(&state);
            let lowest = world.lowest_height(&[state]) - radius;
            state.position += (gap - lowest) * normal;
            Case { world, state, radius }
        },
    )
}

/// Checks that the native solver solves these steps to a residual of 1e-9 m/s. Most of the steps
/// have touching contacts.
#[test]
fn the_native_solver_solves_rounded_points_exactly() {
    let pressed = Cell::new(0);
    let config = ProptestConfig { rng_seed: RngSeed::Fixed(8), ..cases(3000) };
    let outcome = TestRunner::new(config).run(&any_case(), |Case { world, state, radius }| {
        let (contacts, wrench) = (rounded(&world, &state, radius), Wrench::zero());
        let mut solver = NativeSolver::new(&world);
        let start = StepSolution::free(&[state]);
        let (report, solution) =
            common::solve(&mut solver, &world, (&state, &wrench), &contacts, &start);
        prop_assert_ne!(report.status, StepStatus::Failed);
        prop_assert_eq!(solution.contacts.len(), contacts.len());
        let (states, next, wrenches) = (&[state], &solution.states, &[wrench]);
        let claim = Claim { states, next, wrenches, contacts: &contacts, joints: &[], gears: &[] };
        let certificate = Certifier::new().contact_step(&world, &claim, solution.forces());
        prop_assert!(certificate.residual() <= 1e-9, "{certificate:?}");
        // Independent check of the laws: no ball ends in the ground, and a pressing ball touches
        // it.
        let normal = world.ground().unwrap().normal();
        let turn = rotation(&next[0].attitude);
        let places = common::body(&world).contact_points().iter();
        for (place, contact) in places.zip(&solution.contacts) {
            let centre = next[0].position + turn * place.position;
            let gap = normal.dot(&centre) - world.ground().unwrap().offset() - radius;
            let speed = gap / world.time_step();
            prop_assert!(speed > -1e-9, "{speed:e}");
            prop_assert!(!contact.carries_force() || speed < 1e-9, "{speed:e}");
            pressed.set(pressed.get() + u32::from(contact.carries_force()));
        }
        Ok(())
    });
    outcome.unwrap_or_else(|failure| panic!("{failure}"));
    assert!(pressed.get() > 2000, "{}", pressed.get());
}

/// Checks a solid ball that is placed sliding. Friction at its surface, ρ below the centre, slows
/// it and spins it up, with m ρ Δv = −I Δω in every step. In the end it rolls: v = ρ ω = v₀/(1 +
/// I/(m ρ²)), which is 5/7 of v₀ for I = 2/5 m ρ². Rolling is zero slip of the centre and the spin
/// about it (eq. 10a), v = ρ ω. Both hold to rounding.
#[test]
fn a_sliding_ball_rolls_in_the_end() {
    let (radius, speed) = (0.1, 0.7);
    // The second point is inside the ball. A body with all points in its centre is refused.
    let places = [Vector3::zeros(), Vector3::new(0.05, 0.0, 0.0)];
    let inertia = Matrix3::from_diagonal_element(0.4 * radius * radius);
    let world = World::new(parameters(RigidBody::new(1.0, inertia, &places).unwrap())).unwrap();
    let at = [0.0, 0.0, radius, 1.0, 0.0, 0.0, 0.0, speed, 0.0, 0.0, 0.0, 0.0, 0.0];
    let (mut state, mut solver) = (common::state(&at), NativeSolver::new(&world));
    let mut previous = StepSolution::free(&[state]);
    let slows = world.friction() * 9.81 * world.time_step();
    for k in 1..=100 {
        let contacts = &rounded(&world, &state, radius)[..1];
        let of_step = (&state, &Wrench::zero());
        let (report, solution) = common::solve(&mut solver, &world, of_step, contacts, &previous);
        assert_ne!(report.status, StepStatus::Failed, "step {k}");
        (state, previous) = (solution.states[0], solution);
        let expected = (speed - f64::from(k) * slows).max(speed * 5.0 / 7.0);
        let apart = (state.velocity - Vector3::new(expected, 0.0, 0.0)).amax();
        assert!(apart < 1e-12, "step {k}: {apart:e}");
        assert!((state.position[2] - radius).abs() < 1e-12, "step {k}: {}", state.position);
    }
    let spin = state.spin[1];
    assert!((state.velocity[0] - radius * spin).abs() < 1e-12, "{}: {spin}", state.velocity);
}
