//! Runge–Kutta step of the floating scene against closed forms: a body that rotates about a
//! principal axis, and the free symmetric top.

use crate::common::prelude::*;
use crate::common::{body, state, tutorial_parameters};
use tumble_core::contact::certificate::certify_rk4_step;
use tumble_core::mechanics::dynamics::rk4_step;
use tumble_core::simulation::scene::TutorialScene;

/// Rotation by `angle` [rad] about the unit vector `axis`.
fn turn(axis: &Vector3<f64>, angle: f64) -> Vector4<f64> {
    let (sin, cos) = (0.5 * angle).sin_cos();
    Vector4::new(cos, sin * axis[0], sin * axis[1], sin * axis[2])
}

/// Checks the floating cube. Its spin is constant, so q(t) = q₀ ⊗ (cos ½|ω|t, ω/|ω| sin ½|ω|t). The
/// rate q̇ = Ω q has the eigenvalues ±½|ω|i. With y = ½ h |ω| a step multiplies by 1 + iy − y²/2 −
/// iy³/6 + y⁴/24. Its phase is y⁵/120 behind e^{iy}: 7.3e-12 after 1199 steps. The rest is
/// rounding.
#[test]
fn the_floating_cube_follows_its_closed_form() {
    let scene = TutorialScene::floating();
    let parameters =
        Parameters { gravity: scene.gravity, time_step: scene.time_step, ..tutorial_parameters() };
    let start = scene.start(scene.attitude(0));
    let world = World::new(parameters).unwrap();
    let mut simulation = Simulation::new(world, [start], Motion::Floating).unwrap();
    let mut record = StepRecord::new();
    let phase = (0.5 * scene.time_step * scene.spin.norm()).powi(5) / 120.0;
    for k in 1..scene.rows {
        simulation.step(&mut record).unwrap();
        let (now, steps) = (simulation.state(), k as f64);
        let angle = steps * scene.time_step * scene.spin.norm();
        let turned = left(&start.attitude) * turn(&scene.spin.normalize(), angle);
        let error = (now.attitude - turned).norm();
        // 1 % for the next order, and 4 roundings per step of numbers up to 1.
        let rounding = 4.0 * f64::EPSILON * steps.sqrt() + 1e-15;
        assert!((error - steps * phase).abs() < 0.01 * steps * phase + rounding, "{k}: {error:e}");
        // A sum of k terms that ends at 2.4 m. Each addition is rounded to half a unit in the last
        // place: 2.2e-16 m.
        let expected = start.position + scene.velocity * (steps * scene.time_step);
        assert!((now.position - expected).amax() < steps * 2.3e-16, "row {k}");
        assert_eq!(now.velocity, scene.velocity);
        assert!((now.spin - scene.spin).amax() < 1e-15 * steps);
    }
    assert_eq!(simulation.index(), 1199);
}

/// World with a symmetric top: moments 2, 2 and 3 kg m², 1.5 kg.
fn top(gravity: Vector3<f64>, time_step: f64) -> World {
    let inertia = Matrix3::from_diagonal(&Vector3::new(2.0, 2.0, 3.0));
    let body = RigidBody::with_box_corners(1.5, inertia, Vector3::repeat(0.8)).unwrap();
    let usual = tutorial_parameters();
    World::new(Parameters { bodies: vec![body], gravity, time_step, ..usual }).unwrap()
}

fn thrown_top() -> State {
    state(&[0.1, 0.2, 5.0, 0.5, 0.5, -0.5, 0.5, 1.0, 2.0, 3.0, 1.0, 4.0, -2.0])
}

/// State of the free top after `t` s. Its angular momentum L is constant in the world frame. With
/// the moments I₁ across the figure axis e₃ and I₃ about it
///
/// ```text
/// ω = Aᵀ L/I₁ + (1 − I₃/I₁) ω₃ e₃
/// ```
///
/// is the spin of A(t) = exp(t [L]×/I₁) A₀ exp(t (1 − I₃/I₁) ω₃ [e₃]×). That is a steady rotation
/// about L and one about the figure axis. The centre follows a parabola.
fn top_after(world: &World, start: &State, t: f64) -> State {
    let inertia = body(world).inertia();
    let (across, along) = (inertia[(0, 0)], inertia[(2, 2)]);
    let momentum = rotation(&start.attitude) * (inertia * start.spin);
    let precession = turn(&momentum.normalize(), t * momentum.norm() / across);
    let nutation = turn(&Vector3::z(), t * (1.0 - along / across) * start.spin[2]);
    let attitude = left(&(left(&precession) * start.attitude)) * nutation;
    State {
        position: start.position + t * start.velocity + 0.5 * t * t * world.gravity(),
        attitude,
        velocity: start.velocity + t * world.gravity(),
        spin: inertia.try_inverse().unwrap() * rotation(&attitude).tr_mul(&momentum),
    }
}

