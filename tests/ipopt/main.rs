//! Tests of Ipopt's programs: derivatives, the ladder of starts, the tutorial's steps, and
//! comparison with the native solver.

mod agreement;
#[path = "../common/mod.rs"]
mod common;
mod derivatives;
mod ladder;
mod native_point;
#[path = "../common/points.rs"]
mod points;
mod sensitivity;
#[path = "../common/sizes.rs"]
mod sizes;
#[path = "../common/slopes.rs"]
mod slopes;
mod steps;
#[path = "../common/terms.rs"]
mod terms;
#[path = "../common/toss.rs"]
mod toss;
mod tutorial_steps;
