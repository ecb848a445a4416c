//! `run.json`: the inputs and the summary of a run.

mod checksums;
mod reading;
mod solver;

pub use checksums::{Checksums, Seal, Summed, checksum_of};
pub use solver::SolverSettings;

use super::joints_summary::{JointsSummary, StiffJoint, StiffJointReport};
use super::row_counts::RowCounts;
use super::row_selection::RowSelection;
use super::scene::Scene;
use super::solver_choice::{IPOPT_VERSION, SolverChoice};
use crate::document::Document;
use crate::output::tables::IntervalRows;
use serde::{Deserialize, Serialize};
use std::collections::BTreeMap;
use tumble_core::simulation::scene as tutorial;
use tumble_core::simulation::summary::RunSummary;
use tumble_model::failure::Failure;
use tumble_model::shown;

/// Result of a run apart from its rows.
#[derive(Debug, Clone, Copy)]
pub struct RunEnd<'a> {
    /// Outcome, see [`RunFile::outcome`].
    pub outcome: &'a str,
    /// Summary of the steps.
    pub summary: &'a RunSummary,
    /// Wall-clock time of the steps (s); 0 if it was not measured.
    pub seconds: f64,
    /// Largest overlap of all steps (m).
    pub largest_overlap: f64,
    /// Summary of the joints, for a scene with joints.
    pub joints: Option<JointsSummary>,
    /// Joints that were too stiff for the time step.
    pub stiff_joints: &'a StiffJointReport,
}

/// Content of a run.json.
#[derive(Debug, Serialize, Deserialize)]
#[serde(expecting = "an object with the fields of a run.json")]
pub struct RunFile {
    /// Version of the format, [`FORMAT`].
    format: u32,
    /// Outcome: `complete`, or with fewer rows than requested `interrupted` (Ctrl-C) or `stopped`
    /// (an unsolved step under --on-failure stop).
    pub outcome: String,
    /// Version of tumble.
    pub tumble_version: String,
    /// Version of Ipopt; empty in a build without Ipopt.
    #[serde(default)]
    pub ipopt_version: String,
    /// True if wrenches, motors or states were set during the run. Such a run can be displayed but
    /// not verified.
    #[serde(default, skip_serializing_if = "std::ops::Not::not")]
    pub pushed: bool,
    /// Name of the scene.
    pub scene: String,
    /// Names of the settings changed by flags.
    #[serde(default)]
    pub changed: Vec<String>,
    /// Seed of random starts.
    pub seed: u32,
    /// True if the initial state depends on the seed.
    drawn: bool,
    /// Number of requested rows, including those between the rows of `substeps`.
    pub steps: u64,
    /// Steps per requested row (`--substeps`); omitted if 1.
    #[serde(default = "one", skip_serializing_if = "is_one")]
    pub substeps: u64,
    /// Start index k of the first row; omitted if 0.
    #[serde(default, skip_serializing_if = "is_zero")]
    pub start_index: u64,
    /// True if the run also writes trajectory.csv.
    #[serde(default, skip_serializing_if = "std::ops::Not::not")]
    pub trajectory: bool,
    /// Bodies, fixed pieces, constants and initial states, written as a scenario without files.
    #[serde(serialize_with = "reading::write_model", deserialize_with = "reading::read_model")]
    pub model: Document,
    /// Selection of rows in the files.
    #[serde(default, skip_serializing_if = "RowSelection::is_all")]
    pub kept: RowSelection,
    /// Solver and its settings.
    pub solver: SolverSettings,
    /// Summary of the steps.
    pub summary: SummaryFile,
    /// Largest overlap of all steps (m).
    pub largest_overlap_m: f64,
    /// Summary of the joints, for a model with joints.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub joints: Option<JointsSummary>,
    /// Joints that were too stiff in two consecutive steps, with a suitable time step.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub taut_joints: Vec<StiffJoint>,
    /// Names of the run's files. The next run may replace or remove these files.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub files: Vec<String>,
    /// Checksums of the tables by file name. The checksum of run.json itself is its last field.
    #[serde(default, skip_serializing_if = "Checksums::is_empty")]
    pub checksums: Checksums,
    /// Integrity of the file that was read.
    #[serde(skip)]
    pub seal: Seal,
}

