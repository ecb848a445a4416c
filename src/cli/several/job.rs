//! What a scenario file and flags amount to.

use super::entries::SeveralFile;
use super::model::Model;
use super::run_file::{SeveralRun, refuse_large};
use super::scene::{self, Built};
use crate::cli::args::SimulateArgs;
use crate::cli::choices::SolverName;
use crate::cli::contact::Contact;
use crate::cli::job::USUAL_SEED;
use crate::cli::names::FileKind;
use crate::cli::outcome::{Failure, refuse_flags};
use crate::cli::physics::violent_load;
use crate::cli::run::Run;
use crate::cli::run_file::SummaryFile;
use crate::cli::scenario;
use crate::cli::settings::Settings;
use nalgebra::Vector3;
use std::path::Path;
use std::sync::Arc;
use std::sync::atomic::AtomicBool;
use tumble::contact::Candidates;
use tumble::error::Error;
use tumble::ipopt;
use tumble::simulation::{Motion, Simulation};
use tumble::world::World;

/// A simulation of several bodies.
pub struct Job {
    pub name: String,
    /// The settings for which flags gave other values than the file.
    pub changed: Vec<String>,
    pub seed: u32,
    /// Whether anything was drawn from the seed.
    pub drawn: bool,
    pub rows: u64,
    pub model: Model,
    pub world: World,
    pub contact: Contact,
    /// Whether the solver is the usual one, for want of another.
    pub usual_solver: bool,
}

/// The solver of several bodies where none is named.
const USUAL_SOLVER: SolverName = SolverName::Native;

impl Job {
    pub fn new(args: &SimulateArgs, path: &Path, text: &str) -> Result<Self, Failure> {
        refuse_idle_flags(args)?;
        let flags = Settings::of_flags(args)?;
        let seed_given = flags.seed.is_some();
        let job = Self::of(flags, path, text);
        let given = args.given();
        let job = job.map_err(|failure| failure.in_file(path, FileKind::Scenario, &given))?;
        let idle_seed = seed_given && !job.drawn;
        refuse_flags("a scene of which nothing is random", &[("--seed", idle_seed)])?;
        Ok(job)
    }

    /// The job of a file without flags.
    pub fn of_file(path: &Path, text: &str) -> Result<Self, Failure> {
        let job = Self::of(Settings::default(), path, text);
        job.map_err(|failure| failure.in_file(path, FileKind::Scenario, &[]))
    }

    fn of(flags: Settings, path: &Path, text: &str) -> Result<Self, Failure> {
        let mut file: SeveralFile = scenario::parse(text).map_err(Failure::Input)?;
        let name = scenario::name(file.name.take(), path).map_err(Failure::Input)?;
        let below = settings(&mut file).map_err(Failure::Input)?;
        let changed = flags.changed(&below);
        let settings = flags.over(below);
        let folder = path.parent().unwrap_or(Path::new(""));
        let Built { model, drawn } =
            scene::build(file, &settings, folder).map_err(Failure::Input)?;
        refuse_large(&model)?;
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

    pub fn simulation(&self, interrupt: &Arc<AtomicBool>) -> Result<Simulation<'static>, Failure> {
        let solver = self.contact.solver(&self.world)?;
        let motion = Motion::Contact { detection: self.contact.detection, solver };
        let mut simulation = Simulation::new(self.world.clone(), self.model.states(), motion)?;
        for (index, load) in self.model.loads()?.into_iter().enumerate() {
            simulation.set_load(index, load)?;
        }
        simulation.interrupt_by(Arc::clone(interrupt));
        Ok(simulation)
    }

    pub fn run_file(&self, run: &Run, largest_overlap: f64) -> SeveralRun {
        SeveralRun {
            outcome: run.end.name().to_owned(),
            tumble_version: env!("CARGO_PKG_VERSION").to_owned(),
            ipopt_version: ipopt::VERSION.to_owned(),
            scene: self.name.clone(),
            changed: self.changed.clone(),
            seed: self.seed,
            drawn: self.drawn,
            steps: self.rows,
            model: self.model.clone(),
            solver: self.contact.settings(),
            summary: SummaryFile::of(
                &run.summary,
                self.contact.climbs(),
                run.elapsed.as_secs_f64(),
            ),
            largest_overlap_m: largest_overlap,
        }
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

/// Flags of one body's scenes.
fn refuse_idle_flags(args: &SimulateArgs) -> Result<(), Failure> {
    let physics = &args.physics;
    refuse_flags(
        "several bodies, which the scenario file describes",
        &[
            ("--mass", physics.mass.is_some()),
            ("--inertia", physics.inertia.is_some()),
            ("--box", physics.sides.is_some()),
            ("--plane", physics.plane.is_some()),
            ("--force", !physics.force.is_empty()),
            ("--torque", !physics.torque.is_empty()),
            ("--force-at", physics.force_at.is_some()),
            ("--position", args.position.is_some()),
            ("--height", args.height.is_some()),
            ("--attitude", args.attitude.is_some()),
            ("--velocity", args.velocity.is_some()),
            ("--spin", args.spin.is_some()),
            ("--frame", args.frame.is_some()),
        ],
    )
}
