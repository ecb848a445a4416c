//! Why a scenario is refused.

use super::names::{self, FileKind};
use super::shown;
use std::fmt;
use std::path::Path;
use tumble_core::error::Error;

/// Why something cannot be done: one sentence.
#[derive(Debug)]
pub enum Failure {
    /// The user can mend it.
    Input(String),
    /// The same, and it is about a setting, by the name of its flag: what it is called depends
    /// on where it was given.
    Setting {
        /// The flag, without dashes.
        name: String,
        /// What is wrong with it.
        why: String,
    },
    /// Anything else.
    Other(String),
}

impl Failure {
    /// What is wrong with a setting.
    pub fn setting(name: &str, why: impl fmt::Display) -> Self {
        Self::Setting { name: name.to_owned(), why: why.to_string() }
    }

    /// A setting without which there is nothing to simulate.
    pub fn needed(name: &str) -> Self {
        Self::setting(name, "it is not given, and needed")
    }

    /// The same, where a file says what flags do not: with the file, and the name that the setting
    /// has there, unless it is one of `flags`.
    pub fn in_file(self, path: &Path, kind: FileKind, flags: &[&str]) -> Self {
        let file = shown::path(path);
        match self {
            Self::Input(sentence) => Self::Input(format!("{file}: {sentence}")),
            Self::Setting { name, why } if !names::is_among(&name, flags) => {
                Self::Input(format!("{file}: {}: {why}", names::in_file(&name, kind)))
            }
            other => other,
        }
    }
}

impl fmt::Display for Failure {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let sentence = match self {
            Self::Input(sentence) | Self::Other(sentence) => sentence.clone(),
            Self::Setting { name, why } => format!("{}: {why}", names::flags(name)),
        };
        f.write_str(&shown::line(&sentence))
    }
}

/// The model refuses a value: say which setting it is.
impl From<Error> for Failure {
    fn from(error: Error) -> Self {
        match names::behind(&error) {
            Some(name) => Self::setting(name, &error),
            None => Self::Input(error.to_string()),
        }
    }
}

/// An option that would do nothing is refused rather than ignored.
pub fn refuse_flags(place: &str, flags: &[(&str, bool)]) -> Result<(), Failure> {
    match flags.iter().find(|(_, given)| *given) {
        Some((flag, _)) => {
            let name = flag.trim_start_matches('-');
            Err(Failure::setting(name, format!("it has no meaning with {place}; leave it out")))
        }
        None => Ok(()),
    }
}
