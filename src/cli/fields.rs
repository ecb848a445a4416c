//! Fields of the files that are read, and JSON.

use serde::de::DeserializeOwned;
pub use tumble::scenario::fields::{Exactly, Numbers};
use tumble::scenario::fields::{named, plain};

/// What a JSON text says; an error names the field and the line.
pub fn json<T: DeserializeOwned>(text: &str) -> Result<T, String> {
    let mut deserializer = serde_json::Deserializer::from_str(text);
    let value = serde_path_to_error::deserialize(&mut deserializer).map_err(|error| {
        let path = error.path().to_string();
        named(&path, &error.into_inner().to_string())
    })?;
    deserializer.end().map_err(|error| plain(&error.to_string()))?;
    Ok(value)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn lists_have_exactly_their_length() {
        assert_eq!(json::<Numbers<3>>("[1, 2, 3]").unwrap().0, [1.0, 2.0, 3.0]);
        assert_eq!(serde_json::to_string(&Exactly([1.5, 2.0])).unwrap(), "[1.5,2.0]");
        for (text, words) in [
            ("[1, 2]", "invalid length 2, an array is needed of length 3"),
            ("[1, 2, 3, 4, 5]", "invalid length 5, "),
            ("[1, \"2\", 3]", "[1]: invalid type: string \"2\", a number is needed"),
            ("7", "invalid type: integer `7`, an array is needed of length 3"),
            ("[1, 2, 3] 4", "trailing characters"),
        ] {
            let why = json::<Numbers<3>>(text).unwrap_err();
            assert!(why.contains(words), "{text}: {why}");
        }
    }
}
