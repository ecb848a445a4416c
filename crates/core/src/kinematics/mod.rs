//! Attitudes, poses, states and prescribed motions.

pub mod quaternion;
pub mod rotation;
pub mod state;
pub mod trajectory;

pub use rotation::Rotation;
pub use state::{Pose, State, Wrench};
pub use trajectory::Trajectory;
