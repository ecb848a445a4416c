//! Extreme vertices of a core along a direction.

use nalgebra::Vector3;

/// Index and height of the highest vertex along a direction; ties take the first.
pub(super) fn highest(vertices: &[Vector3<f64>], axis: &Vector3<f64>) -> (usize, f64) {
    let mut best = (0, f64::NEG_INFINITY);
    for (index, vertex) in vertices.iter().enumerate() {
        let height = axis.dot(vertex);
        if height > best.1 {
            best = (index, height);
        }
    }
    best
}

/// Index and height of the lowest vertex along a direction; ties take the first.
pub(super) fn lowest(vertices: &[Vector3<f64>], axis: &Vector3<f64>) -> (usize, f64) {
    let (index, height) = highest(vertices, &-axis);
    (index, -height)
}
