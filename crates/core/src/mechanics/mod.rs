//! Rigid bodies in free motion: mass properties, integrators and external loads.

pub mod body;
pub mod dynamics;
pub mod load;

pub use crate::kinematics::{
    Pose, Rotation, State, StepMap, Trajectory, Wrench, quaternion, rotation, state, stretch,
    trajectory,
};
pub use body::RigidBody;
pub use load::{Load, Polyline};

/// Maximum of two numbers; NaN if either is NaN, so that a NaN cannot pass as a small residual.
#[inline]
pub(crate) fn largest(a: f64, b: f64) -> f64 {
    // A comparison with NaN is false.
    if a >= b || a.is_nan() { a } else { b }
}
