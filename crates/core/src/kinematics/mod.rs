//! Attitudes, poses, states and prescribed motions.

pub mod quaternion;
pub mod rotation;
pub mod state;
pub mod step_map;
pub mod stretch;
pub mod trajectory;

pub use rotation::Rotation;
pub use state::{Pose, State, Wrench};
pub use step_map::{SpinStretch, StepMap};
pub use trajectory::Trajectory;
