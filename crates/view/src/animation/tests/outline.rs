//! Unit tests of `outline.rs`.

use super::*;

#[test]
fn convex_hull_omits_interior_points() {
    let spot = |[x, y]: [f64; 2]| [x, y, 1.0];
    let square = [[0.0, 0.0], [4.0, 0.0], [4.0, 4.0], [0.0, 4.0]].map(spot);
    let mut points = square.to_vec();
    points.extend([[1.0, 1.0], [2.0, 0.0], [4.0, 4.0]].map(spot));
    assert_eq!(hull(&points), square);
    assert!(hull(&[[1.0; 3]; 3]).iter().all(|&point| point == [1.0; 3]));
}
