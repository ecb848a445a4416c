//! The features of two cores that can be closest to each other.

use super::hull::Edge;
use nalgebra::Vector3;

/// The edge that stands for a core without edges: its point.
const POINT: usize = usize::MAX;

/// The features that can be closest: those that reach into the layer in which the closest
/// points must be.
#[derive(Debug, Clone, Default)]
pub(super) struct Near {
    pub a: CoreFeatures,
    pub b: CoreFeatures,
}

/// Those of one core.
#[derive(Debug, Clone, Default)]
pub(super) struct CoreFeatures {
    pub vertices: Vec<usize>,
    edges: Vec<usize>,
}

impl Near {
    /// All pairs of near edges, in ascending order; see [`POINT`].
    pub fn each_pair(&self, mut visit: impl FnMut(usize, usize)) {
        for &a in &self.a.edges {
            for &b in &self.b.edges {
                visit(a, b);
            }
        }
    }
}

impl CoreFeatures {
    /// The vertices that are near, and the edges with an end that is.
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
