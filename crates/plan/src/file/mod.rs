//! Problem files in TOML; `docs/planning.md` describes every field.

mod control;
mod tables;
mod target;

use super::{Method, PlanError, PlanProblem, Sample, Shoot, Stage};
use nalgebra::Vector3;
use serde::Deserialize;
use std::path::{Path, PathBuf};
use tables::File;
use tumble_core::world::Integrator;
use tumble_model::failure::Failure;
use tumble_model::fields::Numbers;
use tumble_model::{ReadFile, shown};

use tumble_scene::scene::Scene;

/// Content of a problem file.
pub struct ProblemFile {
    /// The problem.
    pub problem: PlanProblem,
    /// Start of the search.
    pub start: SearchStart,
    /// Stages of the search, in their order.
    pub stages: Vec<StageName>,
    /// Settings of `sample`.
    pub sample: Sample,
    /// Settings of `shoot` and `ddp`.
    pub shoot: Shoot,
    /// Time limit of the search, s, for a caller with a clock.
    pub time: Option<f64>,
}

/// Start of a search.
#[derive(Debug, Clone, PartialEq)]
pub enum SearchStart {
    /// Forces of zero, and the scene's own starts and constants.
    Zero,
    /// A table of controls; a relative path starts at the folder of the problem file.
    File(PathBuf),
}

/// Name of a stage in files.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum StageName {
    /// [`Sample`].
    Sample,
    /// [`Shoot`] with [`Method::LevenbergMarquardt`].
    Shoot,
    /// [`Shoot`] with [`Method::DynamicProgramming`].
    Ddp,
}

impl StageName {
    /// Default stages `ddp`, `sample` and `shoot`, without stages that the problem is too large
    /// for.
    fn usual(problem: &PlanProblem, sample: Sample) -> Vec<Self> {
        let all = vec![Self::Ddp, Self::Sample, Self::Shoot];
        let fits = |name: &Self| name.build(sample, Shoot::default()).check(problem).is_ok();
        let fitting: Vec<_> = all.iter().copied().filter(fits).collect();
        // Without any stage left, the full list leads to the refusal of its first stage.
        if fitting.is_empty() { all } else { fitting }
    }

    /// Builds the stage with these settings; the name decides the method of a shooting.
    pub fn build(self, sample: Sample, shoot: Shoot) -> Box<dyn Stage> {
        match self {
            Self::Sample => Box::new(sample),
            Self::Shoot => Box::new(Shoot { method: Method::LevenbergMarquardt, ..shoot }),
            Self::Ddp => Box::new(Shoot { method: Method::DynamicProgramming, ..shoot }),
        }
    }
}

/// Default weight of effort, N⁻².
const USUAL_EFFORT: f64 = 1e-4;

impl ProblemFile {
    /// Parses the `text` of the problem file `path`; `read` reads the scene file and the files that it names.
    ///
    /// # Errors
    /// One sentence about the first fault, with the file's name.
    pub fn from_text(text: &str, path: &Path, read: ReadFile<'_>) -> Result<Self, Failure> {
        let bad_input = |why: String| Failure::Input(format!("{}: {why}", shown::path(path)));
        let file: File = tumble_scene::parse(text).map_err(bad_input)?;
        let folder = path.parent().unwrap_or(Path::new(""));
        let scene = folder.join(&file.scene);
        let bytes = read(&scene, tumble_scene::LARGEST_FILE).map_err(|error| {
            bad_input(format!("scene: {} cannot be read: {error}", shown::path(&scene)))
        })?;
        let text = String::from_utf8(bytes)
            .map_err(|_| bad_input(format!("scene: {} is not UTF-8 text", shown::path(&scene))))?;
        // The scene of a problem file runs in the plan only.
        let mut scene = Scene::from_text(&text, &scene, &[], read)?;
        scene.use_integrator(Integrator::Euler);
        Self::from_scene(scene, file, folder).map_err(bad_input)
    }

    /// Parses the `text` of a problem of `scene`; the field `scene` of the text is ignored.
    ///
    /// # Errors
    /// As [`ProblemFile::from_text`].
    pub fn from_scene_text(scene: Scene, text: &str) -> Result<Self, String> {
        let file: File = tumble_scene::parse(text)?;
        Self::from_scene(scene, file, Path::new(""))
    }

