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
mod tests {
    use super::*;

    /// The simulator's mean of a held wrench has the bits of the search.
    #[test]
    fn mean_of_piecewise_load_has_the_bits_of_the_search() {
        let h = 0.013;
        let values: Vec<_> = (0..50)
            .map(|k| {
                let x = f64::from(k / 3 % 7) * 0.37 - 1.0;
                Vector3::new(x, -0.1 * x * x, if k % 5 == 0 { 0.0 } else { 1e7 / 3.0 })
            })
            .collect();
        for index in [0, 17, 100_003] {
            let line = through(&values, index, h).unwrap();
            for (k, value) in values.iter().enumerate() {
                let k = index + k as u64;
                let (from, to) = (k as f64 * h, (k + 1) as f64 * h);
                assert_eq!(line.mean(from, to), mean(value, from, to));
            }
            let end = index + 50;
            assert_eq!(line.mean(end as f64 * h, (end + 1) as f64 * h), Vector3::zeros());
        }
    }
}
