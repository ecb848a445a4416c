//! Conversion between numbers of the library and numpy arrays.

use crate::errors::refused;
use nalgebra::{SVector, Vector3};
use numpy::ndarray::ArrayD;
use numpy::{Element, PyArrayDyn, PyArrayMethods, PyReadonlyArrayDyn};
use pyo3::prelude::*;
use tumble_core::mechanics::{State, Wrench};

/// Array returned to Python.
pub type Array<'py, T = f64> = Bound<'py, PyArrayDyn<T>>;

/// Array given by Python.
pub type Numbers<'py> = PyReadonlyArrayDyn<'py, f64>;

/// Creates a read-only array of this shape. The array takes over the memory of `numbers`. Later
/// changes of the source do not show in it, so writing is disabled.
pub fn shaped<'py, T: Element>(
    py: Python<'py>,
    numbers: Vec<T>,
    shape: &[usize],
) -> PyResult<Array<'py, T>> {
    let length = numbers.len();
    let array = ArrayD::from_shape_vec(shape, numbers).map_err(|_| {
        refused(format!("{length} numbers do not fill an array of the shape {shape:?}"))
    })?;
    let array = PyArrayDyn::from_owned_array(py, array);
    array.readwrite().make_nonwriteable();
    Ok(array)
}

/// Creates a read-only array of one dimension.
pub fn list<'py, T: Element>(py: Python<'py>, numbers: Vec<T>) -> PyResult<Array<'py, T>> {
    let count = numbers.len();
    shaped(py, numbers, &[count])
}

/// Numbers of an array in C order.
pub fn numbers<'a>(name: &str, array: &'a Numbers<'_>) -> PyResult<&'a [f64]> {
    array.as_slice().map_err(|_| refused(format!("{name}: an array in C order is needed")))
}

/// Numbers of an array in C order that must have `count` of them.
pub fn as_many<'a>(
    name: &str,
    array: &'a Numbers<'_>,
    count: Option<usize>,
) -> PyResult<&'a [f64]> {
    let all = numbers(name, array)?;
    match count == Some(all.len()) {
        true => Ok(all),
        false => Err(refused(format!("{name}: the array has the wrong size, {}", all.len()))),
    }
}

/// Converts states to an array (N, 13).
pub fn states_array<'py>(py: Python<'py>, states: &[State]) -> PyResult<Array<'py>> {
    let mut numbers = Vec::with_capacity(13 * states.len());
    for state in states {
        numbers.extend_from_slice(state.to_vector().as_slice());
    }
    shaped(py, numbers, &[states.len(), 13])
}

/// Converts an array (N, 13) to states.
pub fn to_states(name: &str, array: &Numbers<'_>) -> PyResult<Vec<State>> {
    let rows = numbers(name, array)?.chunks_exact(13);
    Ok(rows.map(|row| State::from_vector(&SVector::<f64, 13>::from_column_slice(row))).collect())
}

/// Converts six numbers per body to wrenches.
pub fn to_wrenches(numbers: &[f64]) -> impl Iterator<Item = Wrench> + '_ {
    let part = |numbers: &[f64]| Vector3::from_column_slice(numbers);
    let each = numbers.chunks_exact(6);
    each.map(move |six| Wrench { force: part(&six[..3]), torque: part(&six[3..]) })
}
