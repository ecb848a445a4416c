//! A problem as a file: a text in TOML. `docs/planning.md` describes every field.

mod control;
mod tables;
mod target;

use super::{Leg, Method, PlanError, Problem, Sample, Shoot};
use crate::scenario::failure::Failure;
use crate::scenario::fields::Numbers;
use crate::scenario::scene::Scene;
use crate::scenario::settings::Settings;
use crate::scenario::{self, ReadFile, shown};
use nalgebra::Vector3;
use serde::Deserialize;
use std::path::{Path, PathBuf};
use tables::File;

/// What a problem's file says.
pub struct ProblemFile {
    /// The problem.
    pub problem: Problem,
    /// Where the search starts.
    pub start: Start,
    /// By which legs.
    pub legs: Vec<LegName>,
    /// How a sampling goes.
    pub sample: Sample,
    /// How a shooting goes.
    pub shoot: Shoot,
    /// The most time for the search, s, for a caller that has a clock.
    pub time: Option<f64>,
}

/// Where a search starts.
#[derive(Debug, Clone, PartialEq)]
pub enum Start {
    /// No forces, the scene's own starts and constants.
    Zero,
    /// A table of controls, beside the problem's file.
    File(PathBuf),
}

/// A leg by its word.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum LegName {
    /// [`Sample`].
    Sample,
    /// [`Shoot`], all controls at once.
    Shoot,
    /// [`Shoot`], stage by stage.
    Ddp,
    /// [`ProgramLeg`](super::program::ProgramLeg).
    #[cfg(feature = "ipopt")]
    Program,
    /// [`Polish`](super::Polish).
    #[cfg(feature = "ipopt")]
    Polish,
}

impl LegName {
    /// The leg, which draws as `sample` says and shoots as `shoot` does, by the method that its word says.
    #[must_use]
    pub fn leg(self, sample: Sample, shoot: Shoot) -> Box<dyn Leg> {
        match self {
            Self::Sample => Box::new(sample),
            Self::Shoot => Box::new(Shoot { method: Method::LevenbergMarquardt, ..shoot }),
            Self::Ddp => Box::new(Shoot { method: Method::DynamicProgramming, ..shoot }),
            #[cfg(feature = "ipopt")]
            Self::Program => Box::new(super::program::ProgramLeg::default()),
            #[cfg(feature = "ipopt")]
            Self::Polish => Box::new(super::Polish::default()),
        }
    }
}

/// The weight of an effort where none is given, N⁻².
const USUAL_EFFORT: f64 = 1e-4;

impl ProblemFile {
    /// What the file `path`, whose text is `text`, says; the scene's file and what it names are read by `read`.
    ///
    /// # Errors
    /// One sentence about the first thing that cannot be, with the file.
    pub fn of_text(text: &str, path: &Path, read: ReadFile<'_>) -> Result<Self, Failure> {
        let odd = |why: String| Failure::Input(format!("{}: {why}", shown::path(path)));
        let file: File = scenario::parse(text).map_err(odd)?;
        let folder = path.parent().unwrap_or(Path::new(""));
        let scene = folder.join(&file.scene);
        let bytes = read(&scene, scenario::LARGEST_FILE).map_err(|error| {
            odd(format!("scene: {} cannot be read: {error}", shown::path(&scene)))
        })?;
        let text = String::from_utf8(bytes)
            .map_err(|_| odd(format!("scene: {} is no text", shown::path(&scene))))?;
        let scene = Scene::of_text(&text, &scene, Settings::default(), read)?;
        Self::of_scene(scene, file, folder).map_err(odd)
    }

    /// What a text without a scene of its own says of `scene`.
    ///
    /// # Errors
    /// As [`ProblemFile::of_text`].
    pub fn of_scene_text(scene: Scene, text: &str) -> Result<Self, String> {
        let file: File = scenario::parse(text)?;
        Self::of_scene(scene, file, Path::new(""))
    }

    fn of_scene(scene: Scene, file: File, folder: &Path) -> Result<Self, String> {
        let steps = file.steps as usize;
        let effort = file.cost.effort.unwrap_or(USUAL_EFFORT);
        let named = |of: &str, index: usize, why: String| format!("{of}[{index}]: {why}");
        let controls = file.controls.into_iter().enumerate().map(|(index, table)| {
            table.control(&scene, steps, effort).map_err(|why| named("controls", index, why))
        });
        let controls = controls.collect::<Result<Vec<_>, _>>()?;
        let mut targets = Vec::new();
        for (index, table) in file.target.0.into_iter().enumerate() {
            let found = table.targets(&scene, steps);
            targets.extend(found.map_err(|why| named("target", index, why))?);
        }
        let mut keeps = Vec::new();
        for (index, table) in file.keep.0.into_iter().enumerate() {
            let found = table.keeps(&scene);
            keeps.extend(found.map_err(|why| named("keep", index, why))?);
        }
        let problem = Problem::new(scene, steps, controls, targets, keeps).map_err(plain)?;
        let search = file.search;
        let start = match search.start.as_deref() {
            None | Some("zero") => Start::Zero,
            Some(file) => Start::File(folder.join(file)),
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
        let legs = search.legs.unwrap_or_else(|| vec![LegName::Sample, LegName::Shoot]);
        Ok(Self { problem, start, legs, sample, shoot, time })
    }

    /// The legs, made.
    #[must_use]
    pub fn made_legs(&self) -> Vec<Box<dyn Leg>> {
        self.legs.iter().map(|leg| leg.leg(self.sample, self.shoot)).collect()
    }
}

fn plain(error: PlanError) -> String {
    error.to_string()
}

/// The body of a name; the only one where none is given.
fn body_of(scene: &Scene, name: Option<&str>) -> Result<usize, String> {
    match name {
        None if scene.bodies.len() == 1 => Ok(0),
        None => Err("body: it is not given, and the scene has several".to_owned()),
        Some(name) => scene.bodies.iter().position(|known| known == name).ok_or_else(|| {
            format!("body: the scene has none that is called {name:?}; it has {}", {
                let known: Vec<_> = scene.bodies.iter().take(8).cloned().collect();
                known.join(", ")
            })
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
