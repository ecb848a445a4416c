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
