//! Contact problems with closed-form solutions: docs/validation.md.
//!
//! A [`TestProblem`] simulates one or more runs with the solver of a [`Runner`] and compares the
//! results with two values. The *exact* value solves the continuous problem with Newton's and
//! Coulomb's laws by hand. The *discrete* value solves the time-stepping scheme of
//! `docs/formulation.md` for the same motion. It is a sum in closed form or a recurrence in one
//! unknown. Both formulas stand above the code that computes them.
//!
//! A [`TestQuantity`] holds if the measured value equals the discrete one to within its tolerance.
//! The tolerance covers rounding and the residuals of the steps (`tolerance.rs`). The order of
//! convergence of the discrete value to the exact one is declared ([`Convergence`]) and checked
//! ([`TestQuantity::converges`]).

#![allow(clippy::disallowed_methods)]

#[path = "../common/campaign.rs"]
mod campaign;
mod edge;
mod inputs;
mod native;
mod planar;
mod planted;
mod prelude;
mod problem;
mod problems;
mod quantity;
mod residual;
mod runner;
mod threshold;
mod tolerance;
#[path = "../common/turning.rs"]
mod turning;

use inputs::{Input, TestInputs};
use problem::{Refusal, SolvedBy, TestProblem, find};
use quantity::{Convergence, TestQuantity};
