//! External loads: their impulse is exact, for any solver and any step.

use crate::common;
use crate::common::prelude::*;

/// World with a body of 2 kg and 0.5 kg m² about every axis, without gravity.
fn world(time_step: f64) -> World {
    let inertia = Matrix3::from_diagonal_element(0.5);
    let body = RigidBody::with_box_corners(2.0, inertia, Vector3::repeat(0.5)).unwrap();
    let gravity = Vector3::zeros();
    let usual = common::tutorial_parameters();
    World::new(Parameters { bodies: vec![body], gravity, time_step, ..usual }).unwrap()
}

fn high_above() -> State {
    State { velocity: Vector3::new(0.1, 0.2, 0.3), ..State::at_rest(Vector3::new(0.0, 0.0, 50.0)) }
}

/// States after one second under `load`, by the contact step and by Runge–Kutta.
fn after_a_second(load: &Load, steps: u32) -> [State; 2] {
    let world = world(1.0 / f64::from(steps));
    [Motion::native(&world), Motion::Floating].map(|motion| {
        let mut simulation = Simulation::new(world.clone(), [high_above()], motion).unwrap();
        simulation.set_load(0, load.clone()).unwrap();
        let mut record = StepRecord::new();
        for _ in 0..steps {
            simulation.step(&mut record).unwrap();
            assert!(record.residual() < 1e-9);
        }
        *simulation.state()
    })
}

/// Checks v = v_0 + ∫ F dt/m and ω = ∫ τ dt/I: areas of polygons with knots and jumps inside steps.
#[test]
fn velocities_are_those_of_the_impulse() {
    let force = Polyline::new(vec![
        (0.123, Vector3::zeros()),
        (0.4, Vector3::new(6.0, -3.0, 1.0)),
        (0.4, Vector3::new(0.0, 5.0, 0.0)),
        (0.777, Vector3::zeros()),
    ])
    .unwrap();
    let torque = Polyline::constant(Vector3::new(0.3, 0.0, 0.0)).unwrap();
    let load = Load::new(force, torque, Vector3::zeros()).unwrap();
    let impulse =
        0.5 * 0.277 * Vector3::new(6.0, -3.0, 1.0) + 0.5 * 0.377 * Vector3::new(0.0, 5.0, 0.0);
    for steps in [100, 333, 1000] {
        for state in after_a_second(&load, steps) {
            let expected: Vector3<f64> = high_above().velocity + impulse / 2.0;
            assert!((state.velocity - expected).amax() < 1e-12, "{steps}: {}", state.velocity);
            let spin = Vector3::new(0.3 / 0.5, 0.0, 0.0);
            assert!((state.spin - spin).amax() < 1e-12, "{steps}: {}", state.spin);
        }
    }
}

/// Checks a force at the offset p = (0.2, 0, 0). At the start τ = p × F = (0, −0.2·F_z, 0). The
/// body turns by ½ (τ/I) t² = 0.02 rad in a second, so that the cosine shortens the lever by at
/// most 2e-4.
#[test]
fn a_force_off_the_centre_turns_the_body() {
    let force = Polyline::constant(Vector3::new(0.0, 0.0, 0.1)).unwrap();
    let load = Load::new(force, Polyline::default(), Vector3::new(0.2, 0.0, 0.0)).unwrap();
    for state in after_a_second(&load, 1000) {
        let expected = Vector3::new(0.0, -0.02 / 0.5, 0.0);
        assert!((state.spin - expected).amax() < 2e-4 * 0.04, "{}", state.spin);
        let velocity = high_above().velocity + Vector3::new(0.0, 0.0, 0.05);
        assert!((state.velocity - velocity).amax() < 1e-12);
    }
}

/// Checks that a wrench set by a program adds to the load.
#[test]
fn wrench_and_load_add_up() {
    let world = world(0.01);
    let motion = Motion::native(&world);
    let mut simulation = Simulation::new(world, [high_above()], motion).unwrap();
    let force = Polyline::constant(Vector3::new(1.0, 0.0, 0.0)).unwrap();
    let load = Load::new(force, Polyline::default(), Vector3::zeros()).unwrap();
    simulation.set_load(0, load).unwrap();
    let wrench = Wrench { force: Vector3::new(-3.0, 4.0, 0.0), torque: Vector3::zeros() };
    simulation.set_wrench(0, wrench).unwrap();
    let mut record = StepRecord::new();
    simulation.step(&mut record).unwrap();
    let gained: Vector3<f64> = simulation.state().velocity - high_above().velocity;
    let expected: Vector3<f64> = 0.01 * Vector3::new(-1.0, 2.0, 0.0);
    assert!((gained - expected).amax() < 1e-15, "{gained}");
}
