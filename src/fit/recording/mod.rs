//! Recorded tosses: read from bytes, and checked before they are believed.
//!
//! [`read_csv`] takes tables of many tosses, plain or compressed by gzip, [`read_torch`] one toss
//! as `torch.save` writes a tensor. [`Toss::checked`] refuses gaps, numbers that are none,
//! attitudes that are no rotations, and recordings in other units or frames;
//! [`Toss::check_against`] does the last in view of the body that is to have made them.

mod checks;
mod csv_table;
mod pickle;
mod torch;

pub use csv_table::read_csv;
pub use torch::read_torch;

use crate::mechanics::State;

/// The frames of a second where a recording does not say: those of the published cube tosses.
pub const USUAL_RATE: f64 = 148.0;

/// A recorded motion at equal intervals: world with z upwards, SI units, spin in the body's frame.
#[derive(Debug, Clone, PartialEq)]
pub struct Toss {
    /// What it is called: its number in a table, the name of its file.
    pub name: String,
    /// Frames a second.
    pub rate: f64,
    /// The states, their attitudes of unit length.
    pub frames: Vec<State>,
}
