//! Scene: the input of a simulation, independent of the notation of its file.
//!
//! A scene holds the same content twice: as [`Document`] in exact form, which run.json has, and as
//! [`World`], initial states and loads, the form of the core. The latter are made from the document.

use super::document::{Document, LARGEST_START, USUAL_SEED};
use super::robots::Assembled;
use super::solver_choice::SolverChoice;
use super::tables::GroundTable;
use std::num::NonZeroUsize;
use std::sync::Arc;
use std::sync::atomic::AtomicBool;
use tumble_core::contact::Partner;
use tumble_core::error::Error;
use tumble_core::joint::{Course, Knots};
use tumble_core::mechanics::{Load, State};
use tumble_core::simulation::{Motion, Simulation};
use tumble_core::world::{Integrator, World};
use tumble_model::failure::Failure;

/// Bodies, collision geometry, initial states and solver of a simulation.
#[derive(Clone)]
pub struct Scene {
    /// Name of the scene.
    pub name: String,
    /// Names of the settings that differ from the file or the tutorial's scene.
    pub changed: Vec<String>,
    /// Seed of the random start.
    pub seed: u32,
    /// True if an initial state is drawn at random.
    pub drawn: bool,
    /// Start index k: the simulation starts at time k h, also for loads and prescribed motions.
    pub start_index: u64,
    /// Number of rows of a run: one more than steps.
    pub rows: u64,
    /// Number of steps per requested row.
    pub substeps: u64,
    /// World of the simulation.
    pub world: World,
    /// Initial state of each body.
    pub starts: Vec<State>,
    /// External load of each body.
    pub loads: Vec<Load>,
    /// Prescribed motions of joint frames in the world, with the index of each joint.
    pub courses: Vec<(usize, Knots)>,
    /// Names of the bodies.
    pub bodies: Vec<String>,
    /// Names of the fixed pieces, then of the terrains.
    pub fixed: Vec<String>,
    /// Names of the joints.
    pub joints: Vec<String>,
    /// Solver of contact steps. `None` for a scene without `[ground]`: its only body floats and is
    /// integrated by the Runge–Kutta method.
    pub contact: Option<SolverChoice>,
    /// Robots read from files, with the indices of their bodies and joints in the scene.
    pub robots: Vec<Assembled>,
    /// Notes on decomposed meshes of its file.
    pub file_notes: Vec<String>,
    /// Document in exact form, with the constants of the bodies and initial states.
    pub document: Document,
    /// True if a run also writes trajectory.csv: the tutorial's scenes and its preset.
    pub trajectory: bool,
}

impl Scene {
    /// Sets the meaning of the velocities of a run, whose steps are then whole.
    pub fn use_integrator(&mut self, integrator: Integrator) {
        let document = &mut self.document;
        (document.integrator, document.accuracy, document.impacts) = (Some(integrator), None, None);
        self.world = self.world.clone().with_whole_steps().with_integrator(integrator);
    }

    /// World at step `index`, with the frames of prescribed motions at their places.
    pub fn world_at(&self, index: u64) -> World {
        let mut world = self.world.clone();
        world.follow(&self.courses, index as f64 * world.time_step());
        world
    }

    /// Scene of a `document` in exact form and its `world`, with one row and without a random start.
    ///
    /// # Errors
    /// The errors of the core for invalid data.
    pub fn from_document(
        name: String,
        document: Document,
        world: World,
        contact: Option<SolverChoice>,
    ) -> Result<Self, Failure> {
        Ok(Self {
            name,
            changed: Vec::new(),
            seed: USUAL_SEED,
            drawn: false,
            start_index: 0,
            rows: 1,
            substeps: 1,
            world,
            starts: document.states(),
            loads: document.loads()?,
            courses: document.courses()?,
            bodies: document.bodies.iter().map(|body| body.name().to_owned()).collect(),
            fixed: document.fixed_names().map(str::to_owned).collect(),
            joints: document.joint_names().map(str::to_owned).collect(),
            contact,
            robots: Vec::new(),
            file_notes: Vec::new(),
            document,
            trajectory: false,
        })
    }

    /// This scene with the world, initial states and loads of a `document` in exact form.
    ///
    /// # Errors
    /// The errors of the core for invalid data.
    pub fn with_document(self, document: Document) -> Result<Self, Failure> {
        let world = document.world()?;
        Ok(Self {
            changed: self.changed,
            seed: self.seed,
            drawn: self.drawn,
            start_index: self.start_index,
            rows: self.rows,
            substeps: self.substeps,
            robots: self.robots,
            file_notes: self.file_notes,
            trajectory: self.trajectory && document.bodies.len() == 1,
            ..Self::from_document(self.name, document, world, self.contact)?
        })
    }

