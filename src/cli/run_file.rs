//! `run.json`: what made a trajectory, and what came of it.

use super::fields::{self, Exactly, Numbers};
use super::outcome::Failure;
use super::{input, shown};
use serde::{Deserialize, Serialize};
use std::collections::BTreeMap;
use std::path::Path;
use tumble::mechanics::Rotation;
use tumble::scenario::parameters::{LoadParameters, PlaneParameters, unnamed_rotation};
use tumble::simulation::scene::Scene;
use tumble::simulation::summary::RunSummary;
use tumble::solver::ipopt::{self, LADDER_RESIDUAL};
use tumble::solver::native;
use tumble::step_nlp::StepNlp;
use tumble::world::World;

#[derive(Debug, Serialize, Deserialize)]
#[serde(expecting = "an object with the fields of a run.json")]
pub struct RunFile {
    /// `complete`; `interrupted` (Ctrl-C) or `stopped` (a failed step under --on-failure
    /// stop) where there are fewer rows than asked for.
    pub outcome: String,
    pub tumble_version: String,
    pub ipopt_version: String,
    pub scene: String,
    /// The settings of the scene for which flags gave other values.
    #[serde(default)]
    pub changed: Vec<String>,
    pub seed: u32,
    pub parameters: RunParameters,
    pub solver: SolverSettings,
    pub start: StartState,
    pub summary: SummaryFile,
}

/// The constants of the model, SI units.
#[derive(Debug, Clone, Serialize, Deserialize)]
#[serde(expecting = "an object with the constants of the model")]
pub struct RunParameters {
    pub steps: u64,
    pub dt: f64,
    #[serde(default = "unnamed_rotation")]
    pub rotation: Rotation,
    pub mu: f64,
    #[serde(default)]
    pub restitution: f64,
    /// m/s; null for the usual one.
    #[serde(default)]
    pub rebound_speed: Option<f64>,
    pub mass: f64,
    /// By rows.
    pub inertia: Exactly<Numbers<3>, 3>,
    pub gravity: Numbers<3>,
    /// ε of the tutorial's program, N.
    pub epsilon: f64,
    #[serde(default)]
    pub plane: PlaneParameters,
    /// Body frame.
    pub contact_points: Vec<Numbers<3>>,
    /// Null without one.
    #[serde(default)]
    pub load: Option<LoadParameters>,
}

#[derive(Debug, Serialize, Deserialize)]
#[serde(expecting = "an object with the solver's name and settings")]
pub struct SolverSettings {
    pub name: String,
    /// Of Ipopt's program; null for others.
    #[serde(default)]
    pub formulation: Option<String>,
    pub detection: Option<String>,
    pub on_failure: Option<String>,
    pub tol: Option<f64>,
    pub max_iter: Option<u32>,
}

#[derive(Debug, Serialize, Deserialize)]
#[serde(expecting = "an object with the state at the start")]
pub struct StartState {
    pub position: Numbers<3>,
    /// Whether the attitude is drawn from the seed.
    pub random: bool,
    pub attitude: Numbers<4>,
    pub velocity: Numbers<3>,
    pub spin: Numbers<3>,
}

#[derive(Debug, Serialize, Deserialize)]
#[serde(expecting = "an object with the counts of the run")]
pub struct SummaryFile {
    pub rows: u64,
    pub free_steps: u64,
    pub contact_steps: u64,
    pub iterations: u64,
    pub converged: u64,
    pub retried: u64,
    pub fallback: u64,
    /// Steps that turn too far or make energy; none in a file of before they were counted.
    #[serde(default)]
    pub wild: u64,
    /// Steps that took a part of the restitution, because the whole would make energy.
    #[serde(default)]
    pub tempered: u64,
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

impl SolverSettings {
    /// Of a run that has no contact.
    pub fn without_contact(name: &str) -> Self {
        let (formulation, detection, on_failure, tol, max_iter) = (None, None, None, None, None);
        Self { name: name.to_owned(), formulation, detection, on_failure, tol, max_iter }
    }

    /// The residual that a contact step of `world` may have that counts as solved, m/s: what its
    /// solver holds its steps to.
    pub fn accepted_residual(&self, world: &World) -> f64 {
        // The program of several bodies has the ladder's, with and without its other rungs.
        let ladder = || self.on_failure.as_deref() == Some("ladder");
        let accepted = match self.name.as_str() {
            "native" => native::ACCEPTED_RESIDUAL,
            "rk4" => 0.0,
            _ if ladder() || StepNlp::unsuitable(world).is_some() => LADDER_RESIDUAL,
            _ => ipopt::ACCEPTED_RESIDUAL,
        };
        accepted * world.speed_scale()
    }
}

/// What is simulated, in words: the tutorial's scenes are called so, scenarios have names; and
/// what was changed in it.
pub fn heading(scene: &str, changed: &[String]) -> String {
    /// More names than this are only counted.
    const MOST_NAMED: usize = 4;
    let of_tutorial = [Scene::drop().name, Scene::floating().name].contains(&scene);
    let name = if of_tutorial { format!("{scene} scene") } else { scene.to_owned() };
    match changed {
        [] => name,
        few if few.len() <= MOST_NAMED => format!("{name} with changed {}", few.join(", ")),
        many => format!("{name} with {} changed settings", many.len()),
    }
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
            wild: summary.wild,
            tempered: summary.tempered,
            failed: summary.failed,
            rungs,
            certificate_median_m_s: summary.median_residual(),
            certificate_max_m_s: summary.largest_residual(),
            solve_seconds,
        }
    }
}

/// Characters of a name or a word.
const LONGEST_WORD: usize = 80;

/// More bytes than this are no run file.
pub const LARGEST_RUN_FILE: u64 = 16 << 20;

impl RunFile {
    /// `None` where there is no such file.
    pub fn read(path: &Path) -> Result<Option<Self>, Failure> {
        let odd = |why: &dyn std::fmt::Display| {
            Failure::Input(format!("{} is not a run.json: {why}", shown::path(path)))
        };
        let text = match input::text(path, LARGEST_RUN_FILE) {
            Ok(text) => text,
            Err(error) if error.kind() == std::io::ErrorKind::NotFound => return Ok(None),
            Err(error) => return Err(odd(&error)),
        };
        let file: Self = fields::json(&text).map_err(|why| odd(&why))?;
        match file.long_word() {
            None => Ok(Some(file)),
            Some(field) => {
                Err(odd(&format!("{field}: it has more than {LONGEST_WORD} characters")))
            }
        }
    }

    /// The first field that is too long for a title or a table.
    fn long_word(&self) -> Option<&'static str> {
        let solver = &self.solver;
        let words = [
            ("outcome", Some(&self.outcome)),
            ("tumble_version", Some(&self.tumble_version)),
            ("ipopt_version", Some(&self.ipopt_version)),
            ("scene", Some(&self.scene)),
            ("solver.name", Some(&solver.name)),
            ("solver.detection", solver.detection.as_ref()),
            ("solver.on_failure", solver.on_failure.as_ref()),
        ];
        let words = words.into_iter().filter_map(|(field, word)| Some((field, word?)));
        let changed = self.changed.iter().map(|word| ("changed", word));
        words
            .chain(changed)
            .find(|(_, word)| word.chars().count() > LONGEST_WORD)
            .map(|(field, _)| field)
    }
}
