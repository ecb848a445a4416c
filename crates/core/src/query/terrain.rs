//! Distances from terrains.

use super::distance::{Distance, gap, nearest_pieces};
use crate::geometry::{Aabb, PairScratch, PlacedPiece, Terrain};
use crate::mechanics::Pose;
use nalgebra::{Matrix3, Vector3};

/// Pose of terrains.
const FIXED: Pose = Pose { position: Vector3::new(0.0, 0.0, 0.0), rotation: IDENTITY };
const IDENTITY: Matrix3<f64> = Matrix3::new(1.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0);

/// Signed distance of a piece from the nearest triangle of a terrain (m). It is `None` if it is
/// beyond `within`, and may be a larger number then.
pub(super) fn gap_to_terrain(
    piece: PlacedPiece<'_>,
    terrain: &Terrain,
    within: f64,
    scratch: &mut PairScratch,
) -> Option<f64> {
    let mut nearest: Option<f64> = None;
    terrain.visit(&Aabb::from_piece(piece.0, piece.1).grown(within), |triangle| {
        let Some(facet) = terrain.piece(triangle) else { return };
        let limit = nearest.map_or(within, |nearest| nearest.min(within));
        let distance = gap(piece, (facet, &FIXED), limit, scratch);
        if nearest.is_none_or(|nearest| distance < nearest) {
            nearest = Some(distance);
        }
    });
    nearest
}

/// The closest points of pieces and a terrain.
///
/// The search begins in boxes around the pieces that reach as far as the piece is large, and doubles
/// this reach until the boxes have a triangle nearer than it.
pub(super) fn nearest_in_terrain(
    pieces: &[PlacedPiece<'_>],
    terrain: &Terrain,
) -> Option<Distance> {
    let mut nearest: Option<Distance> = None;
    for &(piece, pose) in pieces {
        let around = Aabb::from_piece(piece, pose);
        let everything =
            (around.joined(terrain.bounds()).high - around.joined(terrain.bounds()).low).norm();
        let mut reach = (around.high - around.low).norm();
        loop {
            let mut facets = Vec::new();
            terrain.visit(&around.grown(reach), |triangle| {
                facets.extend(terrain.piece(triangle).map(|facet| (facet, &FIXED)));
            });
            let found = nearest_pieces(&[(piece, pose)], &facets);
            if let Some(found) = found
                .filter(|found| nearest.is_none_or(|nearest| found.distance < nearest.distance))
            {
                nearest = Some(found);
            }
            // Triangles that are not farther than the reach are all in the box.
            let is_near = nearest.is_some_and(|nearest| nearest.distance <= reach);
            if is_near || reach > everything {
                break;
            }
            reach *= 2.0;
        }
    }
    nearest
}
