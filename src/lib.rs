//! Rigid bodies in hard frictional contact: every time step one optimisation problem, solved and certified.

#![deny(unsafe_code)]

pub use nalgebra;
pub use tumble_core::contact::{Certificate, Contact, ContactKey, Detection};
pub use tumble_core::error::Error;
pub use tumble_core::geometry::Piece;
pub use tumble_core::joint::{Axis, Gear, Joint, Motor};
pub use tumble_core::mechanics::{Load, RigidBody, Rotation, State, Wrench};
pub use tumble_core::simulation::{Motion, Simulation, StepRecord};
pub use tumble_core::solver::native::NativeSolver;
pub use tumble_core::step::{ContactForce, Step, StepReport, StepSolution, StepSolver, StepStatus};
pub use tumble_core::world::{Fixed, Parameters, Partner, Plane, World};

pub mod problem;
#[cfg(feature = "rollout")]
pub mod rollout;

#[cfg(feature = "ipopt")]
pub mod ipopt;
#[cfg(feature = "ipopt")]
pub mod solver;
#[cfg(feature = "program")]
pub mod sparsity;
#[cfg(feature = "program")]
pub mod step_nlp;

/// The programs of the guide, compiled and run.
#[cfg(doctest)]
#[doc = include_str!("../docs/guide.md")]
struct Guide;

/// The README's programs, compiled and run.
#[cfg(doctest)]
#[doc = include_str!("../README.md")]
struct Readme;
