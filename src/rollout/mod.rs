//! Many runs of one world at once: other starts, other pushes, other constants, on all cores.
//!
//! A [`Batch`] says what is to be simulated, as plain numbers in the order of numpy's arrays; the
//! caller gives the [memory](RolloutOutputs) for what comes out. Every rollout is a
//! [`Simulation`](tumble_core::simulation::Simulation) of its own, so that its numbers are those of a
//! loop over simulations, to the last bit, whatever the number of threads. The
//! threads are those of one call, and end with it.
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
//! | states | (B, T, N, 13) | as the starts: after each step |
//! | ends | (B, N, 13) | as the starts: after the last step |
//!
//! Beside these arrays, the caller's, a call takes the memory of one simulation a thread, and of its
//! [`RolloutReport`]: thousands of rollouts of small worlds take no more than some.
//!
//! B rollouts of T steps of N bodies, of which D axes of joints can be [driven](tumble_core::world::World::driven_axes) and M have
//! [motors](tumble_core::world::World::motors), those of [sums](tumble_core::world::World::gear_motors) behind them; the last index fastest.

mod batch;
#[cfg(feature = "save")]
mod gradient;
mod run;
mod varied;
mod watch;

pub use batch::{Batch, RolloutOutputs};
#[cfg(feature = "save")]
pub use gradient::{By, Cotangents, Gradients, Noted, gradients};
pub use run::{RolloutError, RolloutReport, RolloutTally, Unsolved, roll_out};
pub use varied::{Constant, Varied};
pub use watch::RolloutWatch;
