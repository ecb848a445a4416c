//! A scene: what is simulated, in whichever notation its file was written.

use super::solver_choice::SolverChoice;
use std::num::NonZeroUsize;
use std::sync::Arc;
use std::sync::atomic::AtomicBool;
use tumble_core::contact::Partner;
use tumble_core::error::Error;
use tumble_core::joint::{Course, Knots};
use tumble_core::mechanics::{Load, State};
use tumble_core::simulation::{Motion, Simulation};
use tumble_core::world::World;
use tumble_model::Model;
use tumble_model::failure::Failure;

/// What is simulated: bodies, what they can touch, where they start and who solves the steps.
#[derive(Clone)]
pub struct Scene {
    /// What it is called.
    pub name: String,
    /// The settings that were told other than the tutorial's scene or the file has them.
    pub changed: Vec<String>,
    /// The seed.
    pub seed: u32,
    /// Whether anything of the start is drawn from the seed.
    pub drawn: bool,
    /// k of the start: its time is k h, and loads are those of the times from there on.
    pub start_index: u64,
    /// Rows of the trajectory: one more than there are steps.
    pub rows: u64,
    /// Steps of one row that was asked for.
    pub substeps: u64,
    /// The world.
    pub world: World,
    /// The states at the start, one a body.
    pub starts: Vec<State>,
    /// What pushes each body.
    pub loads: Vec<Load>,
    /// How joints' frames in the world move, by the joints' indices.
    pub courses: Vec<(usize, Knots)>,
    /// The names of the bodies.
    pub bodies: Vec<String>,
    /// The names of the fixed pieces.
    pub fixed: Vec<String>,
    /// The names of the joints.
    pub joints: Vec<String>,
    /// `None` without a ground.
    pub contact: Option<SolverChoice>,
    /// Whether the solver is the usual one, for want of another.
    pub usual_solver: bool,
    /// The robots from files, and which bodies and joints of the scene they are.
    pub robots: Vec<tumble_robot::Assembled>,
    /// The constants of the bodies and their starts, as run.json has them.
    pub model: Model,
    /// Whether a run writes trajectory.csv instead of the tables: a scene of the tutorial or of `[body]`.
    pub trajectory: bool,
}

impl Scene {
    /// What stands in the files of its robots and has no meaning, and what its joints lock together, a sentence each.
    #[must_use]
    pub fn notes(&self) -> Vec<String> {
        let joints = self.notes_on_joints();
        let of_robots = self.robots.iter().flat_map(|robot| robot.robot().notes.clone());
        of_robots.chain(joints).collect()
    }

    /// Its world as it is at the time of step `index`, joints' frames being where their courses have them.
    #[must_use]
    pub fn world_at(&self, index: u64) -> World {
        let mut world = self.world.clone();
        world.follow(&self.courses, index as f64 * world.time_step());
        world
    }

    /// This scene with the bodies, the fixed things and the joints of `model`, where it says that they start.
    ///
    /// # Errors
    /// What the library refuses.
    pub fn with_model(self, model: Model) -> Result<Self, Failure> {
        Ok(Self {
            world: model.world()?,
            starts: model.states(),
            loads: model.loads()?,
            courses: model.courses()?,
            bodies: model.bodies.iter().map(|body| body.name.clone()).collect(),
            fixed: model.fixed.iter().map(|fixed| fixed.name.clone()).collect(),
            joints: model.joints.iter().map(|joint| joint.name.clone()).collect(),
            trajectory: self.trajectory && model.bodies.len() == 1,
            model,
            ..self
        })
    }

