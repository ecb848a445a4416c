//! Who solves the contact step: [`native`], tumble's own solver, and with the feature `ipopt`
//! the tutorial's program by Ipopt. Both are [`StepSolver`](crate::step::StepSolver)s.

#[cfg(feature = "ipopt")]
pub mod ipopt;

pub use tumble_core::solver::native;
