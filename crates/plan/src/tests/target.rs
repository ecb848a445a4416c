//! Unit tests of `target.rs`.

use super::*;

fn state() -> State {
    State {
        position: Vector3::new(0.3, -1.0, 2.0),
        attitude: Vector4::new(0.3, -0.7, 0.2, 0.5).normalize(),
        velocity: Vector3::new(1.0, 2.0, -0.5),
        spin: Vector3::new(9.0, -14.0, 5.0),
    }
}

/// Central differences of 1e-5 have an error of 1e-10.
#[test]
fn slopes_agree_with_differences() {
    let axis = Vector3::new(0.2, 0.5, 0.9).normalize();
    let quaternion = Vector4::new(0.9, 0.1, -0.3, 0.2).normalize();
    let kinds = [
        TargetKind::Position([Some(1.0), None, Some(2.0)]),
        TargetKind::Velocity([None, Some(0.0), Some(0.3)]),
        TargetKind::Spin([Some(0.0); 3]),
        TargetKind::Attitude(quaternion),
        TargetKind::Attitude(state().attitude),
        TargetKind::Turn { axis, angle: 0.7, from: quaternion },
        TargetKind::Direction { of: axis, to: Vector3::new(0.0, 0.0, -1.0) },
    ];
    for kind in kinds {
        let rows = kind.rows(&state());
        for k in 0..StateChange::LEN {
            let moved = |by: f64| {
                let mut change = [0.0; StateChange::LEN];
                change[k] = by;
                kind.rows(&StateChange::from_array(&change).applied(&state()))
            };
            for ((row, up), down) in rows.iter().zip(moved(1e-5)).zip(moved(-1e-5)) {
                let slope = (up.value - down.value) / 2e-5;
                let found = row.by.to_array()[k];
                assert!((slope - found).abs() < 1e-8, "{kind:?}, {k}: {found} {slope}");
            }
        }
    }
}

#[test]
fn attitude_target_of_a_quarter_turn_has_its_angle() {
    let half = 0.5_f64.sqrt();
    let upright = State { attitude: Vector4::new(1.0, 0.0, 0.0, 0.0), ..state() };
    let turned = State { attitude: Vector4::new(half, 0.0, 0.0, half), ..state() };
    let target = |angle: f64| Target {
        name: "turn".to_owned(),
        body: 0,
        after: 1,
        kind: TargetKind::Turn { axis: Vector3::z(), angle, from: upright.attitude },
        tolerance: 1e-3,
        weight: 1.0,
    };
    let quarter = std::f64::consts::FRAC_PI_2;
    assert!(target(quarter).miss(&turned) < 1e-15);
    assert!((target(quarter).miss(&upright) - quarter).abs() < 1e-15);
    assert!(target(-3.0 * quarter).miss(&turned) < 1e-14);
}