    fn from_scene(scene: Scene, file: File, folder: &Path) -> Result<Self, String> {
        let steps = file.steps as usize;
        let effort = file.cost.effort.unwrap_or(USUAL_EFFORT);
        let named = |of: &str, index: usize, why: String| format!("{of}[{index}]: {why}");
        let controls = file.controls.into_iter().enumerate().map(|(index, table)| {
            table.control(&scene, steps, effort).map_err(|why| named("controls", index, why))
        });
        let controls = controls.collect::<Result<Vec<_>, _>>()?;
        // Controls, targets and path constraints, with their place in messages
        let mut targets = Vec::new();
        for (index, table) in file.target.0.into_iter().enumerate() {
            let found = table.targets(&scene, steps);
            targets.extend(found.map_err(|why| named("target", index, why))?);
        }
        let mut path_constraints = Vec::new();
        for (index, table) in file.path_constraints.0.into_iter().enumerate() {
            let found = table.path_constraints(&scene);
            path_constraints.extend(found.map_err(|why| named("path_constraints", index, why))?);
        }
        let problem =
            PlanProblem::new(scene, steps, controls, targets, path_constraints).map_err(plain)?;
        // Settings of the search, or their defaults
        let search = file.search;
        let start = match search.start.as_deref() {
            None | Some("zero") => SearchStart::Zero,
            Some(file) => SearchStart::File(folder.join(file)),
        };
        let usual = Sample::default();
        let sample = Sample {
            seed: file.seed.unwrap_or(usual.seed),
            runs: search.runs.map(u64::from),
            knots: search.knots.map_or(usual.knots, usize::from),
            rounds: search.rounds.map_or(usual.rounds, u32::from),
        };
        if sample.knots == 0 || sample.rounds == 0 || sample.runs == Some(0) {
            return Err("search: runs, knots and rounds of 1 or more are needed".to_owned());
        }
        let usual = Shoot::default();
        let shoot =
            Shoot { iterations: search.iterations.map_or(usual.iterations, u64::from), ..usual };
        let time = search.time;
        if time.is_some_and(|time| !(time > 0.0 && time.is_finite())) {
            return Err("search.time: a number above 0 is needed".to_owned());
        }
        let stages = search.stages.unwrap_or_else(|| StageName::usual(&problem, sample));
        Ok(Self { problem, start, stages, sample, shoot, time })
    }

    /// Refuses an empty list of stages for a search from [`SearchStart::Zero`], which would choose nothing.
    ///
    /// # Errors
    /// One sentence.
    pub fn check_stages(&self) -> Result<(), String> {
        if self.stages.is_empty() && self.start == SearchStart::Zero {
            return Err("search.stages: the list is empty, and there are no initial controls; \
                        \"ddp\", \"sample\" or \"shoot\" is needed"
                .to_owned());
        }
        Ok(())
    }

    /// Stages with their settings, in their order. Each further `sample` has the next seed.
    pub fn built_stages(&self) -> Vec<Box<dyn Stage>> {
        let mut sample = self.sample;
        let build = |name: &StageName| {
            let stage = name.build(sample, self.shoot);
            sample.seed = sample.seed.wrapping_add(u64::from(*name == StageName::Sample));
            stage
        };
        self.stages.iter().map(build).collect()
    }
}

fn plain(error: PlanError) -> String {
    error.to_string()
}

/// Index of a body by its name; the only body without a name.
fn body_of(scene: &Scene, name: Option<&str>) -> Result<usize, String> {
    match name {
        None if scene.bodies.len() == 1 => Ok(0),
        None => Err("body: a name is needed, because the scene has several bodies".to_owned()),
        Some(name) => scene.bodies.iter().position(|known| known == name).ok_or_else(|| {
            let known = &scene.bodies[..scene.bodies.len().min(8)];
            format!("body: unknown body {name:?}; the scene has {}", known.join(", "))
        }),
    }
}

fn unit(of: &str, vector: &Numbers<3>) -> Result<Vector3<f64>, String> {
    let vector = Vector3::from(vector.0);
    let norm = vector.norm();
    if norm > 1e-6 && norm < 1e6 {
        return Ok(vector / norm);
    }
    Err(format!("{of}: a vector of a length from 1e-6 to 1e6 is needed"))
}
