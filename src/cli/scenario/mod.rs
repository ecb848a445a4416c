//! Scenario files: a simulation written down in TOML. `scenarios/README.md` describes every
//! field.

pub mod tables;

use super::outcome::Failure;
use super::settings::Settings;
use super::{fields, input, shown};
use serde::de::DeserializeOwned;
use std::path::Path;
use tables::ScenarioFile;

/// More bytes than this are no scenario.
const LARGEST_FILE: u64 = 1 << 20;

/// What a file says.
pub struct Scenario {
    pub name: String,
    /// Whether there is a ground.
    pub ground: bool,
    pub settings: Settings,
}

impl Scenario {
    /// Reads and checks a file. Numbers that the model itself judges are left to it.
    pub fn read(path: &Path) -> Result<Self, Failure> {
        let odd = |why: String| Failure::Input(format!("{}: {why}", shown::path(path)));
        let file = parse(&read_text(path)?).map_err(odd)?;
        Self::of(file, path).map_err(odd)
    }

    fn of(file: ScenarioFile, path: &Path) -> Result<Self, String> {
        file.refuse_idle_fields()?;
        let name = name(file.name.clone(), path)?;
        Ok(Self { name, ground: file.ground.is_some(), settings: file.settings()? })
    }
}

/// The text of a file that may be a scenario.
pub fn read_text(path: &Path) -> Result<String, Failure> {
    input::text(path, LARGEST_FILE).map_err(|error| {
        let file = shown::path(path);
        Failure::Input(format!("{file}: cannot be read as a scenario: {error}"))
    })
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
