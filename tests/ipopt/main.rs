//! Tests of Ipopt's programs: derivatives, the ladder of starts, the tutorial's steps, comparison
//! with the native solver, and refused input.

mod agreement;
#[path = "../common/mod.rs"]
mod common;
mod derivatives;
mod free_motion;
mod ladder;
mod many_points;
mod native_point;
mod points;
mod rotation;
mod scaled_copies;
mod sensitivity;
mod sizes;
mod slopes;
mod steps;
mod take_back;
mod terms;
mod threads;
#[path = "../../crates/core/tests/common/toss.rs"]
mod toss;
mod tutorial_steps;
mod wrong_input;
