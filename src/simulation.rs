//! The simulation loop: one step after another, each with its report and certificate.
//!
//! A step is free flight, [detection](crate::contact::detection) of the contacts, a
//! [solver](crate::solver) for their forces, and the
//! [certificate](crate::contact::certificate) that judges the answer. Around it: starts
//! ([`scene`], [`random`]), what is kept of a step ([`record`]), of a run ([`summary`]) and in
//! files (`trajectory` of one body, `tables` of any number, with the feature `csv`).

#[cfg(feature = "csv")]
mod points;
#[cfg(feature = "csv")]
mod rows;
#[cfg(feature = "csv")]
mod sheet;
#[cfg(feature = "csv")]
pub mod tables;
#[cfg(feature = "csv")]
pub mod trajectory;

#[cfg(feature = "csv")]
pub use sheet::{MOST_ROW_BYTES, RowsError};
#[cfg(feature = "save")]
pub use tumble_core::simulation::{Checkpoints, Run, RunGradient, Saved, gradient, save};
pub use tumble_core::simulation::{
    EnergyBalance, Finding, JOINT_AT_THE_START, Lock, Motion, Simulation, Squeeze, StepRecord,
    Stiffness, bounce, energy, random, record, scene, summary, wild,
};
