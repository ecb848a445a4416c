//! Unit tests of `packed.rs`.

use super::*;

/// Inverse of [`text`], as in `page/loader.js`.
fn bytes(text: &str) -> Vec<u8> {
    let alphabet = alphabet();
    let digit = |letter: &u8| alphabet.iter().position(|other| other == letter).unwrap() as u32;
    let (mut held, mut bits, mut bytes) = (0, 0, Vec::new());
    for group in text.as_bytes().chunks(2) {
        (held, bits) = match group {
            [one] => (held << 6 | digit(one), bits + 6),
            _ => (held << 13 | (BASE * digit(&group[0]) + digit(&group[1])), bits + 13),
        };
        while bits >= 8 {
            bits -= 8;
            bytes.push((held >> bits) as u8);
        }
        held &= (1 << bits) - 1;
    }
    bytes
}

#[test]
fn text_holds_all_bytes() {
    let all: Vec<u8> = (0..=255).chain([0, 0, 0, 0, 255, 255, 255, 255]).collect();
    for end in 0..=all.len() {
        assert_eq!(bytes(&text(&all[..end])), all[..end]);
    }
    assert_eq!(alphabet().len(), BASE as usize);
}
