//! Unit tests of `solids.rs`.

use super::*;

/// Comparison with a search along the ray for the distance `radius` to the segment.
#[test]
fn rays_hit_capsules_where_the_distance_is_the_radius() {
    let (a, b, radius) = (Vector3::new(-1.0, 0.2, 0.0), Vector3::new(1.5, 0.0, 0.4), 0.6);
    let eye = Vector3::new(0.3, -6.0, 1.0);
    let apart = |p: &Vector3<f64>| {
        let share = ((p - a).dot(&(b - a)) / (b - a).norm_squared()).clamp(0.0, 1.0);
        (p - a - (b - a) * share).norm()
    };
    let mut hits = 0;
    for i in 0..40 {
        for k in 0..20 {
            let aim = Vector3::new(-2.4 + 0.12 * f64::from(i), 0.0, -1.0 + 0.12 * f64::from(k));
            let direction = aim - eye;
            let nearest = (0..4000).map(|n| eye + direction * (f64::from(n) / 2000.0));
            let nearest = nearest.map(|p| apart(&p)).fold(f64::INFINITY, f64::min);
            let hit = capsule_hit(&eye, &direction, &a, &b, radius);
            if (nearest - radius).abs() > 1e-3 {
                assert_eq!(hit.is_some(), nearest < radius, "{aim}");
            }
            let Some((t, core)) = hit else { continue };
            let point = eye + direction * t;
            assert!((apart(&point) - radius).abs() < 1e-9 && t > 0.0);
            assert!(((point - core).norm() - radius).abs() < 1e-9);
            let before = (0..100).map(|n| eye + direction * (t * f64::from(n) / 100.0));
            assert!(before.into_iter().all(|p| apart(&p) > radius - 1e-9), "the first one");
            hits += 1;
        }
    }
    assert!(hits > 100, "{hits}");
}
