//! Bytes as text in a page: deflate, then five characters for four bytes.
//!
//! Base64 needs four characters for three bytes, a tenth of a megabyte more for this page.

use flate2::Compression;
use flate2::write::DeflateEncoder;
use std::io::{self, Write as _};

/// Characters that have no meaning in markup and scripts; `page/loader.js` has the same.
fn alphabet() -> Vec<u8> {
    (b'!'..=b'~').filter(|letter| !b"\"&'<>\\`".contains(letter)).take(85).collect()
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

/// Digits in base 85 of groups of four bytes, the first byte first. A last group of n bytes has
/// n + 1 digits.
fn text(bytes: &[u8]) -> String {
    let alphabet = alphabet();
    let mut text = String::with_capacity(bytes.len() / 4 * 5 + 5);
    for group in bytes.chunks(4) {
        let mut four = [0; 4];
        four[..group.len()].copy_from_slice(group);
        let value = u32::from_be_bytes(four);
        let digits =
            [85_u32.pow(4), 85_u32.pow(3), 85_u32.pow(2), 85, 1].map(|unit| value / unit % 85);
        text.extend(digits[..=group.len()].iter().map(|&digit| alphabet[digit as usize] as char));
    }
    text
}

#[cfg(test)]
#[path = "tests/packed.rs"]
mod tests;
