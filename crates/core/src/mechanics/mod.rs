//! Rigid bodies in free motion: what a body is, how it moves while nothing touches it, and
//! what pushes it from outside.

pub mod body;
pub mod dynamics;
pub mod load;
pub mod quaternion;
pub mod rotation;
pub mod state;
pub mod way;

pub use body::RigidBody;
pub use load::{Load, Polyline};
pub use rotation::Rotation;
pub use state::{Pose, State, Wrench};
pub use way::Way;

/// The larger of two numbers, NaN if either is: a NaN must not pass for a small residual.
#[inline]
pub(crate) fn largest(a: f64, b: f64) -> f64 {
    // Beside a NaN no comparison holds.
    if a >= b || a.is_nan() { a } else { b }
}
