//! Core of tumble, a simulator of rigid bodies in hard frictional contact.
//!
//! The core has bodies and collision geometry, joints, contact detection, the native solver of the
//! contact step, and the time-stepping loop. It also has the certificate, an independent check of
//! every step. The loop is [`Simulation::step`](simulation::Simulation::step), a good place to
//! start reading.
//!
//! Programs depend on the crate `tumble`, which re-exports the types of a program at its root and
//! adds a guide. The core is a separate crate so that it compiles independently of the rest.

#![deny(unsafe_code)]
#![cfg_attr(test, allow(clippy::disallowed_methods))]

pub mod error;

pub mod geometry;
pub mod joint;
pub mod kinematics;
pub mod mechanics;

pub mod contact;
pub mod derivative;
pub mod problem;
pub mod query;
pub mod world;

pub mod simulation;
pub mod solver;
pub mod step;

mod partner;
mod sets;
mod sparse;
