//! `run.json`: what made the rows, and what came of it.

mod checksums;
mod reading;
mod solver;

pub use checksums::{Checksums, Seal, Summed, checksum_of};
pub use solver::SolverSettings;

use super::joints_summary::{JointsSummary, Taut, TautJoint};
use super::kept::KeptSteps;
use super::scene::Scene;
use super::solver_choice::{IPOPT_VERSION, SolverChoice};
use crate::output::tables::{JointRow, StepRow, TableStep};
use serde::{Deserialize, Serialize};
use std::collections::BTreeMap;
use tumble_core::simulation::scene as tutorial;
use tumble_core::simulation::summary::{RunSummary, StatusCount};
use tumble_model::Model;
use tumble_model::failure::Failure;
use tumble_model::shown;

/// What a run came to, beside its rows.
#[derive(Debug, Clone, Copy)]
pub struct RunEnd<'a> {
    /// See [`RunFile::outcome`].
    pub outcome: &'a str,
    /// Of its steps.
    pub summary: &'a RunSummary,
    /// Of the stepping alone, s; 0 where nobody looked at a clock.
    pub seconds: f64,
    /// The largest overlap of all steps, m.
    pub largest_overlap: f64,
    /// Of a scene with joints.
    pub joints: Option<JointsSummary>,
    /// The joints that were too stiff for the time step.
    pub taut: &'a Taut,
}

/// A run.json.
#[derive(Debug, Serialize, Deserialize)]
#[serde(expecting = "an object with the fields of a run.json")]
pub struct RunFile {
    /// `complete`; `interrupted` (Ctrl-C) or `stopped` (a failed step under --on-failure
    /// stop) where there are fewer rows than asked for.
    pub outcome: String,
    /// The version of tumble that made it.
    pub tumble_version: String,
    /// That of Ipopt; empty where tumble was built without.
    #[serde(default)]
    pub ipopt_version: String,
    /// Whether more moved the bodies than the file says: wrenches, motors or states that were set on the way. Such a run
    /// can be shown, and not be verified.
    #[serde(default, skip_serializing_if = "std::ops::Not::not")]
    pub pushed: bool,
    /// What the scene is called.
    pub scene: String,
    /// The settings of the scene for which flags gave other values.
    #[serde(default)]
    pub changed: Vec<String>,
    /// What the start was drawn from, where anything was.
    pub seed: u32,
    /// Whether anything of the start is drawn from the seed.
    drawn: bool,
    /// Requested rows, those between the rows of `substeps` counted.
    pub steps: u64,
    /// Steps of one requested row (`--substeps`); not written where it is 1.
    #[serde(default = "one", skip_serializing_if = "is_one")]
    pub substeps: u64,
    /// k of the first row; not written where it is 0.
    #[serde(default, skip_serializing_if = "is_zero")]
    pub start_index: u64,
    /// Whether the rows are trajectory.csv instead of the tables.
    #[serde(default, skip_serializing_if = "std::ops::Not::not")]
    pub trajectory: bool,
    /// Bodies, fixed pieces, constants and starts.
    pub model: Model,
    /// Which rows stand in the files.
    #[serde(default, skip_serializing_if = "KeptSteps::is_all")]
    pub kept: KeptSteps,
    /// Who solved the steps.
    pub solver: SolverSettings,
    /// What came of it.
    pub summary: SummaryFile,
    /// Largest overlap of all steps, m; none for a trajectory.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub largest_overlap_m: Option<f64>,
    /// Of a model with joints.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub joints: Option<JointsSummary>,
    /// The joints that were too stiff for the time step in two steps running, with the time step that would do.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub taut_joints: Vec<TautJoint>,
    /// The names of the run's files: what the next run may replace or remove.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub files: Vec<String>,
    /// Of the tables, by their files' names. A run.json has one of itself too, its last field.
    #[serde(default, skip_serializing_if = "Checksums::is_empty")]
    pub checksums: Checksums,
    /// Whether what was read is as it was written.
    #[serde(skip)]
    pub seal: Seal,
}

/// How the steps of a run ended.
#[derive(Debug, Serialize, Deserialize)]
#[serde(expecting = "an object with the counts of the run")]
pub struct SummaryFile {
    /// Rows of the file, where it has all of them: steps, and one.
    pub rows: u64,
    /// Steps in free flight.
    pub free_steps: u64,
    /// Steps with contacts.
    pub contact_steps: u64,
    /// Of the solver, of all steps.
    pub iterations: u64,
    /// Steps solved from the first start.
    pub converged: u64,
    /// From a later one.
    pub retried: u64,
    /// By another solver.
    pub fallback: u64,
    /// In shorter steps; none in a file of before they were counted.
    #[serde(default)]
    pub substepped: u64,
    /// Steps that turn too far or make energy; none in a file of before they were counted.
    #[serde(default)]
    pub wild: u64,
    /// Steps that took a part of the restitution, because the whole would make energy; null in a
    /// file of before they were counted.
    #[serde(default)]
    pub tempered: Option<u64>,
    /// Not solved.
    pub failed: u64,
    /// Contact steps by the rung of Ipopt's ladder that their solution came from; a failed step
    /// counts on that of the best point. Empty without the ladder.
    pub rungs: BTreeMap<String, u64>,
    /// The residual, of the contact steps; null without contact.
    pub certificate_median_m_s: Option<f64>,
    /// Of all steps; null without steps.
    pub certificate_max_m_s: Option<f64>,
    /// Of the stepping alone.
    pub solve_seconds: f64,
}

