//! Places of objects.

use nalgebra::{Matrix3, Quaternion, Vector3, Vector4};
use serde::{Deserialize, Serialize};
use tumble_core::joint::JointFrame;
use tumble_core::mechanics::quaternion::rotation;

/// Position and attitude of an object in an outer frame.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
pub struct Place {
    /// Position (m).
    pub position: [f64; 3],
    /// Unit quaternion w, x, y, z, own frame → outer frame.
    pub attitude: [f64; 4],
}

impl Place {
    /// Place as the frame of a joint.
    pub fn frame(&self) -> JointFrame {
        JointFrame { anchor: self.position.into(), attitude: self.attitude.into() }
    }

    /// Place of the frame of a joint.
    pub fn from_frame(frame: &JointFrame) -> Self {
        Self { position: frame.anchor.into(), attitude: frame.attitude.into() }
    }

    /// Identity: both frames coincide.
    pub const ORIGIN: Self = Self { position: [0.0; 3], attitude: [1.0, 0.0, 0.0, 0.0] };

    /// This place composed with `outer`: the result is in the frame in which `outer` is given.
    pub fn within(&self, outer: &Self) -> Self {
        let [ours, theirs] = [self, outer].map(Self::quaternion);
        let position =
            Vector3::from(outer.position) + outer.rotation() * Vector3::from(self.position);
        let turned = if ours == Quaternion::identity() { theirs } else { theirs * ours };
        let [x, y, z, w] = *turned.as_vector().as_ref();
        Self { position: position.into(), attitude: [w, x, y, z] }
    }

    /// Rotation matrix, own frame → outer frame.
    pub fn rotation(&self) -> Matrix3<f64> {
        rotation(&Vector4::from(self.attitude))
    }

    fn quaternion(&self) -> Quaternion<f64> {
        let [w, x, y, z] = self.attitude;
        Quaternion::new(w, x, y, z)
    }

    /// Unit quaternion w, x, y, z of the rotation about `axis` by `degrees`.
    pub fn turn(axis: Vector3<f64>, degrees: f64) -> [f64; 4] {
        let axis = nalgebra::Unit::new_normalize(axis);
        let (sine, cosine) = libm::sincos(0.5 * degrees.to_radians());
        [cosine, sine * axis[0], sine * axis[1], sine * axis[2]]
    }
}
