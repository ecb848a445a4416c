//! Frame of a joint in a body or in the world.

use crate::error::{Error, all_in_range, in_range};
use crate::mechanics::quaternion::product;
use crate::mechanics::{Pose, State};
use nalgebra::{Matrix3, Vector3, Vector4};

/// Frame of a joint in a body or in the world.
#[derive(Debug, Clone, Copy, PartialEq)]
#[cfg_attr(feature = "save", derive(serde::Serialize, serde::Deserialize))]
pub struct JointFrame {
    /// Anchor (m), body frame.
    pub anchor: Vector3<f64>,
    /// Rotation joint → body, a unit quaternion (w, x, y, z). Hinges and slides use its z axis.
    pub attitude: Vector4<f64>,
}

impl JointFrame {
    /// Frame at `anchor` (m), aligned with the body frame.
    pub fn at(anchor: Vector3<f64>) -> Self {
        Self { anchor, attitude: Vector4::new(1.0, 0.0, 0.0, 0.0) }
    }

    /// Frame at `anchor` (m) with its z axis along `axis` (body frame, any nonzero length).
    ///
    /// # Errors
    /// [`Error::OutOfRange`] if the axis has no length or is not finite.
    pub fn along(anchor: Vector3<f64>, axis: Vector3<f64>) -> Result<Self, Error> {
        let allowed = "-1e9 to 1e9";
        all_in_range("component of a joint's axis", &axis, -1e9, 1e9, allowed)?;
        let length = axis.norm();
        in_range("length of a joint's axis", length, 1e-9, 1e9, "1e-9 to 1e9")?;
        // Smallest rotation from z: (1 + z·u, z × u), or a half turn about x.
        let unit = axis / length;
        let turn = Vector4::new(1.0 + unit[2], -unit[1], unit[0], 0.0);
        let attitude =
            if turn.norm() > 1e-6 { turn.normalize() } else { Vector4::new(0.0, 1.0, 0.0, 0.0) };
        Ok(Self { anchor, attitude })
    }

    /// Frame in the world of this frame on a body at `state`.
    pub(crate) fn placed(&self, state: &State) -> Self {
        let Pose { position, rotation } = state.pose();
        let attitude = product(&state.attitude, &self.attitude);
        Self { anchor: position + rotation * self.anchor, attitude }
    }

    /// Rotation matrix F, joint → body.
    pub fn rotation(&self) -> Matrix3<f64> {
        crate::mechanics::quaternion::rotation(&self.attitude)
    }

    pub(crate) fn checked(self) -> Result<Self, Error> {
        for &length in &self.anchor {
            in_range("anchor of a joint (m)", length, -1e6, 1e6, "-1e6 to 1e6")?;
        }
        let norm = self.attitude.norm();
        in_range("norm of a joint's attitude", norm, 0.99, 1.01, "1, within 0.01")?;
        // A unit quaternion to rounding keeps its bits, so that saving and reading a joint
        // reproduces it.
        let is_unit = (norm - 1.0).abs() <= 4.0 * f64::EPSILON;
        let attitude = if is_unit { self.attitude } else { self.attitude / norm };
        Ok(Self { attitude, ..self })
    }
}
