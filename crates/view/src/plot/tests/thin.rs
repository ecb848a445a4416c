//! Unit tests of `thin.rs`.

use super::*;

const COLUMNS: usize = 100;

fn thinned(values: &[f64]) -> Vec<PlotPoint> {
    let times: Vec<f64> = (0..values.len()).map(|i| i as f64).collect();
    thin(&times, values, [0.0, values.len() as f64], COLUMNS)
}

#[test]
fn few_points_stay_as_they_are() {
    let points = thinned(&[1.0, f64::NAN, 3.0]);
    assert_eq!(points, [Some((0.0, 1.0)), None, Some((2.0, 3.0))]);
    assert_eq!(thinned(&[]), []);
}

#[test]
fn every_column_keeps_its_extremes_and_its_ends() {
    // One spike up and one down in each column of 1000, never at its ends.
    let value = |i: usize| match i % 1000 {
        137 => 5.0 + i as f64,
        731 => -5.0 - i as f64,
        within => within as f64 * 1e-3,
    };
    let values: Vec<f64> = (0..1000 * COLUMNS).map(value).collect();
    let points: Vec<_> = thinned(&values).into_iter().flatten().collect();
    assert_eq!(points.len(), 4 * COLUMNS);
    assert!(points.is_sorted_by(|a, b| a.0 < b.0));
    for column in 0..COLUMNS {
        for within in [0, 137, 731, 999] {
            let i = 1000 * column + within;
            assert!(points.contains(&(i as f64, value(i))), "{i}");
        }
    }
}

#[test]
fn gaps_as_wide_as_a_column_stay_and_the_number_of_points_is_bounded() {
    let half = |i: usize| if i < 25_000 { 1.0 } else { 2.0 };
    let open = |i: usize| !(20_000..30_000).contains(&i);
    let values: Vec<f64> = (0..50_000).map(|i| if open(i) { half(i) } else { f64::NAN }).collect();
    let points = thinned(&values);
    assert_eq!(points.iter().filter(|point| point.is_none()).count(), 1);

    let flicker: Vec<f64> = (0..50_000).map(|i| if i % 2 == 0 { 1.0 } else { f64::NAN }).collect();
    assert!(thinned(&flicker).len() <= 5 * COLUMNS);
}
