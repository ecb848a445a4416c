//! Unit tests of `camera.rs`.

use super::*;

#[test]
fn camera_frames_all_points_and_touches_the_margin() {
    let points: Vec<_> = (0..8)
        .map(|i| {
            let bit = |k: u32| f64::from(i >> k & 1);
            Vector3::new(7.0 * bit(0) - 40.0, 3.0 * bit(1), 2.0 * bit(2))
        })
        .collect();
    for azimuth in [-170.0, -32.0, 0.0, 45.0, 90.0, 1000.0] {
        for elevation in [0.0, 20.0, 60.0, 90.0] {
            let camera =
                Camera::fit(View { azimuth, elevation }, &Rotation3::identity(), 800, &points);
            let mut reached = 0.0f64;
            for point in &points {
                let [x, y] = camera.project(point).map(f64::from);
                let (x, y) = ((x - 400.0) / 400.0, (400.0 - y) / 400.0);
                assert!(x.abs() <= FILL + 1e-6, "{x}");
                assert!((-FILL - 1e-6..=FILL_ABOVE + 1e-6).contains(&y), "{y}");
                reached = reached.max((x / FILL).abs()).max(y / FILL_ABOVE).max(-y / FILL);
            }
            assert!((reached - 1.0).abs() < 1e-5, "{azimuth} {elevation}: {reached}");
        }
    }
}

#[test]
fn ray_through_a_projected_point_hits_the_point() {
    let points = [Vector3::new(-4.0, 1.0, 0.0), Vector3::new(2.0, 3.0, 1.5), Vector3::x()];
    let camera = Camera::fit(View::default(), &Rotation3::identity(), 800, &points);
    for point in points {
        let [x, y, w] = camera.spot(&point);
        assert!((camera.eye() + camera.ray(x, y) / w - point).norm() < 1e-9);
        assert!((camera.ray(x, y).dot(&camera.forward()) - 1.0).abs() < 1e-12);
        let [px, py] = camera.project(&point).map(f64::from);
        assert!((px - x).abs() < 1e-3 && (py - y).abs() < 1e-3);
    }
}

#[test]
fn the_axes_are_a_right_handed_frame_with_forward_towards_the_scene() {
    let axes = axes(View { azimuth: 30.0, elevation: 90.0 });
    assert!((axes * axes.transpose() - Matrix3::identity()).amax() < 1e-15);
    // right × up points at the viewer.
    assert!((axes.determinant() + 1.0).abs() < 1e-15);
    assert!((axes.row(2)[2] + 1.0).abs() < 1e-15);
}
