//! `run.json` of several bodies.

use super::model::Model;
use crate::cli::outcome::Failure;
use crate::cli::run_file::{SolverSettings, SummaryFile};
use crate::cli::{fields, input, shown};
use serde::{Deserialize, Serialize};
use std::path::Path;

/// What made the tables, and what came of it.
#[derive(Debug, Serialize, Deserialize)]
pub struct SeveralRun {
    /// As of one body.
    pub outcome: String,
    pub tumble_version: String,
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

/// Larger ones are no run files: two thousand bodies with meshes of their own.
const LARGEST: u64 = 256 << 20;

impl SeveralRun {
    /// `None` where there is no such file, or it is of one body.
    pub fn read(path: &Path) -> Result<Option<Self>, Failure> {
        let odd = |why: &dyn std::fmt::Display| {
            Failure::Input(format!("{} is not a run.json: {why}", shown::path(path)))
        };
        let text = match input::text(path, LARGEST) {
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
        serde_json::to_string_pretty(self)
            .map(|json| json + "\n")
            .map_err(|error| Failure::Other(format!("run.json cannot be made: {error}")))
    }
}

/// Refuses, where one body's trajectory is asked for, a file beside a run.json of several.
pub fn refuse_run_of_several(file: &Path) -> Result<(), Failure> {
    match SeveralRun::read(&file.with_file_name("run.json"))? {
        None => Ok(()),
        Some(run) => Err(Failure::Input(format!(
            "{}: the run.json beside it is of a run of several bodies ({}); pictures are drawn of \
             one body's trajectory.csv",
            shown::path(file),
            run.model.bodies.len()
        ))),
    }
}
