//! Unit tests of `digits.rs`.

use super::Places;

#[test]
fn numbers_are_rounded_to_the_last_place() {
    let places = Places::new(2e-3);
    assert_eq!(places.0, 1e3);
    for (number, rounded) in [(0.12345, 0.123), (-4e-4, 0.0), (1e300, 1e300), (7.0, 7.0)] {
        assert_eq!(places.rounded(number).to_bits(), f64::to_bits(rounded), "{number}");
    }
    assert!(places.rounded(f64::NAN).is_nan());
}

/// Without an exact power of ten, numbers stay the same.
#[test]
fn a_step_below_the_last_power_rounds_nothing() {
    for step in [1e-30, 0.0, f64::NAN] {
        let places = Places::new(step);
        let numbers = [0.1, 1e-25, 1e300].map(|number| places.rounded(number));
        assert_eq!(numbers, [0.1, 1e-25, 1e300], "{step}");
    }
}
