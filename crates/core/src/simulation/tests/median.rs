//! Unit tests of `median.rs`.

use super::*;

fn median_of(numbers: &[f64]) -> Option<f64> {
    let mut median = Median::default();
    numbers.iter().for_each(|number| median.add(*number));
    assert!(median.classes.len() + median.recent.len() <= 2 * MOST_CLASSES);
    median.get()
}

fn exact(numbers: &[f64]) -> f64 {
    let mut sorted = numbers.to_vec();
    sorted.sort_by(f64::total_cmp);
    let middle = sorted.len() / 2;
    let even = sorted.len().is_multiple_of(2);
    if even { 0.5 * (sorted[middle - 1] + sorted[middle]) } else { sorted[middle] }
}

/// `count` numbers from 10⁻¹⁸ to 1, with `different` distinct values.
fn spread(count: u64, different: u64) -> Vec<f64> {
    let number = |i: u64| {
        let part = (i % different).wrapping_mul(0x9E37_79B9_7F4A_7C15) >> 11;
        10_f64.powf(-18.0 * part as f64 / (1_u64 << 53) as f64)
    };
    (0..count).map(number).collect()
}

#[test]
fn is_exact_while_few_numbers_are_different() {
    assert_eq!(median_of(&[]), None);
    assert_eq!(median_of(&[3.0]), Some(3.0));
    assert_eq!(median_of(&[3.0, 1.0]), Some(2.0));
    assert_eq!(median_of(&[0.0, 1.0, f64::INFINITY, 0.0]), Some(0.5));
    for (count, different) in [(1000, 1000), (65_536, 65_536), (300_001, 5000), (400_000, 777)] {
        let numbers = spread(count, different);
        assert_eq!(median_of(&numbers), Some(exact(&numbers)), "{count} {different}");
    }
}

#[test]
fn is_within_a_thousandth_in_bounded_memory_where_many_are() {
    let mut numbers = spread(1_000_000, u64::MAX);
    let found = median_of(&numbers).unwrap();
    let wanted = exact(&numbers);
    assert!((found / wanted - 1.0).abs() <= 1e-3, "{found} {wanted}");
    // Most are zero, and some are not numbers.
    numbers.extend(std::iter::repeat_n(0.0, 1_500_000));
    numbers.extend([f64::NAN, f64::INFINITY]);
    assert_eq!(median_of(&numbers), Some(0.0));
}
