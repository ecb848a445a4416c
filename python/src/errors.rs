//! Errors of the library as Python exceptions.

use pyo3::PyErr;
use pyo3::create_exception;
use pyo3::exceptions::{PyKeyboardInterrupt, PyValueError};
use pyo3::pyfunction;
use std::fmt::Display;
use tumble_core::error::Error;
use tumble_model::nearest;

create_exception!(
    tumble,
    TumbleError,
    PyValueError,
    "Invalid input. The message is one sentence with the fault and the remedy."
);

/// Creates an exception with this message.
pub fn refused(why: impl Display) -> PyErr {
    TumbleError::new_err(why.to_string())
}

/// Converts an error of a step or a batch. An interruption becomes KeyboardInterrupt.
pub fn step_error(error: &Error) -> PyErr {
    match error {
        Error::Interrupted => PyKeyboardInterrupt::new_err(()),
        other => refused(other),
    }
}

/// End of an error about an unknown name: a question about the nearest of the `known` names, or
/// nothing.
#[pyfunction]
pub fn name_hint(name: &str, known: Vec<String>) -> String {
    nearest::hint(name, known.iter().map(String::as_str))
}