/// Counts of the steps of a run by their result.
#[derive(Debug, Serialize, Deserialize)]
#[serde(expecting = "an object with the counts of the run")]
pub struct SummaryFile {
    /// Number of rows of a complete table: steps + 1.
    pub rows: u64,
    /// Steps in free flight.
    pub free_steps: u64,
    /// Steps with contacts.
    pub contact_steps: u64,
    /// Iterations of the solver, sum over all steps.
    pub iterations: u64,
    /// Steps solved from the first initial point.
    pub converged: u64,
    /// Steps solved from a later initial point.
    pub retried: u64,
    /// Steps solved by another solver.
    pub fallback: u64,
    /// Steps divided into shorter steps; 0 if an old file lacks the field.
    #[serde(default)]
    pub substepped: u64,
    /// Unphysical steps: they rotate too far or increase the energy. 0 if an old file lacks the
    /// field.
    #[serde(default)]
    pub wild: u64,
    /// Steps with reduced restitution, because full restitution would increase the energy; null if
    /// an old file lacks the field.
    #[serde(default)]
    pub tempered: Option<u64>,
    /// Steps with substeps that are less accurate than asked; left out if there are none.
    #[serde(default, skip_serializing_if = "is_zero")]
    pub coarse: u64,
    /// Steps in which impacts are closer than the error; left out if there are none.
    #[serde(default, skip_serializing_if = "is_zero")]
    pub ambiguous: u64,
    /// Steps that were not solved.
    pub failed: u64,
    /// Number of contact steps per rung of Ipopt's ladder; empty without the ladder.
    ///
    /// An unsolved step counts on the rung of its best point.
    pub rungs: BTreeMap<String, u64>,
    /// Median residual of the contact steps (m/s); null without contact.
    pub certificate_median_m_s: Option<f64>,
    /// Largest residual of all steps (m/s); null without steps.
    pub certificate_max_m_s: Option<f64>,
    /// Wall-clock time of the steps (s).
    pub solve_seconds: f64,
}

/// Title of a run: the name of the scene and its changed settings.
///
/// The tutorial's scenes have "scene" after their names.
pub fn heading(scene: &str, changed: &[String]) -> String {
    /// Maximum number of names in the title; more names are counted.
    const MOST_NAMED: usize = 4;
    let of_tutorial =
        [tutorial::TutorialScene::drop().name, tutorial::TutorialScene::floating().name]
            .contains(&scene);
    let name = if of_tutorial { format!("{scene} scene") } else { scene.to_owned() };
    match changed {
        [] => name,
        few if few.len() <= MOST_NAMED => format!("{name} with changed {}", few.join(", ")),
        many => format!("{name} with {} changed settings", many.len()),
    }
}

impl SummaryFile {
    /// Summary of a run. With `climbs` it includes the rungs of Ipopt's ladder.
    fn new(run: &RunEnd<'_>, climbs: bool) -> Self {
        let summary = run.summary;
        let starts = summary.starts.iter().filter(|_| climbs);
        let rungs = starts.map(|(start, count)| (start.to_string(), *count)).collect();
        Self {
            rows: summary.steps() + 1,
            free_steps: summary.free,
            contact_steps: summary.contact_steps(),
            iterations: summary.iterations,
            converged: summary.converged,
            retried: summary.retried,
            fallback: summary.fallback,
            substepped: summary.substepped,
            wild: summary.wild,
            tempered: Some(summary.tempered),
            coarse: summary.coarse,
            ambiguous: summary.ambiguous,
            failed: summary.failed,
            rungs,
            certificate_median_m_s: summary.median_residual(),
            certificate_max_m_s: summary.largest_residual(),
            solve_seconds: run.seconds,
        }
    }
}

/// Version of the format. Files without one have the first.
pub const FORMAT: u32 = 2;

/// Maximum size of a run.json (bytes).
pub const LARGEST_FILE: u64 = 1 << 28;

impl RunFile {
    /// Content of run.json for a run of `scene`.
    ///
    /// # Errors
    /// A solver that does not support the scene.
    pub fn new(scene: &Scene, run: &RunEnd<'_>) -> Result<Self, Failure> {
        let climbs = scene.contact.as_ref().is_some_and(SolverChoice::climbs);
        let mut model = scene.document.clone();
        model.drop_draws_unless_from(scene.seed);
        Ok(Self {
            format: FORMAT,
            outcome: run.outcome.to_owned(),
            tumble_version: env!("CARGO_PKG_VERSION").to_owned(),
            ipopt_version: IPOPT_VERSION.to_owned(),
            pushed: false,
            scene: scene.name.clone(),
            changed: scene.changed.clone(),
            seed: scene.seed,
            drawn: model.is_drawn(),
            steps: scene.rows,
            substeps: scene.substeps,
            start_index: scene.start_index,
            kept: RowSelection::default(),
            solver: SolverSettings::new(scene.contact.as_ref(), &scene.world)?,
            summary: SummaryFile::new(run, climbs),
            largest_overlap_m: run.largest_overlap,
            trajectory: scene.trajectory,
            model,
            joints: run.joints,
            taut_joints: run.stiff_joints.joints(scene.world.time_step()),
            files: Vec::new(),
            checksums: Checksums::new(),
            seal: Seal::None,
        })
    }

