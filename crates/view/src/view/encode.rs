//! Numbers as text that a script reads fast and that is short: whole numbers of a step, and
//! of them only what the numbers before do not tell.

use base64::Engine as _;
use base64::engine::general_purpose::STANDARD;
use serde::Serialize;

/// Values in whole numbers of `step`, as base64 of bytes.
///
/// A value is predicted from those before, by `order` 1 as the last one, by `order` 2 on the
/// line through the last two; what was before the first is 0. The bytes are groups of seven
/// bits, the lowest first, the last group of a number without its high bit. Of them 0 and a
/// further number n are n + 1 values as predicted, 1 is no number, and 2 d + 1 (d > 0) or
/// −2 d (d < 0) a value that is d more than predicted.
#[derive(Debug, Serialize)]
pub struct PackedNumbers {
    step: f64,
    count: usize,
    order: u8,
    bytes: String,
}

/// Beyond so many steps a number is none: JavaScript has whole numbers up to 2⁵³.
const MOST_STEPS: f64 = (1u64 << 48) as f64;

/// Each of `values` to the nearest multiple of `step`.
pub fn packed(values: impl Iterator<Item = f64>, step: f64) -> PackedNumbers {
    let whole = |value: f64| {
        let steps = (value / step).round();
        (steps.abs() <= MOST_STEPS).then_some(steps as i64)
    };
    packed_whole(&values.map(whole).collect::<Vec<_>>(), step)
}

/// Whole numbers.
pub fn packed_rows(rows: impl Iterator<Item = usize>) -> PackedNumbers {
    packed_whole(&rows.map(|row| i64::try_from(row).ok()).collect::<Vec<_>>(), 1.0)
}

/// Values to sixteen significant bits: the upper three bytes of an `f32`, negative where it
/// is.
pub fn packed_floats(values: impl Iterator<Item = f64>) -> PackedNumbers {
    /// Of the largest `f32`, so that nothing is rounded to infinity.
    const LARGEST: u32 = 0x7f7f_ffff >> 8;
    let upper = |value: f64| {
        let single = value as f32;
        let bits = (single.abs().to_bits() + (1 << 7)) >> 8;
        let signed = i64::from(bits.min(LARGEST)) * if single < 0.0 { -1 } else { 1 };
        single.is_finite().then_some(signed)
    };
    packed_whole(&values.map(upper).collect::<Vec<_>>(), 1.0)
}

/// By whichever order is shorter.
fn packed_whole(values: &[Option<i64>], step: f64) -> PackedNumbers {
    let (once, twice) = (bytes(values, 1), bytes(values, 2));
    let (order, bytes) = if twice.len() < once.len() { (2, twice) } else { (1, once) };
    PackedNumbers { step, count: values.len(), order, bytes: STANDARD.encode(bytes) }
}

fn bytes(values: &[Option<i64>], order: u8) -> Vec<u8> {
    let mut bytes = Vec::new();
    let (mut last, mut before) = (0, 0);
    let mut as_predicted = 0;
    for value in values {
        let predicted = if order == 2 { 2 * last - before } else { last };
        let code = match value {
            Some(value) if *value == predicted => 0,
            Some(value) if *value > predicted => 2 * value.abs_diff(predicted) + 1,
            Some(value) => 2 * value.abs_diff(predicted),
            None => 1,
        };
        if let Some(value) = *value {
            (last, before) = (value, last);
        }
        if code == 0 {
            as_predicted += 1;
            continue;
        }
        put_run(&mut bytes, &mut as_predicted);
        put(&mut bytes, code);
    }
    put_run(&mut bytes, &mut as_predicted);
    bytes
}

fn put_run(bytes: &mut Vec<u8>, length: &mut u64) {
    if *length > 0 {
        put(bytes, 0);
        put(bytes, *length - 1);
        *length = 0;
    }
}

fn put(bytes: &mut Vec<u8>, mut code: u64) {
    while code > 0x7f {
        bytes.push(code as u8 | 0x80);
        code >>= 7;
    }
    bytes.push(code as u8);
}

/// Bytes as they are, in base64.
pub fn u8s(values: impl Iterator<Item = u8>) -> String {
    STANDARD.encode(values.collect::<Vec<u8>>())
}

#[cfg(test)]
impl PackedNumbers {
    /// The whole numbers, as the page reads them.
    pub fn unpacked(&self) -> Vec<Option<i64>> {
        let bytes = STANDARD.decode(&self.bytes).unwrap();
        let mut bytes = bytes.into_iter();
        let mut next = || {
            let (mut code, mut shift) = (0u64, 0);
            loop {
                let byte = bytes.next().unwrap();
                code |= u64::from(byte & 0x7f) << shift;
                shift += 7;
                if byte < 0x80 {
                    return code;
                }
            }
        };
        let (mut values, mut last, mut before) = (Vec::new(), 0, 0);
        while values.len() < self.count {
            let code = next();
            let times = if code == 0 { next() + 1 } else { 1 };
            for _ in 0..times {
                if code == 1 {
                    values.push(None);
                    continue;
                }
                let more = if code % 2 == 1 { code as i64 / 2 } else { -(code as i64 / 2) };
                let predicted = if self.order == 2 { 2 * last - before } else { last };
                (last, before) = (predicted + more, last);
                values.push(Some(last));
            }
        }
        values
    }

    /// The values, where they are `f32`s.
    pub fn floats(&self) -> Vec<f32> {
        let float = |value: Option<i64>| {
            let Some(value) = value else { return f32::NAN };
            let size = f32::from_bits((value.unsigned_abs() as u32) << 8);
            if value < 0 { -size } else { size }
        };
        self.unpacked().into_iter().map(float).collect()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn values_come_back_to_half_a_step() {
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
        // A fall bends evenly: about a byte a value, in base64 four thirds of it.
        assert_eq!(packed.order, 2);
        assert!(packed.bytes.len() < 504 * 3 / 2, "{}", packed.bytes.len());
    }

    #[test]
    fn what_rests_takes_no_room() {
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
    fn the_bytes_are_as_documented() {
        // 3 steps more than 0; as predicted twice; 1 less; none; 100 more.
        let values = [0.3, 0.3, 0.3, 0.2, f64::INFINITY, 10.2];
        let packed = packed(values.into_iter(), 0.1);
        assert_eq!(packed.order, 1);
        assert_eq!(STANDARD.decode(packed.bytes).unwrap(), [7, 0, 1, 2, 1, 0xc9, 1]);
    }
}
