//! Wrenches that are constant over each step, as loads over time.

use nalgebra::Vector3;
use tumble_core::error::Error;
use tumble_core::mechanics::load::Polyline;

/// Mean from `from` to `to` (s) of a [polyline](through) that holds `value`: the value with the simulator's rounding.
pub(super) fn mean(value: &Vector3<f64>, from: f64, to: f64) -> Vector3<f64> {
    (Vector3::zeros() + 0.5 * (to - from) * (value + value)) / (to - from)
}

/// Polyline that holds each of `values` for one step of `h` (s), from step `index` on, and is zero after the last.
///
/// # Errors
/// As [`Polyline::new`].
pub(super) fn through(values: &[Vector3<f64>], index: u64, h: f64) -> Result<Polyline, Error> {
    let time = |k: usize| (index + k as u64) as f64 * h;
    let mut knots = Vec::new();
    let mut last = None;
    for (k, value) in values.iter().enumerate() {
        if last == Some(value) {
            continue;
        }
        knots.extend(last.map(|last| (time(k), *last)));
        knots.push((time(k), *value));
        last = Some(value);
    }
    let none = Vector3::zeros();
    if let Some(last) = last.filter(|last| **last != none) {
        knots.extend([(time(values.len()), *last), (time(values.len()), none)]);
    }
    Polyline::new(knots)
}

#[cfg(test)]
#[path = "tests/piecewise_loads.rs"]
mod tests;
