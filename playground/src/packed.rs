//! Bytes as text in a page: deflate, then two characters for 13 bits.
//!
//! Base64 needs four characters for three bytes, 150 kB more for this page.

use flate2::Compression;
use flate2::write::DeflateEncoder;
use std::io::{self, Write as _};

/// Number of digits.
const BASE: u32 = 91;

/// Characters that have no meaning in markup and scripts; `page/loader.js` has the same.
fn alphabet() -> Vec<u8> {
    (b'!'..=b'~').filter(|letter| !b"&<\\".contains(letter)).collect()
}

/// Compressed `bytes` as text.
///
/// # Errors
/// None in memory.
pub fn packed(bytes: &[u8]) -> io::Result<String> {
    let mut encoder = DeflateEncoder::new(Vec::new(), Compression::best());
    encoder.write_all(bytes)?;
    Ok(text(&encoder.finish()?))
}

/// Two digits in base 91 for each 13 bits, the first bit first. The last bits have one digit if they are
/// at most 6.
fn text(bytes: &[u8]) -> String {
    let alphabet = alphabet();
    let byte = |place: usize| u32::from(bytes.get(place).copied().unwrap_or(0));
    let mut text = String::with_capacity(bytes.len() / 13 * 16 + 16);
    for bit in (0..8 * bytes.len()).step_by(13) {
        let place = bit / 8;
        let three = byte(place) << 16 | byte(place + 1) << 8 | byte(place + 2);
        let value = three >> (11 - bit % 8) & 0x1fff;
        let is_short = 8 * bytes.len() - bit <= 6;
        let digits = [value / BASE, value % BASE, value >> 7];
        let digits = if is_short { &digits[2..] } else { &digits[..2] };
        text.extend(digits.iter().map(|&digit| alphabet[digit as usize] as char));
    }
    text
}

#[cfg(test)]
#[path = "tests/packed.rs"]
mod tests;