/// Checks the fourth order of the method. Halving h divides the error after a second, some two
/// turns, by 2⁴ = 16. The next order is h |ω| = 5 % at the coarser step. The parabola is exact to
/// rounding.
#[test]
fn the_free_top_is_followed_to_fourth_order() {
    let gravity = Vector3::new(1.0, -2.0, -9.0);
    let apart = |steps: u32| {
        let world = top(gravity, 1.0 / f64::from(steps));
        let mut simulation =
            Simulation::new(world.clone(), [thrown_top()], Motion::Floating).unwrap();
        let mut record = StepRecord::new();
        for _ in 0..steps {
            simulation.step(&mut record).unwrap();
        }
        let exact = top_after(&world, &thrown_top(), 1.0);
        let end = simulation.state();
        assert!((end.position - exact.position).amax() < 1e-13 * f64::from(steps));
        assert!((end.velocity - exact.velocity).amax() < 1e-14 * f64::from(steps));
        [(end.attitude - exact.attitude).norm(), (end.spin - exact.spin).norm()]
    };
    let (coarse, fine) = (apart(100), apart(200));
    for (coarse, fine) in coarse.into_iter().zip(fine) {
        assert!(coarse < 1e-6, "{coarse:e}");
        assert!((coarse / fine - 16.0).abs() < 0.05 * 16.0, "{coarse:e} {fine:e}");
    }
}

/// Checks the certificate of a floating step against the closed form's next state. It is the error
/// of the method in one step, of order h⁵ in the spin and, divided by h, h⁴ in the attitude. For a
/// state with a larger error it is that error. So the certificate does not only compare the method
/// with itself.
#[test]
fn the_certificate_of_a_floating_step_is_the_distance_from_the_truth() {
    let certify = |h: f64, change: &dyn Fn(&mut State)| {
        let world = top(Vector3::zeros(), h);
        let mut next = top_after(&world, &thrown_top(), h);
        change(&mut next);
        let (states, next, wrenches) = (&[thrown_top()], &[next], &[Wrench::zero()]);
        let claim = Claim { states, next, wrenches, contacts: &[], joints: &[], gears: &[] };
        let certificate = certify_rk4_step(&world, &claim);
        assert_eq!(certificate.residual(), certificate.dynamics);
        certificate.dynamics
    };
    let (coarse, fine) = (certify(0.02, &|_| ()), certify(0.01, &|_| ()));
    assert!(coarse < 1e-6, "{coarse:e}");
    assert!((coarse / fine - 16.0).abs() < 0.1 * 16.0, "{coarse:e} {fine:e}");
    // 1 mm in 10 ms, 1e-4 of a turn at the reach of 0.8 m in the same time, 0.1 m/s, 0.1 rad/s
    // there.
    type Change<'a> = &'a dyn Fn(&mut State);
    let changes: [(Change<'_>, f64); 4] = [
        (&|next| next.position[1] += 1e-3, 0.1),
        (&|next| next.attitude[2] -= 1e-4, 1e-4 * 0.8 / 0.01),
        (&|next| next.velocity[0] += 0.1, 0.1),
        (&|next| next.spin[2] += 0.1, 0.1 * 0.8),
    ];
    for (change, expected) in changes {
        let found = certify(0.01, change);
        assert!((found - expected).abs() < 2.0 * fine, "{found} {expected}");
    }
}

/// Checks that the quaternion is normalised after a step. Without that its length would have an
/// error of y⁶/144, y = ½ h |ω|, 2e-5 in a step of 0.1 s.
#[test]
fn a_long_step_keeps_the_quaternion_a_rotation() {
    let scene = TutorialScene::floating();
    let start = scene.start(scene.attitude(0));
    let cube = &tutorial_parameters().bodies[0];
    let long = rk4_step(cube, &start, &Wrench::zero(), 0.1);
    assert!((long.attitude.norm() - 1.0).abs() < 1e-15);
}