/// What is simulated, in words: the tutorial's scenes are called so, scenarios have names; and
/// what was changed in it.
#[must_use]
pub fn heading(scene: &str, changed: &[String]) -> String {
    /// More names than this are only counted.
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
    /// The summary of a run, with the starts of its steps where they are rungs of a ladder.
    fn of(run: &RunEnd<'_>, climbs: bool) -> Self {
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
            failed: summary.failed,
            rungs,
            certificate_median_m_s: summary.median_residual(),
            certificate_max_m_s: summary.largest_residual(),
            solve_seconds: run.seconds,
        }
    }
}

/// More bytes than this are no run file.
pub const LARGEST_FILE: u64 = 1 << 28;

impl RunFile {
    /// That of a run of `scene`.
    ///
    /// # Errors
    /// A solver that is not made for the scene.
    pub fn of(scene: &Scene, run: &RunEnd<'_>) -> Result<Self, Failure> {
        let climbs = scene.contact.as_ref().is_some_and(SolverChoice::climbs);
        let mut model = scene.model.clone();
        model.keep_draws_of(scene.seed);
        Ok(Self {
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
            kept: KeptSteps::default(),
            solver: SolverSettings::of(scene.contact.as_ref(), &scene.world)?,
            summary: SummaryFile::of(run, climbs),
            largest_overlap_m: (!scene.trajectory).then_some(run.largest_overlap),
            trajectory: scene.trajectory,
            model,
            joints: run.joints,
            taut_joints: run.taut.joints(scene.world.time_step()),
            files: Vec::new(),
            checksums: Checksums::new(),
            seal: Seal::None,
        })
    }

    /// That of a run of `scene`, or of a part of one, whose rows these are, a state without a step at last: it
    /// begins with the first of them and is complete, whatever was asked for. None without rows.
    ///
    /// # Errors
    /// As [`RunFile::of`].
    pub fn of_rows(scene: &Scene, rows: &[TableStep]) -> Result<Option<Self>, Failure> {
        let Some(first) = rows.first() else { return Ok(None) };
        let (mut summary, mut joints) = (RunSummary::default(), JointsSummary::default());
        let (mut largest_overlap, mut world) = (0.0_f64, scene.world.clone());
        let mut taut = Taut::default();
        for (place, step) in rows.iter().enumerate() {
            let StepRow { index, status, iterations, residual, restitution_share, .. } = step.row;
            let part = "";
            summary.count(&StatusCount {
                index,
                status,
                iterations,
                residual,
                part,
                restitution_share,
            });
            largest_overlap = largest_overlap.max(step.row.overlap);
            if place > 0 {
                world.follow(&scene.courses, index as f64 * world.time_step());
                joints.add_errors(&world, &step.states);
            }
            joints.add_stiffness(step.row.stiffness);
            for joint in &step.joints {
                joints.add_residual(joint.residual.locked, joint.residual.drive);
            }
            for (gear, of) in step.gears.iter().zip(world.gears()) {
                joints.add_gear(of, gear.residual);
            }
            world.follow(&scene.courses, (index + 1) as f64 * world.time_step());
            let forces: Vec<_> = step.joints.iter().map(JointRow::forces).collect();
            let gears: Vec<_> = step.gears.iter().map(|gear| gear.force).collect();
            taut.add(&world, &step.states, &forces, &gears, step.row.stiffness);
        }
        let joints = (!scene.joints.is_empty()).then_some(joints);
        let (outcome, summary, seconds) = ("complete", &summary, 0.0);
        let mut file = Self::of(
            scene,
            &RunEnd { outcome, summary, seconds, largest_overlap, joints, taut: &taut },
        )?;
        file.start_index = first.row.index;
        file.steps = rows.len() as u64;
        file.model.start_at(&first.states, first.row.index as f64 * scene.world.time_step())?;
        file.model.keep_draws_of(scene.seed);
        file.drawn = file.model.is_drawn();
        Ok(Some(file))
    }

    /// What is wrong with what the file says was drawn from the seed into the starts of a model's bodies.
    #[must_use]
    pub fn drawn_otherwise(&self) -> Option<String> {
        if self.drawn != self.model.is_drawn() {
            return Some("drawn is not what its bodies say of their starts".to_owned());
        }
        let (seed, body) = (self.seed, shown::line(self.model.drawn_otherwise(self.seed)?));
        Some(format!("the seed {seed} draws another start of {body} than its own"))
    }

    /// The seed, where anything of the start was drawn from it.
    #[must_use]
    pub fn drawn_seed(&self) -> Option<u32> {
        self.drawn.then_some(self.seed)
    }

    /// The names of the bodies.
    #[must_use]
    pub fn bodies(&self) -> Vec<&str> {
        self.model.bodies.iter().map(|body| body.name.as_str()).collect()
    }

    /// The file's text, with its checksum.
    ///
    /// # Errors
    /// None for what [`RunFile::of`] made.
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

fn is_zero(index: &u64) -> bool {
    *index == 0
}

fn json(value: &impl Serialize) -> Result<String, Failure> {
    serde_json::to_string_pretty(value)
        .map(|json| json + "\n")
        .map_err(|error| Failure::Other(format!("run.json cannot be made: {error}")))
}

/// Refuses a model that makes a longer run.json than is read again.
///
/// # Errors
/// Such a model.
pub fn refuse_large(model: &Model) -> Result<(), Failure> {
    /// What besides the model stands in the file.
    const REST: u64 = 1 << 16;
    let length = json(model)?.len() as u64;
    if length + REST <= LARGEST_FILE {
        return Ok(());
    }
    Err(Failure::Input(format!(
        "shapes: the scene has {length} bytes in run.json, of which at most {LARGEST_FILE} are \
         read; fewer bodies, or fewer or coarser meshes and hulls, are needed"
    )))
}
