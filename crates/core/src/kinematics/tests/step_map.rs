//! Unit tests of `step_map.rs`.

use super::*;
use crate::kinematics::quaternion::{left, rotation};

const SPIN: Vector3<f64> = Vector3::new(30.0, -50.0, 80.0);

/// Attitude after a rotation by `turn` (rad, body frame).
fn exactly_turned(q: &Vector4<f64>, turn: &Vector3<f64>) -> Vector4<f64> {
    let half = 0.5 * turn.norm();
    let axis = turn.normalize() * libm::sin(half);
    left(q) * Vector4::new(libm::cos(half), axis[0], axis[1], axis[2])
}

#[test]
fn the_momentum_form_turns_by_the_spin_times_the_step() {
    let q = Vector4::new(0.5, -0.1, 0.7, 0.3).normalize();
    for h in [1e-4, 1e-3, 5e-3] {
        let map = StepMap { form: Rotation::Momentum, time_step: h };
        let off = (map.advance(&q, &SPIN) - exactly_turned(&q, &(h * SPIN))).norm();
        // Half of the error of the angle, with its next term.
        assert!(off <= 0.6 * map.angle_error(&SPIN) + 4e-16, "{h}: {off}");
        let tutorial = StepMap { form: Rotation::Tutorial, ..map };
        let off = (tutorial.advance(&q, &SPIN) - exactly_turned(&q, &(h * SPIN))).norm();
        let expected = 0.5 * tutorial.angle_error(&SPIN);
        assert!((off / expected - 1.0).abs() < 0.1, "{h}: {off}");
    }
}

#[test]
fn the_rate_between_two_attitudes_is_the_spin() {
    let q = Vector4::new(0.5, -0.1, 0.7, 0.3).normalize();
    for form in Rotation::ALL {
        for h in [1e-4, 2e-3, 0.01] {
            let map = StepMap { form, time_step: h };
            let (from, to) = (rotation(&q), rotation(&map.advance(&q, &SPIN)));
            // Rounding errors of the attitudes, over h.
            let off = (map.rate_between(&from, &to) - from * SPIN).norm();
            assert!(off < 4e-15 / h, "{h}: {off}");
        }
    }
}

#[test]
fn slopes_are_those_of_differences() {
    // Central differences with 1e-3 rad/s.
    for form in Rotation::ALL {
        let map = StepMap { form, time_step: 5e-3 };
        let slope = map.stretch(&SPIN).slope(&SPIN);
        for k in 0..3 {
            let step = Vector3::ith(k, 1e-3);
            let change = (map.stretched(&(SPIN + step)) - map.stretched(&(SPIN - step))) / 2e-3;
            assert!((change - slope.column(k)).norm() < 1e-9);
        }
        // The half angle a turns the body by 2 δa/(1 + a·a) along its axis.
        let tangent = |h: f64| 0.5 * h * map.over(h).stretched(&SPIN).norm();
        let angle = |h: f64| 2.0 * libm::atan(tangent(h));
        let rate = (angle(5e-3 + 1e-6) - angle(5e-3 - 1e-6)) / 2e-6;
        assert!((rate / SPIN.norm() - map.rate(&SPIN)).abs() < 1e-8);
    }
}
