//! Numbers and texts of other programs: numpy, CasADi, exact solutions in `data`, Siconos' format.

mod casadi;
#[path = "../common/mod.rs"]
mod common;
#[path = "../../crates/core/tests/common/contact_problem.rs"]
mod contact_problem;
mod hard_steps;
mod random_draws;
mod reference;
mod siconos;
#[path = "../../crates/core/tests/common/toss.rs"]
mod toss;
