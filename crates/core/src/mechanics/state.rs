//! The state of a rigid body and the wrench on it: what a
//! [`Simulation`](crate::simulation::Simulation) starts from, and what is set on it.

use super::quaternion::{advance, rotation};
use crate::error::{Error, all_in_range, in_range};
use nalgebra::{Matrix3, SVector, Vector3, Vector4};

/// X = (r, q, v, ω): thirteen numbers in this order.
#[derive(Debug, Clone, Copy, PartialEq)]
#[cfg_attr(feature = "save", derive(serde::Serialize, serde::Deserialize))]
pub struct State {
    /// r, m, world: the centre of mass.
    pub position: Vector3<f64>,
    /// q = (w, x, y, z), unit quaternion, body → world.
    pub attitude: Vector4<f64>,
    /// v, m/s, world.
    pub velocity: Vector3<f64>,
    /// ω, rad/s, **body**.
    pub spin: Vector3<f64>,
}

/// Where a body is: position and rotation of a [`State`], ready to place points.
#[derive(Debug, Clone, Copy, PartialEq)]
#[cfg_attr(feature = "save", derive(serde::Serialize, serde::Deserialize))]
pub struct Pose {
    /// r, m, world.
    pub position: Vector3<f64>,
    /// A(q), body → world.
    pub rotation: Matrix3<f64>,
}

/// A force and a torque on a body.
#[derive(Debug, Clone, Copy, PartialEq)]
#[cfg_attr(feature = "save", derive(serde::Serialize, serde::Deserialize))]
pub struct Wrench {
    /// N, world, at the centre of mass.
    pub force: Vector3<f64>,
    /// N m, **body**.
    pub torque: Vector3<f64>,
}

impl State {
    /// The number of coordinates.
    pub const LEN: usize = 13;

    /// X as one vector.
    #[must_use]
    pub fn to_vector(&self) -> SVector<f64, 13> {
        let mut x = SVector::<f64, 13>::zeros();
        x.fixed_rows_mut::<3>(0).copy_from(&self.position);
        x.fixed_rows_mut::<4>(3).copy_from(&self.attitude);
        x.fixed_rows_mut::<3>(7).copy_from(&self.velocity);
        x.fixed_rows_mut::<3>(10).copy_from(&self.spin);
        x
    }

    /// The state of a vector (r, q, v, ω).
    #[must_use]
    pub fn from_vector(x: &SVector<f64, 13>) -> Self {
        Self {
            position: x.fixed_rows::<3>(0).into(),
            attitude: x.fixed_rows::<4>(3).into(),
            velocity: x.fixed_rows::<3>(7).into(),
            spin: x.fixed_rows::<3>(10).into(),
        }
    }

    /// The state after `time_step` (s) if the velocities stay what they are.
    #[must_use]
    pub fn coasted(&self, time_step: f64) -> Self {
        Self {
            position: self.position + self.velocity * time_step,
            attitude: advance(&self.attitude, &self.spin, time_step),
            ..*self
        }
    }

    /// Where the body is.
    #[must_use]
    pub fn pose(&self) -> Pose {
        Pose { position: self.position, rotation: rotation(&self.attitude) }
    }

    /// The state from which a simulation can start: this one, its attitude made a unit
    /// quaternion where it is not one to rounding.
    ///
    /// # Errors
    /// A coordinate that is not finite or beyond 1e6 m, 1e5 m/s, 1e5 rad/s; a
    /// quaternion whose norm differs from 1 by more than 1e-5.
    pub fn checked(&self) -> Result<Self, Error> {
        all_in_range("position (m)", &self.position, -1e6, 1e6, "-1e6 to 1e6")?;
        all_in_range("velocity (m/s)", &self.velocity, -1e5, 1e5, "-1e5 to 1e5")?;
        all_in_range("spin (rad/s)", &self.spin, -1e5, 1e5, "-1e5 to 1e5")?;
        self.with_unit_attitude()
    }

    /// This state, its attitude made a unit quaternion where it is not one to rounding, however far and fast it is.
    ///
    /// # Errors
    /// A quaternion whose norm differs from 1 by more than 1e-5.
    pub fn with_unit_attitude(&self) -> Result<Self, Error> {
        let norm = self.attitude.norm();
        let allowed = "1 to within 1e-5";
        in_range("norm of the attitude quaternion", norm, 1.0 - 1e-5, 1.0 + 1e-5, allowed)?;
        // A unit quaternion to rounding keeps its bits: a norm of four squares is known to 4ε.
        let is_unit = (norm - 1.0).abs() <= 4.0 * f64::EPSILON;
        let attitude = if is_unit { self.attitude } else { self.attitude / norm };
        Ok(Self { attitude, ..*self })
    }
}

impl Wrench {
    /// No force, no torque.
    #[must_use]
    pub fn zero() -> Self {
        Self { force: Vector3::zeros(), torque: Vector3::zeros() }
    }

    /// Checks that a simulation can bear this.
    ///
    /// # Errors
    /// A component that is not finite or beyond 1e9 N, 1e9 N m.
    pub fn validate(&self) -> Result<(), Error> {
        all_in_range("force (N)", &self.force, -1e9, 1e9, "-1e9 to 1e9")?;
        all_in_range("torque (N m)", &self.torque, -1e9, 1e9, "-1e9 to 1e9")?;
        Ok(())
    }

    /// Both wrenches together.
    #[must_use]
    pub fn plus(&self, other: &Self) -> Self {
        Self { force: self.force + other.force, torque: self.torque + other.torque }
    }
}
