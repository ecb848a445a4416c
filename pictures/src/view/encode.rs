//! Numbers in little-endian bytes, in base64: what JavaScript's typed arrays read.

use base64::Engine as _;
use base64::engine::general_purpose::STANDARD;

fn base64<const N: usize>(values: impl Iterator<Item = [u8; N]>) -> String {
    STANDARD.encode(values.flatten().collect::<Vec<u8>>())
}

/// As a `Float32Array`.
pub fn f32s(values: impl Iterator<Item = f64>) -> String {
    base64(values.map(|value| (value as f32).to_le_bytes()))
}

/// As a `Uint32Array`. Row numbers fit: a page is made of far fewer rows.
pub fn u32s(values: impl Iterator<Item = usize>) -> String {
    base64(values.map(|value| u32::try_from(value).unwrap_or(u32::MAX).to_le_bytes()))
}

/// As a `Uint8Array`.
pub fn u8s(values: impl Iterator<Item = u8>) -> String {
    base64(values.map(|value| [value]))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_bytes_are_little_endian() {
        assert_eq!(u32s([1, 256].into_iter()), "AQAAAAABAAA=");
        assert_eq!(u8s([1, 2, 3].into_iter()), "AQID");
        assert_eq!(f32s([1.0].into_iter()), STANDARD.encode(1f32.to_le_bytes()));
    }
}
