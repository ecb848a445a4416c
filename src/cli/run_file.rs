//! `run.json`: what made the rows, and what came of it.

use super::choices::{Inertia, Shape};
use super::fields::{self, Exactly, Numbers};
use super::joints::JointsSummary;
use super::outcome::Failure;
use super::run::Run;
use super::scene::{OutputFormat, Scene};
use super::{input, shown};
use nalgebra::Vector3;
use serde::{Deserialize, Serialize};
use std::collections::BTreeMap;
use std::path::Path;
use tumble::mechanics::body::box_corners;
use tumble::mechanics::{Load, Rotation, State};
use tumble::scenario::contact::Contact;
use tumble::scenario::fields::{by_rows, matrix, numbers};
use tumble::scenario::model::Model;
use tumble::scenario::parameters::{LoadParameters, PlaneParameters, unnamed_rotation};
use tumble::scenario::physics::plane;
use tumble::scenario::settings::Settings;
use tumble::simulation::scene as tutorial;
use tumble::solver::ipopt::{self, LADDER_RESIDUAL};
use tumble::solver::native;
use tumble::step_nlp::{SMOOTHING, StepNlp};
use tumble::world::{Plane, World};

/// A run.json in either format: with `parameters` and `start` of one body, or with a `model`.
#[derive(Debug, Serialize, Deserialize)]
#[serde(expecting = "an object with the fields of a run.json")]
pub struct RunFile {
    /// `complete`; `interrupted` (Ctrl-C) or `stopped` (a failed step under --on-failure
    /// stop) where there are fewer rows than asked for.
    pub outcome: String,
    pub tumble_version: String,
    #[serde(default)]
    pub ipopt_version: String,
    pub scene: String,
    /// The settings of the scene for which flags gave other values.
    #[serde(default)]
    pub changed: Vec<String>,
    pub seed: u32,
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub parameters: Option<RunParameters>,
    /// Whether anything of the start is drawn from the seed.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    drawn: Option<bool>,
    /// Rows asked for.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub steps: Option<u64>,
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub model: Option<Model>,
    pub solver: SolverSettings,
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub start: Option<StartState>,
    pub summary: SummaryFile,
    /// m, of all steps.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub largest_overlap_m: Option<f64>,
    /// Of a model with joints.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub joints: Option<JointsSummary>,
}

/// The part of a run.json that says which format it is of.
#[derive(Deserialize)]
struct Kind {
    model: Option<serde::de::IgnoredAny>,
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
    /// Whether the body is the box whose corners they are, and not made of points.
    #[serde(default)]
    is_box: bool,
    /// Null without one.
    #[serde(default)]
    pub load: Option<LoadParameters>,
}

#[derive(Debug, Serialize, Deserialize)]
#[serde(expecting = "an object with the solver's name and settings")]
pub struct SolverSettings {
    pub name: String,
    /// What all of the others were said by, if a preset was.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub preset: Option<String>,
    /// Of Ipopt's program; null for others.
    #[serde(default)]
    pub formulation: Option<String>,
    pub detection: Option<String>,
    pub on_failure: Option<String>,
    pub tol: Option<f64>,
    pub max_iter: Option<u32>,
    /// The residual that a contact step may have that counts as solved, m/s: what the solver
    /// promises. A file of before it was written has none.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub accepted_residual_m_s: Option<f64>,
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
    /// Steps that took a part of the restitution, because the whole would make energy; null in a
    /// file of before they were counted.
    #[serde(default)]
    pub tempered: Option<u64>,
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

impl StartState {
    fn state(&self) -> State {
        State {
            position: self.position.0.into(),
            attitude: self.attitude.0.into(),
            velocity: self.velocity.0.into(),
            spin: self.spin.0.into(),
        }
    }
}

impl RunParameters {
    /// Those of `world`, whose one body is pushed by `load`, and of so many `rows`.
    pub fn of(world: &World, load: &Load, rows: u64) -> Self {
        let body = &world.bodies()[0];
        Self {
            steps: rows,
            dt: world.time_step(),
            rotation: world.rotation(),
            mu: world.friction(),
            restitution: world.restitution(),
            rebound_speed: world.given_rebound_speed(),
            mass: body.mass(),
            inertia: by_rows(body.inertia()),
            gravity: numbers(world.gravity()),
            epsilon: SMOOTHING,
            plane: plane(&world.ground().cloned().unwrap_or_default()),
            contact_points: body.contact_points().iter().map(|c| numbers(&c.position)).collect(),
            // A box is the only piece that a body of this notation may be.
            is_box: !body.pieces().is_empty(),
            load: (!load.is_none()).then(|| LoadParameters::of(load)),
        }
    }

