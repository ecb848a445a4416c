//! `run.json` of several bodies.

use super::model::Model;
use crate::cli::outcome::Failure;
use crate::cli::run_file::{LARGEST_RUN_FILE, SolverSettings, SummaryFile};
use crate::cli::{fields, input, shown};
use serde::{Deserialize, Serialize};
use std::path::Path;

/// What made the tables, and what came of it.
#[derive(Debug, Serialize, Deserialize)]
pub struct SeveralRun {
    /// As of one body.
    pub outcome: String,
    pub tumble_version: String,
    #[serde(default)]
    pub ipopt_version: String,
    pub scene: String,
    /// The settings for which flags gave other values than the scenario.
    pub changed: Vec<String>,
    pub seed: u32,
    /// Whether anything of the start is drawn from the seed.
    pub drawn: bool,
    /// Rows asked for.
    pub steps: u64,
    pub model: Model,
    pub solver: SolverSettings,
    pub summary: SummaryFile,
    /// m, of all steps.
    pub largest_overlap_m: f64,
}

/// The part of any run.json that says which kind it is.
#[derive(Deserialize)]
struct Kind {
    model: Option<serde::de::IgnoredAny>,
}

impl SeveralRun {
    /// `None` where there is no such file, or it is of one body.
    pub fn read(path: &Path) -> Result<Option<Self>, Failure> {
        let odd = |why: &dyn std::fmt::Display| {
            Failure::Input(format!("{} is not a run.json: {why}", shown::path(path)))
        };
        let text = match input::text(path, LARGEST_RUN_FILE) {
            Ok(text) => text,
            Err(error) if error.kind() == std::io::ErrorKind::NotFound => return Ok(None),
            Err(error) => return Err(odd(&error)),
        };
        match serde_json::from_str(&text) {
            Ok(Kind { model: Some(_) }) => fields::json(&text).map(Some).map_err(|why| odd(&why)),
            _ => Ok(None),
        }
    }

    pub fn write(&self) -> Result<String, Failure> {
        json(self)
    }
}

fn json(value: &impl Serialize) -> Result<String, Failure> {
    serde_json::to_string_pretty(value)
        .map(|json| json + "\n")
        .map_err(|error| Failure::Other(format!("run.json cannot be made: {error}")))
}

/// Refuses a model that makes a longer run.json than is read again.
pub fn refuse_large(model: &Model) -> Result<(), Failure> {
    /// What besides the model stands in the file.
    const REST: u64 = 1 << 16;
    let length = json(model)?.len() as u64;
    if length + REST <= LARGEST_RUN_FILE {
        return Ok(());
    }
    Err(Failure::Input(format!(
        "shapes: the scene has {length} bytes in run.json, of which at most {LARGEST_RUN_FILE} are \
         read; fewer or coarser meshes and hulls are needed"
    )))
}
