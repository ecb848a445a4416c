//! Frames: position and attitude, and their composition.

use nalgebra::{Matrix3, Vector3, Vector4};
pub use tumble_core::mechanics::quaternion::conjugated;
use tumble_core::mechanics::quaternion::{product, rotation};

/// Pose of a frame in an outer frame.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct LinkFrame {
    /// Origin (m), in the outer frame.
    pub position: Vector3<f64>,
    /// Unit quaternion (w, x, y, z) from this frame to the outer one.
    pub attitude: Vector4<f64>,
}

impl LinkFrame {
    /// Identity transform.
    pub fn identity() -> Self {
        Self { position: Vector3::zeros(), attitude: Vector4::new(1.0, 0.0, 0.0, 0.0) }
    }

    /// Frame at `position` with the axes of the outer frame.
    pub fn at(position: Vector3<f64>) -> Self {
        Self { position, ..Self::identity() }
    }

    /// Composition: pose of `inner`, given in this frame, in the outer frame.
    pub fn then(&self, inner: &Self) -> Self {
        Self {
            position: self.point(&inner.position),
            attitude: product(&self.attitude, &inner.attitude).normalize(),
        }
    }

    /// Pose of this frame in `outer`. Both are given in the same frame.
    pub fn relative_to(&self, outer: &Self) -> Self {
        let position = outer.rotation().tr_mul(&(self.position - outer.position));
        Self { position, attitude: product(&conjugated(&outer.attitude), &self.attitude) }
    }

    /// Transforms a point of this frame to the outer frame.
    pub fn point(&self, point: &Vector3<f64>) -> Vector3<f64> {
        self.position + self.rotation() * point
    }

    /// Rotation matrix from this frame to the outer one.
    pub fn rotation(&self) -> Matrix3<f64> {
        rotation(&self.attitude)
    }
}

/// Quaternion of the rotation about the unit vector `axis` by `angle` (rad).
pub fn about(axis: &Vector3<f64>, angle: f64) -> Vector4<f64> {
    let (sine, cosine) = libm::sincos(0.5 * angle);
    Vector4::new(cosine, axis[0] * sine, axis[1] * sine, axis[2] * sine)
}

/// Quaternion of the shortest rotation from z to the unit vector `to`.
pub fn from_z(to: &Vector3<f64>) -> Vector4<f64> {
    let turn = Vector4::new(1.0 + to[2], -to[1], to[0], 0.0);
    if turn.norm() > 1e-6 { turn.normalize() } else { Vector4::new(0.0, 1.0, 0.0, 0.0) }
}

/// Quaternion of a rotation matrix.
pub fn attitude_from_matrix(matrix: &Matrix3<f64>) -> Vector4<f64> {
    let rotation = nalgebra::Rotation3::from_matrix_unchecked(*matrix);
    let q = nalgebra::UnitQuaternion::from_rotation_matrix(&rotation);
    Vector4::new(q.w, q.i, q.j, q.k)
}