    /// As settings, under which flags may be laid.
    pub fn settings(&self) -> Result<Settings, Failure> {
        let load = self.load.as_ref().map_or(Ok(Load::none()), LoadParameters::load)?;
        let points: Vec<Vector3<f64>> = self.contact_points.iter().map(|c| c.0.into()).collect();
        let half = points.iter().fold(Vector3::zeros(), |half: Vector3<f64>, c| half.sup(&c.abs()));
        // Whatever is said of them, points that are no corners are points.
        let shape = match self.is_box && points == box_corners(&half) {
            true => Shape::Box(2.0 * half),
            false => Shape::Points(points),
        };
        Ok(Settings {
            dt: Some(self.dt),
            rotation: Some(self.rotation),
            mu: Some(self.mu),
            restitution: Some(self.restitution),
            rebound_speed: self.rebound_speed,
            mass: Some(self.mass),
            inertia: Some(Inertia::Matrix(matrix(&self.inertia))),
            gravity: Some(self.gravity.0.into()),
            shape: Some(shape),
            plane: Some(Plane::new(self.plane.normal.0.into(), self.plane.offset)?),
            force: Some(load.force.clone()),
            torque: Some(load.torque.clone()),
            force_at: Some(*load.point()),
            ..Settings::default()
        })
    }
}

impl SolverSettings {
    fn of(scene: &Scene) -> Result<Self, Failure> {
        let contact = scene.contact.as_ref();
        let ipopt = contact.and_then(|contact| contact.ipopt.as_ref());
        let solver = contact.map(|contact| contact.solver(&scene.world)).transpose()?;
        Ok(Self {
            name: scene.solver().to_owned(),
            preset: contact.and_then(|contact| Some(contact.preset?.name().to_owned())),
            formulation: ipopt.map(|(formulation, _)| formulation.name().to_owned()),
            detection: contact.map(|contact| contact.detection.name().to_owned()),
            on_failure: contact.map(|contact| contact.on_failure.name().to_owned()),
            tol: ipopt.map(|(_, options)| options.tolerance),
            max_iter: ipopt.map(|(_, options)| options.max_iterations),
            accepted_residual_m_s: Some(solver.map_or(0.0, |solver| solver.accepted_residual())),
        })
    }

    /// The residual that a contact step of `world` may have that counts as solved, m/s: what its
    /// solver holds its steps to. Where the file does not say it, the name must be known.
    pub fn accepted_residual(&self, world: &World) -> Result<f64, String> {
        if let Some(accepted) = self.accepted_residual_m_s {
            return match accepted >= 0.0 {
                true => Ok(accepted),
                false => Err(format!(
                    "solver.accepted_residual_m_s is {}; a speed of 0 or more is needed",
                    shown::number(accepted)
                )),
            };
        }
        // The program of several bodies has the ladder's, with and without its other rungs.
        let ladder = || self.on_failure.as_deref() == Some("ladder");
        let accepted = match self.name.as_str() {
            "native" => native::ACCEPTED_RESIDUAL,
            "rk4" => 0.0,
            "ipopt" if ladder() || StepNlp::unsuitable(world).is_some() => LADDER_RESIDUAL,
            "ipopt" => ipopt::ACCEPTED_RESIDUAL,
            other => {
                return Err(format!(
                    "solver.name: {} is no solver of tumble; what it promises is needed in \
                     solver.accepted_residual_m_s",
                    shown::line(other)
                ));
            }
        };
        Ok(accepted * world.speed_scale())
    }
}

/// What is simulated, in words: the tutorial's scenes are called so, scenarios have names; and
/// what was changed in it.
pub fn heading(scene: &str, changed: &[String]) -> String {
    /// More names than this are only counted.
    const MOST_NAMED: usize = 4;
    let of_tutorial =
        [tutorial::Scene::drop().name, tutorial::Scene::floating().name].contains(&scene);
    let name = if of_tutorial { format!("{scene} scene") } else { scene.to_owned() };
    match changed {
        [] => name,
        few if few.len() <= MOST_NAMED => format!("{name} with changed {}", few.join(", ")),
        many => format!("{name} with {} changed settings", many.len()),
    }
}

impl SummaryFile {
    /// The summary of a run, with the starts of its steps where they are rungs of a ladder.
    fn of(run: &Run, climbs: bool) -> Self {
        let summary = &run.summary;
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
            wild: summary.wild,
            tempered: Some(summary.tempered),
            failed: summary.failed,
            rungs,
            certificate_median_m_s: summary.median_residual(),
            certificate_max_m_s: summary.largest_residual(),
            solve_seconds: run.elapsed.as_secs_f64(),
        }
    }
}

/// Characters of a name or a word.
const LONGEST_WORD: usize = 80;

