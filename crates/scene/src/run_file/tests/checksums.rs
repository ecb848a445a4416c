//! Unit tests of `checksums.rs`.

use super::*;

#[test]
fn sealed_text_passes_until_a_byte_changes() {
    let text = sealed("{\n  \"seed\": 42\n}\n");
    assert!(serde_json::from_str::<serde_json::Value>(&text).is_ok(), "{text}");
    assert_eq!(seal_of(&text), Seal::Whole);
    assert_eq!(seal_of(&text.replace("42", "43")), Seal::Broken);
    assert_eq!(seal_of(&text.replace("{\n", "{\n\n")), Seal::Broken);
    assert_eq!(seal_of("{\n  \"seed\": 42\n}\n"), Seal::None);
}

/// The standard check value of CRC-32 is the checksum of the digits 1 to 9.
#[test]
fn crc32_matches_the_standard_check_value() {
    assert_eq!(checksum_of(&b"123456789"[..]).unwrap(), "cbf43926");
    let mut stream = Summed::new(Vec::new());
    stream.write_all(b"1234").unwrap();
    stream.write_all(b"56789").unwrap();
    assert_eq!(stream.finish(), (b"123456789".to_vec(), "cbf43926".to_owned()));
}
