//! Recorded tosses: read from bytes, and checked before they are believed.
//!
//! [`read_csv`] takes tables of many tosses, plain or compressed by gzip, [`read_bodies`] the tables of states that runs of
//! several bodies write, [`read_torch`] one toss as `torch.save` writes a tensor. [`Toss::checked`] refuses gaps, numbers that are none,
//! attitudes that are no rotations, and recordings in other units or frames;
//! [`Toss::check_against`] does the last in view of the body that is to have made them.

mod bodies_table;
mod checks;
mod csv_table;
mod pickle;
mod torch;

pub use bodies_table::read_bodies;
pub use csv_table::read_csv;
pub use torch::read_torch;

use crate::mechanics::State;

/// The frames of a second where a recording does not say: those of the published cube tosses.
pub const USUAL_RATE: f64 = 148.0;

/// A recorded motion at equal intervals, of a body that is thrown or of several: world with z upwards, SI units, spin in
/// the body's frame.
#[derive(Debug, Clone, PartialEq)]
pub struct Toss {
    /// What it is called: its number in a table, the name of its file.
    pub name: String,
    /// Frames a second.
    pub rate: f64,
    /// The time of the first frame, s.
    pub begin: f64,
    /// How many bodies it is of: 1 or more.
    pub bodies: usize,
    /// The states, their attitudes of unit length: of each frame those of all bodies.
    pub frames: Vec<State>,
}

impl Toss {
    /// One of a single body, from the time 0 on.
    pub fn new(name: impl Into<String>, rate: f64, frames: Vec<State>) -> Self {
        Self { name: name.into(), rate, begin: 0.0, bodies: 1, frames }
    }

    /// How many frames it has.
    #[must_use]
    pub fn count(&self) -> usize {
        self.frames.len() / self.bodies.max(1)
    }

    /// The states of a frame, one a body; none of one that is not there.
    #[must_use]
    pub fn frame(&self, frame: usize) -> &[State] {
        let first = frame.saturating_mul(self.bodies);
        self.frames.get(first..first + self.bodies).unwrap_or_default()
    }

    /// The states of one body.
    fn of_body(&self, body: usize) -> impl Iterator<Item = &State> + Clone {
        self.frames.iter().skip(body).step_by(self.bodies.max(1))
    }
}
