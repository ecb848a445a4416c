//! A running scene: steps, and the way back.

use crate::change::has_ended;
use crate::history::History;
use crate::pull::{Grab, Hand, Pulls};
use crate::scenes;
use nalgebra::Vector3;
use std::sync::Arc;
use std::sync::atomic::AtomicBool;
use tumble_core::contact::Partner;
use tumble_core::error::in_range;
use tumble_core::mechanics::Load;
use tumble_core::query::{Query, Ray};
use tumble_core::simulation::summary::RunSummary;
use tumble_core::simulation::{Simulation, StepRecord};
use tumble_core::world::Integrator;
use tumble_scene::scene::Scene;
use tumble_scene::solver_choice::SolverChoice;

/// A scene with its simulation. The text of the scene gives the same bits on the command line.
pub struct Session {
    text: String,
    scene: Scene,
    simulation: Simulation<'static>,
    record: StepRecord,
    summary: RunSummary,
    /// Unsolved steps of the sessions before a change.
    earlier: Unsolved,
    pulls: Pulls,
    history: History,
    /// True if the page wrote the text, in which every body has its own table.
    is_own: bool,
    /// False until the first step.
    has_step: bool,
}

impl Session {
    /// Session of a scenario text, before its first step.
    ///
    /// # Errors
    /// The first fault of the text.
    pub fn open(text: &str) -> Result<Self, String> {
        let scene = scenes::read(text).map_err(|failure| failure.to_string())?;
        let is_own = scenes::text(&scene).is_ok_and(|own| own == text);
        Self::new(text.to_owned(), scene, is_own)
    }

    /// Session of a scene with the native solver, whose text is that of the page.
    ///
    /// # Errors
    /// A scene that no text can hold, or that asks for Ipopt.
    pub fn from_scene(scene: Scene) -> Result<Self, String> {
        if scene.contact.as_ref().is_some_and(SolverChoice::is_ipopt) {
            return Err("the scene names Ipopt; a live run has the native solver".to_owned());
        }
        Self::new(String::new(), scene, false)?.rewritten()
    }

    /// Session that continues this one with a text of the page.
    pub(crate) fn continued(&self, text: String) -> Result<Self, String> {
        Ok(Self { earlier: self.unsolved(), ..Self::from_text(text, true)? })
    }

    fn from_text(text: String, is_own: bool) -> Result<Self, String> {
        let scene = scenes::read(&text).map_err(|failure| failure.to_string())?;
        Self::new(text, scene, is_own)
    }

    fn new(text: String, scene: Scene, is_own: bool) -> Result<Self, String> {
        let never = Arc::new(AtomicBool::new(false));
        let simulation = scene.simulation(&never).map_err(|failure| failure.to_string())?;
        let mut session = Self {
            text,
            scene,
            simulation,
            record: StepRecord::new(),
            summary: RunSummary::default(),
            earlier: Unsolved::default(),
            pulls: Pulls::default(),
            history: History::default(),
            is_own,
            has_step: false,
        };
        session.history.store(&session.simulation, &session.summary);
        Ok(session)
    }

    /// Advances by one step. The pull on a body is a load of this step.
    ///
    /// # Errors
    /// A step that cannot be posed. The state then stays.
    pub fn step(&mut self) -> Result<(), String> {
        self.pulls.renew(&self.simulation);
        self.advance()
    }

    /// Advances by one step with the recorded pulls.
    fn advance(&mut self) -> Result<(), String> {
        self.pulls.apply(&mut self.simulation).map_err(|error| error.to_string())?;
        self.simulation.step(&mut self.record).map_err(|error| error.to_string())?;
        self.has_step = true;
        self.summary.add(&self.record);
        self.history.store(&self.simulation, &self.summary);
        Ok(())
    }

    /// The session from its start, without its pulls.
    ///
    /// # Errors
    /// Never for a text that was opened.
    pub fn restarted(&self) -> Result<Self, String> {
        Self::from_text(self.text.clone(), self.is_own)
    }

    /// Goes back by one step. Pulls after it are forgotten.
    ///
    /// # Errors
    /// The first step that is kept.
    pub fn back(&mut self) -> Result<(), String> {
        let first = || "There is no earlier step: older ones are not kept.".to_owned();
        let previous = self.simulation.index().checked_sub(1).ok_or_else(first)?;
        let kept = self.history.before(previous).ok_or_else(first)?;
        self.simulation.restore(&kept.saved).map_err(|error| error.to_string())?;
        self.summary = kept.summary.clone();
        self.has_step = false;
        self.history.forget_after(self.simulation.index());
        self.pulls.forget_from(previous);
        while self.simulation.index() < previous {
            self.advance()?;
        }
        Ok(())
    }

