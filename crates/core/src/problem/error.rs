//! Why a contact problem was refused.

use super::matrix::LARGEST;

/// Why a contact problem cannot be posed, or was not solved to an end. Each message says what was given
/// and what would be right.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum ProblemError {
    /// A list of the wrong length.
    #[error("{what}: {given} given, {wanted} wanted")]
    Length {
        /// Of what.
        what: &'static str,
        /// How many there are.
        given: usize,
        /// How many there should be.
        wanted: usize,
    },
    /// A matrix of the wrong shape.
    #[error("{what} is {rows} x {columns}; {wanted} x {wanted} is wanted")]
    Shape {
        /// Which.
        what: &'static str,
        /// Its rows.
        rows: usize,
        /// Its columns.
        columns: usize,
        /// How many there should be of both.
        wanted: usize,
    },
    /// An entry that is outside of its matrix.
    #[error("an entry is at ({row}, {column}), outside of its matrix of {rows} x {columns}")]
    Entry {
        /// Its row, from 0.
        row: usize,
        /// Its column, from 0.
        column: usize,
        /// Those of the matrix.
        rows: usize,
        /// Those of the matrix.
        columns: usize,
    },
    /// A number that is not finite.
    #[error("{what} is {value:?}; a finite number is wanted")]
    NotFinite {
        /// Which.
        what: &'static str,
        /// The number.
        value: f64,
    },
    /// A matrix that is not symmetric.
    #[error(
        "{what} is not symmetric at ({row}, {column}) by more than 1 % of its largest entry; a \
         symmetric matrix is wanted"
    )]
    Asymmetric {
        /// Which.
        what: &'static str,
        /// Where it is worst, from 0.
        row: usize,
        /// Where it is worst, from 0.
        column: usize,
    },
    /// A matrix that is not positive semidefinite.
    #[error(
        "{what} is not positive semidefinite in its rows {row} and {column}, so that no bodies have it"
    )]
    Indefinite {
        /// Which.
        what: &'static str,
        /// One row that shows it, from 0.
        row: usize,
        /// The other one.
        column: usize,
    },
    /// A mass matrix that is singular or not positive definite.
    #[error("M is singular or not positive definite in the part of its row {row}")]
    Mass {
        /// A row of that part, from 0.
        row: usize,
    },
    /// A law that cannot be.
    #[error("{what} is {value:?}; allowed is {allowed}")]
    OutOfRange {
        /// Which number.
        what: &'static str,
        /// The number.
        value: f64,
        /// The range.
        allowed: &'static str,
    },
    /// A problem with groups for which a file of others has no words.
    #[error(
        "such a file has contacts of one dimension alone; group {group} is no contact, or one of another \
         dimension"
    )]
    NoWords {
        /// The first such group, from 0.
        group: usize,
    },
    /// A step whose problem is no problem of contacts.
    #[error("the contact problem of the step cannot be posed: {why}")]
    Step {
        /// Why.
        why: &'static str,
    },
    /// It was given up because its interrupt flag was raised.
    #[error("the solve was interrupted")]
    Interrupted,
}

/// Refuses a list of another length.
pub(super) fn length(what: &'static str, given: usize, wanted: usize) -> Result<(), ProblemError> {
    if given == wanted { Ok(()) } else { Err(ProblemError::Length { what, given, wanted }) }
}

/// Refuses the first number that is not finite, or larger than an entry of a matrix may be.
pub(super) fn all_in_range(what: &'static str, numbers: &[f64]) -> Result<(), ProblemError> {
    match numbers.iter().find(|number| number.is_nan() || number.abs() > LARGEST) {
        Some(&value) if value.is_finite() => {
            Err(ProblemError::OutOfRange { what, value, allowed: "up to 1e100 in size" })
        }
        Some(&value) => Err(ProblemError::NotFinite { what, value }),
        None => Ok(()),
    }
}
