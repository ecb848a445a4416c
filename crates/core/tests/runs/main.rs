//! Tests of the simulation loop: runs, and the derivatives of steps.

#![allow(clippy::disallowed_methods)]

#[path = "../common/mod.rs"]
mod common;
mod gradients;
mod rolling;
mod simulation;
#[path = "../common/toss.rs"]
mod toss;
