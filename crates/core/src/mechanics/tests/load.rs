//! Unit tests of `load.rs`.

use super::*;

fn push(knots: &[(f64, f64)]) -> Load {
    let knots = knots.iter().map(|&(time, x)| (time, Vector3::new(x, 0.0, 0.0))).collect();
    let force = Polyline::new(knots).unwrap();
    Load::new(force, Polyline::default(), Vector3::zeros()).unwrap()
}

fn upright() -> Vector4<f64> {
    Vector4::new(1.0, 0.0, 0.0, 0.0)
}

#[test]
fn a_constant_load_is_itself_to_rounding() {
    let load = push(&[(0.0, 0.1)]);
    for k in [0, 1, 17, 123_456, 9_000_000_000_000_000, 9_000_000_000_000_001] {
        let force = load.wrench(k, 0.002, &upright()).force[0];
        assert!((force - 0.1).abs() <= f64::EPSILON * 0.1, "{k}: {force}");
    }
}

/// The impulse of a polyline is its integral for any step, even if knots and jumps fall inside
/// steps.
#[test]
fn impulses_do_not_depend_on_the_step() {
    let load = push(&[(0.1, 0.0), (0.35, 5.0), (0.35, -2.0), (0.6, -2.0), (0.6, 0.0)]);
    let area = 0.5 * 0.25 * 5.0 - 0.25 * 2.0;
    for steps in [1_u64, 3, 7, 20, 100, 1000] {
        let h = 1.0 / steps as f64;
        let impulse: f64 = (0..steps).map(|k| h * load.wrench(k, h, &upright()).force[0]).sum();
        assert!((impulse - area).abs() < 1e-14, "{steps}: {impulse}");
    }
}

#[test]
fn a_load_keeps_its_ends() {
    let load = push(&[(1.0, 3.0), (2.0, 4.0)]);
    assert_eq!(load.wrench(0, 0.5, &upright()).force[0], 3.0);
    assert_eq!(load.wrench(99, 0.5, &upright()).force[0], 4.0);
    assert!((load.wrench(1, 1.0, &upright()).force[0] - 3.5).abs() < 1e-15);
    assert_eq!(Load::none().wrench(5, 0.1, &upright()), Wrench::zero());
}

/// A force off the centre has a torque. A quarter turn about z maps the body's x to the world's
/// y, so that a force along y is along the body's x.
#[test]
fn a_force_off_the_centre_turns_the_body() {
    let half = 0.5_f64.sqrt();
    let force = Polyline::constant(Vector3::new(0.0, 2.0, 0.0)).unwrap();
    let torque = Polyline::constant(Vector3::new(0.5, 0.0, 0.0)).unwrap();
    let load = Load::new(force, torque, Vector3::new(0.0, 0.0, 3.0)).unwrap();
    let wrench = load.wrench(0, 0.1, &Vector4::new(half, 0.0, 0.0, half));
    // p × (2, 0, 0) = (0, 6, 0) in the body frame.
    assert!((wrench.torque - Vector3::new(0.5, 6.0, 0.0)).norm() < 1e-14);
    assert!((wrench.force - Vector3::new(0.0, 2.0, 0.0)).norm() < 1e-15);
}

/// Two knots at the same time form a jump; a third one would be ambiguous.
#[test]
fn third_knot_at_one_time_is_rejected() {
    let line = |knots: &[(f64, f64)]| {
        Polyline::new(knots.iter().map(|&(t, x)| (t, Vector3::repeat(x))).collect())
    };
    assert!(line(&[(0.0, 1.0), (-0.0, 2.0), (0.5, 3.0), (0.5, 4.0)]).is_ok());
    for knots in [
        [(0.4, 1.0), (0.4, 2.0), (0.4, 3.0), (0.5, 0.0)],
        [(0.0, 1.0), (0.4, 2.0), (0.4, 2.0), (0.4, 2.0)],
        [(0.4, 1.0), (0.4, 1.0), (0.4, 1.0), (0.4, 1.0)],
    ] {
        let refusal = line(&knots).unwrap_err().to_string();
        let expected = "the load has more than two knots at 0.4 s; allowed: one, or two for a jump";
        assert_eq!(refusal, expected);
    }
}

#[test]
fn loads_out_of_range_are_rejected() {
    let refused = |knots: &[(f64, f64)]| {
        let knots: Vec<_> = knots.iter().map(|&(t, x)| (t, Vector3::repeat(x))).collect();
        assert!(Polyline::new(knots.clone()).is_err(), "{knots:?}");
    };
    refused(&[(1.0, 0.0), (0.5, 0.0)]);
    refused(&[(f64::NAN, 0.0)]);
    refused(&[(0.0, f64::INFINITY)]);
    let nan = Vector3::new(f64::NAN, 0.0, 0.0);
    assert!(Load::new(Polyline::default(), Polyline::default(), nan).is_err());
}
