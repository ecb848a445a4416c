//! Unit tests of `curves.rs`.

use super::*;

fn points(values: &[f64]) -> Vec<(i64, f32)> {
    let (rows, values) = thinned(values, COLUMNS);
    rows.unpacked().into_iter().map(Option::unwrap).zip(values.floats()).collect()
}

#[test]
fn thinned_curves_keep_ends_of_level_parts_and_a_row_in_gaps() {
    let gap = f64::NAN;
    let found = points(&[0.0, 0.0, 0.0, 0.0, 7.0, gap, gap, 2.0, 1e99, 3.0]);
    let rows: Vec<_> = found.iter().map(|point| point.0).collect();
    assert_eq!(rows, [0, 3, 4, 6, 7, 8, 9]);
    let gaps: Vec<_> = found.iter().filter(|point| point.1.is_nan()).map(|p| p.0).collect();
    assert_eq!(gaps, [6, 8]);
}

#[test]
fn a_long_curve_keeps_its_extremes() {
    let value = |i: usize| match i {
        77_777 => 1e4,
        123_456 => -3.0,
        _ => (i as f64).sin(),
    };
    let found = points(&(0..200_000).map(value).collect::<Vec<_>>());
    assert!(found.len() <= 4 * COLUMNS);
    assert!(found.contains(&(77_777, 1e4)) && found.contains(&(123_456, -3.0)));
}
