//! Faces that meet in a line only: tiles of a floor.

use crate::geometry::{PieceSide, PlacedPiece, Touch};
use nalgebra::Vector3;

/// Face normals are parallel to this: cosine.
const PARALLEL: f64 = 0.999_55;

/// Whether two faces lie in one plane but overlap in a line or a point only, to rounding: boxes on a
/// floor of tiles, where one reaches the next. Neither holds the other there.
pub(super) fn shares_a_line_only(
    a: PlacedPiece<'_>,
    b: PlacedPiece<'_>,
    touches: &[Touch],
    size: f64,
) -> bool {
    let Some(first) = touches.first() else { return true };
    let (owner, other) = match first.point_of {
        PieceSide::A => (b, a),
        PieceSide::B => (a, b),
    };
    // In the world.
    let normal = owner.1.rotation * first.normal;
    let faces = |(piece, pose): PlacedPiece<'_>, normal: Vector3<f64>| {
        let normal = pose.rotation.tr_mul(&normal);
        piece.core().faces().iter().any(|face| face.normal.dot(&normal) >= PARALLEL)
    };
    if !faces(owner, normal) || !faces(other, -normal) {
        return false;
    }
    let points = || {
        touches.iter().map(|touch| {
            let (_, pose) = if touch.point_of == PieceSide::A { a } else { b };
            pose.position + pose.rotation * touch.point
        })
    };
    let Some(from) = points().next() else { return true };
    let farthest = points()
        .map(|point| point - from)
        .max_by(|x, y| x.norm_squared().total_cmp(&y.norm_squared()));
    let Some(along) = farthest.and_then(|along| along.try_normalize(0.0)) else { return true };
    let width = points().map(|point| (point - from).cross(&along).norm()).fold(0.0, f64::max);
    width <= 1e-7 * size
}
