//! Unit tests of `piecewise_loads.rs`.

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
