//! Unit tests of `packed.rs`.

use super::*;

/// Inverse of [`text`], as in `page/loader.js`.
fn bytes(text: &str) -> Vec<u8> {
    let alphabet = alphabet();
    let digit = |letter: &u8| alphabet.iter().position(|other| other == letter).unwrap() as u64;
    let mut bytes = Vec::new();
    for group in text.as_bytes().chunks(5) {
        let digits = (0..5).map(|place| group.get(place).map_or(84, digit));
        let value = digits.fold(0, |value, digit| 85 * value + digit) as u32;
        bytes.extend(&value.to_be_bytes()[..group.len() - 1]);
    }
    bytes
}

#[test]
fn text_holds_all_bytes() {
    let all: Vec<u8> = (0..=255).chain([0, 0, 0, 0, 255, 255, 255, 255]).collect();
    for end in 0..=all.len() {
        assert_eq!(bytes(&text(&all[..end])), all[..end]);
    }
    assert_eq!(alphabet().len(), 85);
}