/// More bytes than this are no run file.
const LARGEST_RUN_FILE: u64 = 16 << 20;

impl RunFile {
    /// That of a run of `scene`.
    pub fn of(scene: &Scene, run: &Run) -> Result<Self, Failure> {
        let climbs = scene.contact.as_ref().is_some_and(Contact::climbs);
        let (tables, one) = match &scene.format {
            OutputFormat::Tables(model) => (Some(model), None),
            OutputFormat::Trajectory => (None, Some((&scene.starts[0], &scene.loads[0]))),
        };
        let start = |start: &State| StartState {
            position: numbers(&start.position),
            random: scene.drawn,
            attitude: Exactly(start.attitude.into()),
            velocity: numbers(&start.velocity),
            spin: numbers(&start.spin),
        };
        Ok(Self {
            outcome: run.end.name().to_owned(),
            tumble_version: env!("CARGO_PKG_VERSION").to_owned(),
            ipopt_version: tumble::ipopt::VERSION.to_owned(),
            scene: scene.name.clone(),
            changed: scene.changed.clone(),
            seed: scene.seed,
            parameters: one.map(|(_, load)| RunParameters::of(&scene.world, load, scene.rows)),
            drawn: tables.map(|_| scene.drawn),
            steps: tables.map(|_| scene.rows),
            model: tables.map(|model| Model::clone(model)),
            solver: SolverSettings::of(scene)?,
            start: one.map(|(state, _)| start(state)),
            summary: SummaryFile::of(run, climbs),
            largest_overlap_m: tables.map(|_| run.overlap.map_or(0.0, |(_, overlap)| overlap)),
            joints: run.joints,
        })
    }

    /// The seed, where anything of the start was drawn from it.
    pub fn drawn_seed(&self) -> Option<u32> {
        let drawn = self.drawn.or(self.start.as_ref().map(|start| start.random));
        drawn.unwrap_or(false).then_some(self.seed)
    }

    /// Rows that were asked for; `None` in no file that was read.
    pub fn rows_asked(&self) -> Option<u64> {
        self.steps.or(self.parameters.as_ref().map(|parameters| parameters.steps))
    }

    /// The states at the start, one a body.
    pub fn starts(&self) -> Vec<State> {
        let of_one = self.start.iter().map(StartState::state);
        self.model.as_ref().map_or_else(|| of_one.collect(), Model::states)
    }

    /// The names of the bodies; one without a name where there is no model.
    pub fn bodies(&self) -> Vec<&str> {
        match &self.model {
            Some(model) => model.bodies.iter().map(|body| body.name.as_str()).collect(),
            None => vec![""],
        }
    }

    /// The file's text.
    pub fn text(&self) -> Result<String, Failure> {
        json(self)
    }

    /// `None` where there is no such file. Where there is none with a model, `lonely` may refuse
    /// what it should stand beside.
    pub fn read(
        path: &Path,
        lonely: impl FnOnce() -> Result<(), Failure>,
    ) -> Result<Option<Self>, Failure> {
        let odd = |why: &dyn std::fmt::Display| {
            Failure::Input(format!("{} is not a run.json: {why}", shown::path(path)))
        };
        let text = input::text(path, LARGEST_RUN_FILE);
        let kind = text.as_ref().ok().and_then(|text| serde_json::from_str(text).ok());
        if !matches!(kind, Some(Kind { model: Some(_) })) {
            lonely()?;
        }
        let text = match text {
            Ok(text) => text,
            Err(error) if error.kind() == std::io::ErrorKind::NotFound => return Ok(None),
            Err(error) => return Err(odd(&error)),
        };
        let file: Self = fields::json(&text).map_err(|why| odd(&why))?;
        if let Some(field) = file.missing() {
            return Err(odd(&format!("missing field `{field}`")));
        }
        match file.long_word() {
            None => Ok(Some(file)),
            Some(field) => {
                Err(odd(&format!("{field}: it has more than {LONGEST_WORD} characters")))
            }
        }
    }

    fn has_joints(&self) -> bool {
        self.model.as_ref().is_some_and(|model| !model.joints.is_empty())
    }

    /// The first field that its format has, and it has not.
    fn missing(&self) -> Option<&'static str> {
        let of_model = [
            ("drawn", self.drawn.is_none()),
            ("steps", self.steps.is_none()),
            ("largest_overlap_m", self.largest_overlap_m.is_none()),
            ("joints", self.joints.is_none() && self.has_joints()),
        ];
        let of_one = [("parameters", self.parameters.is_none()), ("start", self.start.is_none())];
        let fields = if self.model.is_some() { &of_model[..] } else { &of_one };
        fields.iter().find(|(_, missing)| *missing).map(|(field, _)| *field)
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
            ("solver.preset", solver.preset.as_ref()),
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
