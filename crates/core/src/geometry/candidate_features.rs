//! Candidate features for the closest points of two cores.

use super::hull::Edge;
use super::pair::PiecePair;
use nalgebra::Vector3;

/// Placeholder edge index of a core without edges; it means the core's single point.
const POINT: usize = usize::MAX;

/// Features that can contain the closest points: those that reach into the layer between the cores
/// where the closest points must lie.
#[derive(Debug, Clone, Default)]
pub(super) struct CandidateFeatures {
    pub a: CoreFeatures,
    pub b: CoreFeatures,
}

/// Candidate features of one core.
#[derive(Debug, Clone, Default)]
pub(super) struct CoreFeatures {
    pub vertices: Vec<usize>,
    edges: Vec<usize>,
}

impl CandidateFeatures {
    /// Collects the features that reach into the layer along `axis` in which the closest points lie.
    ///
    /// `vertices` are those of B in the frame of A. `ends` are the highest point of A and the lowest
    /// point of B along the axis (m). `bound` is an upper bound on the distance (m).
    pub fn find(
        &mut self,
        pair: &PiecePair<'_>,
        vertices: &[Vector3<f64>],
        axis: &Vector3<f64>,
        [high, low]: [f64; 2],
        bound: f64,
    ) {
        let slack = 1e-12 * (1.0 + bound);
        let near_a = |v: &Vector3<f64>| axis.dot(v) >= low - bound - slack;
        let near_b = |v: &Vector3<f64>| axis.dot(v) <= high + bound + slack;
        self.a.find(pair.a.vertices(), pair.a.edges(), near_a);
        self.b.find(vertices, pair.b.edges(), near_b);
    }

    /// Number of pairs of candidate edges.
    pub fn pairs(&self) -> usize {
        self.a.edges.len() * self.b.edges.len()
    }

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
    fn find(
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
