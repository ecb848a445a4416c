//! Unit tests of `floor.rs`.

use super::*;

#[test]
fn the_grid_has_round_lengths() {
    for (length, round) in [(0.7, 1.0), (1.1, 2.0), (2.5, 5.0), (60.0, 100.0), (0.02, 0.02)] {
        assert!((round_length(length) / round - 1.0).abs() < 1e-12, "{length}");
    }
}

#[test]
fn the_ground_fades_from_the_motion_outward() {
    let light = Light::for_azimuth(10.0);
    let points = [Vector3::new(1.0, 2.0, 3.0), Vector3::new(-4.0, 2.5, 0.0)];
    let floor = Floor::under(&points, light);
    assert!(points.iter().all(|point| floor.fade(&point.xy()) == 1.0));
    let far = |share: f64| floor.middle + Vector2::x() * (share * floor.radius);
    let fades = [0.3, 0.5, 0.7, 0.9, 1.0].map(|share| floor.fade(&far(share)));
    assert!(fades.is_sorted_by(|a, b| a > b), "{fades:?}");
    assert_eq!((fades[0], fades[4]), (1.0, 0.0));
    let shadow = floor.shadows(&points[0]).next().unwrap();
    assert!(shadow.z == 0.0 && (shadow.xy() - points[0].xy()).norm() > 1.0);
}
