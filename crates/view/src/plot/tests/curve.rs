//! Unit tests of `curve.rs`.

use super::*;

#[test]
fn lines_break_at_gaps_and_lone_points_become_dots() {
    let points = [Some((0.0, 1.0)), Some((1.0, 2.5)), None, Some((3.0, 1.0)), None];
    assert_eq!(line(&points), "M0 1L1 2.5M3 1");
    assert_eq!(dots(&points, false), "M3 1h.01");
    assert_eq!(dots(&points, true).matches('M').count(), 3);
}

#[test]
fn horizontal_stretches_keep_only_their_ends() {
    let points: Vec<_> =
        [0.0, 1.0, 1.0, 1.0, 2.0].iter().enumerate().map(|(i, y)| Some((i as f64, *y))).collect();
    assert_eq!(line(&points), "M0 0L1 1L3 1L4 2");
}

#[test]
fn steps_keep_each_value_up_to_the_next() {
    let points = [Some((0.0, 1.0)), Some((1.0, 3.0)), None, Some((4.0, 2.0))];
    let corner = Some((1.0, 1.0));
    assert_eq!(steps(&points), [points[0], corner, points[1], None, points[3]]);
}
