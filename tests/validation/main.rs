//! The contact problems of `crates/core/tests/validation`, solved by Ipopt.

// Only the problems and their runner are used, not what the native solver's tests need.
#![allow(dead_code)]

mod ipopt;

#[path = "../../crates/core/tests/validation/edge.rs"]
mod edge;
#[path = "../../crates/core/tests/validation/inputs.rs"]
mod inputs;
#[path = "../../crates/core/tests/validation/planar.rs"]
mod planar;
#[path = "../../crates/core/tests/validation/prelude.rs"]
mod prelude;
#[path = "../../crates/core/tests/validation/problem.rs"]
mod problem;
#[path = "../../crates/core/tests/validation/problems/mod.rs"]
mod problems;
#[path = "../../crates/core/tests/validation/quantity.rs"]
mod quantity;
#[path = "../../crates/core/tests/validation/residual.rs"]
mod residual;
#[path = "../../crates/core/tests/validation/runner.rs"]
mod runner;
#[path = "../../crates/core/tests/validation/threshold.rs"]
mod threshold;
#[path = "../../crates/core/tests/validation/tolerance.rs"]
mod tolerance;
#[path = "../../crates/core/tests/common/turning.rs"]
mod turning;

use inputs::{Input, TestInputs};
use problem::{Refusal, SolvedBy, TestProblem, find};
use quantity::{Convergence, TestQuantity};
