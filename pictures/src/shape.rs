//! What a body looks like, from its points.

use nalgebra::Vector3;

/// How a body is drawn.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Shape {
    /// Eight corners of a box, x fastest: faces and edges.
    Box,
    /// Anything else: the outline of the points, and the points.
    Points,
}

impl Shape {
    /// What `points` are the corners of.
    pub fn of(points: &[Vector3<f64>]) -> Self {
        let &[origin, x, y, _, z, ..] = points else { return Self::Points };
        let edges = [x - origin, y - origin, z - origin];
        let size = edges.iter().map(|edge| edge.amax()).fold(0.0, f64::max);
        let volume = edges[0].cross(&edges[1]).dot(&edges[2]).abs();
        let fits = points.iter().enumerate().all(|(i, point)| {
            let steps = (0..3).map(|k| edges[k] * (i >> k & 1) as f64).sum::<Vector3<f64>>();
            (origin + steps - point).amax() <= 1e-6 * size
        });
        if points.len() == 8 && fits && volume > 0.0 { Self::Box } else { Self::Points }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn corners(edges: [Vector3<f64>; 3]) -> Vec<Vector3<f64>> {
        (0..8).map(|i| (0..3).map(|k| edges[k] * f64::from(i >> k & 1)).sum()).collect()
    }

    #[test]
    fn boxes_are_told_from_other_bodies() {
        let edges = [Vector3::x(), Vector3::y() * 2.0, Vector3::z() * 0.1];
        let mut points = corners(edges);
        assert_eq!(Shape::of(&points), Shape::Box);
        points[3][2] += 0.01;
        assert_eq!(Shape::of(&points), Shape::Points);
        assert_eq!(Shape::of(&points[..4]), Shape::Points);
        assert_eq!(Shape::of(&corners([edges[0]; 3])), Shape::Points);
    }
}
