//! Tests of the simulation loop: scenes of files, batches, gradients, saved states.

mod accuracy;
mod bouncing_islands;
#[path = "../common/mod.rs"]
mod common;
mod elastic_motion;
mod energy;
mod gradients;
mod half_kicks;
mod leapfrog;
mod passive;
mod rollout;
mod save;
mod starts;
mod symmetry;
mod terrain_files;
#[path = "../../crates/core/tests/common/toss.rs"]
mod toss;
mod turns;
