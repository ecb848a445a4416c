//! Scenario files: a simulation written down in TOML. `scenarios/README.md` describes every
//! field.

mod tables;

use super::outcome::Failure;
use super::settings::Settings;
use std::fs::File;
use std::io::Read;
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
        let odd = |why: String| Failure::Input(format!("{}: {why}", path.display()));
        let mut text = String::new();
        File::open(path)
            .and_then(|file| file.take(LARGEST_FILE + 1).read_to_string(&mut text))
            .map_err(|error| odd(format!("cannot be read as a scenario: {error}")))?;
        if text.len() as u64 > LARGEST_FILE {
            return Err(odd(format!("is longer than {LARGEST_FILE} bytes, it is no scenario")));
        }
        let file: ScenarioFile =
            toml::from_str(&text).map_err(|error| odd(sentence(&text, &error)))?;
        let stem = path.file_stem().map(|stem| stem.to_string_lossy().into_owned());
        Self::of(file, stem.unwrap_or_default()).map_err(odd)
    }

    fn of(file: ScenarioFile, stem: String) -> Result<Self, String> {
        file.refuse_idle_fields()?;
        let name = file.name.clone().unwrap_or(stem);
        if name.is_empty() || name.chars().count() > 80 || name.chars().any(char::is_control) {
            return Err("name: 1 to 80 characters in one line are needed".to_owned());
        }
        Ok(Self { name, ground: file.ground.is_some(), settings: file.settings()? })
    }
}

/// What is wrong, and in which line.
fn sentence(text: &str, error: &toml::de::Error) -> String {
    let Some(span) = error.span() else { return plain(error.message()) };
    let before = &text.as_bytes()[..span.start.min(text.len())];
    let line = before.iter().filter(|byte| **byte == b'\n').count();
    let shown: String = text.lines().nth(line).unwrap_or("").trim().chars().take(60).collect();
    let message = plain(error.message());
    // A table that is missing is missing nowhere.
    if shown.is_empty() || (span.start == 0 && message.starts_with("missing field")) {
        return message;
    }
    format!("line {}, `{shown}`: {message}", line + 1)
}

/// A message without the names of our own types.
fn plain(message: &str) -> String {
    let types = [
        ("expected f64", "a number is needed"),
        ("expected u64", "a whole number is needed"),
        ("expected u32", "a whole number from 0 to 4294967295 is needed"),
        (" as i128", ""),
        ("expected struct BodyTable", "a table [body] is needed"),
        ("expected struct GroundTable", "a table [ground] is needed"),
        ("expected struct StartTable", "a table [start] is needed"),
        ("expected struct LoadTable", "a table [load] is needed"),
        ("expected struct SolverTable", "a table [solver] is needed"),
    ];
    types.iter().fold(message.to_owned(), |text, (name, plain)| text.replace(name, plain))
}
