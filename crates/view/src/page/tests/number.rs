//! Unit tests of `number.rs`.

use super::*;

#[test]
fn numbers_have_only_significant_digits() {
    for (value, text) in [
        (0.0, "0"),
        (1.529_051_987, "1.52905"),
        (-0.001_234_567_8, "-0.00123457"),
        (123_456.7, "123457"),
        (4.2e-13, "4.20e-13"),
        (-7e8, "-7.00e8"),
        (f64::NAN, "—"),
        (f64::INFINITY, "inf"),
    ] {
        assert_eq!(figure(value), text);
    }
}

#[test]
fn powers_of_ten_are_raised() {
    assert_eq!(html("-3.1e-3"), "−3.1·10<sup>−3</sup>");
    assert_eq!(html("1.52905"), "1.52905");
}
