//! Hulls whose faces are planar to rounding.
//!
//! Triangles that are nearly in one plane become one face, so its corners may be off its plane. Such a hull
//! is two different pieces: that of its faces and that of its vertices. The corners are moved into the
//! planes. With the faces f of more than three corners, their mean planes n_f·x = d_f, and the heights
//! h_f = n_f·v − d_f of a corner v,
//!
//! ```text
//! (Σ n_f n_fᵀ + λ 1) δv = −Σ h_f n_f,   v ← v + δv
//! ```
//!
//! and the planes are fitted again. A corner of up to three faces is in all of them after a few
//! repetitions. A triangle is planar wherever its corners are.

use super::Hull;
use crate::error::Error;
use nalgebra::{Matrix3, Vector3};

/// Height of a corner over its face at rounding level, as a fraction of the largest coordinate.
const ROUNDING: f64 = 64.0 * f64::EPSILON;
/// λ: keeps the corner of two nearly parallel faces from moving far along both.
const DAMPING: f64 = 1e-4;
/// Largest number of repetitions. Each one leaves a fraction of about λ if no corner has more than three
/// faces.
const REPETITIONS: u32 = 200;
/// Largest number of hulls of moved corners. A moved corner may join or leave faces.
const HULLS: u32 = 4;

/// The hull with its corners moved into the planes of its faces. If the faces cannot be planar, the hull
/// of its vertices with faces that are. `coplanar` is the tolerance of faces relative to the size.
pub(super) fn planar(hull: Hull, coplanar: f64) -> Result<Hull, Error> {
    let mut moved = None;
    for _ in 0..HULLS {
        let now = moved.as_ref().unwrap_or(&hull);
        if is_planar(now) {
            return Ok(moved.unwrap_or(hull));
        }
        let Ok(next) = Hull::joined(&corners_in_planes(now), coplanar) else { break };
        moved = Some(next);
    }
    Hull::joined(hull.vertices(), ROUNDING)
}

fn is_planar(hull: &Hull) -> bool {
    let rounding = ROUNDING * largest(hull.vertices());
    (0..hull.faces().len()).all(|face| {
        let Plane { normal, offset } = mean_plane(hull, hull.vertices(), face);
        hull.polygon(face).all(|corner| (normal.dot(corner) - offset).abs() <= rounding)
    })
}

fn largest(points: &[Vector3<f64>]) -> f64 {
    points.iter().map(Vector3::amax).fold(0.0, f64::max)
}

/// Plane n·x = d.
struct Plane {
    normal: Vector3<f64>,
    offset: f64,
}

/// Plane through the mean of the corners of a face, across its area vector, with the vertices of the hull
/// at `points` (m).
fn mean_plane(hull: &Hull, points: &[Vector3<f64>], face: usize) -> Plane {
    let corners = || hull.face_loop(face).iter().map(|corner| points[corner.vertex as usize]);
    let count = hull.face_loop(face).len();
    let mean = corners().sum::<Vector3<f64>>() / count as f64;
    let sides = corners().zip(corners().cycle().skip(1));
    let area: Vector3<f64> = sides.map(|(from, to)| (from - mean).cross(&(to - mean))).sum();
    let normal = area.normalize();
    Plane { normal, offset: normal.dot(&mean) }
}

/// Vertices of the hull, moved into the planes of its faces (m).
fn corners_in_planes(hull: &Hull) -> Vec<Vector3<f64>> {
    let mut points = hull.vertices().to_vec();
    let rounding = f64::EPSILON * largest(&points);
    let faces = (0..hull.faces().len()).filter(|&face| hull.face_loop(face).len() > 3);
    let faces: Vec<usize> = faces.collect();
    for _ in 0..REPETITIONS {
        let mut sums = vec![(Matrix3::identity() * DAMPING, Vector3::zeros()); points.len()];
        let mut most = 0.0_f64;
        for &face in &faces {
            let Plane { normal, offset } = mean_plane(hull, &points, face);
            for corner in hull.face_loop(face) {
                let vertex = corner.vertex as usize;
                let height = normal.dot(&points[vertex]) - offset;
                sums[vertex].0 += normal * normal.transpose();
                sums[vertex].1 -= normal * height;
                most = most.max(height.abs());
            }
        }
        if most <= rounding {
            break;
        }
        for (point, (matrix, right)) in points.iter_mut().zip(&sums) {
            if let Some(factor) = matrix.cholesky() {
                *point += factor.solve(right);
            }
        }
    }
    points
}
