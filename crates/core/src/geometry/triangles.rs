//! The convex hull of points as triangles, by adding one point after the other. Which side of
//! a triangle a point is on is decided exactly (Shewchuk's adaptive predicate), so that the
//! result is a closed convex surface whatever the points are: coplanar, nearly coplanar or
//! repeated.

use nalgebra::Vector3;
use robust::{Coord3D, orient3d};

/// Three points, counter-clockwise seen from outside.
pub(super) type Triangle = [usize; 3];

/// Points within this part of their largest extent of one plane have no hull with an inside.
pub(super) const FLAT: f64 = 1e-5;

/// The triangles of the hull of `points`, or `None` if the points are [`FLAT`]. A point in the
/// inside of a triangle's plane polygon or edge is no corner of a triangle, but may be one if
/// it came before the corners around it.
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
        // The rim of what the point sees: edges whose other side it does not see.
        visible.sort_unstable();
        rim.clear();
        let is_rim = |&&(u, v): &&(usize, usize)| visible.binary_search(&(v, u)).is_err();
        rim.extend(visible.iter().filter(is_rim));
        triangles.extend(rim.iter().map(|&(u, v)| [u, v, point]));
    }
    Some(triangles)
}

/// Four points that are far apart: the lowest in x, the farthest from it, the farthest from
/// their line, the farthest from their plane; of equals the first.
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

/// The four faces of a tetrahedron, each turned so that the fourth point is below it.
fn faces_of(points: &[Vector3<f64>], [a, b, c, d]: [usize; 4]) -> Vec<Triangle> {
    let faces = [([a, b, c], d), ([a, d, b], c), ([b, d, c], a), ([c, d, a], b)];
    let turned = |([u, v, w], other): (Triangle, usize)| {
        if is_above(points, [u, v, w], other) { [u, w, v] } else { [u, v, w] }
    };
    faces.into_iter().map(turned).collect()
}

/// Whether a point is strictly on the outer side of a triangle's plane: exact.
fn is_above(points: &[Vector3<f64>], [a, b, c]: Triangle, point: usize) -> bool {
    let at = |index: usize| {
        let p: &Vector3<f64> = &points[index];
        Coord3D { x: p.x, y: p.y, z: p.z }
    };
    orient3d(at(a), at(b), at(c), at(point)) < 0.0
}
