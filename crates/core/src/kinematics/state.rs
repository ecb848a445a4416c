//! State of a rigid body, and external wrench on it.

use super::quaternion::rotation;
use crate::error::{Error, all_in_range, in_range};
use nalgebra::{Matrix3, SVector, Vector3, Vector4};

/// State X = (r, q, v, ω) of a body: thirteen numbers in this order.
#[derive(Debug, Clone, Copy, PartialEq)]
#[cfg_attr(feature = "save", derive(serde::Serialize, serde::Deserialize))]
pub struct State {
    /// Position r of the centre of mass (m), world frame.
    pub position: Vector3<f64>,
    /// Attitude q = (w, x, y, z), unit quaternion, body → world.
    pub attitude: Vector4<f64>,
    /// Velocity v (m/s), world frame.
    pub velocity: Vector3<f64>,
    /// Spin ω (rad/s), **body** frame.
    pub spin: Vector3<f64>,
}

/// Pose of a body: position and rotation matrix of a [`State`].
#[derive(Debug, Clone, Copy, PartialEq)]
#[cfg_attr(feature = "save", derive(serde::Serialize, serde::Deserialize))]
pub struct Pose {
    /// Position r (m), world frame.
    pub position: Vector3<f64>,
    /// Rotation matrix A(q), body → world.
    pub rotation: Matrix3<f64>,
}

impl Pose {
    /// Place of the body's point `local` (m, body frame) in the world (m).
    pub fn place(&self, local: &Vector3<f64>) -> Vector3<f64> {
        self.position + self.rotation * local
    }
}

/// Force and torque on a body.
#[derive(Debug, Clone, Copy, PartialEq)]
#[cfg_attr(feature = "save", derive(serde::Serialize, serde::Deserialize))]
pub struct Wrench {
    /// Force at the centre of mass (N), world frame.
    pub force: Vector3<f64>,
    /// Torque (N m), **body** frame.
    pub torque: Vector3<f64>,
}

impl State {
    /// State at rest at `position` (m), with the body frame parallel to the world frame.
    pub fn at_rest(position: impl Into<Vector3<f64>>) -> Self {
        Self {
            position: position.into(),
            attitude: Vector4::new(1.0, 0.0, 0.0, 0.0),
            velocity: Vector3::zeros(),
            spin: Vector3::zeros(),
        }
    }

    /// This state with velocities of the instant, from those one interval `before`, between which forces
    /// acted over `kick` times its length (eq. 37a).
    pub(crate) fn extrapolated(&self, before: &Self, kick: f64) -> Self {
        let share = 0.5 / kick;
        Self {
            velocity: self.velocity + share * (self.velocity - before.velocity),
            spin: self.spin + share * (self.spin - before.spin),
            ..*self
        }
    }

    /// Number of coordinates.
    pub const LEN: usize = 13;

    /// State as one vector (r, q, v, ω).
    pub fn to_vector(&self) -> SVector<f64, 13> {
        let mut x = SVector::<f64, 13>::zeros();
        x.fixed_rows_mut::<3>(0).copy_from(&self.position);
        x.fixed_rows_mut::<4>(3).copy_from(&self.attitude);
        x.fixed_rows_mut::<3>(7).copy_from(&self.velocity);
        x.fixed_rows_mut::<3>(10).copy_from(&self.spin);
        x
    }

    /// Creates a state from a vector (r, q, v, ω).
    pub fn from_vector(x: &SVector<f64, 13>) -> Self {
        Self {
            position: x.fixed_rows::<3>(0).into(),
            attitude: x.fixed_rows::<4>(3).into(),
            velocity: x.fixed_rows::<3>(7).into(),
            spin: x.fixed_rows::<3>(10).into(),
        }
    }

    /// Pose of the body.
    pub fn pose(&self) -> Pose {
        Pose { position: self.position, rotation: rotation(&self.attitude) }
    }

    /// Checks this state as an initial state and normalises its attitude, unless that is a unit
    /// quaternion to rounding.
    ///
    /// # Errors
    /// If a coordinate is not finite or beyond 1e6 m, 1e5 m/s or 1e5 rad/s, or if the norm of the
    /// quaternion differs from 1 by more than 1e-5.
    pub fn checked(&self) -> Result<Self, Error> {
        all_in_range("position (m)", &self.position, -1e6, 1e6, "-1e6 to 1e6")?;
        all_in_range("velocity (m/s)", &self.velocity, -1e5, 1e5, "-1e5 to 1e5")?;
        all_in_range("spin (rad/s)", &self.spin, -1e5, 1e5, "-1e5 to 1e5")?;
        self.with_unit_attitude()
    }

    /// Normalises the attitude, unless it is a unit quaternion to rounding. Positions and
    /// velocities are not checked.
    ///
    /// # Errors
    /// If the norm of the quaternion differs from 1 by more than 1e-5.
    pub fn with_unit_attitude(&self) -> Result<Self, Error> {
        let norm = self.attitude.norm();
        let allowed = "1 to within 1e-5";
        in_range("norm of the attitude quaternion", norm, 1.0 - 1e-5, 1.0 + 1e-5, allowed)?;
        // A unit quaternion to rounding keeps its bits: the norm of four squares is accurate to 4ε.
        let is_unit = (norm - 1.0).abs() <= 4.0 * f64::EPSILON;
        let attitude = if is_unit { self.attitude } else { self.attitude / norm };
        Ok(Self { attitude, ..*self })
    }
}

impl Wrench {
    /// Zero wrench.
    pub fn zero() -> Self {
        Self { force: Vector3::zeros(), torque: Vector3::zeros() }
    }

    /// Checks the range of the wrench.
    ///
    /// # Errors
    /// If a component is not finite or beyond 1e9 N or 1e9 N m.
    pub fn validate(&self) -> Result<(), Error> {
        all_in_range("force (N)", &self.force, -1e9, 1e9, "-1e9 to 1e9")?;
        all_in_range("torque (N m)", &self.torque, -1e9, 1e9, "-1e9 to 1e9")?;
        Ok(())
    }

    /// This wrench times a factor.
    pub fn scaled(&self, factor: f64) -> Self {
        Self { force: self.force * factor, torque: self.torque * factor }
    }

    /// Sum of both wrenches.
    pub fn plus(&self, other: &Self) -> Self {
        Self { force: self.force + other.force, torque: self.torque + other.torque }
    }
}
