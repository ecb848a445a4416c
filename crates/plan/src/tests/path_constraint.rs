//! Unit tests of `path_constraint.rs`.

use super::*;

/// Central differences of 1e-5 have an error of 1e-10.
#[test]
fn slopes_agree_with_differences() {
    let kinds = [
        PathConstraintKind::Above { at: 0.4, width: 0.3, height: 0.7 },
        PathConstraintKind::AtLeast { component: 1, low: 0.2 },
        PathConstraintKind::AtMost { component: 2, high: 0.2 },
        PathConstraintKind::Away { point: Vector3::new(0.1, -0.2, 0.4), radius: 0.3 },
    ];
    let r = Vector3::new(0.5, 0.7, 0.9);
    for kind in kinds {
        let (_, slope) = kind.at(&r);
        for k in 0..3 {
            let step = Vector3::ith(k, 1e-5);
            let [up, down] = [r + step, r - step].map(|r| kind.at(&r).0);
            assert!(((up - down) / 2e-5 - slope[k]).abs() < 1e-8, "{kind:?}");
        }
    }
}
