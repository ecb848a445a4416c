//! Path of a body within a step.

use super::quaternion::{left, rotation};
use super::state::{Pose, State};
use nalgebra::{Vector3, Vector4};

/// Largest rotation in a step with a known direction (rad).
pub const LARGEST_TURN: f64 = 1.0;

/// Path of a body from one end of a step to the other. The centre of mass moves on a straight line,
/// and the body rotates at a constant rate about one axis, as with the mean velocities of the step.
/// With s from 0 to 1,
///
/// ```text
/// r(s) = r + s Δr,   A(s) = exp(s [θ]×) A
/// ```
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Trajectory {
    position: Vector3<f64>,
    attitude: Vector4<f64>,
    shift: Vector3<f64>,
    turn: Vector3<f64>,
    angle: f64,
}

impl Trajectory {
    /// Path of a fixed object at the origin.
    pub const STILL: Self = Self {
        position: Vector3::new(0.0, 0.0, 0.0),
        attitude: Vector4::new(1.0, 0.0, 0.0, 0.0),
        shift: Vector3::new(0.0, 0.0, 0.0),
        turn: Vector3::new(0.0, 0.0, 0.0),
        angle: 0.0,
    };

    /// Shortest path between two states of a body, independent of their velocities.
    pub fn between(from: &State, to: &State) -> Self {
        let (position, attitude) = (from.position, from.attitude);
        let shift = to.position - position;
        let mut trajectory = Self { position, attitude, shift, ..Self::STILL };
        if to.attitude == attitude {
            return trajectory;
        }
        // q⁺ = p ⊗ q with p = (cos ½|θ|, sin ½|θ| θ/|θ|).
        let p = left(&to.attitude) * conjugate(&attitude);
        let sign = if p[0] < 0.0 { -1.0 } else { 1.0 };
        let cosine = sign * p[0];
        let half = sign * Vector3::new(p[1], p[2], p[3]);
        let sine = half.norm();
        if sine > 0.0 {
            trajectory.angle = 2.0 * libm::atan2(sine, cosine);
            trajectory.turn = half * (trajectory.angle / sine);
        }
        trajectory
    }

    /// Displacement Δr (m), world frame.
    pub fn shift(&self) -> Vector3<f64> {
        self.shift
    }

    /// Rotation vector θ (rad), world frame.
    pub fn turn(&self) -> Vector3<f64> {
        self.turn
    }

    /// Angle |θ| of at most π (rad).
    pub fn angle(&self) -> f64 {
        self.angle
    }

    /// Pose at the fraction `share` of the path, 0 to 1.
    pub fn at(&self, share: f64) -> Pose {
        let (position, attitude) = self.placed(share);
        Pose { position, rotation: rotation(&attitude) }
    }

    /// Position and attitude quaternion at the fraction `share` of the path, 0 to 1.
    #[inline]
    pub fn placed(&self, share: f64) -> (Vector3<f64>, Vector4<f64>) {
        let position = self.position + share * self.shift;
        if self.angle == 0.0 {
            return (position, self.attitude);
        }
        let (sine, cosine) = libm::sincos(0.5 * share * self.angle);
        let axis = self.turn * (sine / self.angle);
        let part = Vector4::new(cosine, axis[0], axis[1], axis[2]);
        (position, left(&part) * self.attitude)
    }
}

fn conjugate(q: &Vector4<f64>) -> Vector4<f64> {
    Vector4::new(q[0], -q[1], -q[2], -q[3])
}

#[cfg(test)]
#[path = "tests/trajectory.rs"]
mod tests;
