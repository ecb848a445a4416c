//! Parallel simulation of many runs of one world with different starts, wrenches or constants.
//!
//! A [`Batch`] is the input, as plain numbers in the memory order of numpy's arrays. The caller
//! provides the [output buffers](RolloutOutputs). Every rollout is its own
//! [`Simulation`](tumble_core::simulation::Simulation). Its numbers equal those of a loop over
//! simulations to the last bit, on any number of threads. The threads live for one call.
//!
//! ```
//! use std::num::NonZeroUsize;
//! use tumble::rollout::{Batch, RolloutOutputs, RolloutWatch, Varied, roll_out};
//! use tumble::{Constant, Motion, TutorialScene, World, tutorial_parameters};
//!
//! let scene = TutorialScene::drop();
//! let world = World::new(tutorial_parameters()?)?;
//! let start = scene.start(scene.attitude(42)).to_vector();
//! let frictions = [0.1, 0.2, 0.3, 0.4];
//! let batch = Batch {
//!     world: &world,
//!     motion: &|world| Ok(Motion::native(world)),
//!     loads: &[],
//!     courses: &[],
//!     index: 0,
//!     rollouts: 4,
//!     steps: 300,
//!     starts: start.as_slice(), // one for all
//!     controls: &[],
//!     motors: &[],
//!     joint_forces: &[],
//!     parameters: &[Varied { constant: Constant::Friction, values: &frictions }],
//! };
//! let mut ends = [0.0; 4 * 13];
//! let outputs = RolloutOutputs { ends: &mut ends, ..RolloutOutputs::default() };
//! let threads = NonZeroUsize::new(2).unwrap();
//! let report = roll_out(&batch, outputs, threads, RolloutWatch::default())?;
//! assert!(report.unsolved.is_empty() && report.all.largest_residual < 1e-9);
//! assert_ne!(ends[..13], ends[13..26]);
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```
//!
//! | array | shape | unit, frame |
//! |---|---|---|
//! | starts | (B or 1, N, 13) | m, unit quaternion w x y z, m/s (world), rad/s (body) |
//! | controls | (B or 1, T, N, 6) | force, N, world; torque, N m, body |
//! | motors | (B or 1, T, M) | targets: m/s, rad/s, m or rad |
//! | joint_forces | (B or 1, T, D) | N or N m, along the axes |
//! | states | (B, T, N, 13) | same columns as starts: after each step |
//! | ends | (B, N, 13) | same columns as starts: after the last step |
//!
//! The last index varies fastest. B is the number of rollouts, T of steps and N of bodies. D is the
//! number of [driven axes](tumble_core::world::World::driven_axes). M is the number of motors: the
//! [motors](tumble_core::world::World::motors) of joints first, then the
//! [motors of gears](tumble_core::world::World::gear_motors).
//!
//! Besides these arrays of the caller, a call allocates one simulation per thread and its
//! [`RolloutReport`].

mod batch;
mod driven;
#[cfg(feature = "save")]
mod gradient;
mod run;
mod varied;
mod watch;

pub use batch::{Batch, RolloutOutputs};
pub use driven::Driven;
#[cfg(feature = "save")]
pub use gradient::{By, Cotangents, Gradients, Noted, gradients};
pub use run::{RolloutError, RolloutReport, RolloutTally, Unsolved, roll_out};
pub use varied::{Constant, Varied};
pub use watch::RolloutWatch;