    /// Content of run.json for a whole or partial run of `scene` with the given `rows`, which contain idle
    /// contacts or, with `loaded_contacts`, may lack them.
    ///
    /// The last row is a state without a step. The run counts as complete, starts at the first row and
    /// has no trajectory.csv. Returns `None` without rows.
    ///
    /// # Errors
    /// The errors of [`RunFile::new`].
    pub fn from_rows(
        scene: &Scene,
        rows: &[IntervalRows],
        loaded_contacts: bool,
    ) -> Result<Option<Self>, Failure> {
        let Some(first) = rows.first() else { return Ok(None) };
        let mut counts = RowCounts::new(scene.world.clone(), scene.courses.clone());
        rows.iter().for_each(|row| counts.add(row));
        let RowCounts { summary, joints, largest_overlap, stiff_joints, .. } = counts;
        let joints = (!scene.joints.is_empty()).then_some(joints);
        let end = RunEnd {
            outcome: "complete",
            summary: &summary,
            seconds: 0.0,
            largest_overlap,
            joints,
            stiff_joints: &stiff_joints,
        };
        let mut file = Self::new(scene, &end)?;
        file.trajectory = false;
        let lacks = |rows: &IntervalRows| rows.contacts.len() < rows.row.contacts;
        file.kept.loaded_contacts = loaded_contacts || rows.iter().any(lacks);
        file.start_index = first.row.index;
        file.steps = rows.iter().filter(|rows| rows.row.interval == 0).count() as u64;
        file.model
            .start_at(first.instant_states(), first.row.index as f64 * scene.world.time_step())?;
        file.model.drop_draws_unless_from(scene.seed);
        file.drawn = file.model.is_drawn();
        Ok(Some(file))
    }

    /// Error message if the seed does not reproduce the random starts of the bodies.
    pub fn seed_mismatch(&self) -> Option<String> {
        if self.drawn != self.model.is_drawn() {
            return Some("drawn contradicts the starts of the bodies".to_owned());
        }
        let (seed, body) = (self.seed, shown::line(self.model.seed_mismatch(self.seed)?));
        Some(format!("the seed {seed} draws a different start of {body}"))
    }

    /// Seed of a random start; `None` if the start does not depend on it.
    pub fn drawn_seed(&self) -> Option<u32> {
        self.drawn.then_some(self.seed)
    }

    /// Names of the bodies.
    pub fn bodies(&self) -> Vec<&str> {
        self.model.bodies.iter().map(|body| body.name()).collect()
    }

    /// This content without model and checksums, with `notes`, as one JSON object in a line.
    ///
    /// # Errors
    /// None for a value made by [`RunFile::new`].
    pub fn summary_text(&self, notes: &[String]) -> Result<String, Failure> {
        let mut summary = serde_json::to_value(self)
            .map_err(|error| Failure::Other(format!("run.json cannot be written: {error}")))?;
        if let Some(fields) = summary.as_object_mut() {
            fields.retain(|name, _| name != "model" && name != "checksums");
            fields.insert("notes".to_owned(), notes.into());
        }
        Ok(format!("{summary}\n"))
    }

    /// Text of the file, with its checksum.
    ///
    /// # Errors
    /// None for a value made by [`RunFile::new`].
    pub fn text(&self) -> Result<String, Failure> {
        Ok(checksums::sealed(&json(self)?))
    }
}

fn one() -> u64 {
    1
}

fn is_one(count: &u64) -> bool {
    *count == 1
}

fn is_zero(number: &u64) -> bool {
    *number == 0
}

fn json(value: &impl Serialize) -> Result<String, Failure> {
    serde_json::to_string_pretty(value)
        .map(|json| json + "\n")
        .map_err(|error| Failure::Other(format!("run.json cannot be created: {error}")))
}

/// Checks that the run.json of a document is small enough to be read.
///
/// # Errors
/// A document whose run.json would exceed [`LARGEST_FILE`].
pub fn refuse_large(document: &Document) -> Result<(), Failure> {
    /// Allowance for the rest of the file (bytes).
    const REST: u64 = 1 << 16;
    let length = json(&crate::written::table(document)?)?.len() as u64;
    if length + REST <= LARGEST_FILE {
        return Ok(());
    }
    Err(Failure::Input(format!(
        "shapes: the scene has {length} bytes in run.json; allowed: up to {LARGEST_FILE}; use \
         fewer bodies, or fewer or coarser meshes and hulls"
    )))
}
