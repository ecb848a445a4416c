//! Tests of bodies in free motion, their rotation and their units.

#[path = "../common/mod.rs"]
mod common;
mod elastic_motion;
mod free_motion;
mod loads;
mod random_draws;
mod rotation;
mod runge_kutta;
mod scaled_copies;
