//! Simulates the problems' runs and keeps what the answers are compared with.

use super::Unsuitable;
use crate::contact::detection::Detection;
use crate::contact::plane::Plane;
use crate::error::Error;
use crate::mechanics::body::RigidBody;
use crate::mechanics::load::Load;
use crate::mechanics::state::State;
use crate::simulation::{Motion, Simulation, StepRecord};
use crate::step::{StepSolver, StepStatus};
use crate::world::{Parameters, World};
use nalgebra::Vector3;
use std::sync::Arc;
use std::sync::atomic::AtomicBool;

/// Makes the solver under test for a model.
pub type MakeSolver<'a> = dyn Fn(&World) -> Result<Box<dyn StepSolver>, Error> + 'a;

/// One run of a problem.
#[derive(Debug, Clone)]
pub struct Setup {
    /// The body.
    pub body: RigidBody,
    /// The ground.
    pub plane: Plane,
    /// g, m/s², downwards.
    pub gravity: f64,
    /// μ.
    pub friction: f64,
    /// At the start, in the **ground's** frame.
    pub start: State,
    /// The external load.
    pub load: Load,
    /// How long it goes on, s.
    pub duration: f64,
}

/// Ends a run early: whether the state (ground's frame) is past all that matters.
pub type Until<'a> = &'a dyn Fn(&State) -> bool;

/// What a run came to, in the ground's frame.
#[derive(Debug, Clone, PartialEq)]
pub struct Run {
    /// h, s.
    pub time_step: f64,
    /// The states, one more than steps.
    pub states: Vec<State>,
    /// The sum of all contact forces of each step, N.
    pub forces: Vec<Vector3<f64>>,
    /// The certificate of each step, m/s.
    pub certificates: Vec<f64>,
}

/// All states of a run are in memory, 0.1 kB each.
const MOST_STEPS: f64 = 1e6;

/// Where the runs are made.
pub struct Laboratory<'a> {
    make_solver: &'a MakeSolver<'a>,
    interrupt: Option<Arc<AtomicBool>>,
    /// h, s.
    time_step: f64,
    /// Steps of all runs.
    pub steps: u64,
    /// Steps that did not converge.
    pub failed: u64,
    /// Steps for which another solver's answer stands in.
    pub fallback: u64,
    /// The largest certificate, m/s.
    pub worst_certificate: f64,
}

impl<'a> Laboratory<'a> {
    /// A laboratory for one solver and one time step (s).
    #[must_use]
    pub fn new(make_solver: &'a MakeSolver<'a>, time_step: f64) -> Self {
        Self {
            make_solver,
            interrupt: None,
            time_step,
            steps: 0,
            failed: 0,
            fallback: 0,
            worst_certificate: 0.0,
        }
    }

    /// Gives up a run with [`Error::Interrupted`] soon after `flag` is raised.
    pub fn interrupt_by(&mut self, flag: Arc<AtomicBool>) {
        self.interrupt = Some(flag);
    }

    /// h, s.
    #[must_use]
    pub fn time_step(&self) -> f64 {
        self.time_step
    }

    /// Simulates `setup` for its duration.
    ///
    /// # Errors
    /// A setup that the model refuses, or of more than a million steps.
    pub fn run(&mut self, setup: &Setup) -> Result<Run, Unsuitable> {
        self.run_until(setup, &|_| false)
    }

