//! Rigid bodies in free motion: mass properties, states, integrators and external loads.

pub mod body;
pub mod dynamics;
pub mod load;
pub mod quaternion;
pub mod rotation;
pub mod state;
pub mod trajectory;

pub use body::RigidBody;
pub use load::{Load, Polyline};
pub use rotation::Rotation;
pub use state::{Pose, State, Wrench};
pub use trajectory::Trajectory;

/// Maximum of two numbers; NaN if either is NaN, so that a NaN cannot pass as a small residual.
#[inline]
pub(crate) fn largest(a: f64, b: f64) -> f64 {
    // A comparison with NaN is false.
    if a >= b || a.is_nan() { a } else { b }
}
