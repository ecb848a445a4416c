//! Unit tests of `colour.rs`.

use super::*;

#[test]
fn colours_round_trip_and_invalid_ones_are_rejected() {
    let read = |text: &str| Colour::try_from(text.to_owned());
    assert_eq!(read("#0120fF"), Ok(Colour([1, 0x20, 0xff])));
    assert_eq!(String::from(Colour([1, 0x20, 0xff])), "#0120ff");
    assert!(NAMED.iter().all(|(name, colour)| read(name) == Ok(Colour(*colour))));
    assert!(NAMED.is_sorted());
    for invalid in ["", "#", "0120ff", "#0120f", "#0120fff", "#+120ff", "Red", "mauve", "#é120f"] {
        assert!(read(invalid).unwrap_err().contains("black, blue"), "{invalid}");
    }
}

#[test]
fn labels_are_one_line_of_limited_length() {
    let read = |text: &str| BodyLabel::try_from(text.to_owned());
    assert_eq!(read("Würfel 1").unwrap().0, "Würfel 1");
    for invalid in ["", "  ", "a\nb", &"x".repeat(41)] {
        assert!(read(invalid).is_err(), "{invalid:?}");
    }
}
