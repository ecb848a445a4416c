//! Candidate features for the closest points of two cores.

use super::hull::Edge;
use nalgebra::Vector3;

/// Placeholder edge index of a core without edges; it means the core's single point.
const POINT: usize = usize::MAX;

/// Features that can contain the closest points: those that reach into the layer between the cores
/// where the closest points must lie.
#[derive(Debug, Clone, Default)]
pub(super) struct Near {
    pub a: CoreFeatures,
    pub b: CoreFeatures,
}

/// Candidate features of one core.
#[derive(Debug, Clone, Default)]
pub(super) struct CoreFeatures {
    pub vertices: Vec<usize>,
    edges: Vec<usize>,
}

impl Near {
    /// Calls `visit` on all pairs of candidate edges in ascending order; see [`POINT`].
    pub fn each_pair(&self, mut visit: impl FnMut(usize, usize)) {
        for &a in &self.a.edges {
            for &b in &self.b.edges {
                visit(a, b);
            }
        }
    }
}

impl CoreFeatures {
    /// Collects the vertices for which `is_near` holds, and the edges with at least one such end.
    pub fn find(
        &mut self,
        vertices: &[Vector3<f64>],
        edges: &[Edge],
        is_near: impl Fn(&Vector3<f64>) -> bool,
    ) {
        self.vertices.clear();
        self.vertices.extend((0..vertices.len()).filter(|&index| is_near(&vertices[index])));
        self.edges.clear();
        let reaches = |edge: &Edge| edge.vertices.iter().any(|&v| is_near(&vertices[v as usize]));
        self.edges.extend((0..edges.len()).filter(|&index| reaches(&edges[index])));
        if edges.is_empty() {
            self.edges.push(POINT);
        }
    }
}
