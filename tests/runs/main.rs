//! Tests of the simulation loop: runs, batches, gradients, saved states.

mod accuracy;
#[path = "../common/mod.rs"]
mod common;
mod gradients;
mod half_kicks;
mod leapfrog;
mod rollout;
mod save;
mod simulation;
mod threads;
#[path = "../common/toss.rs"]
mod toss;
mod turns;
