//! Closest points of two pieces.

use super::closest_features::closest_features;
use super::hint::Hint;
use super::pair::{PiecePair, PlacedPiece};
use super::scratch::PairScratch;
use super::separation::{Separation, signed_distance};
use crate::kinematics::Pose;
use nalgebra::Vector3;

/// Relative distance of cores below which they count as touching.
const TOUCHING: f64 = 1e-9;

/// Separation of two pieces with a closest point of each.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ClosestPoints {
    /// Signed distance and its direction.
    pub separation: Separation,
    /// Point on the surface of A (m, world).
    pub a: Vector3<f64>,
    /// Point on the surface of B (m, world): the point of A moved by the signed distance along the
    /// axis.
    pub b: Vector3<f64>,
}

/// Computes the [`signed_distance`] of two pieces and the points between which it is measured.
///
/// If the cores are apart, these are the closest points. If they overlap, B is first moved out of A
/// along the axis n of the separation. The origin of the Minkowski difference A − B then leaves the
/// difference through its face nearest to the origin, so the closest points of the moved pair are
/// those that touch last:
///
/// ```text
/// b' − a = δ n,   b = b' − s n
/// ```
///
/// with s the shift of B. Parallel faces or edges have many closest points, and one of them is
/// returned.
pub fn closest_points(
    a: PlacedPiece<'_>,
    b: PlacedPiece<'_>,
    hint: &mut Hint,
    scratch: &mut PairScratch,
) -> ClosestPoints {
    let separation = signed_distance(a, b, hint, scratch);
    let pair = PiecePair::new(a, b);
    let size = pair.size();
    let cores = separation.distance + pair.radii();
    let shift = if cores > TOUCHING * size { 0.0 } else { size - cores };
    let moved = Pose { position: b.1.position + separation.axis * shift, ..*b.1 };
    let pair = PiecePair::new(a, (b.0, &moved));
    let axis = a.1.rotation.tr_mul(&separation.axis);
    let on_a = if pair.is_smooth() {
        pair.smooth_nearest(&axis).map_or_else(|| pair.extremes(&-axis)[0], |near| near.a)
    } else {
        pair.place(scratch);
        closest_features(&pair, scratch, Some(&axis)).a + axis * a.0.radius()
    };
    let on_a = a.1.rotation * on_a + a.1.position;
    ClosestPoints { separation, a: on_a, b: on_a + separation.axis * separation.distance }
}
