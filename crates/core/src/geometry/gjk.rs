//! Nearest points of two convex sets by the algorithm of Gilbert, Johnson and Keerthi ("A fast procedure
//! for computing the distance between complex objects in three-dimensional space", IEEE Journal on
//! Robotics and Automation, 1988), from support points alone.
//!
//! Let W be the set of all differences b − a of points of B and A. Its point nearest to the origin is the
//! difference of the nearest points, and lies in a simplex of at most four support points. Each step takes
//! the point v of the current simplex that is nearest to the origin, and adds the support point w that
//! is lowest along v. |v|² − v·w bounds what is left of |v|².

use super::pair::PiecePair;
use super::support::{highest, lowest};
use nalgebra::{Matrix3, Vector3};

/// Largest number of support points.
const MOST_POINTS: u32 = 200;
/// Difference of the bounds of the distance at which a search for the nearest points ends, relative to
/// the smaller piece.
const CONVERGED: f64 = 1e-13;
/// Difference of the bounds of the squared distance at which a search for close points ends, relative to
/// it.
const ENOUGH: f64 = 1e-6;

/// Nearest points of two pieces.
#[derive(Debug, Clone, Copy)]
pub(super) struct Nearest {
    /// Unit vector from A to B (frame of A).
    pub axis: Vector3<f64>,
    /// Nearest point of A (m, frame of A).
    pub a: Vector3<f64>,
}

/// A support point of W and the point of A that belongs to it.
#[derive(Debug, Clone, Copy)]
struct Support {
    w: Vector3<f64>,
    a: Vector3<f64>,
}

/// Corners of a simplex whose hull has the point `nearest` to the origin.
#[derive(Debug, Clone, Copy)]
struct Simplex {
    corners: [Support; 4],
    count: usize,
    nearest: Support,
}

/// Finds the nearest points of two pieces from an axis along which they are apart (unit, frame of
/// A). `None` if they touch.
pub(super) fn nearest(pair: &PiecePair<'_>, axis: &Vector3<f64>) -> Option<Nearest> {
    let tolerance = CONVERGED * pair.size();
    let support = |toward: &Vector3<f64>| {
        let [a, b] = pair.extremes(&-toward);
        Support { w: b - a, a }
    };
    let is_nearest = |v: &Vector3<f64>, w: &Vector3<f64>| {
        let distance = v.norm();
        distance <= tolerance || distance - (v / distance).dot(w) <= tolerance
    };
    let along = |v: &Vector3<f64>| support(&v.try_normalize(0.0).unwrap_or(*axis));
    let Support { w, a } = nearest_to_origin(support(axis), along, is_nearest);
    Some(Nearest { axis: w.try_normalize(tolerance)?, a })
}

/// A point of each core (m, frame of A) whose distance is nearly the smallest. The search ends early
/// if the cores overlap to rounding.
///
/// `along` is the first direction, from A to B. `a` and `b` are the vertices.
pub(super) fn close_points(
    a: &[Vector3<f64>],
    b: &[Vector3<f64>],
    along: &Vector3<f64>,
) -> [Vector3<f64>; 2] {
    let support = |along: &Vector3<f64>| {
        let a = a[highest(a, along).0];
        Support { w: b[lowest(b, along).0] - a, a }
    };
    let is_close = |v: &Vector3<f64>, w: &Vector3<f64>| {
        v.norm_squared() - v.dot(w) <= ENOUGH * v.norm_squared()
    };
    let Support { w, a } = nearest_to_origin(support(along), support, is_close);
    [a, a + w]
}

/// Point of W nearest to the origin, from the support point `first` on, until `is_near` holds for v and w.
/// If W contains the origin, a point near it.
fn nearest_to_origin(
    first: Support,
    support: impl Fn(&Vector3<f64>) -> Support,
    is_near: impl Fn(&Vector3<f64>, &Vector3<f64>) -> bool,
) -> Support {
    let mut simplex = Simplex { corners: [first; 4], count: 1, nearest: first };
    for _ in 0..MOST_POINTS {
        let v = simplex.nearest.w;
        let next = support(&v);
        if is_near(&v, &next.w) {
            break;
        }
        let smaller = simplex.with(next).filter(|new| new.nearest.w.norm() < v.norm());
        let Some(smaller) = smaller else { break };
        simplex = smaller;
    }
    simplex.nearest
}

impl Simplex {
    /// The face with the point nearest to the origin, of this simplex and the corner `next`. `None`
    /// for a tetrahedron around the origin.
    fn with(&self, next: Support) -> Option<Self> {
        let mut all = self.corners;
        *all.get_mut(self.count)? = next;
        let mut best: Option<Self> = None;
        for chosen in 1_u32..1 << (self.count + 1) {
            let mut face = Self { corners: all, count: 0, nearest: next };
            for (_, corner) in all.iter().enumerate().filter(|(at, _)| chosen >> at & 1 == 1) {
                face.corners[face.count] = *corner;
                face.count += 1;
            }
            let Some(nearest) = nearest_of_span(&face.corners[..face.count]) else { continue };
            let square = nearest.w.norm_squared();
            if best.is_none_or(|best| square < best.nearest.w.norm_squared()) {
                best = Some(Self { nearest, ..face });
            }
        }
        best.filter(|best| best.count < 4)
    }
}

/// Point nearest to the origin on the plane, line or point through the corners. `None` if it is
/// outside their hull.
///
/// With the edges e_i = w_i − w₀, its weights t solve (e_i·e_j) t = −e_i·w₀.
fn nearest_of_span(corners: &[Support]) -> Option<Support> {
    let first = corners[0];
    let edges = &corners[1..];
    let edge = |at: usize| edges.get(at).map(|corner| corner.w - first.w);
    let square = Matrix3::from_fn(|i, j| match (edge(i), edge(j)) {
        (Some(u), Some(v)) => u.dot(&v),
        _ => f64::from(u8::from(i == j)),
    });
    let right = Vector3::from_fn(|i, _| edge(i).map_or(0.0, |u| -u.dot(&first.w)));
    let weights = square.lu().solve(&right)?;
    if weights.iter().any(|&weight| weight < 0.0) || weights.sum() > 1.0 {
        return None;
    }
    let each = edges.iter().zip(weights.iter());
    Some(each.fold(first, |sum, (corner, &weight)| Support {
        w: sum.w + (corner.w - first.w) * weight,
        a: sum.a + (corner.a - first.a) * weight,
    }))
}
