//! Errors of the library as Python exceptions.

use pyo3::PyErr;
use pyo3::create_exception;
use pyo3::exceptions::{PyKeyboardInterrupt, PyValueError};
use std::fmt::Display;
use tumble_core::error::Error;

create_exception!(
    tumble,
    TumbleError,
    PyValueError,
    "Input that cannot be simulated, in one sentence: what is wrong, and what would be right."
);

/// Creates an exception with this message.
pub fn refused(why: impl Display) -> PyErr {
    TumbleError::new_err(why.to_string())
}

/// Converts an error of a step or a batch. An interruption becomes KeyboardInterrupt.
pub fn of_step(error: &Error) -> PyErr {
    match error {
        Error::Interrupted => PyKeyboardInterrupt::new_err(()),
        other => refused(other),
    }
}
