//! Signed distance of two pieces.

use super::axes::best_axis;
use super::closest_features::closest_features;
use super::features::PieceSide;
use super::hint::Hint;
use super::pair::{PiecePair, PlacedPiece};
use super::scratch::PairScratch;
use super::separating_axis::{AxisSource, TieBreak};
use nalgebra::Vector3;

/// Signed distance of two pieces and its direction.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Separation {
    /// Distance (m) of separated pieces. For overlapping pieces it is minus the length of the
    /// shortest translation that separates them.
    pub distance: f64,
    /// Unit vector (world, from A to B) along the shortest line between the pieces. For overlapping
    /// pieces it is the direction of B's shortest separating translation.
    pub axis: Vector3<f64>,
}

/// Computes the separation of two pieces at two poses, exact to rounding.
///
/// If the cores of two pieces without faces (spheres, capsules) overlap, the distance is minus the
/// sum of the radii.
pub fn signed_distance(
    a: PlacedPiece<'_>,
    b: PlacedPiece<'_>,
    hint: &mut Hint,
    scratch: &mut PairScratch,
) -> Separation {
    let pair = PiecePair::new(a, b);
    let touching = touching(a, b, hint, scratch);
    if !pair.is_smooth() {
        return touching;
    }
    let axis = a.1.rotation.tr_mul(&touching.axis);
    let Some(near) = pair.smooth_nearest(&axis) else { return touching };
    hint.set(&pair, Some(near.axis), None);
    let distance = pair.gap_along(&near.axis) - pair.radii();
    Separation { distance, axis: a.1.rotation * near.axis }
}

/// Separation of two pieces, exact if they touch. Apart from a smooth shape it is a lower bound.
pub(super) fn touching(
    a: PlacedPiece<'_>,
    b: PlacedPiece<'_>,
    hint: &mut Hint,
    scratch: &mut PairScratch,
) -> Separation {
    let pair = PiecePair::new(a, b);
    let (distance, axis, kind) = if pair.is_smooth() {
        let axis = pair.smooth_axis(hint);
        (pair.gap_along(&axis), axis, None)
    } else {
        exact(&pair, scratch)
    };
    hint.set(&pair, Some(axis), kind);
    Separation { distance: distance - pair.radii(), axis: a.1.rotation * axis }
}

/// Penetration depth of two pieces (m), 0 if they are apart. See [`signed_distance`].
pub fn overlap(
    a: PlacedPiece<'_>,
    b: PlacedPiece<'_>,
    hint: &mut Hint,
    scratch: &mut PairScratch,
) -> f64 {
    let pair = PiecePair::new(a, b);
    if pair.quick_gap(hint) > pair.radii() {
        return 0.0;
    }
    (-signed_distance(a, b, hint, scratch).distance).max(0.0)
}

/// Separation of the cores (m), its axis (unit, frame of A), and the features that span the axis if
/// there are any.
fn exact(
    pair: &PiecePair<'_>,
    scratch: &mut PairScratch,
) -> (f64, Vector3<f64>, Option<AxisSource>) {
    pair.place(scratch);
    let tie = TieBreak { within: 0.0, to: PieceSide::A };
    let axis = best_axis(pair, scratch, f64::INFINITY, tie);
    if let Some(axis) = axis.filter(|axis| axis.exact) {
        return (axis.gap, axis.normal, Some(axis.kind));
    }
    let points = closest_features(pair, scratch, axis.as_ref().map(|axis| &axis.normal));
    let distance = points.distance();
    // A distance at rounding level has no direction; the axis is used instead.
    if distance > 1e-12 * pair.size() {
        return (distance, (points.b - points.a) / distance, None);
    }
    let normal = axis.map_or_else(|| across_cores(pair, scratch), |axis| axis.normal);
    (distance, normal, axis.map(|axis| axis.kind))
}

/// A direction perpendicular to two touching cores without faces: to both segments, to the only
/// segment, or an arbitrary one.
pub(super) fn across_cores(pair: &PiecePair<'_>, scratch: &PairScratch) -> Vector3<f64> {
    let along = |vertices: &[Vector3<f64>]| vertices[vertices.len() - 1] - vertices[0];
    let along_a = along(pair.a.vertices());
    let along_b = along(&scratch.vertices);
    let across = along_a.cross(&along_b);
    if across.norm() > 1e-9 * along_a.norm() * along_b.norm() && across.norm() > 0.0 {
        return across.normalize();
    }
    let along = if along_a.norm() > 0.0 { along_a } else { along_b };
    let least = along.iamin();
    let across = along.cross(&Vector3::ith(least, 1.0));
    across.try_normalize(0.0).unwrap_or_else(Vector3::z)
}
