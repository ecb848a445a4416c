//! Conversion of untrusted text for terminals and titles.

use std::path::Path;

/// Maximum length of a displayed sentence (bytes): text from files can be long.
const LONGEST: usize = 800;

/// Replaces every non-printable character of `text` by its escape sequence.
///
/// Examples are line breaks, terminal escapes and marks of writing direction.
pub fn escaped(text: &str) -> String {
    /// Printable characters that `escape_debug` would escape.
    const QUOTES: [char; 3] = ['"', '\'', '\\'];
    let mut shown = String::with_capacity(text.len());
    for piece in text.split_inclusive(QUOTES) {
        let plain = piece.trim_end_matches(QUOTES);
        shown.extend(plain.escape_debug());
        shown.push_str(&piece[plain.len()..]);
    }
    shown
}

/// File name for display.
pub fn path(path: &Path) -> String {
    escaped(&path.to_string_lossy())
}

/// Converts `text` to one line: line breaks become blanks, and a long text loses its middle.
pub fn line(text: &str) -> String {
    let blank = |c: char| if matches!(c, '\n' | '\r' | '\t') { ' ' } else { c };
    let line = escaped(&text.chars().map(blank).collect::<String>());
    if line.len() <= LONGEST {
        return line;
    }
    let (head, tail) = (line.floor_char_boundary(LONGEST / 2), line.len() - LONGEST / 2);
    format!("{} … {}", &line[..head], &line[line.ceil_char_boundary(tail)..])
}

/// Shortest decimal number that reads back to `value`: 7 instead of 7.0, 1e-320 instead of 320
/// digits.
pub fn number(value: f64) -> String {
    let text = format!("{value:?}");
    text.strip_suffix(".0").map_or(text.clone(), str::to_owned)
}

/// Four digits of a number of any size.
pub fn rounded(value: f64) -> String {
    format!("{value:.3e}").parse().map_or_else(|_| String::new(), number)
}

/// True if `text` can be a title: one non-empty line of at most 80 characters.
pub fn is_name(text: &str) -> bool {
    !text.is_empty() && text.chars().count() <= 80 && !text.chars().any(char::is_control)
}

/// Checks the name of a body, a fixed object or a joint.
///
/// # Errors
/// An invalid name; the sentence begins with the field.
pub fn checked_name(name: &str) -> Result<(), String> {
    let fits = |c: char| c.is_ascii_alphanumeric() || "_-.".contains(c);
    if (1..=40).contains(&name.len()) && name.chars().all(fits) && name != "ground" {
        return Ok(());
    }
    Err(format!(
        "name: {name:?} is not allowed; use 1 to 40 letters, digits, `-`, `_` or `.`, but not \
         `ground`"
    ))
}

#[cfg(test)]
#[path = "tests/shown.rs"]
mod tests;