    /// Body that a ray from `origin` (m) along `direction` hits first, and the point (m, world).
    pub fn hit(&self, origin: Vector3<f64>, direction: Vector3<f64>) -> Option<Hit> {
        let query = Query::new(self.simulation.world(), self.simulation.states()).ok()?;
        let hit = query.cast_ray(&Ray::new(origin, direction).ok()?, |_| true)?;
        match hit.owner {
            Partner::Body(body) => Some(Hit { body, point: hit.point }),
            Partner::Ground | Partner::Fixed(_) => None,
        }
    }

    /// Grabs the body of a `hit` with a hand. It is pulled until [`Session::release`].
    ///
    /// # Errors
    /// A text that cannot hold pulls, see [`Session::for_pulls`]; a body with a load of its own.
    pub fn grab(&mut self, hand: Hand, hit: &Hit) -> Result<(), String> {
        if !self.is_own {
            return Err("The text of the scene cannot hold a pull.".to_owned());
        }
        if self.scene.loads.get(hit.body).is_none_or(|load| !load.is_none()) {
            let name = self.scene.bodies.get(hit.body).map_or("The body", String::as_str);
            return Err(format!("{name} has a load of its own, so it cannot be pulled."));
        }
        self.pulls.grab(hand, Grab::new(&self.simulation, hit));
        Ok(())
    }

    /// Moves the target of the point that a hand grabbed (m, world).
    ///
    /// # Errors
    /// A target where no body may be. The present one then stays.
    pub fn pull(&mut self, hand: Hand, target: Vector3<f64>) -> Result<(), String> {
        for x in &target {
            in_range("target of the pull (m)", *x, -1e6, 1e6, "-1e6 to 1e6")
                .map_err(|error| error.to_string())?;
        }
        self.pulls.pull(hand, target);
        Ok(())
    }

    /// Lets the body in a hand go.
    pub fn release(&mut self, hand: Hand) {
        self.pulls.release(hand, self.simulation.index());
    }

    /// Lets all bodies go.
    pub(crate) fn release_all(&mut self) {
        self.pulls.release_all(self.simulation.index());
    }

    /// Session whose text can hold pulls: one with a table per body, whose loads act over whole steps and
    /// have not ended.
    /// `None` if this one is so. The present state is the start of the new session.
    ///
    /// # Errors
    /// A scene that no text can hold at this state.
    pub fn for_pulls(&self) -> Result<Option<Self>, String> {
        let has_whole_steps = self.scene.world.integrator() == Integrator::Euler;
        let time = self.simulation.index() as f64 * self.scene.world.time_step();
        let is_past = |load: &Load| !load.is_none() && has_ended(load, time);
        let has_past = self.scene.loads.iter().any(is_past);
        let fits = self.is_own && has_whole_steps && !has_past;
        if fits { Ok(None) } else { self.rewritten().map(Some) }
    }

    /// Forgets most of the past, to save memory.
    pub(crate) fn shorten(&mut self) {
        self.history.shorten(self.scene.bodies.len());
    }

    /// Steps that were not solved, including those before a change.
    pub fn unsolved(&self) -> Unsolved {
        let summary = &self.summary;
        let first_wild = summary.first_wild.map(|(index, _)| index);
        let first_failed = summary.first_failures.first().map(|failed| failed.index);
        let first = first_wild.into_iter().chain(first_failed).min();
        Unsolved {
            failed: self.earlier.failed + summary.failed,
            wild: self.earlier.wild + summary.wild,
            first: self.earlier.first.or(first),
        }
    }

    /// Text of the scene, without the pulls.
    pub fn text(&self) -> &str {
        &self.text
    }

    /// The scene.
    pub fn scene(&self) -> &Scene {
        &self.scene
    }

    /// The simulation.
    pub fn simulation(&self) -> &Simulation<'static> {
        &self.simulation
    }

    /// Number of rows since the start of the session.
    pub fn rows(&self) -> u64 {
        self.simulation.index() - self.scene.start_index + 1
    }

    /// Record of the last step; `None` before the first.
    pub fn record(&self) -> Option<&StepRecord> {
        self.has_step.then_some(&self.record)
    }

    /// Counts of the steps since the start of the session.
    pub fn summary(&self) -> &RunSummary {
        &self.summary
    }

    /// The pulls since the start of the session.
    pub fn pulls(&self) -> &Pulls {
        &self.pulls
    }
}

/// Counts of steps that did not converge or are unphysical.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub struct Unsolved {
    /// Number of failed steps.
    pub failed: u64,
    /// Number of unphysical steps.
    pub wild: u64,
    /// Index of the first of them.
    pub first: Option<u64>,
}

/// Body that a ray hits.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Hit {
    /// Index of the body.
    pub body: usize,
    /// Point on its surface (m, world).
    pub point: Vector3<f64>,
}
