//! What a step of tumble is made of: bodies and what they
//! touch, the contact step as a problem, the native solver of it, the certificate that judges its
//! answer, and the loop of one step after another.
//!
//! It is a crate of its own so that it is optimised as a whole and compiled apart from all that is
//! around it. Programs depend on `tumble`, which has all of this under the same paths, and a guide.

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
