#![cfg_attr(feature = "guide", doc = include_str!(concat!(env!("OUT_DIR"), "/guide.md")))]
#![cfg_attr(not(feature = "guide"), doc = include_str!("../docs/guide.md"))]
#![deny(unsafe_code)]

pub use tumble_core::{contact, derivative, error, geometry, joint, mechanics, step, world};

#[cfg(feature = "film")]
pub mod film;
pub mod problem;
pub mod solver;
#[cfg(feature = "program")]
pub mod sparsity;
#[cfg(feature = "program")]
pub mod step_nlp;

#[cfg(feature = "plan")]
pub mod plan;
#[cfg(feature = "robot")]
pub mod robot;
#[cfg(feature = "rollout")]
pub mod rollout;
#[cfg(feature = "scenario")]
pub mod scenario;
pub mod simulation;

#[cfg(feature = "ipopt")]
pub mod ipopt;

/// The programs of the document of robots, compiled.
#[cfg(all(doctest, feature = "robot"))]
#[doc = include_str!("../docs/robots.md")]
struct Robots;

/// The README's programs, compiled and run.
#[cfg(doctest)]
#[doc = include_str!("../README.md")]
struct Readme;
