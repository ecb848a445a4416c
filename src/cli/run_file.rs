//! `run.json`: what made a trajectory, and what came of it.

use super::outcome::Failure;
use serde::{Deserialize, Serialize};
use std::collections::BTreeMap;
use std::path::Path;
use tumble::simulation::scene::Scene;
use tumble::simulation::summary::RunSummary;

#[derive(Debug, Serialize, Deserialize)]
pub struct RunFile {
    /// `complete`; `interrupted` (Ctrl-C) or `stopped` (a failed step under --on-failure
    /// stop) where there are fewer rows than asked for.
    pub outcome: String,
    pub tumble_version: String,
    pub ipopt_version: String,
    pub scene: String,
    pub seed: u32,
    pub parameters: RunParameters,
    pub solver: SolverSettings,
    pub start: StartState,
    pub summary: SummaryFile,
}

/// The constants of the model, SI units.
#[derive(Debug, Clone, Serialize, Deserialize)]
pub struct RunParameters {
    pub steps: u64,
    pub dt: f64,
    pub mu: f64,
    pub mass: f64,
    /// By rows.
    pub inertia: [[f64; 3]; 3],
    pub gravity: [f64; 3],
    /// ε of the tutorial's program, N.
    pub epsilon: f64,
    #[serde(default)]
    pub plane: PlaneParameters,
    /// Body frame.
    pub contact_points: Vec<[f64; 3]>,
    /// Null without one.
    #[serde(default)]
    pub load: Option<LoadParameters>,
}

/// The ground n·x = d.
#[derive(Debug, Clone, Serialize, Deserialize)]
pub struct PlaneParameters {
    pub normal: [f64; 3],
    pub offset: f64,
}

/// The external load.
#[derive(Debug, Clone, Serialize, Deserialize)]
pub struct LoadParameters {
    /// Knots: t, s, and the force, N, world.
    pub force: Vec<[f64; 4]>,
    /// Knots: t, s, and the torque, N m, body.
    pub torque: Vec<[f64; 4]>,
    /// Where the force acts, m, body.
    pub at: [f64; 3],
}

impl Default for PlaneParameters {
    fn default() -> Self {
        Self { normal: [0.0, 0.0, 1.0], offset: 0.0 }
    }
}

#[derive(Debug, Serialize, Deserialize)]
pub struct SolverSettings {
    pub name: String,
    pub detection: Option<String>,
    pub on_failure: Option<String>,
    pub tol: Option<f64>,
    pub max_iter: Option<u32>,
}

#[derive(Debug, Serialize, Deserialize)]
pub struct StartState {
    pub position: [f64; 3],
    /// Whether the attitude is drawn from the seed.
    pub random: bool,
    pub attitude: [f64; 4],
    pub velocity: [f64; 3],
    pub spin: [f64; 3],
}

#[derive(Debug, Serialize, Deserialize)]
pub struct SummaryFile {
    pub rows: u64,
    pub free_steps: u64,
    pub contact_steps: u64,
    pub iterations: u64,
    pub converged: u64,
    pub retried: u64,
    pub fallback: u64,
    pub failed: u64,
    /// Contact steps by the rung of Ipopt's ladder that their solution came from; a failed step
    /// counts on that of the best point. Empty without the ladder.
    pub rungs: BTreeMap<String, u64>,
    /// The residual, of the contact steps; null without contact.
    pub certificate_median_m_s: Option<f64>,
    /// Of all steps; null without steps.
    pub certificate_max_m_s: Option<f64>,
    pub solve_seconds: f64,
}

/// What is simulated, in words: the tutorial's scenes are called so, scenarios have names.
pub fn heading(scene: &str) -> String {
    let of_tutorial = [Scene::drop().name, Scene::floating().name].contains(&scene);
    if of_tutorial { format!("{scene} scene") } else { scene.to_owned() }
}

impl SummaryFile {
    /// The summary of a run, with the starts of its steps where they are rungs of a ladder.
    pub fn of(summary: &RunSummary, climbs: bool, solve_seconds: f64) -> Self {
        let starts = summary.starts.iter().filter(|_| climbs);
        let rungs = starts.map(|(start, count)| ((*start).to_owned(), *count)).collect();
        Self {
            rows: summary.steps() + 1,
            free_steps: summary.free,
            contact_steps: summary.contact_steps(),
            iterations: summary.iterations,
            converged: summary.converged,
            retried: summary.retried,
            fallback: summary.fallback,
            failed: summary.failed,
            rungs,
            certificate_median_m_s: summary.median_residual(),
            certificate_max_m_s: summary.largest_residual(),
            solve_seconds,
        }
    }
}

/// Reads a run file. Larger ones than this are no run files.
const LARGEST_RUN_FILE: u64 = 16 << 20;

impl RunFile {
    /// `None` where there is no such file.
    pub fn read(path: &Path) -> Result<Option<Self>, Failure> {
        let odd =
            |why: String| Failure::Input(format!("{} is not a run.json: {why}", path.display()));
        let length = match std::fs::metadata(path) {
            Ok(metadata) => metadata.len(),
            Err(error) if error.kind() == std::io::ErrorKind::NotFound => return Ok(None),
            Err(error) => return Err(odd(error.to_string())),
        };
        if length > LARGEST_RUN_FILE {
            return Err(odd(format!("it has {length} bytes, at most {LARGEST_RUN_FILE} expected")));
        }
        let text = std::fs::read_to_string(path).map_err(|error| odd(error.to_string()))?;
        serde_json::from_str(&text).map(Some).map_err(|error| odd(error.to_string()))
    }
}
