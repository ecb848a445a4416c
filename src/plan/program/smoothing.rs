//! What makes the rows of a program smooth.

use super::law::Rows;

/// The smoothing of one program of the path.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Smoothing {
    /// δ, of weights times the program's unit of speed.
    pub delta: f64,
    /// ε: the compliance of every contact, a part of the speed that its impulse would give a body of mean mass.
    pub compliance: f64,
}

impl Smoothing {
    /// ε_f = 0.1 √δ, weights: what the friction force's norm is smoothed by.
    fn norm(&self) -> f64 {
        0.1 * self.delta.sqrt()
    }

    /// The rows of all contacts.
    pub(super) fn rows(&self) -> Rows {
        Rows::Smoothed { delta: self.delta, norm: self.norm() }
    }
}
