//! What a scenario file and flags amount to.

use super::entries::{Files, ReadFile, SeveralFile};
use super::model::Model;
use super::scene::{self, Built};
use crate::contact::Candidates;
use crate::error::Error;
use crate::mechanics::Rotation;
use crate::scenario;
use crate::scenario::choices::SolverName;
use crate::scenario::contact::Contact;
use crate::scenario::failure::{Failure, refuse_flags};
use crate::scenario::job::USUAL_SEED;
use crate::scenario::physics::violent_load;
use crate::scenario::settings::Settings;
use crate::simulation::Simulation;
use crate::world::World;
use nalgebra::Vector3;
use std::path::Path;
use std::sync::Arc;
use std::sync::atomic::AtomicBool;

/// A simulation of several bodies.
pub struct Job {
    /// What is simulated.
    pub name: String,
    /// The settings for which flags gave other values than the file.
    pub changed: Vec<String>,
    /// The seed.
    pub seed: u32,
    /// Whether anything was drawn from the seed.
    pub drawn: bool,
    /// Rows of the trajectory: one more than there are steps.
    pub rows: u64,
    /// The bodies and constants.
    pub model: Model,
    /// The world of the model.
    pub world: World,
    /// How contact steps are solved.
    pub contact: Contact,
    /// Whether the solver is the usual one, for want of another.
    pub usual_solver: bool,
}

/// The solver of several bodies where none is named.
const USUAL_SOLVER: SolverName = SolverName::Native;

impl Job {
    /// The job of the scenario `path`, whose text is `text`, under `flags`. The files of its meshes
    /// are read by `read`.
    ///
    /// # Errors
    /// The first thing that cannot be.
    pub fn of(
        flags: Settings,
        path: &Path,
        text: &str,
        read: ReadFile<'_>,
    ) -> Result<Self, Failure> {
        let mut file: SeveralFile = scenario::parse(text).map_err(Failure::Input)?;
        let name = scenario::name(file.name.take(), path).map_err(Failure::Input)?;
        let below = settings(&mut file).map_err(Failure::Input)?;
        let changed = flags.changed(&below);
        let settings = flags.over(below);
        let folder = path.parent().unwrap_or(Path::new(""));
        let Built { model, drawn } =
            scene::build(file, &settings, Files { folder, read }).map_err(Failure::Input)?;
        let world = model.world()?;
        refuse_preset(&settings)?;
        let contact = Contact::new(&settings, USUAL_SOLVER)?;
        // Whether there is one for this world, before anything is written.
        contact.solver(&world)?;
        let rows = settings.steps.ok_or_else(|| Failure::needed("steps"))?;
        let job = Self {
            name,
            changed,
            seed: settings.seed.unwrap_or(USUAL_SEED),
            drawn,
            rows,
            model,
            world,
            contact,
            usual_solver: settings.solver.is_none(),
        };
        for (index, load) in job.model.loads()?.iter().enumerate() {
            let body = &job.world.bodies()[index];
            if let Some(why) = violent_load(body, load, job.world.time_step()) {
                let name = &job.model.bodies[index].name;
                return Err(Failure::Input(format!("load of {name}: {why}")));
            }
        }
        job.refuse_start_below_ground()?;
        job.refuse_overlap()?;
        Ok(job)
    }

    /// A simulation from the start, which ends when `interrupt` is raised.
    ///
    /// # Errors
    /// What the library refuses.
    pub fn simulation(&self, interrupt: &Arc<AtomicBool>) -> Result<Simulation<'static>, Failure> {
        let motion = self.contact.motion(&self.world)?;
        let mut simulation = Simulation::new(self.world.clone(), self.model.states(), motion)?;
        for (index, load) in self.model.loads()?.into_iter().enumerate() {
            simulation.set_load(index, load)?;
        }
        simulation.interrupt_by(Arc::clone(interrupt));
        Ok(simulation)
    }

    /// What is inside the ground would be thrown out of it within one step.
    fn refuse_start_below_ground(&self) -> Result<(), Failure> {
        for (index, state) in self.model.states().iter().enumerate() {
            let heights = self.world.heights(index, &state.pose());
            let lowest = heights.fold(f64::INFINITY, f64::min);
            let reach = self.world.bodies()[index].reach();
            // A NaN is above nothing.
            let is_above = lowest >= -OVERLAP_AT_THE_START * reach;
            if !is_above {
                return Err(Failure::Input(format!(
                    "position: {} would start {:.3e} m below the ground; allowed is to touch",
                    self.model.bodies[index].name, -lowest
                )));
            }
        }
        Ok(())
    }

    /// Pieces that overlap would fly apart in the first step.
    fn refuse_overlap(&self) -> Result<(), Failure> {
        let deepest = Candidates::new().deepest_overlap(&self.world, &self.model.states());
        let Some((depth, first, second)) = deepest else { return Ok(()) };
        if depth <= OVERLAP_AT_THE_START * self.world.reach() {
            return Ok(());
        }
        let [first, second] = [first, second].map(|partner| self.model.name(partner).to_owned());
        Err(Failure::Input(format!("position: {}", Error::Overlap { first, second, depth })))
    }
}

/// What rounding and the digits of a file may leave, in parts of the reach: the library's own rule.
const OVERLAP_AT_THE_START: f64 = 1e-6;

/// What the file says, but for the bodies.
fn settings(file: &mut SeveralFile) -> Result<Settings, String> {
    let steps = file.steps.unwrap_or(1000);
    if !(1..=10_000_000).contains(&steps) {
        return Err(format!("steps is {steps}; allowed is 1 to 10000000"));
    }
    let mut below = Settings {
        steps: Some(steps),
        seed: Some(file.seed.unwrap_or(USUAL_SEED)),
        dt: Some(file.time_step.unwrap_or(0.002)),
        rotation: Some(file.rotation.unwrap_or(Rotation::Momentum)),
        ..Settings::default()
    };
    let gravity = file.gravity.take().map(|gravity| gravity.vector());
    below.gravity = Some(gravity.unwrap_or(Vector3::new(0.0, 0.0, -9.81)));
    let Some(ground) = file.ground.take() else {
        return Err(
            "ground: a table [ground] is needed with [[bodies]]; with `none = true` in it \
                    there is none, and the friction is that of all bodies"
                .to_owned(),
        );
    };
    ground.set_if_any(&mut below)?;
    if let Some(solver) = file.solver.take() {
        solver.set(&mut below);
    }
    Ok(below)
}

/// The tutorial has one body.
fn refuse_preset(settings: &Settings) -> Result<(), Failure> {
    let place = "several bodies: the tutorial's program is of one";
    refuse_flags(place, &[("--preset", settings.preset.is_some())])
}