    /// Simulates `setup` for its duration or until a state is past all that matters.
    ///
    /// # Errors
    /// A setup that the model refuses, or of more than a million steps.
    pub fn run_until(&mut self, setup: &Setup, until: Until<'_>) -> Result<Run, Unsuitable> {
        let world = World::new(Parameters {
            bodies: vec![setup.body.clone()],
            ground: setup.plane.clone(),
            gravity: Vector3::new(0.0, 0.0, -setup.gravity),
            friction: setup.friction,
            time_step: self.time_step,
        })?;
        let steps = (setup.duration / self.time_step).round();
        if steps > MOST_STEPS {
            return Err(Unsuitable::Motion(format!(
                "the motion takes {:.3} s, more than a million steps of {} s",
                setup.duration, self.time_step
            )));
        }
        let plane = &setup.plane;
        let solver = (self.make_solver)(&world)?;
        let motion = Motion::Contact { detection: Detection::default(), solver };
        let start = plane.state_to_world(&setup.start);
        let mut simulation = Simulation::new(world, [start], motion)?;
        simulation.set_load(0, setup.load.clone())?;
        if let Some(flag) = &self.interrupt {
            simulation.interrupt_by(Arc::clone(flag));
        }

        let mut record = StepRecord::new();
        let mut run = Run {
            time_step: self.time_step,
            states: vec![setup.start],
            forces: Vec::new(),
            certificates: Vec::new(),
        };
        for _ in 0..steps as usize {
            simulation.step(&mut record)?;
            let force = record.solution.total_force(0);
            run.forces.push(plane.vector_to_ground(&force));
            run.certificates.push(record.certificate.residual());
            run.states.push(plane.state_to_ground(record.next()));
            self.count(&record);
            if until(&run.states[run.states.len() - 1]) {
                break;
            }
        }
        Ok(run)
    }

    fn count(&mut self, record: &StepRecord) {
        self.steps += 1;
        self.failed += u64::from(record.report.status == StepStatus::Failed);
        self.fallback += u64::from(record.report.status == StepStatus::Fallback);
        let certificate = record.certificate.residual();
        if certificate.is_nan() || certificate > self.worst_certificate {
            self.worst_certificate = certificate;
        }
    }
}

impl Run {
    /// Time of the state `k`, s.
    #[must_use]
    pub fn time(&self, k: usize) -> f64 {
        k as f64 * self.time_step
    }

    /// The last state.
    #[must_use]
    pub fn end(&self) -> &State {
        &self.states[self.states.len() - 1]
    }

    /// How far the velocities may be off by what the certificates say, m/s: each step adds at
    /// most its own c_k.
    ///
    /// ```text
    /// |δv| ≤ Σ c_k
    /// ```
    ///
    /// To that comes rounding.
    #[must_use]
    pub fn velocity_slack(&self) -> f64 {
        let sum: f64 = self.certificates.iter().sum();
        sum + self.rounding(|state| state.velocity.amax())
    }

    /// How far positions may be off, m: a velocity lost in step k is missing ever after.
    ///
    /// ```text
    /// |δr| ≤ h Σ (n − k) c_k
    /// ```
    #[must_use]
    pub fn position_slack(&self) -> f64 {
        let steps = self.certificates.len() as f64;
        let ages = (0..self.certificates.len()).map(|k| steps - k as f64);
        let sum: f64 = self.certificates.iter().zip(ages).map(|(c, age)| c * age).sum();
        self.time_step * sum + self.rounding(|state| state.position.amax())
    }

    /// What sums over thousands of steps may make of the last digits of a number this large.
    fn rounding(&self, size: impl Fn(&State) -> f64) -> f64 {
        1e-11 * (1.0 + self.states.iter().map(size).fold(0.0, f64::max))
    }

    /// When a `speed` that falls linearly comes to an end, s: the line through the last two
    /// states of at least a hundredth of the start's speed, followed to zero. `None` if it
    /// does not fall.
    #[must_use]
    pub fn stop_time(&self, speed: impl Fn(&State) -> f64) -> Option<f64> {
        let least = 0.01 * speed(&self.states[0]);
        let last = (0..self.states.len()).rev().find(|&k| speed(&self.states[k]) > least)?;
        let (before, after) = (last.checked_sub(1)?, last);
        let (fast, slow) = (speed(&self.states[before]), speed(&self.states[after]));
        (fast > slow).then(|| self.time(after) + slow * self.time_step / (fast - slow))
    }
}
