//! Unit tests of `mod.rs`.

use super::*;

/// Box of half sides 0.12 m about a point.
fn near(x: f64, y: f64, z: f64) -> Aabb {
    let centre = Vector3::new(x, y, z);
    Aabb { low: centre.add_scalar(-0.12), high: centre.add_scalar(0.12) }
}

/// Pieces in a box: true for a plane, with the triangle of its name.
fn pieces(terrain: &Terrain, around: &Aabb) -> Vec<(bool, usize)> {
    let mut pieces = Vec::new();
    terrain.visit_pieces(around, &mut Vec::new(), |piece| {
        pieces.push((terrain.is_plane(piece), terrain.triangle_of(piece)));
    });
    pieces
}

/// Ten by ten cells of 0.1 m with the height `z` over the column of points.
fn field(z: impl Fn(usize) -> f64) -> Terrain {
    let heights = (0..11 * 11).map(|point| z(point % 11)).collect();
    HeightField::new(heights, 11, [0.1; 2]).unwrap().into()
}

/// Bodies over the inside of a level field touch its plane. Those near its border, and those that are not as
/// low, touch triangles or nothing.
#[test]
fn a_patch_is_one_plane_inside() {
    let level = field(|_| 0.0);
    assert_eq!(pieces(&level, &near(0.5, 0.5, 0.1)), [(true, 0)]);
    assert_eq!(pieces(&level, &near(0.5, 0.5, 0.3)), []);
    for place in [0.1, 0.9, 1.1] {
        let found = pieces(&level, &near(place, 0.5, 0.1));
        assert!(!found.is_empty() && found.iter().all(|(is_plane, _)| !is_plane), "{place}");
    }
    let plane = level.piece(level.plane(0)).unwrap();
    for face in plane.core().faces() {
        assert!((face.normal.z.abs() - 1.0).abs() <= 1e-15 && face.offset.abs() <= 1e-15);
    }
}

/// Beside a fold both sides have triangles; a quarter metre from it the plane of the slope is touched.
#[test]
fn a_slope_ends_at_its_fold() {
    let folded = field(|column| 0.1 * (column as f64 - 5.0).max(0.0));
    let at_fold = pieces(&folded, &near(0.5, 0.5, 0.1));
    assert!(at_fold.len() > 8 && at_fold.iter().all(|(is_plane, _)| !is_plane));
    let [(true, first)] = pieces(&folded, &near(0.75, 0.5, 0.31))[..] else { panic!("no plane") };
    assert!(folded.corners(first).iter().all(|corner| corner.x >= 0.5 - 1e-12));
    assert_eq!(pieces(&folded, &near(0.25, 0.5, 0.1)), [(true, 0)]);
}
