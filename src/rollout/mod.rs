//! Many runs of one world at once: other starts, other pushes, other constants, on all cores.
//!
//! A [`Batch`] says what is to be simulated, as plain numbers in the order of numpy's arrays; the
//! caller gives the [memory](Outputs) for what comes out. Every rollout is a
//! [`Simulation`](crate::simulation::Simulation) of its own, so that its numbers are those of a
//! loop over simulations, to the last bit, whatever the number of threads. This is the one part of
//! the library that starts threads: those of one call, which end with it.
//!
//! | array | shape | unit, frame |
//! |---|---|---|
//! | starts | (B or 1, N, 13) | m, unit quaternion w x y z, m/s (world), rad/s (body) |
//! | controls | (B or 1, T, N, 6) | force, N, world; torque, N m, body |
//! | states | (B, T, N, 13) | as the starts: after each step |
//!
//! B rollouts of T steps of N bodies, the last index fastest.

mod batch;
mod parameter;
mod run;

pub use batch::{Batch, Outputs};
pub use parameter::{Parameter, Values};
pub use run::{Report, RolloutError, Unsolved, Watch, roll_out};
