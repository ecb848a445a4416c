//! Who solves the contact step: [`native`], tumble's own solver. Others are
//! [`StepSolver`](crate::step::StepSolver)s of other crates.

pub mod native;
