//! Compact encoding of numbers as text: integer multiples of a step, predicted from previous
//! values.

use base64::Engine as _;
use base64::engine::general_purpose::STANDARD;
use serde::Serialize;

/// Values as integer multiples of `step`, encoded in base64.
///
/// Each value is predicted from those before it. `order` 1 predicts the last value, `order` 2
/// extrapolates the last two linearly. Values before the first are 0. Codes are variable-length
/// integers: groups of seven bits, lowest first, with the high bit set in all but the last. The
/// codes are:
///
/// - 0, followed by n: n + 1 values equal to their prediction
/// - 1: NaN
/// - 2 d + 1 (d > 0): value larger than its prediction by d
/// - −2 d (d < 0): value smaller than its prediction by −d
#[derive(Debug, Serialize)]
pub struct PackedNumbers {
    step: f64,
    count: usize,
    order: u8,
    bytes: String,
}

/// Largest magnitude in steps; larger values become NaN. JavaScript integers are exact up to 2⁵³.
const MOST_STEPS: f64 = (1u64 << 48) as f64;

/// Encodes `values` rounded to multiples of `step`.
pub fn packed(values: impl Iterator<Item = f64>, step: f64) -> PackedNumbers {
    let whole = |value: f64| {
        let steps = (value / step).round();
        (steps.abs() <= MOST_STEPS).then_some(steps as i64)
    };
    packed_whole(&values.map(whole).collect::<Vec<_>>(), step)
}

/// Encodes integers.
pub fn packed_rows(rows: impl Iterator<Item = usize>) -> PackedNumbers {
    packed_whole(&rows.map(|row| i64::try_from(row).ok()).collect::<Vec<_>>(), 1.0)
}

/// Encodes values with sixteen significant bits: the upper three bytes of an `f32`, with sign.
pub fn packed_floats(values: impl Iterator<Item = f64>) -> PackedNumbers {
    /// Largest finite value, which prevents rounding to infinity.
    const LARGEST: u32 = 0x7f7f_ffff >> 8;
    let upper = |value: f64| {
        let single = value as f32;
        let bits = (single.abs().to_bits() + (1 << 7)) >> 8;
        let signed = i64::from(bits.min(LARGEST)) * if single < 0.0 { -1 } else { 1 };
        single.is_finite().then_some(signed)
    };
    packed_whole(&values.map(upper).collect::<Vec<_>>(), 1.0)
}

/// Encodes with the order that is shorter.
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

/// Encodes raw bytes in base64.
pub fn u8s(values: impl Iterator<Item = u8>) -> String {
    STANDARD.encode(values.collect::<Vec<u8>>())
}

#[cfg(test)]
impl PackedNumbers {
    /// Decodes the integers, as the page does.
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

    /// Decodes values encoded as `f32`.
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
#[path = "tests/encode.rs"]
mod tests;
