//! Errors of contact problems.

use super::matrix::LARGEST;

/// Reason for rejecting a contact problem or stopping its solve. Each message names the input and
/// the allowed range.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum ProblemError {
    /// A list of the wrong length.
    #[error("{what}: {given} given; {wanted} are needed")]
    Length {
        /// Name of the list.
        what: &'static str,
        /// Actual length.
        given: usize,
        /// Required length.
        wanted: usize,
    },
    /// A matrix of the wrong shape.
    #[error("{what} is {rows} x {columns}; {wanted} x {wanted} is needed")]
    Shape {
        /// Name of the matrix.
        what: &'static str,
        /// Number of rows.
        rows: usize,
        /// Number of columns.
        columns: usize,
        /// Required number of rows and columns.
        wanted: usize,
    },
    /// An entry outside its matrix.
    #[error("an entry is at ({row}, {column}), outside of its matrix of {rows} x {columns}")]
    Entry {
        /// Row of the entry, from 0.
        row: usize,
        /// Column of the entry, from 0.
        column: usize,
        /// Number of rows of the matrix.
        rows: usize,
        /// Number of columns of the matrix.
        columns: usize,
    },
    /// A number that is not finite.
    #[error("{what} is {value:?}; a finite number is needed")]
    NotFinite {
        /// Name of the number.
        what: &'static str,
        /// Rejected number.
        value: f64,
    },
    /// A matrix that is not symmetric.
    #[error(
        "{what} is not symmetric at ({row}, {column}) by more than 1 % of its largest entry; a \
         symmetric matrix is needed"
    )]
    Asymmetric {
        /// Name of the matrix.
        what: &'static str,
        /// Row of the largest error, from 0.
        row: usize,
        /// Column of the largest error, from 0.
        column: usize,
    },
    /// A matrix that is not positive semidefinite.
    #[error(
        "{what} is not positive semidefinite in rows {row} and {column}; no set of bodies has this \
         matrix"
    )]
    Indefinite {
        /// Name of the matrix.
        what: &'static str,
        /// Index of a row that shows it, from 0.
        row: usize,
        /// Index of the other row, from 0.
        column: usize,
    },
    /// A mass matrix that is singular or not positive definite.
    #[error("M is singular or not positive definite in the block of row {row}")]
    Mass {
        /// Row of the offending block, from 0.
        row: usize,
    },
    /// A number of a law outside its range.
    #[error("{what} is {value:?}; allowed: {allowed}")]
    OutOfRange {
        /// Name of the number.
        what: &'static str,
        /// Rejected number.
        value: f64,
        /// Allowed range.
        allowed: &'static str,
    },
    /// A problem whose groups the file format cannot represent.
    #[error(
        "this file format holds contacts of one dimension only; group {group} is not such a contact"
    )]
    NoWords {
        /// Index of the first such group, from 0.
        group: usize,
    },
    /// A step without an equivalent contact problem.
    #[error("the contact problem of the step cannot be posed: {why}")]
    Step {
        /// Reason.
        why: &'static str,
    },
    /// The solve was interrupted because its flag was raised.
    #[error("the solve was interrupted")]
    Interrupted,
}

/// Rejects a list of another length.
pub(super) fn length(what: &'static str, given: usize, wanted: usize) -> Result<(), ProblemError> {
    if given == wanted { Ok(()) } else { Err(ProblemError::Length { what, given, wanted }) }
}

/// Rejects the first number that is not finite, or is larger than an entry of a matrix may be.
pub(super) fn all_in_range(what: &'static str, numbers: &[f64]) -> Result<(), ProblemError> {
    match numbers.iter().find(|number| number.is_nan() || number.abs() > LARGEST) {
        Some(&value) if value.is_finite() => {
            Err(ProblemError::OutOfRange { what, value, allowed: "magnitudes up to 1e100" })
        }
        Some(&value) => Err(ProblemError::NotFinite { what, value }),
        None => Ok(()),
    }
}
