//! Types that most tests use.

// Every test program compiles this file separately and uses only a part of it.
#![allow(unused_imports)]

pub use super::steps::{converged, euler, has_not_failed, is_solved, last_step, simulate, steps};
pub use nalgebra::{DMatrix, Matrix3, Rotation3, UnitQuaternion, Vector3, Vector4};
pub use tumble_core::contact::certificate::{Certifier, Claim};
pub use tumble_core::contact::{Candidates, Contact, Detection, Partner, Plane};
pub use tumble_core::derivative::StateChange;
pub use tumble_core::error::Error;
pub use tumble_core::geometry::Piece;
pub use tumble_core::joint::{Axis, Drive, Gear, GearAxis, Joint, JointAxis, JointFrame, Motor};
pub use tumble_core::mechanics::quaternion::{left, rotation};
pub use tumble_core::mechanics::{Load, Polyline, Pose, RigidBody, Rotation, State, Wrench};
pub use tumble_core::simulation::random::Draws;
pub use tumble_core::simulation::{Motion, Simulation, StepRecord};
pub use tumble_core::solver::native::{NativeSolver, StepChange, StepDerivative};
pub use tumble_core::step::{ContactForce, Step, StepReport, StepSolution, StepSolver, StepStatus};
pub use tumble_core::world::{Coefficient, Constant, Integrator, Parameters, World};
