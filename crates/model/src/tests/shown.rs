//! Unit tests of `shown.rs`.

use super::*;

#[test]
fn control_and_direction_characters_are_escaped() {
    assert_eq!(escaped("a\u{1b}[31mb\u{202e}c"), "a\\u{1b}[31mb\\u{202e}c");
    assert_eq!(escaped("it's a \"größe\" \\ 長い"), "it's a \"größe\" \\ 長い");
    assert_eq!(line("one\ntwo\u{7}"), "one two\\u{7}");
}

#[test]
fn long_lines_are_shortened_in_the_middle() {
    let long = line(&format!("head{}tail", "ä".repeat(100_000)));
    assert!(long.starts_with("head") && long.ends_with("tail") && long.contains(" … "));
    assert!(long.len() <= LONGEST + 5, "{}", long.len());
}

#[test]
fn numbers_are_short_and_read_back() {
    for (value, text) in [(7.0, "7"), (1e-320, "1e-320"), (-0.25, "-0.25"), (1e300, "1e300")] {
        assert_eq!(number(value), text);
        assert_eq!(text.parse::<f64>().unwrap(), value);
    }
}
