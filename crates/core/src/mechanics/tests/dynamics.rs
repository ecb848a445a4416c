//! Unit tests of `dynamics.rs`.

use super::*;

fn brick() -> RigidBody {
    let inertia = Matrix3::from_diagonal(&Vector3::new(1.0, 2.0, 2.5));
    RigidBody::with_box_corners(3.0, inertia, Vector3::new(1.0, 0.6, 0.4)).unwrap()
}

fn spinning(spin: Vector3<f64>) -> State {
    State { velocity: Vector3::new(1.0, 2.0, 3.0), spin, ..State::at_rest(Vector3::zeros()) }
}

/// Angular momentum in the world is constant without torque. RK4 conserves it to fourth order:
/// halving h divides the error by 16, minus a margin for rounding.
#[test]
fn rk4_keeps_angular_momentum_to_fourth_order() {
    let body = brick();
    let drift = |h: f64, steps: usize| {
        let mut state = spinning(Vector3::new(1.0, 4.0, 0.5));
        let momentum = |s: &State| {
            crate::mechanics::quaternion::rotation(&s.attitude) * (body.inertia() * s.spin)
        };
        let start = momentum(&state);
        for _ in 0..steps {
            state = rk4_step(&body, &state, &Wrench::zero(), h);
        }
        (momentum(&state) - start).norm()
    };
    let ratio = drift(0.01, 100) / drift(0.005, 200);
    assert!(ratio > 12.0, "{ratio}");
}

#[test]
fn a_constant_wrench_gives_the_parabola() {
    let body = brick();
    let wrench = Wrench { force: Vector3::new(3.0, 0.0, -6.0), torque: Vector3::zeros() };
    let mut state = spinning(Vector3::zeros());
    for _ in 0..100 {
        state = rk4_step(&body, &state, &wrench, 0.01);
    }
    // r = v t + ½ (f/m) t² at t = 1; RK4 is exact for it up to rounding.
    assert!((state.position - Vector3::new(1.5, 2.0, 2.0)).norm() < 1e-13);
}

#[test]
fn the_implicit_gyroscopic_equation_is_solved() {
    let body = brick();
    for scale in [0.1_f64, 10.0, 1000.0] {
        let state = spinning(scale * Vector3::new(1.0, 4.0, 0.5));
        let h = 0.01;
        let gravity = Vector3::new(0.0, 0.0, -9.81);
        let of = Rotation::Tutorial;
        let next = free_flight(&body, &state, &Wrench::zero(), &gravity, h, of);
        let gyroscopic = next.spin.cross(&(body.inertia() * next.spin));
        let left = body.inertia() * (next.spin - state.spin) + h * gyroscopic;
        assert!(left.norm() < 1e-13 * scale * scale.max(1.0), "{scale}: {left}");
        assert!((next.attitude.norm() - 1.0).abs() < 1e-15);
    }
}
