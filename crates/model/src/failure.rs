//! Errors of input, settings and files.

use super::names::{self, FileKind};
use super::shown;
use std::fmt;
use std::path::Path;
use tumble_core::error::Error;

/// Reason of a failure, as one sentence.
#[derive(Debug)]
pub enum Failure {
    /// Invalid input that the user can correct.
    Input(String),
    /// Invalid setting, identified by its flag.
    ///
    /// The displayed name of the setting depends on its source (flag or file).
    Setting {
        /// Flag without dashes.
        name: String,
        /// Description of the fault.
        why: String,
    },
    /// Anything else.
    Other(String),
}

impl Failure {
    /// Failure of the setting `name`.
    pub fn setting(name: &str, why: impl fmt::Display) -> Self {
        Self::Setting { name: name.to_owned(), why: why.to_string() }
    }

    /// Failure because the required setting `name` is missing.
    pub fn needed(name: &str) -> Self {
        Self::setting(name, "it is required")
    }

    /// Adds the name of the file to the message.
    ///
    /// A setting that is not among `flags` comes from the file and gets its field name there. A
    /// setting among `flags` stays as it is.
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

/// Maps an error of the core to the setting that causes it.
impl From<Error> for Failure {
    fn from(error: Error) -> Self {
        match names::behind(&error) {
            Some(name) => Self::setting(name, &error),
            None => Self::Input(error.to_string()),
        }
    }
}

/// Rejects every given flag: it has no effect with `place`. `flags` holds each flag and whether it
/// was given.
pub fn refuse_flags(place: &str, flags: &[(&str, bool)]) -> Result<(), Failure> {
    match flags.iter().find(|(_, given)| *given) {
        Some((flag, _)) => {
            let name = flag.trim_start_matches('-');
            Err(Failure::setting(name, format!("it has no meaning with {place}; leave it out")))
        }
        None => Ok(()),
    }
}
