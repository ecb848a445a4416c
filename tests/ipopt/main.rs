//! Tests of Ipopt's programs: derivatives, the ladder of starts, the tutorial's steps, and
//! comparison with the native solver.

mod agreement;
#[path = "../common/casadi.rs"]
mod casadi;
#[path = "../common/mod.rs"]
mod common;
mod derivatives;
mod ladder;
mod native_point;
#[path = "../common/points.rs"]
mod points;
mod sensitivity;
mod several;
mod several_derivatives;
#[path = "../common/sizes.rs"]
mod sizes;
#[path = "../common/slopes.rs"]
mod slopes;
#[path = "../common/terms.rs"]
mod terms;
#[path = "../common/toss.rs"]
mod toss;
mod tutorial_steps;
