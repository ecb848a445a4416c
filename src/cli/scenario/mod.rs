//! Scenario files: a simulation written down in TOML. `scenarios/README.md` describes every
//! field.

mod tables;

use super::outcome::Failure;
use super::settings::Settings;
use super::{fields, input, shown};
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
        let text = input::text(path, LARGEST_FILE)
            .map_err(|error| odd(format!("cannot be read as a scenario: {error}")))?;
        let file = parse(&text).map_err(odd)?;
        let stem = path.file_stem().map(|stem| stem.to_string_lossy().into_owned());
        Self::of(file, stem.unwrap_or_default()).map_err(odd)
    }

    fn of(file: ScenarioFile, stem: String) -> Result<Self, String> {
        file.refuse_idle_fields()?;
        let name = file.name.clone().unwrap_or(stem);
        if !shown::is_name(&name) {
            return Err("name: 1 to 80 characters in one line are needed".to_owned());
        }
        Ok(Self { name, ground: file.ground.is_some(), settings: file.settings()? })
    }
}

fn parse(text: &str) -> Result<ScenarioFile, String> {
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
