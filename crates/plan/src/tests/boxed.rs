//! Unit tests of `boxed.rs`.

use super::*;

/// Karush–Kuhn–Tucker conditions of drawn boxes with a nearly singular matrix of six.
#[test]
fn the_minimum_in_a_box_meets_the_optimality_conditions() {
    let mut state = 7_u64;
    let mut draw = || {
        state =
            state.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        (state >> 11) as f64 / (1_u64 << 53) as f64 * 2.0 - 1.0
    };
    let (mut at_bounds, mut inside) = (0, 0);
    for _ in 0..300 {
        let rows = DMatrix::from_fn(4, 6, |_, _| draw());
        let matrix = rows.tr_mul(&rows) + DMatrix::identity(6, 6) * 1e-3;
        let gradient = DVector::from_fn(6, |_, _| draw());
        let low = DVector::from_fn(6, |_, _| -draw().abs());
        let high = DVector::from_fn(6, |_, _| draw().abs());
        let found = least_in_box(&matrix, &gradient, &low, &high).unwrap();
        let slope = &matrix * &found.step + &gradient;
        for k in 0..6 {
            let d = found.step[k];
            assert!(low[k] <= d && d <= high[k]);
            let is_free = found.free.contains(&k);
            if d > low[k] && d < high[k] {
                // Rounding with a condition number of 1e4.
                assert!(slope[k].abs() < 1e-10, "{}", slope[k]);
                assert!(is_free);
                inside += 1;
            } else {
                assert!(slope[k] * if d <= low[k] { 1.0 } else { -1.0 } > -1e-10);
                at_bounds += 1;
            }
        }
    }
    assert!(at_bounds > 300 && inside > 300, "{at_bounds} {inside}");
}
