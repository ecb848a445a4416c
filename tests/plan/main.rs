//! Plans: how they are found, and the program of all steps.

#[path = "../common/casadi.rs"]
mod casadi;
#[path = "../common/mod.rs"]
mod common;
mod plans;
mod program;
#[path = "../common/slopes.rs"]
mod slopes;
