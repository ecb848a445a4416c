//! Pieces that meet in a line only: coplanar faces like those of the tiles of a floor, and corners.

use crate::geometry::{ManifoldPoint, PieceSide, PlacedPiece, flat_faces};
use nalgebra::Vector3;

/// Cosine above which face normals are parallel.
const PARALLEL: f64 = 0.999_55;
/// Cosine below which a face is no other view of the contact's plane.
const ACROSS: f64 = 0.9;
/// Most contact points of two pieces that may meet at a corner only.
const MOST_POINTS: usize = 2;

/// True if two faces lie in one plane and overlap in a line or a point only, to rounding. Boxes on
/// a tiled floor do so where one tile meets the next. Such faces do not support each other.
pub(super) fn shares_a_line_only(
    a: PlacedPiece<'_>,
    b: PlacedPiece<'_>,
    touches: &[ManifoldPoint],
    size: f64,
) -> bool {
    let Some(first) = touches.first() else { return true };
    let (owner, other) = match first.point_of {
        PieceSide::A => (b, a),
        PieceSide::B => (a, b),
    };
    // Normal in the world.
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

/// True if two pieces that touch are not deeper than `within` (m) across another face. A body that slides
/// to the edge of a plate which is level with it is beside the plate and above it. The step decides which.
pub(super) fn meet_at_a_corner(
    a: PlacedPiece<'_>,
    b: PlacedPiece<'_>,
    touches: &[ManifoldPoint],
    within: f64,
) -> bool {
    let Some(first) = touches.first().filter(|_| touches.len() <= MOST_POINTS) else {
        return false;
    };
    let owner = if first.point_of == PieceSide::A { b } else { a };
    let normal = owner.1.rotation * first.normal;
    let is_beside = |(piece, pose): PlacedPiece<'_>, (other, of_other): PlacedPiece<'_>| {
        flat_faces(piece).map(|face| piece.core().faces()[face]).any(|face| {
            let outward = pose.rotation * face.normal;
            let lowest = other.farthest(&-of_other.rotation.tr_mul(&outward));
            let lowest = of_other.position + of_other.rotation * lowest - pose.position;
            outward.dot(&normal).abs() < ACROSS
                && outward.dot(&lowest) - face.offset - piece.radius() >= -within
        })
    };
    is_beside(a, b) || is_beside(b, a)
}
