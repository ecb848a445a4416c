//! Unit tests of `fields.rs`.

use super::*;

#[test]
fn lists_have_exactly_their_length() {
    assert_eq!(json::<Numbers<3>>("[1, 2, 3]").unwrap().0, [1.0, 2.0, 3.0]);
    assert_eq!(serde_json::to_string(&Exactly([1.5, 2.0])).unwrap(), "[1.5,2.0]");
    for (text, words) in [
        ("[1, 2]", "invalid length 2, expected an array of length 3"),
        ("[1, 2, 3, 4, 5]", "invalid length 5, "),
        ("[1, \"2\", 3]", "[1]: invalid type: string \"2\", expected a number"),
        ("7", "invalid type: integer `7`, expected an array of length 3"),
        ("[1, 2, 3] 4", "trailing characters"),
    ] {
        let why = json::<Numbers<3>>(text).unwrap_err();
        assert!(why.contains(words), "{text}: {why}");
    }
}
