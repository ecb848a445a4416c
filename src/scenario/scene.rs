//! A scene, whether its file is of one body or of several.

use super::Scenario;
use super::choices::SolverName;
use super::contact::Contact;
use super::failure::{Failure, refuse_flags};
use super::job::{Job, refuse_idle_settings};
use super::names::FileKind;
use super::settings::Settings;
use super::several::{self, ReadFile};
use crate::error::Error;
use crate::mechanics::{Load, State};
use crate::simulation::Motion;
use crate::world::World;
#[cfg(feature = "threads")]
use std::num::NonZeroUsize;
use std::path::Path;

/// What is simulated: bodies, what they can touch, where they start and who solves the steps.
pub struct Scene {
    /// What it is called.
    pub name: String,
    /// The seed of the start, where any of it was drawn.
    pub seed: Option<u32>,
    /// Rows of the trajectory: one more than there are steps.
    pub rows: u64,
    /// The world.
    pub world: World,
    /// The states at step 0, one a body.
    pub starts: Vec<State>,
    /// What pushes each body.
    pub loads: Vec<Load>,
    /// The names of the bodies.
    pub bodies: Vec<String>,
    /// The names of the fixed pieces.
    pub fixed: Vec<String>,
    /// `None` without a ground.
    pub contact: Option<Contact>,
}

impl Scene {
    /// The scene of the scenario `path`, whose text is `text`, under `flags`. The native solver
    /// solves it where neither says who does. The files of meshes are read by `read`.
    ///
    /// # Errors
    /// The first thing that cannot be; a seed where nothing is random.
    pub fn of_text(
        text: &str,
        path: &Path,
        flags: Settings,
        read: ReadFile<'_>,
    ) -> Result<Self, Failure> {
        let in_file = |failure: Failure| failure.in_file(path, FileKind::Scenario, &[]);
        let seed_given = flags.seed.is_some();
        let scene = if several::is_scenario(text) {
            let job = several::job::Job::of(flags, path, text, read);
            job.and_then(Self::of_several).map_err(in_file)?
        } else {
            let scenario = Scenario::of_text(text, path)?;
            refuse_idle_settings(scenario.ground, &flags)?;
            let settings = flags.over(scenario.settings);
            let job = Job::of(scenario.name, scenario.ground, settings, SolverName::Native);
            Self::of_job(job.map_err(in_file)?)
        };
        let idle_seed = seed_given && scene.seed.is_none();
        refuse_flags("a scene of which nothing is random", &[("--seed", idle_seed)])?;
        Ok(scene)
    }

    fn of_job(job: Job) -> Self {
        Self {
            name: job.name,
            seed: job.drawn.then_some(job.seed),
            rows: job.rows,
            world: job.physics.world,
            starts: vec![job.start],
            loads: vec![job.physics.load],
            bodies: vec!["body".to_owned()],
            fixed: Vec::new(),
            contact: job.contact,
        }
    }

    fn of_several(job: several::job::Job) -> Result<Self, Failure> {
        Ok(Self {
            seed: job.drawn.then_some(job.seed),
            rows: job.rows,
            starts: job.model.states(),
            loads: job.model.loads()?,
            bodies: job.model.bodies.iter().map(|body| body.name.clone()).collect(),
            fixed: job.model.fixed.iter().map(|fixed| fixed.name.clone()).collect(),
            name: job.name,
            world: job.world,
            contact: Some(job.contact),
        })
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
    /// [`NativeSolver::with_threads`](crate::solver::native::NativeSolver::with_threads).
    #[cfg(feature = "threads")]
    pub fn motion_on(&self, threads: NonZeroUsize) -> Result<Motion<'static>, Failure> {
        let Some(contact) = &self.contact else { return Ok(Motion::Floating) };
        let mut contact = contact.clone();
        contact.set_threads(threads)?;
        contact.motion(&self.world)
    }

    /// Who solves contact steps: `native`, `ipopt`, or `rk4` without a ground.
    #[must_use]
    pub fn solver(&self) -> &'static str {
        self.contact.as_ref().map_or("rk4", Contact::solver_name)
    }
}
