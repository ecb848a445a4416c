//! Core of tumble: bodies and collision geometry, the contact step as an optimisation problem, the
//! native solver, the certificate that checks its solution, and the time-stepping loop.
//!
//! This is a separate crate so that it compiles independently of the rest. Programs depend on the
//! crate `tumble`. It re-exports these modules under the same paths and adds a guide.

#![deny(unsafe_code)]

pub mod error;

pub mod geometry;
pub mod joint;
pub mod mechanics;

pub mod contact;
pub mod derivative;
pub mod problem;
pub mod world;

pub mod simulation;
pub mod solver;
pub mod step;
