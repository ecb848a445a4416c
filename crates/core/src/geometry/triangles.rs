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

/// Relative error bound of a height that is computed in floating-point numbers: some 20 roundings.
const ROUNDING: f64 = 1e-14;

/// A triangle of the hull so far.
struct Side {
    corners: Triangle,
    /// A corner (m).
    from: Vector3<f64>,
    /// Outward normal, twice as long as the area of the triangle.
    normal: Vector3<f64>,
    /// Height times the length of the normal below which its sign is not certain.
    uncertain: f64,
}

impl Side {
    /// `size` is a bound on the distance of two points (m).
    fn new(points: &[Vector3<f64>], corners: Triangle, size: f64) -> Self {
        let [from, b, c] = corners.map(|corner| points[corner]);
        let (along, across) = (b - from, c - from);
        let uncertain = ROUNDING * along.norm() * across.norm() * size;
        Self { corners, from, normal: along.cross(&across), uncertain }
    }

    /// True if a point is strictly on the outer side of the plane. The test is exact.
    fn is_below(&self, points: &[Vector3<f64>], point: usize) -> bool {
        let height = self.normal.dot(&(points[point] - self.from));
        if height.abs() > self.uncertain {
            height > 0.0
        } else {
            is_above(points, self.corners, point)
        }
    }
}

/// Triangles of the hull of `points`, or `None` if the points are [`FLAT`].
///
/// A point in the interior of a coplanar polygon or an edge need not be a corner. It can be one if
/// it was inserted before the corners around it.
pub(super) fn hull_triangles(points: &[Vector3<f64>]) -> Option<Vec<Triangle>> {
    let first = first_tetrahedron(points)?;
    let size = 2.0 * points.iter().map(|point| (point - points[0]).norm()).fold(0.0, f64::max);
    let side = |corners| Side::new(points, corners, size);
    let mut sides: Vec<Side> = faces_of(points, first).into_iter().map(side).collect();
    let (mut visible, mut rim) = (Vec::new(), Vec::new());
    for point in (0..points.len()).filter(|point| !first.contains(point)) {
        visible.clear();
        sides.retain(|side| {
            let is_visible = side.is_below(points, point);
            if is_visible {
                let [a, b, c] = side.corners;
                visible.extend([(a, b), (b, c), (c, a)]);
            }
            !is_visible
        });
        // Boundary of the region visible from the point: edges whose other side is not visible.
        visible.sort_unstable();
        rim.clear();
        let is_rim = |&&(u, v): &&(usize, usize)| visible.binary_search(&(v, u)).is_err();
        rim.extend(visible.iter().filter(is_rim));
        sides.extend(rim.iter().map(|&(u, v)| side([u, v, point])));
    }
    Some(sides.into_iter().map(|side| side.corners).collect())
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
