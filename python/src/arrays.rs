//! Conversion between numbers of the library and numpy arrays.

use crate::errors::refused;
use nalgebra::SVector;
use numpy::ndarray::ArrayD;
use numpy::{Element, PyArrayDyn, PyArrayMethods, PyReadonlyArrayDyn};
use pyo3::prelude::*;
use tumble_core::mechanics::State;

/// Array returned to Python.
pub type Array<'py, T = f64> = Bound<'py, PyArrayDyn<T>>;

/// Creates a read-only array of this shape. The array takes over the memory of `numbers`. Later
/// changes of the source do not show in it, so writing is disabled.
pub fn shaped<'py, T: Element>(
    py: Python<'py>,
    numbers: Vec<T>,
    shape: &[usize],
) -> PyResult<Bound<'py, PyArrayDyn<T>>> {
    let length = numbers.len();
    let array = ArrayD::from_shape_vec(shape, numbers).map_err(|_| {
        refused(format!("{length} numbers do not fill an array of the shape {shape:?}"))
    })?;
    let array = PyArrayDyn::from_owned_array(py, array);
    array.readwrite().make_nonwriteable();
    Ok(array)
}

/// Numbers of an array in C order.
pub fn numbers<'a>(name: &str, array: &'a PyReadonlyArrayDyn<'_, f64>) -> PyResult<&'a [f64]> {
    array.as_slice().map_err(|_| refused(format!("{name}: an array in C order is needed")))
}

/// Numbers of an array in C order that must have `count` of them.
pub fn as_many<'a>(
    name: &str,
    array: &'a PyReadonlyArrayDyn<'_, f64>,
    count: Option<usize>,
) -> PyResult<&'a [f64]> {
    let all = numbers(name, array)?;
    match count == Some(all.len()) {
        true => Ok(all),
        false => Err(refused(format!("{name}: the array has the wrong size, {}", all.len()))),
    }
}

/// Converts states to an array (N, 13).
pub fn states_array<'py>(
    py: Python<'py>,
    states: &[State],
) -> PyResult<Bound<'py, PyArrayDyn<f64>>> {
    let mut numbers = Vec::with_capacity(13 * states.len());
    for state in states {
        numbers.extend_from_slice(state.to_vector().as_slice());
    }
    shaped(py, numbers, &[states.len(), 13])
}

/// Converts an array (N, 13) to states.
pub fn to_states(name: &str, array: &PyReadonlyArrayDyn<'_, f64>) -> PyResult<Vec<State>> {
    let rows = numbers(name, array)?.chunks_exact(13);
    Ok(rows.map(|row| State::from_vector(&SVector::<f64, 13>::from_column_slice(row))).collect())
}
