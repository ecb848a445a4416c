#![cfg_attr(feature = "guide", doc = include_str!(concat!(env!("OUT_DIR"), "/guide.md")))]
#![cfg_attr(not(feature = "guide"), doc = include_str!("../docs/guide.md"))]
#![deny(unsafe_code)]

pub mod body;
pub mod certificate;
pub mod detection;
pub mod dynamics;
pub mod error;
pub mod ipopt;
pub mod load;
pub mod model;
pub mod plane;
pub mod quaternion;
pub mod random;
pub mod scene;
pub mod simulation;
pub mod solver;
pub mod sparsity;
pub mod state;
pub mod step_nlp;
pub mod summary;
#[cfg(feature = "csv")]
pub mod trajectory;
pub mod validation;

/// The README's programs, compiled and run.
#[cfg(doctest)]
#[doc = include_str!("../README.md")]
struct Readme;