    /// This scene with the default settings of the native solver.
    #[must_use]
    pub fn with_native_solver(mut self) -> Self {
        if self.document.ground.is_none() {
            self.document.ground = Some(GroundTable::none());
            self.document.rotation = Some(self.world.rotation());
            self.document.integrator = Some(self.world.integrator());
        }
        Self { contact: Some(SolverChoice::native()), ..self }
    }

    /// Simulation from the initial state; it ends when `interrupt` is set.
    ///
    /// # Errors
    /// The errors of the core for invalid data.
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

    /// Simulation from `states` at step `index`, which moves prescribed frames to their places.
    ///
    /// # Errors
    /// Those of [`Simulation::new`].
    pub fn simulation_from(
        &self,
        states: Vec<State>,
        index: u64,
        motion: Motion<'static>,
    ) -> Result<Simulation<'static>, Error> {
        let mut simulation = Simulation::new(self.world_at(index), states, motion)?;
        self.prepare_at(index, &mut simulation)?;
        Ok(simulation)
    }

    /// Sets the start index, loads and prescribed motions of a `simulation` of this scene.
    ///
    /// # Errors
    /// Errors of the core. They cannot occur for a simulation of the scene's own world.
    pub fn prepare(&self, simulation: &mut Simulation<'_>) -> Result<(), Error> {
        self.prepare_at(self.start_index, simulation)
    }

    fn prepare_at(&self, index: u64, simulation: &mut Simulation<'_>) -> Result<(), Error> {
        simulation.set_index(index)?;
        for (body, load) in self.loads.iter().enumerate() {
            simulation.set_load(body, load.clone())?;
        }
        for (joint, knots) in &self.courses {
            simulation.set_course(*joint, Course::Through(knots.clone()))?;
        }
        Ok(())
    }

    /// Integrator of `world`, the scene's world or one with other constants.
    ///
    /// # Errors
    /// A world that the solver does not support.
    pub fn motion(&self, world: &World) -> Result<Motion<'static>, Error> {
        let Some(contact) = &self.contact else { return Ok(Motion::Floating) };
        contact
            .motion(world)
            .map_err(|failure| Error::Solver { solver: "ipopt", why: failure.to_string() })
    }

    /// Integrator of the scene's world with up to `threads` threads.
    ///
    /// # Errors
    /// A scene solved by Ipopt, the errors of [`Scene::motion`] and those of
    /// [`NativeSolver::with_threads`](tumble_core::solver::native::NativeSolver::with_threads).
    pub fn motion_on(&self, threads: NonZeroUsize) -> Result<Motion<'static>, Failure> {
        let Some(contact) = &self.contact else { return Ok(Motion::Floating) };
        let mut contact = contact.clone();
        contact.set_threads(threads)?;
        contact.motion(&self.world)
    }

    /// This scene with every step divided into `substeps` steps.
    ///
    /// The time step becomes shorter; the number of steps and the start index become larger.
    ///
    /// # Errors
    /// A time step out of range; more than ten million rows.
    pub fn in_substeps(mut self, substeps: u64) -> Result<Self, Failure> {
        const MOST_ROWS: u64 = 10_000_000;
        if substeps <= 1 {
            return Ok(self);
        }
        let rows = self.rows.saturating_sub(1).saturating_mul(substeps).saturating_add(1);
        if rows > MOST_ROWS {
            let why = format!(
                "{} rows become {rows} rows of substeps; allowed: up to {MOST_ROWS}",
                self.rows
            );
            return Err(Failure::setting("substeps", why));
        }
        let mut parameters = self.world.parameters().clone();
        parameters.time_step /= substeps as f64;
        let time_step = parameters.time_step;
        let of_substeps = |error: Error| Failure::setting("substeps", error.to_string());
        self.world = self.world.with_parameters(parameters).map_err(of_substeps)?;
        (self.rows, self.substeps) = (rows, self.substeps.saturating_mul(substeps));
        self.start_index = self.start_index.saturating_mul(substeps);
        if self.start_index > LARGEST_START {
            let why = format!(
                "the start index becomes {}; allowed: 0 to {LARGEST_START}",
                self.start_index
            );
            return Err(Failure::setting("substeps", why));
        }
        self.changed.push("substeps".to_owned());
        self.document.time_step = Some(time_step);
        Ok(self)
    }

    /// Name of the solver: `native`, `ipopt`, or `rk4` for a body that floats.
    pub fn solver(&self) -> &'static str {
        self.contact.as_ref().map_or("rk4", SolverChoice::solver_name)
    }

    /// Seed of a random start; `None` if the start does not depend on it.
    pub fn drawn_seed(&self) -> Option<u32> {
        self.drawn.then_some(self.seed)
    }

    /// Name of a contact partner.
    pub fn partner(&self, partner: Partner) -> &str {
        let named = match partner {
            Partner::Ground => None,
            Partner::Fixed(index) => self.fixed.get(index),
            Partner::Body(index) => self.bodies.get(index),
        };
        named.map_or("the ground", String::as_str)
    }
}
