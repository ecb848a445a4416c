//! The laws of groups of rows.

use super::ProblemError;
use super::error::all_in_range;
use crate::joint::Graph;

/// The law of a group of rows.
#[derive(Debug, Clone, PartialEq)]
pub enum Law {
    /// Hard contact and Coulomb's cone with maximum dissipation: the first row is the normal, the others
    /// are tangents.
    Contact {
        /// μ.
        friction: f64,
        /// One or two.
        tangents: usize,
    },
    /// Up to three rows, each by itself.
    Rows(Vec<RowLaw>),
}

/// The law of a row by itself, as joints have them.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum RowLaw {
    /// No impulse.
    Free,
    /// No velocity, by any impulse.
    Locked,
    /// 0 ≤ u ⊥ p ≥ 0: a stop.
    Limit,
    /// No velocity, as far as an impulse between two bounds holds it: dry friction, or a motor that
    /// holds. Where the row moves, the impulse is `most` against u < 0 and `least` against u > 0.
    Box {
        /// N s.
        least: f64,
        /// N s.
        most: f64,
    },
}

impl Law {
    /// A contact with `dimension` rows, the normal first, and the coefficient `friction`.
    ///
    /// # Errors
    /// A dimension that is not 2 or 3; a coefficient that is negative or not finite.
    pub fn contact(dimension: usize, friction: f64) -> Result<Self, ProblemError> {
        if !(2..=3).contains(&dimension) {
            let (what, value) = ("the dimension of a contact", dimension as f64);
            return Err(ProblemError::OutOfRange { what, value, allowed: "2 or 3" });
        }
        if !(friction >= 0.0 && friction.is_finite()) {
            let (what, allowed) = ("a coefficient of friction", "0 or more, and finite");
            return Err(ProblemError::OutOfRange { what, value: friction, allowed });
        }
        Ok(Self::Contact { friction, tangents: dimension - 1 })
    }

    /// Contacts with `dimension` rows each, one for every coefficient.
    ///
    /// # Errors
    /// Those of [`contact`](Self::contact).
    pub fn contacts(dimension: usize, friction: &[f64]) -> Result<Vec<Self>, ProblemError> {
        friction.iter().map(|friction| Self::contact(dimension, *friction)).collect()
    }

    /// One to three rows, each by itself.
    ///
    /// # Errors
    /// None, or more than three; bounds that are no numbers, in the wrong order, or larger than 1e100.
    pub fn rows_of(rows: Vec<RowLaw>) -> Result<Self, ProblemError> {
        if !(1..=3).contains(&rows.len()) {
            let (what, value) = ("the number of rows of a group", rows.len() as f64);
            return Err(ProblemError::OutOfRange { what, value, allowed: "1 to 3" });
        }
        for row in &rows {
            let RowLaw::Box { least, most } = *row else { continue };
            all_in_range("a bound of a box", &[least, most])?;
            if least > most {
                let (what, allowed) = ("the least impulse of a box", "at most the greatest");
                return Err(ProblemError::OutOfRange { what, value: least, allowed });
            }
        }
        Ok(Self::Rows(rows))
    }

    /// How many rows it has.
    #[must_use]
    pub fn rows(&self) -> usize {
        match self {
            Self::Contact { tangents, .. } => 1 + tangents,
            Self::Rows(rows) => rows.len(),
        }
    }
}

impl RowLaw {
    /// Its graph, impulse against speed, the impulse in parts of `unit`.
    pub(crate) fn graph(&self, unit: f64) -> Graph {
        match *self {
            Self::Free => Graph::free(),
            Self::Locked => Graph::locked(),
            Self::Limit => Graph::limit(),
            Self::Box { least, most } => Graph::between(least / unit, most / unit),
        }
    }
}
