//! Laws of groups of rows.

use super::ProblemError;
use super::error::all_in_range;
use crate::joint::Graph;

/// Law of a group of rows.
#[derive(Debug, Clone, PartialEq)]
pub enum Law {
    /// Hard contact with Coulomb's cone and maximum dissipation. The first row is the normal, the
    /// others are tangents.
    Contact {
        /// Coefficient of friction μ.
        friction: f64,
        /// Number of tangents, one or two.
        tangents: usize,
    },
    /// Rolling and torsional resistance of a contact (C7). Its three rows turn about two tangents and
    /// the normal.
    Moment {
        /// Group of the contact, before this one.
        contact: usize,
        /// Limit of the norm of the first two impulses, over the normal impulse of the contact.
        rolling: f64,
        /// Limit of the third impulse, over the same.
        torsional: f64,
    },
    /// Up to three independent rows.
    Rows(Vec<RowLaw>),
}

/// Law of an independent row, as in joints.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum RowLaw {
    /// No impulse.
    Free,
    /// Zero velocity, with any impulse.
    Locked,
    /// Unilateral stop: 0 ≤ u ⊥ p ≥ 0.
    Limit,
    /// Zero velocity, with an impulse between two bounds: dry friction or a velocity motor. A
    /// moving row has the impulse `most` for u < 0 and `least` for u > 0.
    Box {
        /// Lower bound (N s).
        least: f64,
        /// Upper bound (N s).
        most: f64,
    },
}

impl Law {
    /// Contact with `dimension` rows, normal first, and the coefficient of friction `friction`.
    ///
    /// # Errors
    /// If the dimension is not 2 or 3, or if the coefficient is negative or not finite.
    pub fn contact(dimension: usize, friction: f64) -> Result<Self, ProblemError> {
        if !(2..=3).contains(&dimension) {
            let what = "the dimension of a contact";
            let value = dimension as f64;
            return Err(ProblemError::OutOfRange { what, value, allowed: "2 or 3" });
        }
        is_coefficient("a coefficient of friction", friction)?;
        Ok(Self::Contact { friction, tangents: dimension - 1 })
    }

    /// Moment of the earlier group `contact`.
    ///
    /// # Errors
    /// If a limit is negative or not finite.
    pub fn moment(contact: usize, rolling: f64, torsional: f64) -> Result<Self, ProblemError> {
        is_coefficient("a limit of rolling resistance", rolling)?;
        is_coefficient("a limit of torsional resistance", torsional)?;
        Ok(Self::Moment { contact, rolling, torsional })
    }

    /// Contacts with `dimension` rows each, one per coefficient of friction.
    ///
    /// # Errors
    /// Same as [`contact`](Self::contact).
    pub fn contacts(dimension: usize, friction: &[f64]) -> Result<Vec<Self>, ProblemError> {
        friction.iter().map(|friction| Self::contact(dimension, *friction)).collect()
    }

    /// One to three independent rows.
    ///
    /// # Errors
    /// If there are no rows or more than three, or if bounds are NaN, in the wrong order or larger
    /// than 1e100.
    pub fn rows_of(rows: Vec<RowLaw>) -> Result<Self, ProblemError> {
        if !(1..=3).contains(&rows.len()) {
            let what = "the number of rows of a group";
            let value = rows.len() as f64;
            return Err(ProblemError::OutOfRange { what, value, allowed: "1 to 3" });
        }
        for row in &rows {
            let RowLaw::Box { least, most } = *row else { continue };
            all_in_range("a bound of a box", &[least, most])?;
            if least > most {
                let (what, allowed) =
                    ("the least impulse of a box", "at most the greatest impulse");
                return Err(ProblemError::OutOfRange { what, value: least, allowed });
            }
        }
        Ok(Self::Rows(rows))
    }

    /// Number of rows.
    pub fn rows(&self) -> usize {
        match self {
            Self::Contact { tangents, .. } => 1 + tangents,
            Self::Moment { .. } => 3,
            Self::Rows(rows) => rows.len(),
        }
    }

    /// Coefficient of friction of a contact; 0 for other rows.
    pub fn friction(&self) -> f64 {
        match self {
            Self::Contact { friction, .. } => *friction,
            Self::Moment { .. } | Self::Rows(_) => 0.0,
        }
    }

    /// Copy with a coefficient of friction of at most `most`.
    pub(super) fn with_friction_up_to(&self, most: f64) -> Self {
        match self {
            Self::Contact { friction, tangents } => {
                Self::Contact { friction: friction.min(most), tangents: *tangents }
            }
            Self::Moment { .. } | Self::Rows(_) => self.clone(),
        }
    }
}

fn is_coefficient(what: &'static str, value: f64) -> Result<(), ProblemError> {
    let allowed = "0 or more, and finite";
    let is_one = value >= 0.0 && value.is_finite();
    if is_one { Ok(()) } else { Err(ProblemError::OutOfRange { what, value, allowed }) }
}

impl RowLaw {
    /// Force law of the row: impulse, in units of `unit`, against speed.
    pub(crate) fn graph(&self, unit: f64) -> Graph {
        match *self {
            Self::Free => Graph::free(),
            Self::Locked => Graph::locked(),
            Self::Limit => Graph::limit(),
            Self::Box { least, most } => Graph::between(least / unit, most / unit),
        }
    }
}
