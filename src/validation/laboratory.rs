//! Simulates the problems' runs and keeps what the answers are compared with. Nothing else
//! of the validation knows how a simulation is made.

use super::Unsuitable;
use super::incline::Incline;
use super::residual::Residual;
use crate::contact::Plane;
use crate::contact::detection::Detection;
use crate::error::Error;
use crate::mechanics::Load;
use crate::mechanics::RigidBody;
use crate::mechanics::State;
use crate::mechanics::quaternion::{advance, rotation};
use crate::simulation::{Motion, Simulation, StepRecord};
use crate::step::{StepSolver, StepStatus};
use crate::step_nlp::SMOOTHING;
use crate::world::{Parameters, World};
use nalgebra::Vector3;
use std::sync::Arc;
use std::sync::atomic::AtomicBool;

/// Makes the solver under test for a world.
pub type MakeSolver<'a> = dyn Fn(&World) -> Result<Box<dyn StepSolver>, Error> + 'a;

/// One run of a problem.
#[derive(Debug, Clone)]
pub struct Setup {
    /// The body.
    pub body: RigidBody,
    /// Of the ground, which falls towards +x, degrees.
    pub slope: f64,
    /// g, m/s², downwards.
    pub gravity: f64,
    /// μ.
    pub friction: f64,
    /// At the start, relative to the slope: x downhill, z along its normal.
    pub start: State,
    /// The external load.
    pub load: Load,
    /// How long it goes on, s.
    pub duration: f64,
}

/// A step that was taken, relative to the slope.
#[derive(Debug, Clone, Copy)]
pub struct Taken<'a> {
    /// The state at its start.
    pub before: &'a State,
    /// The state at its end.
    pub after: &'a State,
    /// The forces of the ground at the body's contact points, N.
    pub forces: &'a [Vector3<f64>],
    /// What it lacks.
    pub residual: Residual,
}

/// Looks at every step; ends the run where it says that all that matters is past.
pub type Until<'a> = &'a mut dyn FnMut(&Taken<'_>) -> bool;

/// What a run came to, relative to the slope.
#[derive(Debug, Clone, PartialEq)]
pub struct Run {
    /// h, s.
    pub time_step: f64,
    /// The states, one more than steps.
    pub states: Vec<State>,
    /// The sum of all contact forces of each step, N.
    pub forces: Vec<Vector3<f64>>,
    /// What each step lacks.
    pub residuals: Vec<Residual>,
}

/// All states of a run are in memory, 0.2 kB each.
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
    pub worst_residual: f64,
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
            worst_residual: 0.0,
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
        self.run_until(setup, &mut |_| false)
    }

    /// Simulates `setup` for its duration or until a step is past all that matters.
    ///
    /// # Errors
    /// A setup that the model refuses, or of more than a million steps.
    pub fn run_until(&mut self, setup: &Setup, until: Until<'_>) -> Result<Run, Unsuitable> {
        let steps = (setup.duration / self.time_step).round();
        if steps > MOST_STEPS {
            return Err(Unsuitable::Motion(format!(
                "the motion takes {:.3} s, more than a million steps of {} s",
                setup.duration, self.time_step
            )));
        }
        let incline = Incline::new(setup.slope);
        let mut simulation = self.simulation(setup, incline.state_to_world(&setup.start))?;
        let mut record = StepRecord::new();
        let mut forces = vec![Vector3::zeros(); setup.body.contact_points().len()];
        let mut before = setup.start;
        let mut run = Run {
            time_step: self.time_step,
            states: vec![before],
            forces: Vec::new(),
            residuals: Vec::new(),
        };
        for _ in 0..steps as usize {
            simulation.step(&mut record)?;
            self.count(&record);
            forces.fill(Vector3::zeros());
            for contact in &record.solution.contacts {
                forces[contact.key.point] = incline.vector_from_world(&contact.force);
            }
            let after = incline.state_from_world(record.next());
            let residual = self.residual(setup, &record);
            run.forces.push(forces.iter().sum());
            run.residuals.push(residual);
            run.states.push(after);
            if until(&Taken { before: &before, after: &after, forces: &forces, residual }) {
                break;
            }
            before = after;
        }
        Ok(run)
    }

    fn simulation(&self, setup: &Setup, start: State) -> Result<Simulation<'a>, Error> {
        let world = World::new(Parameters {
            bodies: vec![setup.body.clone()],
            ground: Plane::sloping(setup.slope)?,
            gravity: Vector3::new(0.0, 0.0, -setup.gravity),
            friction: setup.friction,
            time_step: self.time_step,
        })?;
        let solver = (self.make_solver)(&world)?;
        let motion = Motion::Contact { detection: Detection::default(), solver };
        let mut simulation = Simulation::new(world, [start], motion)?;
        simulation.set_load(0, setup.load.clone())?;
        if let Some(flag) = &self.interrupt {
            simulation.interrupt_by(Arc::clone(flag));
        }
        Ok(simulation)
    }

    /// What a step lacks. The equations of motion are evaluated row by row, with Euclidean
    /// norms; the contact laws are those of its certificate.
    ///
    /// ```text
    /// kinematics = max(|r⁺ − r − h v⁺|/h, 2ℓ |8b|/h)
    /// momentum   = max(|v⁺ − v − h (F/m + g)|, ℓ |8d|)
    /// ```
    ///
    /// (A quaternion that is off by δ is one that is turned by 2 δ.)
    fn residual(&self, setup: &Setup, record: &StepRecord) -> Residual {
        let (h, body) = (self.time_step, &setup.body);
        let (before, after) = (record.state(), record.next());
        let external = setup.load.wrench(record.index, h, &before.attitude);
        let to_body = rotation(&before.attitude).transpose();
        let (mut force, mut torque) = (external.force, external.torque);
        for contact in &record.solution.contacts {
            let point = body.contact_points()[contact.key.point].position;
            force += contact.force;
            torque += point.cross(&(to_body * contact.force));
        }
        torque -= after.spin.cross(&(body.inertia() * after.spin));
        let gravity = Vector3::new(0.0, 0.0, -setup.gravity);

        let position = after.position - before.position - h * after.velocity;
        let attitude = after.attitude - advance(&before.attitude, &after.spin, h);
        let velocity = after.velocity - before.velocity - h * (force / body.mass() + gravity);
        let spin = after.spin - before.spin - h * (body.inertia_inverse() * torque);
        let certificate = &record.certificate;
        Residual {
            kinematics: position.norm().max(2.0 * body.reach() * attitude.norm()) / h,
            momentum: velocity.norm().max(body.reach() * spin.norm()),
            normal: certificate.normal_law.max(certificate.penetration),
            friction: certificate.friction_law,
        }
        .excused(h * SMOOTHING / body.mass())
    }

    fn count(&mut self, record: &StepRecord) {
        self.steps += 1;
        self.failed += u64::from(record.report.status == StepStatus::Failed);
        self.fallback += u64::from(record.report.status == StepStatus::Fallback);
        let certificate = record.certificate.residual();
        if certificate.is_nan() || certificate > self.worst_residual {
            self.worst_residual = certificate;
        }
    }
}

impl Run {
    /// Steps.
    #[must_use]
    pub fn steps(&self) -> usize {
        self.residuals.len()
    }

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
}
