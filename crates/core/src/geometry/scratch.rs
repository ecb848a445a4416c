//! Workspace of the narrow phase.

use super::candidate_features::CandidateFeatures;
use super::overlap::FaceOverlap;
use super::pair::PiecePair;
use nalgebra::Vector3;

/// Workspace of the narrow phase, shared by all pairs. It stops allocating after the largest hulls.
#[derive(Debug, Clone, Default)]
pub struct PairScratch {
    /// Vertices of B (m, frame of A).
    pub(super) vertices: Vec<Vector3<f64>>,
    /// Normals of B's faces (frame of A).
    pub(super) normals: Vec<Vector3<f64>>,
    /// Dot products of an edge of A with B's normals.
    pub(super) products: Vec<f64>,
    /// Edges of A and of B that may span the axis of largest separation.
    pub(super) edges: [Vec<usize>; 2],
    /// Candidate features for the closest points.
    pub(super) near: CandidateFeatures,
    /// Two faces to be intersected.
    pub(super) overlap: FaceOverlap,
}

impl PiecePair<'_> {
    /// Writes B's vertices and normals to `scratch` in the frame of A.
    pub fn place(&self, scratch: &mut PairScratch) {
        scratch.vertices.clear();
        scratch.vertices.extend(self.b.vertices().iter().map(|v| self.rotation * v + self.shift));
        scratch.normals.clear();
        scratch.normals.extend(self.b.faces().iter().map(|face| self.rotation * face.normal));
    }
}
