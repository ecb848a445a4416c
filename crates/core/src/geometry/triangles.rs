//! Triangulated convex hull of points, built by inserting one point after the other.
//!
//! Shewchuk's adaptive predicate decides exactly on which side of a triangle a point lies. The
//! result is a closed convex surface even for coplanar, nearly coplanar or repeated points.

use nalgebra::Vector3;
use robust::{Coord3D, orient3d};

/// Indices of three points, counter-clockwise seen from outside.
pub(super) type Triangle = [usize; 3];

/// Relative flatness limit: points within this fraction of their largest extent of one plane have
/// no solid hull.
pub(super) const FLAT: f64 = 1e-5;

/// Triangles of the hull of `points`, or `None` if the points are [`FLAT`].
///
/// A point in the interior of a coplanar polygon or an edge need not be a corner. It can be one if
/// it was inserted before the corners around it.
pub(super) fn hull_triangles(points: &[Vector3<f64>]) -> Option<Vec<Triangle>> {
    let first = first_tetrahedron(points)?;
    let mut triangles = faces_of(points, first);
    let (mut visible, mut rim) = (Vec::new(), Vec::new());
    for point in (0..points.len()).filter(|point| !first.contains(point)) {
        visible.clear();
        triangles.retain(|&triangle| {
            let seen = is_above(points, triangle, point);
            if seen {
                let [a, b, c] = triangle;
                visible.extend([(a, b), (b, c), (c, a)]);
            }
            !seen
        });
        // Boundary of the region visible from the point: edges whose other side is not visible.
        visible.sort_unstable();
        rim.clear();
        let is_rim = |&&(u, v): &&(usize, usize)| visible.binary_search(&(v, u)).is_err();
        rim.extend(visible.iter().filter(is_rim));
        triangles.extend(rim.iter().map(|&(u, v)| [u, v, point]));
    }
    Some(triangles)
}

/// Four points that are far apart: the lowest in x, the farthest from it, the farthest from their
/// line, and the farthest from their plane. Ties take the first.
fn first_tetrahedron(points: &[Vector3<f64>]) -> Option<[usize; 4]> {
    let farthest = |distance: &dyn Fn(&Vector3<f64>) -> f64| {
        let mut best = (0, f64::NEG_INFINITY);
        for (index, point) in points.iter().enumerate() {
            let value = distance(point);
            if value > best.1 {
                best = (index, value);
            }
        }
        best
    };
    let (a, _) = farthest(&|p| -p.x);
    let origin = *points.get(a)?;
    let (b, length) = farthest(&|p| (p - origin).norm());
    let along = (points[b] - origin) / length;
    let (c, width) = farthest(&|p| (p - origin).cross(&along).norm());
    let normal = along.cross(&(points[c] - origin)) / width;
    let (d, height) = farthest(&|p| (p - origin).dot(&normal).abs());
    (width > FLAT * length && height > FLAT * length).then_some([a, b, c, d])
}

/// The four faces of a tetrahedron, oriented so that the fourth point is below each.
fn faces_of(points: &[Vector3<f64>], [a, b, c, d]: [usize; 4]) -> Vec<Triangle> {
    let faces = [([a, b, c], d), ([a, d, b], c), ([b, d, c], a), ([c, d, a], b)];
    let turned = |([u, v, w], other): (Triangle, usize)| {
        if is_above(points, [u, v, w], other) { [u, w, v] } else { [u, v, w] }
    };
    faces.into_iter().map(turned).collect()
}

/// True if a point is strictly on the outer side of a triangle's plane. The test is exact.
fn is_above(points: &[Vector3<f64>], [a, b, c]: Triangle, point: usize) -> bool {
    let at = |index: usize| {
        let p: &Vector3<f64> = &points[index];
        Coord3D { x: p.x, y: p.y, z: p.z }
    };
    orient3d(at(a), at(b), at(c), at(point)) < 0.0
}
