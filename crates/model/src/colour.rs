//! Colours and labels of bodies. Only pictures use them.

use serde::{Deserialize, Serialize};

/// RGB colour, written `"#rrggbb"`; scenario files also accept the names in `NAMED`.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
#[serde(try_from = "String", into = "String")]
pub struct Colour(pub [u8; 3]);

/// Colour names and their RGB values, sorted by name.
const NAMED: [(&str, [u8; 3]); 12] = [
    ("black", [0x20, 0x20, 0x20]),
    ("blue", [0x2f, 0x74, 0xb5]),
    ("brown", [0x8b, 0x5a, 0x2b]),
    ("cyan", [0x2a, 0xa5, 0xb8]),
    ("green", [0x24, 0x8f, 0x4b]),
    ("grey", [0x80, 0x86, 0x8e]),
    ("orange", [0xe0, 0x80, 0x1c]),
    ("pink", [0xe3, 0x7f, 0xb0]),
    ("purple", [0x7d, 0x4b, 0xa8]),
    ("red", [0xc8, 0x32, 0x32]),
    ("white", [0xf2, 0xf2, 0xf2]),
    ("yellow", [0xe8, 0xc0, 0x2a]),
];

impl TryFrom<String> for Colour {
    type Error = String;

    fn try_from(text: String) -> Result<Self, String> {
        let named = NAMED.iter().find(|(name, _)| *name == text).map(|(_, colour)| *colour);
        let written = || {
            let digits = text.strip_prefix('#').filter(|digits| digits.len() == 6)?;
            let is_hex = digits.bytes().all(|digit| digit.is_ascii_hexdigit());
            let number = u32::from_str_radix(digits, 16).ok().filter(|_| is_hex)?;
            let [_, red, green, blue] = number.to_be_bytes();
            Some([red, green, blue])
        };
        named.or_else(written).map(Self).ok_or_else(|| {
            let names: Vec<_> = NAMED.iter().map(|(name, _)| *name).collect();
            format!(
                "{text:?} is not a colour; \"#rrggbb\" or one of {} is needed",
                names.join(", ")
            )
        })
    }
}

impl From<Colour> for String {
    fn from(Colour([red, green, blue]): Colour) -> Self {
        format!("#{red:02x}{green:02x}{blue:02x}")
    }
}

/// Text shown next to a body in pictures: one line.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
#[serde(try_from = "String", into = "String")]
pub struct BodyLabel(pub String);

/// Maximum length of a label (characters).
const LONGEST: usize = 40;

impl TryFrom<String> for BodyLabel {
    type Error = String;

    fn try_from(text: String) -> Result<Self, String> {
        let is_line = !text.chars().any(char::is_control);
        if is_line && !text.trim().is_empty() && text.chars().count() <= LONGEST {
            Ok(Self(text))
        } else {
            Err(format!("a line of 1 to {LONGEST} characters is needed"))
        }
    }
}

impl From<BodyLabel> for String {
    fn from(label: BodyLabel) -> Self {
        label.0
    }
}

#[cfg(test)]
#[path = "tests/colour.rs"]
mod tests;
