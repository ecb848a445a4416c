//! Solvers of the contact step.
//!
//! [`native`] is tumble's own. Other crates implement [`StepSolver`](crate::step::StepSolver).

pub mod native;
