//! Parameters from recorded motion: which friction, rounding or inertia makes simulated tosses of
//! a body go like recorded ones; which masses, dampings or springs a mechanism that was filmed?
//!
//! ```text
//! bytes ─ recording ─ Toss ─┐
//! World ─ model ── ParameterValues ──┴─ rollout ─ TossScore ─ loss ─ evaluator ─ search ─ neighbourhood
//! ```
//!
//! [`recording`] reads tosses, and runs of several bodies, and refuses what cannot be one. [`protocol`] says where a
//! simulation starts and how it is compared. [`model`] is what is simulated, [`parameter`] names its numbers. [`rollout`] simulates a toss,
//! every step with its certificate, and counts the steps that failed; [`evaluator`] does so with many, on all threads of the
//! caller's rayon pool. [`search`] looks by its [`plan`] for the values of least [`loss`], [`polish`] goes on from there by the
//! [`slopes`] of every toss, [`neighbourhood`] says how well
//! they are known, [`folds`] how they do on tosses that were kept back,
//! [`ensemble`] how far the noise of the starts carries.
//!
//! Motions with impacts are chaotic: which face a cube comes to rest on hangs on the last digits of
//! the start. So the loss is bounded, the search needs no derivative, which only finishes it, and what is said of the
//! result is averaged over a neighbourhood.
//!
//! Everything is deterministic: the same input gives the same bits on any number of threads.

pub mod ensemble;
pub mod error;
pub mod evaluator;
pub mod folds;
pub mod loss;
pub mod model;
pub mod neighbourhood;
pub mod parameter;
pub mod plan;
pub mod polish;
pub mod protocol;
pub mod recording;
pub mod rollout;
pub mod search;
pub mod slopes;

pub use error::FitError;
pub use evaluator::{Evaluator, Query, ScoreMemory};
pub use loss::{Loss, TossScore};
pub use model::{Constant, Model, SOUGHT, sought};
pub use parameter::{Parameter, ParameterValues};
pub use plan::{Plan, Sought};
pub use protocol::Protocol;
pub use recording::Toss;
