//! What comes from outside, as it can be shown in a terminal and in a title.

use std::path::Path;

/// More bytes than this of a sentence are not shown: a file's own words may be long.
const LONGEST: usize = 800;

/// The text, each character that is not for the eye (line breaks, escape sequences, marks that
/// turn the direction of writing) as its escape.
pub fn escaped(text: &str) -> String {
    /// Readable, though a literal would have to escape them.
    const QUOTES: [char; 3] = ['"', '\'', '\\'];
    let mut shown = String::with_capacity(text.len());
    for piece in text.split_inclusive(QUOTES) {
        let plain = piece.trim_end_matches(QUOTES);
        shown.extend(plain.escape_debug());
        shown.push_str(&piece[plain.len()..]);
    }
    shown
}

/// A file's name.
pub fn path(path: &Path) -> String {
    escaped(&path.to_string_lossy())
}

/// One line of a bearable length: line breaks as blanks, and the middle left out where there is
/// too much of it.
pub fn line(text: &str) -> String {
    let blank = |c: char| if matches!(c, '\n' | '\r' | '\t') { ' ' } else { c };
    let line = escaped(&text.chars().map(blank).collect::<String>());
    if line.len() <= LONGEST {
        return line;
    }
    let (head, tail) = (line.floor_char_boundary(LONGEST / 2), line.len() - LONGEST / 2);
    format!("{} … {}", &line[..head], &line[line.ceil_char_boundary(tail)..])
}

/// A number with the fewest digits that read back to it, as it is typed: 7 and not 7.0, 1e-320
/// and not its 320 digits.
pub fn number(value: f64) -> String {
    let text = format!("{value:?}");
    text.strip_suffix(".0").map_or(text.clone(), str::to_owned)
}

/// Whether this can stand in a title: something, in one line, of bearable length.
pub fn is_name(text: &str) -> bool {
    !text.is_empty() && text.chars().count() <= 80 && !text.chars().any(char::is_control)
}

/// Whether this can be the name of a body, a fixed thing or a joint.
///
/// # Errors
/// A sentence that begins with the field.
pub fn checked_name(name: &str) -> Result<(), String> {
    let fits = |c: char| c.is_ascii_alphanumeric() || "_-.".contains(c);
    if (1..=40).contains(&name.len()) && name.chars().all(fits) && name != "ground" {
        return Ok(());
    }
    Err(format!(
        "name: {name:?} is none; 1 to 40 letters, digits, `-`, `_` or `.` are needed, and not `ground`"
    ))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_is_not_for_the_eye_is_escaped() {
        assert_eq!(escaped("a\u{1b}[31mb\u{202e}c"), "a\\u{1b}[31mb\\u{202e}c");
        assert_eq!(escaped("it's a \"größe\" \\ 長い"), "it's a \"größe\" \\ 長い");
        assert_eq!(line("one\ntwo\u{7}"), "one two\\u{7}");
    }

    #[test]
    fn a_long_line_keeps_its_ends() {
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
}
