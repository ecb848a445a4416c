//! Nearest points of two pieces that are apart, from support points alone.
//!
//! Let W be the set of all differences b − a of points of B and A. Its point nearest to the origin is
//! the difference of the nearest points. The search is that of Gilbert, Johnson and Keerthi, "A fast
//! procedure for computing the distance between complex objects in three-dimensional space" (1988).

use super::pair::PiecePair;
use nalgebra::{Matrix3, Vector3};

/// Largest number of support points.
const MOST_POINTS: u32 = 200;
/// Difference of the bounds of the distance at which the search ends, relative to the smaller
/// piece.
const CONVERGED: f64 = 1e-13;

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
    let first = support(axis);
    let mut simplex = Simplex { corners: [first; 4], count: 1, nearest: first };
    for _ in 0..MOST_POINTS {
        let distance = simplex.nearest.w.norm();
        let toward = simplex.nearest.w.try_normalize(tolerance)?;
        let next = support(&toward);
        if distance - toward.dot(&next.w) <= tolerance {
            break;
        }
        let Some(smaller) = simplex.with(next).filter(|new| new.nearest.w.norm() < distance) else {
            break;
        };
        simplex = smaller;
    }
    let axis = simplex.nearest.w.try_normalize(0.0)?;
    Some(Nearest { axis, a: simplex.nearest.a })
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
