//! Derivative of a step against central differences of steps, in every regime and by every
//! argument.

mod articulated;
mod campaign;
mod compare;
mod digits;
mod dry;
mod laws;
mod own;
mod random;
mod smooth;
mod sums;
mod turns;

use crate::common::draw;
use crate::common::prelude::*;
use compare::{
    Direction, Tally, apart, compare, difference, directions, on_a_slope, size, step, transposed,
};
use tumble_core::solver::native::{Smoothing, StepGradient};

/// Component of δv along the slope for changes of the constants of the world.
fn along_the_slope(
    scene: &(World, Vec<State>),
    angle: f64,
    constants: &[(Constant, &[f64])],
) -> f64 {
    let (simulation, base) = step(&scene.0, &scene.1, &[]).unwrap();
    let mut derivative = StepDerivative::new();
    simulation.linearise(&base, &mut derivative).unwrap();
    let mut end = Vec::new();
    derivative.jvp(&StepChange { constants, ..StepChange::default() }, &mut end).unwrap();
    Vector3::new(angle.cos(), 0.0, -angle.sin()).dot(&end[0].velocity)
}

/// Checks v⁺ = v + h g (sin α − μ cos α) for four sliding corners, two of which are redundant.
#[test]
fn a_slide_by_friction_gravity_mass_and_inertia() {
    let (angle, friction, h, g) = (0.5, 0.3, 0.002, 9.81);
    let scene = on_a_slope(angle, friction, 1.0);
    let by = |constants: &[(Constant, &[f64])]| along_the_slope(&scene, angle, constants);
    // Rounding of the velocity 1 m/s, and 1e-16/1e-6 for the undetermined part.
    let close =
        |found: f64, expected: f64| assert!((found - expected).abs() < 1e-11, "{found} {expected}");
    close(by(&[(Constant::Friction, &[1.0])]), -h * g * angle.cos());
    close(
        by(&[(Constant::Gravity, &[0.0, 0.0, -1.0])]),
        h * (angle.sin() - friction * angle.cos()),
    );
    close(by(&[(Constant::Mass, &[1.0])]), 0.0);
    close(by(&[(Constant::Inertia, &[1e-2, 0.0, 0.0, 0.0, 2e-2, 0.0, 0.0, 0.0, 3e-2])]), 0.0);
    close(by(&[(Constant::TimeStep, &[1.0])]), g * (angle.sin() - friction * angle.cos()));
}

/// Checks the derivatives by the adhesion F and the time step of a block that slides, h μ (g + F/m) slower, and of one
/// that comes off with the speed h (P − F)/m. On the central path they are near.
#[test]
fn slides_and_breaks_by_the_adhesion() {
    let (friction, h, pull, mass) = (0.3, 0.002, 5.0, 2.0);
    let (world, states) = on_a_slope(0.0, friction, 1.0);
    let world = world.with_coefficient(Coefficient::Adhesion, pull).unwrap();
    let slides = -friction * (9.81 + pull / mass);
    let parted = 0.5 * pull / mass;
    let cases = [
        (0.0, Vector3::x(), [-h * friction / mass, slides]),
        (1.5 * pull + mass * 9.81, Vector3::z(), [-h / mass, parted]),
    ];
    for (load, along, expected) in cases {
        let wrenches = [Wrench { force: Vector3::z() * load, torque: Vector3::zeros() }];
        let (simulation, base) = step(&world, &states, &wrenches).unwrap();
        let exact = StepDerivative::new();
        let central = StepDerivative::smoothed(Smoothing::CentralPath(1e-5)).unwrap();
        for (mut derivative, within) in [(exact, 1e-9), (central, 1e-3)] {
            simulation.linearise(&base, &mut derivative).unwrap();
            let asked = [Constant::Coefficient(Coefficient::Adhesion), Constant::TimeStep];
            for (constant, expected) in asked.into_iter().zip(expected) {
                let mut end = Vec::new();
                let constants = [(constant, &[1.0][..])];
                let change = StepChange { constants: &constants, ..StepChange::default() };
                derivative.jvp(&change, &mut end).unwrap();
                let mut gradient = StepGradient::default();
                let by_end = StateChange { velocity: along, ..StateChange::zero() };
                derivative.vjp(&[by_end], &[constant], &mut gradient).unwrap();
                for found in [along.dot(&end[0].velocity), gradient.constants[0][0]] {
                    let off = (found - expected).abs() / expected.abs();
                    assert!(off < within, "{constant:?} {found} {expected}");
                }
            }
        }
    }
}

/// Checks that a sticking block has zero derivatives for any push: a plateau.
#[test]
fn sticking_body_has_zero_derivative_by_a_push() {
    let angle = 0.2;
    let scene = on_a_slope(angle, 0.5, 0.0);
    let found = along_the_slope(&scene, angle, &[(Constant::Gravity, &[1.0, 0.5, -2.0])]);
    assert!(found.abs() < 1e-11, "{found}");
    assert!(along_the_slope(&scene, angle, &[(Constant::Friction, &[1.0])]).abs() < 1e-11);
}

/// Checks that with compliance a sticking block creeps under a push along the ground. Four corners
/// with u = −ε p̂ each and m v = h F + Σ m p̂ lead to v = h F/m ε/(4 + ε). The same holds for a
/// push downwards.
#[test]
fn sticking_body_creeps_with_compliance() {
    let (world, states) = on_a_slope(0.0, 0.5, 0.0);
    let (simulation, base) = step(&world, &states, &[]).unwrap();
    for compliance in [1e-6, 1e-3, 1e-1] {
        let mut derivative = StepDerivative::smoothed(Smoothing::Compliance(compliance)).unwrap();
        simulation.linearise(&base, &mut derivative).unwrap();
        let mut pushed = |force: Vector3<f64>, torque: Vector3<f64>| {
            let wrenches = [Wrench { force, torque }];
            let mut end = Vec::new();
            let change = StepChange { wrenches: &wrenches, ..StepChange::default() };
            derivative.jvp(&change, &mut end).unwrap();
            end[0]
        };
        let expected = 0.002 / 2.0 * compliance / (4.0 + compliance);
        // With the torque of the friction about the centre.
        let torque = -0.1 * 4.0 / (4.0 + compliance);
        let along = pushed(Vector3::x(), Vector3::new(0.0, torque, 0.0));
        assert!((along.velocity[0] - expected).abs() <= 1e-9 * expected, "{along:?}");
        assert!(along.spin.norm() <= 1e-9 * expected / 0.1, "{along:?}");
        let down = pushed(-Vector3::z(), Vector3::zeros());
        assert!((down.velocity[2] + expected).abs() <= 1e-9 * expected, "{down:?}");
        assert_eq!(derivative.smoothing(), Some(Smoothing::Compliance(compliance)));
    }
    for refused in [0.0, -1.0, 2.0, f64::NAN] {
        assert!(StepDerivative::smoothed(Smoothing::Compliance(refused)).is_err());
    }
}
