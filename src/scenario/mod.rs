//! Scenario files: a simulation written down in TOML. `scenarios/README.md` describes every
//! field.
//!
//! A file is text here: who reads it, and how the files of its meshes are read, is the caller's
//! business. A file is laid under what else is told ([`settings`]), and comes to a [`job`] of one
//! body or of [several].

mod changed;
pub mod choices;
pub mod contact;
pub mod failure;
pub mod fields;
pub mod job;
pub mod names;
pub mod parameters;
pub mod physics;
pub mod scene;
pub mod settings;
pub mod several;
pub mod shown;
mod tables;

use failure::Failure;
use serde::de::DeserializeOwned;
use settings::Settings;
use std::path::Path;
use tables::ScenarioFile;

/// More bytes than this are no scenario.
pub const LARGEST_FILE: u64 = 1 << 20;

/// What a file says.
pub struct Scenario {
    /// What the scenario is called.
    pub name: String,
    /// Whether there is a ground.
    pub ground: bool,
    /// What it says.
    pub settings: Settings,
}

impl Scenario {
    /// Checks the text of the file `path`. Numbers that the model itself judges are left to it.
    ///
    /// # Errors
    /// The first thing wrong with the text, with the file.
    pub fn of_text(text: &str, path: &Path) -> Result<Self, Failure> {
        let odd = |why: String| Failure::Input(format!("{}: {why}", shown::path(path)));
        Self::of(parse(text).map_err(odd)?, path).map_err(odd)
    }

    fn of(file: ScenarioFile, path: &Path) -> Result<Self, String> {
        file.refuse_idle_fields()?;
        let name = name(file.name.clone(), path)?;
        Ok(Self { name, ground: file.ground.is_some(), settings: file.settings()? })
    }
}

/// The name that a scenario gives itself, or else its file's.
pub fn name(given: Option<String>, path: &Path) -> Result<String, String> {
    let stem = || path.file_stem().map(|stem| stem.to_string_lossy().into_owned());
    let name = given.or_else(stem).unwrap_or_default();
    if !shown::is_name(&name) {
        return Err("name: 1 to 80 characters in one line are needed".to_owned());
    }
    Ok(name)
}

/// What a scenario's text says.
pub fn parse<T: DeserializeOwned>(text: &str) -> Result<T, String> {
    let deserializer =
        toml::Deserializer::parse(text).map_err(|error| sentence(text, ".", &error))?;
    serde_path_to_error::deserialize(deserializer)
        .map_err(|error| sentence(text, &error.path().to_string(), error.inner()))
}

/// What is wrong, with which field, and in which line.
fn sentence(text: &str, field: &str, error: &toml::de::Error) -> String {
    let message = fields::named(field, error.message());
    let Some(span) = error.span() else { return message };
    let before = &text.as_bytes()[..span.start.min(text.len())];
    let line = before.iter().filter(|byte| **byte == b'\n').count();
    let shown: String = text.lines().nth(line).unwrap_or("").trim().chars().take(60).collect();
    // A table that is missing is missing nowhere.
    if shown.is_empty() || (span.start == 0 && error.message().starts_with("missing field")) {
        return message;
    }
    format!("line {}, `{shown}`: {message}", line + 1)
}
