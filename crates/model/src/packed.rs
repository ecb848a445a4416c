//! Many numbers as one text: little-endian bytes, compressed by deflate, in Base64.

use base64::Engine;
use base64::engine::general_purpose::STANDARD;
use flate2::Compression;
use flate2::read::ZlibDecoder;
use flate2::write::ZlibEncoder;
use std::io::{Read, Write};

/// Largest number of bytes of a list: 30 million numbers of 8 bytes.
const MOST_BYTES: u64 = 240_000_000;

/// Packs bytes.
fn packed(bytes: &[u8]) -> Result<String, String> {
    let mut encoder = ZlibEncoder::new(Vec::new(), Compression::default());
    let written = encoder.write_all(bytes).and_then(|()| encoder.finish());
    written.map(|bytes| STANDARD.encode(bytes)).map_err(|error| error.to_string())
}

fn unpacked(text: &str) -> Result<Vec<u8>, String> {
    let bytes = STANDARD.decode(text).map_err(|error| format!("it is not Base64: {error}"))?;
    let mut numbers = Vec::new();
    let mut decoder = ZlibDecoder::new(&bytes[..]).take(MOST_BYTES + 1);
    decoder.read_to_end(&mut numbers).map_err(|error| format!("it is damaged: {error}"))?;
    if numbers.len() as u64 > MOST_BYTES {
        return Err(format!("it has more than {MOST_BYTES} bytes"));
    }
    Ok(numbers)
}

/// Little-endian numbers of `N` bytes of a text.
fn unpack<T, const N: usize>(text: &str, number: fn([u8; N]) -> T) -> Result<Vec<T>, String> {
    let bytes = unpacked(text)?;
    let (numbers, rest) = bytes.as_chunks::<N>();
    if !rest.is_empty() {
        return Err(format!("it does not have whole numbers of {N} bytes"));
    }
    Ok(numbers.iter().copied().map(number).collect())
}

/// Text of numbers.
///
/// # Errors
/// Too many numbers for the memory.
pub fn pack_floats(numbers: impl Iterator<Item = f64>) -> Result<String, String> {
    packed(&numbers.flat_map(f64::to_le_bytes).collect::<Vec<_>>())
}

/// Numbers of a text.
///
/// # Errors
/// Another text.
pub fn unpack_floats(text: &str) -> Result<Vec<f64>, String> {
    unpack(text, f64::from_le_bytes)
}

/// Text of indices.
///
/// # Errors
/// Too many numbers for the memory.
pub fn pack_indices(numbers: impl Iterator<Item = u32>) -> Result<String, String> {
    packed(&numbers.flat_map(u32::to_le_bytes).collect::<Vec<_>>())
}

/// Indices of a text.
///
/// # Errors
/// Another text.
pub fn unpack_indices(text: &str) -> Result<Vec<u32>, String> {
    unpack(text, u32::from_le_bytes)
}
