//! Worlds without a ground: pairs in free space, and fixed pieces with nothing below.

use crate::common::prelude::*;

const GRAVITY: f64 = 9.81;
const STEP: f64 = 0.002;

fn parameters(bodies: Vec<RigidBody>, gravity: f64, offset: f64) -> Parameters {
    Parameters {
        ground: Some(Plane::new(Vector3::z(), offset).unwrap()),
        gravity: Vector3::new(0.0, 0.0, -gravity),
        friction: 0.4,
        ..Parameters::new(bodies)
    }
}

/// World with these constants and no ground.
fn groundless(parameters: Parameters) -> World {
    euler(Parameters { ground: None, ..parameters })
}

fn cube(mass: f64) -> RigidBody {
    RigidBody::solid_box(mass, Vector3::repeat(0.1)).unwrap()
}

fn run(world: &World, starts: &[State], count: usize, motion: Motion<'_>) -> Vec<StepRecord> {
    let mut run = Simulation::new(world.clone(), starts.to_vec(), motion).unwrap();
    steps(&mut run, count, has_not_failed)
}

/// Checks two cubes that collide at height 0 without a ground. The result equals that above a
/// distant plane, to the rounding of a plane 50 m away. Ipopt agreed to its residuals.
#[test]
fn a_pair_in_free_space_needs_no_plane() {
    let bodies = || vec![cube(1.0), cube(3.0)];
    let mut starts = [State::at_rest([0.0, 0.0, 0.0]), State::at_rest([0.33, 0.03, 0.05])];
    starts[0].attitude = Vector4::new(0.9, 0.2, 0.3, 0.1).normalize();
    starts[0].velocity = Vector3::new(1.0, 0.0, -0.1);
    starts[0].spin = Vector3::new(0.3, 2.0, 1.5);
    let world = groundless(parameters(bodies(), 0.0, 0.0));
    let above = euler(parameters(bodies(), 0.0, -50.0));
    let free = run(&world, &starts, 100, Motion::native(&world));
    let far = run(&above, &starts, 100, Motion::native(&above));
    let touched = |record: &StepRecord| !record.first().solution.contacts.is_empty();
    assert!(free.iter().any(touched));
    for (a, b) in free.iter().zip(&far) {
        for (a, b) in a.next_states().iter().zip(b.next_states()) {
            assert!((a.to_vector() - b.to_vector()).amax() < 1e-11);
        }
        let mut partners = a.first().solution.contacts.iter().map(|contact| contact.key.partner);
        assert!(partners.all(|partner| partner != Partner::Ground));
    }

    // Velocities (m/s) recorded from Ipopt, with the program of several bodies that tumble 0.2 had.
    // Each impulse has an error of one residual, and the motion is the sum of the impulses: Σ 2 K δ
    // over the contacts K and residuals δ (m/s) of the steps.
    let ipopt = [
        [0.32999377571759586, -0.10419227031004981, -0.09628405348319544],
        [0.22333540809413466, 0.034730756770016594, -0.0012386488389348645],
    ];
    for (state, recorded) in free[99].next_states().iter().zip(ipopt) {
        let apart = (state.velocity - Vector3::from(recorded)).amax();
        assert!(apart <= 6.8e-5, "{apart:e}");
    }
}

/// Checks a ball that comes to rest in a bowl of four slabs. Another one falls past it for ever:
/// after k steps it is g h² k (k + 1)/2 below its start. No ground limits the heights.
#[test]
fn a_bowl_with_nothing_under_it_holds_a_ball_and_lets_another_fall() {
    let ball = RigidBody::solid(1.0, &[Piece::sphere(0.1).unwrap()]).unwrap().0;
    let slab = Piece::cuboid(Vector3::new(0.5, 0.5, 0.05)).unwrap();
    let fixed = (0..4).map(|side| {
        let (sin, cos) = (std::f64::consts::FRAC_PI_2 * f64::from(side)).sin_cos();
        let about = Matrix3::new(cos, -sin, 0.0, sin, cos, 0.0, 0.0, 0.0, 1.0);
        let (s, c) = 0.5_f64.sin_cos();
        // Inclined by 0.5 rad. The upper face contains the origin.
        let inclined = Matrix3::new(c, 0.0, -s, 0.0, 1.0, 0.0, s, 0.0, c);
        let centre = inclined * Vector3::new(0.5, 0.0, -0.05);
        slab.moved_by(&(about * inclined), &(about * centre)).unwrap()
    });
    let world = groundless(parameters(vec![ball.clone(), ball], GRAVITY, 0.0));
    let world = world.with_fixed(fixed.collect());
    assert!(world.ground().is_none());
    let starts = [State::at_rest([0.02, 0.01, 0.3]), State::at_rest([3.0, 0.0, 0.0])];
    assert_eq!(world.lowest_height(&starts), f64::INFINITY);
    let steps = 2000;
    let records = run(&world, &starts, steps, Motion::native(&world));
    let end = &records[steps - 1].next_states();
    // The ball touches four planes through the origin at 0.5 rad: its centre is R/cos 0.5 above it.
    assert!((end[0].position[2] - 0.1 / 0.5_f64.cos()).abs() < 1e-6, "{}", end[0].position);
    assert!(end[0].velocity.norm() < 1e-6, "{}", end[0].velocity);
    let k = steps as f64;
    let fallen = 0.5 * GRAVITY * STEP * STEP * k * (k + 1.0);
    assert!((end[1].position[2] + fallen).abs() < 1e-9, "{}", end[1].position);
    assert!(records.iter().all(|record| record.residual() < 1e-9));
}

/// Checks that a body without pieces and ground has no contacts.
#[test]
fn one_body_without_a_ground_falls() {
    let world = groundless(parameters(vec![cube(1.0)], GRAVITY, 0.0));
    let starts = [State::at_rest([0.0, 0.0, 0.0])];
    let end = run(&world, &starts, 50, Motion::native(&world)).pop().unwrap();
    let fallen = 0.5 * GRAVITY * STEP * STEP * 50.0 * 51.0;
    assert!((end.next().position[2] + fallen).abs() < 1e-12);
}

#[test]
fn a_pair_with_a_ground_that_is_not_there_is_refused() {
    let world = groundless(parameters(vec![cube(1.0)], GRAVITY, 0.0));
    let refused = world.with_coefficient_between(Coefficient::Friction, 0, Partner::Ground, 0.3);
    assert!(matches!(refused, Err(Error::Count { .. })), "{refused:?}");
}
