//! Unit tests of `encode.rs`.

use super::*;

#[test]
fn encoded_values_decode_to_within_half_a_step() {
    let fall = |i: u32| 2.5 - 9.81 * f64::from(i * i) * 2e-6;
    let values: Vec<f64> = (0..500).map(fall).chain([1e300, -3.0, f64::NAN, 0.0]).collect();
    let packed = packed(values.iter().copied(), 1e-4);
    assert_eq!(packed.count, 504);
    for (value, whole) in values.iter().zip(packed.unpacked()) {
        match whole {
            Some(whole) => assert!((value - whole as f64 * 1e-4).abs() < 0.51e-4, "{value}"),
            None => assert!(value.is_nan() || value.abs() > 1e10, "{value}"),
        }
    }
    // A fall has a constant second difference: about one byte per value, and four thirds of it
    // in base64.
    assert_eq!(packed.order, 2);
    assert!(packed.bytes.len() < 504 * 3 / 2, "{}", packed.bytes.len());
}

#[test]
fn constant_values_take_at_most_12_bytes() {
    let rests = packed([0.1; 10_000].into_iter(), 1e-5);
    assert!(rests.bytes.len() <= 12, "{}", rests.bytes);
    assert!(rests.unpacked().iter().all(|whole| *whole == Some(10_000)));
    assert_eq!(packed_rows([].into_iter()).unpacked(), []);
    let rows = [0, 1, 2, 3, 4, 9, 10, usize::MAX];
    let expected = [0, 1, 2, 3, 4, 9, 10].map(Some).into_iter().chain([None]);
    assert!(packed_rows(rows.into_iter()).unpacked().into_iter().eq(expected));
}

#[test]
fn floats_keep_four_digits() {
    let values = [0.0, -1.5, 1e-30, 123.456, -98.1e6, f64::from(f32::MAX), f64::NAN, 1e99];
    for (value, float) in values.iter().zip(packed_floats(values.into_iter()).floats()) {
        if value.abs() <= f64::from(f32::MAX) {
            assert!((f64::from(float) - value).abs() <= 1.6e-5 * value.abs(), "{value}");
        } else {
            assert!(float.is_nan(), "{value}");
        }
    }
}

#[test]
fn encoding_matches_the_documented_bytes() {
    // Code sequence: 3 steps above 0; as predicted twice; 1 lower; NaN; 100 higher.
    let values = [0.3, 0.3, 0.3, 0.2, f64::INFINITY, 10.2];
    let packed = packed(values.into_iter(), 0.1);
    assert_eq!(packed.order, 1);
    assert_eq!(STANDARD.decode(packed.bytes).unwrap(), [7, 0, 1, 2, 1, 0xc9, 1]);
}