    /// A simulation from the start, which ends when `interrupt` is raised.
    ///
    /// # Errors
    /// What the library refuses.
    pub fn simulation(&self, interrupt: &Arc<AtomicBool>) -> Result<Simulation<'static>, Failure> {
        let motion = match &self.contact {
            None => Motion::Floating,
            Some(contact) => contact.motion(&self.world)?,
        };
        let mut simulation = Simulation::new(self.world.clone(), self.starts.clone(), motion)?;
        self.prepare(&mut simulation)?;
        simulation.interrupt_by(Arc::clone(interrupt));
        Ok(simulation)
    }

    /// Sets in a `simulation` of the scene what of it changes with time: the index of the start, loads and courses.
    ///
    /// # Errors
    /// What the library refuses: none of a simulation of the scene's world.
    pub fn prepare(&self, simulation: &mut Simulation<'_>) -> Result<(), Error> {
        simulation.set_index(self.start_index)?;
        for (body, load) in self.loads.iter().enumerate() {
            simulation.set_load(body, load.clone())?;
        }
        for (joint, knots) in &self.courses {
            simulation.set_course(*joint, Course::Through(knots.clone()))?;
        }
        Ok(())
    }

    /// What moves the bodies of `world`, the scene's or one with other constants.
    ///
    /// # Errors
    /// A world that the solver does not know.
    pub fn motion(&self, world: &World) -> Result<Motion<'static>, Error> {
        let Some(contact) = &self.contact else { return Ok(Motion::Floating) };
        contact
            .motion(world)
            .map_err(|failure| Error::Solver { solver: "ipopt", why: failure.to_string() })
    }

    /// What moves the bodies of the scene's world, on up to `threads` threads.
    ///
    /// # Errors
    /// Ipopt; as [`Scene::motion`] otherwise, and
    /// [`NativeSolver::with_threads`](tumble_core::solver::native::NativeSolver::with_threads).
    pub fn motion_on(&self, threads: NonZeroUsize) -> Result<Motion<'static>, Failure> {
        let Some(contact) = &self.contact else { return Ok(Motion::Floating) };
        let mut contact = contact.clone();
        contact.set_threads(threads)?;
        contact.motion(&self.world)
    }

    /// The same with `substeps` steps in place of each, of a time step that is so much shorter: as many times the steps, and the
    /// start's index too.
    ///
    /// # Errors
    /// A time step that is out of range then; more than ten million rows.
    pub fn in_substeps(mut self, substeps: u64) -> Result<Self, Failure> {
        const MOST_ROWS: u64 = 10_000_000;
        const LARGEST_INDEX: u64 = (1 << 53) - MOST_ROWS;
        if substeps <= 1 {
            return Ok(self);
        }
        let rows = self.rows.saturating_sub(1).saturating_mul(substeps).saturating_add(1);
        if rows > MOST_ROWS {
            let why =
                format!("with {} rows makes {rows} of steps; allowed are {MOST_ROWS}", self.rows);
            return Err(Failure::setting("substeps", why));
        }
        let mut parameters = self.world.parameters().clone();
        parameters.time_step /= substeps as f64;
        let time_step = parameters.time_step;
        let of_substeps = |error: Error| Failure::setting("substeps", error.to_string());
        self.world = self.world.with_parameters(parameters).map_err(of_substeps)?;
        (self.rows, self.substeps) = (rows, self.substeps.saturating_mul(substeps));
        self.start_index = self.start_index.saturating_mul(substeps);
        if self.start_index > LARGEST_INDEX {
            let why =
                format!("makes the start's index {}; allowed is below 2^53", self.start_index);
            return Err(Failure::setting("substeps", why));
        }
        self.changed.push("substeps".to_owned());
        self.model.dt = time_step;
        Ok(self)
    }

    /// Who solves contact steps: `native`, `ipopt`, or `rk4` without a ground.
    #[must_use]
    pub fn solver(&self) -> &'static str {
        self.contact.as_ref().map_or("rk4", SolverChoice::solver_name)
    }

    /// The seed, where anything of the start was drawn from it.
    #[must_use]
    pub fn drawn_seed(&self) -> Option<u32> {
        self.drawn.then_some(self.seed)
    }

    /// The name of whom a contact is with.
    #[must_use]
    pub fn partner(&self, partner: Partner) -> &str {
        let named = match partner {
            Partner::Ground => None,
            Partner::Fixed(index) => self.fixed.get(index),
            Partner::Body(index) => self.bodies.get(index),
        };
        named.map_or("the ground", String::as_str)
    }
}
