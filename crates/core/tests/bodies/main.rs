//! Tests of bodies: free motion, rotation, loads, and changes of the set of bodies.

#![allow(clippy::disallowed_methods)]

mod changes;
#[path = "../common/mod.rs"]
mod common;
mod loads;
mod rotation;
mod runge_kutta;
