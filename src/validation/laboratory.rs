//! Simulates the problems' runs and keeps what the answers are compared with. Nothing else
//! of the validation knows how a simulation is made.

use super::incline::Incline;
use super::quantity::Label;
use super::residual::Residual;
use super::{Curve, Unsuitable};
use crate::contact::detection::Detection;
use crate::contact::{Partner, Plane};
use crate::error::Error;
use crate::geometry::Piece;
use crate::joint::{Drive, Joint, JointAxis, JointForce};
use crate::mechanics::quaternion::{advance, rotation};
use crate::mechanics::{Load, Polyline, RigidBody, Rotation, State};
use crate::simulation::{Motion, Simulation, StepRecord};
use crate::step::{ContactForce, StepSolution, StepSolver, StepStatus};
use crate::step_nlp::SMOOTHING;
use crate::world::{Fixed, Parameters, World};
use nalgebra::{Matrix3, Vector3};
use std::sync::Arc;
use std::sync::atomic::AtomicBool;

/// Makes the solver under test for a world.
pub type MakeSolver<'a> = dyn Fn(&World) -> Result<Box<dyn StepSolver>, Error> + 'a;

/// A body of a run.
#[derive(Debug, Clone)]
pub struct Subject {
    /// The body.
    pub body: RigidBody,
    /// At the start, relative to the slope: x downhill, z along its normal.
    pub start: State,
    /// The external load.
    pub load: Load,
}

/// A torque about an axis of a joint, N m, where the bodies are at these states.
pub type Torque = fn(&[State]) -> f64;

/// One run of a problem.
#[derive(Debug, Clone)]
pub struct Setup {
    /// The bodies.
    pub bodies: Vec<Subject>,
    /// Pieces that never move, relative to the slope.
    pub fixed: Vec<Fixed>,
    /// What ties the bodies, on level ground.
    pub joints: Vec<Joint>,
    /// Torques about the z axes of joints, N m, by these and the states at a step's start, in place of what else drives them.
    pub torques: Vec<(usize, Torque)>,
    /// Coefficients of friction between a body and a partner, where they are not `friction`.
    pub frictions: Vec<(usize, Partner, f64)>,
    /// Of the ground, which falls towards +x, degrees.
    pub slope: f64,
    /// g, m/s², downwards.
    pub gravity: f64,
    /// μ.
    pub friction: f64,
    /// e.
    pub restitution: f64,
    /// How long it goes on, s.
    pub duration: f64,
}

impl Subject {
    /// A body without a load.
    #[must_use]
    pub fn new(body: RigidBody, start: State) -> Self {
        Self { body, start, load: Load::none() }
    }

    /// A solid box without a load; masses in kg, `half_sides` in m.
    pub(super) fn solid_box(
        mass: f64,
        half_sides: Vector3<f64>,
        start: State,
    ) -> Result<Self, Error> {
        Ok(Self::new(RigidBody::solid_box(mass, half_sides)?, start))
    }

    /// The same, pulled by `force` (N, world) at its centre of mass.
    pub(super) fn pulled(self, force: Polyline) -> Result<Self, Error> {
        Ok(Self { load: Load::new(force, Polyline::default(), Vector3::zeros())?, ..self })
    }

    /// Equal balls without a load, of this `radius` (m), from each of `starts`.
    pub(super) fn balls(
        mass: f64,
        radius: f64,
        starts: impl IntoIterator<Item = State>,
    ) -> Result<Vec<Self>, Error> {
        let (ball, _) = RigidBody::solid(mass, &[Piece::sphere(radius)?])?;
        Ok(starts.into_iter().map(|start| Self::new(ball.clone(), start)).collect())
    }
}

impl Setup {
    /// These bodies on level ground, and nothing else.
    #[must_use]
    pub fn new(bodies: Vec<Subject>, gravity: f64, friction: f64, duration: f64) -> Self {
        Self {
            bodies,
            fixed: Vec::new(),
            joints: Vec::new(),
            torques: Vec::new(),
            frictions: Vec::new(),
            slope: 0.0,
            gravity,
            friction,
            restitution: 0.0,
            duration,
        }
    }
}

/// A step that was taken, relative to the slope.
#[derive(Debug, Clone, Copy)]
pub struct Taken<'a> {
    /// The states at its start, one a body.
    pub before: &'a [State],
    /// The states at its end.
    pub after: &'a [State],
    /// The forces of its contacts.
    pub contacts: &'a [ContactForce],
    /// The forces of its joints.
    pub joints: &'a [JointForce],
    /// What it lacks.
    pub residual: Residual,
}

impl<'a> Taken<'a> {
    /// The contacts between body `body` and `partner`, in either order.
    pub(super) fn between(
        &self,
        body: usize,
        partner: Partner,
    ) -> impl Iterator<Item = &'a ContactForce> {
        self.contacts.iter().filter(move |contact| {
            let key = &contact.key;
            let other = Partner::Body(body);
            key.body == body && key.partner == partner
                || key.partner == other && Partner::Body(key.body) == partner
        })
    }
}

/// Looks at every step; ends the run where it says that all that matters is past.
pub type Until<'a> = &'a mut dyn FnMut(&Taken<'_>) -> bool;

/// What a run came to, relative to the slope.
#[derive(Debug, Clone, PartialEq)]
pub struct Run {
    /// h, s.
    pub time_step: f64,
    /// What each step lacks.
    pub residuals: Vec<Residual>,
    /// One a body.
    tracks: Vec<Track>,
}

/// What became of a body.
#[derive(Debug, Clone, PartialEq)]
struct Track {
    /// One more than steps.
    states: Vec<State>,
    /// The sum of the contact forces of each step, N.
    forces: Vec<Vector3<f64>>,
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
    /// Whether the solver of the last run has the selection rule.
    selects: bool,
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
            selects: false,
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
        Unsuitable::when(steps > MOST_STEPS, || {
            format!(
                "the motion takes {:.3} s, more than a million steps of {} s",
                setup.duration, self.time_step
            )
        })?;
        let incline = Incline::new(setup.slope);
        let (mut simulation, selects) = self.simulation(setup, &incline)?;
        self.selects = selects;
        let mut record = StepRecord::new();
        let mut solution = StepSolution::default();
        let mut before: Vec<State> = setup.bodies.iter().map(|subject| subject.start).collect();
        let track = |start: &State| Track { states: vec![*start], forces: Vec::new() };
        let tracks = before.iter().map(track).collect();
        let mut run = Run { time_step: self.time_step, residuals: Vec::new(), tracks };
        for _ in 0..steps as usize {
            for (joint, torque) in &setup.torques {
                let drive = Drive { force: torque(&before), ..Drive::NONE };
                simulation.set_drive(*joint, JointAxis::Angular(2), drive)?;
            }
            simulation.step(&mut record)?;
            self.count(&record);
            incline.solution_from_world(&record.solution, &mut solution);
            let residual = self.residual(setup, &record);
            run.residuals.push(residual);
            for (index, track) in run.tracks.iter_mut().enumerate() {
                track.states.push(solution.states[index]);
                track.forces.push(solution.total_force(index));
            }
            let StepSolution { states: after, contacts, joints, .. } = &solution;
            if until(&Taken { before: &before, after, contacts, joints, residual }) {
                break;
            }
            before.copy_from_slice(after);
        }
        Ok(run)
    }

    /// Simulates `setup` for its duration and looks at every step; what is seen in each of them.
    pub(super) fn watch<T>(
        &mut self,
        setup: &Setup,
        mut look: impl FnMut(&Taken<'_>) -> T,
    ) -> Result<(Run, Vec<T>), Unsuitable> {
        let mut seen = Vec::new();
        let run = self.run_until(setup, &mut |step| {
            seen.push(look(step));
            false
        })?;
        Ok((run, seen))
    }

    /// Whether the solver of the last run takes the selection rule where the laws leave the motion
    /// open ([`StepSolver::selects`]).
    pub(super) fn selects(&self) -> bool {
        self.selects
    }

    /// The simulation, and whether its solver has the selection rule.
    fn simulation(
        &self,
        setup: &Setup,
        incline: &Incline,
    ) -> Result<(Simulation<'a>, bool), Error> {
        let mut world = World::new(Parameters {
            bodies: setup.bodies.iter().map(|subject| subject.body.clone()).collect(),
            ground: Some(Plane::sloping(setup.slope)?),
            gravity: Vector3::new(0.0, 0.0, -setup.gravity),
            friction: setup.friction,
            time_step: self.time_step,
            rotation: Rotation::Momentum,
        })?;
        world = world.with_restitution(setup.restitution)?;
        let fixed = setup.fixed.iter().map(|fixed| incline.fixed_to_world(fixed));
        world = world.with_fixed(fixed.collect::<Result<_, _>>()?)?;
        for &(body, partner, friction) in &setup.frictions {
            world = world.with_friction_between(body, partner, friction)?;
        }
        if !setup.joints.is_empty() {
            world = world.with_joints(setup.joints.clone())?;
        }
        let solver = (self.make_solver)(&world)?;
        let selects = solver.selects();
        let motion = Motion::Contact { detection: Detection::default(), solver };
        let starts = setup.bodies.iter().map(|subject| incline.state_to_world(&subject.start));
        let mut simulation = Simulation::new(world, starts, motion)?;
        for (index, subject) in setup.bodies.iter().enumerate() {
            simulation.set_load(index, subject.load.clone())?;
        }
        if let Some(flag) = &self.interrupt {
            simulation.interrupt_by(Arc::clone(flag));
        }
        Ok((simulation, selects))
    }

    /// What a step lacks: the most that a body does. The equations of motion are evaluated row
    /// by row, with Euclidean norms; the contact laws are those of its certificate.
    ///
    /// ```text
    /// kinematics = max(|r⁺ − r − h v⁺|/h, 2ℓ |8b|/h)
    /// momentum   = max(|v⁺ − v − h (F/m + g)|, ℓ |8d|)
    /// ```
    ///
    /// (A quaternion that is off by δ is one that is turned by 2 δ.)
    fn residual(&self, setup: &Setup, record: &StepRecord) -> Residual {
        let certificate = &record.certificate;
        let mut residual = Residual {
            normal: certificate.normal_law.max(certificate.penetration),
            friction: certificate.friction_law,
            ..Residual::default()
        };
        for index in 0..setup.bodies.len() {
            let (kinematics, momentum) = self.motion_residual(setup, record, index);
            residual.kinematics = residual.kinematics.max(kinematics);
            residual.momentum = residual.momentum.max(momentum);
        }
        if !setup.joints.is_empty() {
            // Forces of joints are those of the certificate.
            residual.momentum = certificate.dynamics;
            residual.joint = certificate.joint.max(certificate.joint_law);
        }
        let lightest = setup.bodies.iter().map(|subject| subject.body.mass());
        let lightest = lightest.fold(f64::INFINITY, f64::min);
        residual.excused(self.time_step * SMOOTHING / lightest)
    }

    /// The residual of the equations of motion of body `index`: kinematics and momentum.
    fn motion_residual(&self, setup: &Setup, record: &StepRecord, index: usize) -> (f64, f64) {
        let (h, Subject { body, load, .. }) = (self.time_step, &setup.bodies[index]);
        let (before, after) = (&record.states[index], &record.solution.states[index]);
        let external = load.wrench(record.index, h, &before.attitude);
        let to_body = rotation(&before.attitude).transpose();
        let (mut force, mut torque) = (external.force, external.torque);
        for (contact, found) in record.contacts.iter().zip(&record.solution.contacts) {
            if contact.key.body == index {
                force += found.force;
                torque += contact.lever.cross(&(to_body * found.force));
            } else if contact.key.partner == Partner::Body(index) {
                let point = record.states[contact.key.body].position + contact.arm;
                let lever = to_body * (point - before.position);
                force -= found.force;
                torque -= lever.cross(&(to_body * found.force));
            }
        }
        // P^±(ω) (eq. 34), as a matrix times I ω.
        let momentum = |spin: &Vector3<f64>, h: f64| {
            let turned = spin.cross_matrix() * (0.5 * h);
            let along = spin * spin.transpose() * (0.25 * h * h);
            (Matrix3::identity() + turned + along) * body.inertia() * spin
        };
        let gravity = Vector3::new(0.0, 0.0, -setup.gravity);

        let position = after.position - before.position - h * after.velocity;
        let attitude = after.attitude - advance(&before.attitude, &after.spin, h);
        let velocity = after.velocity - before.velocity - h * (force / body.mass() + gravity);
        let turning = momentum(&after.spin, h) - momentum(&before.spin, -h) - h * torque;
        let spin = body.inertia_inverse() * turning;
        (
            position.norm().max(2.0 * body.reach() * attitude.norm()) / h,
            velocity.norm().max(body.reach() * spin.norm()),
        )
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

    /// The states of body `index`, one more than steps.
    ///
    /// # Panics
    /// If there is no such body.
    #[must_use]
    pub fn states(&self, index: usize) -> &[State] {
        &self.tracks[index].states
    }

    /// The sum of all contact forces on body `index` in each step, N.
    ///
    /// # Panics
    /// If there is no such body.
    #[must_use]
    pub fn forces(&self, index: usize) -> &[Vector3<f64>] {
        &self.tracks[index].forces
    }

    /// The last state of body `index`.
    ///
    /// # Panics
    /// If there is no such body.
    #[must_use]
    pub fn end(&self, index: usize) -> &State {
        &self.states(index)[self.steps()]
    }

    /// What is `measured` of the states of body `index`.
    pub(super) fn curve(
        &self,
        label: Label,
        index: usize,
        measured: impl Fn(&State) -> f64,
    ) -> Curve {
        Curve::of(label, self, |k| measured(&self.states(index)[k]))
    }

    /// What was `measured` in the steps, from which the states come.
    pub(super) fn curve_of_steps(&self, label: Label, measured: impl Fn(usize) -> f64) -> Curve {
        Curve::of(label, self, |k| measured(k.saturating_sub(1)))
    }

    /// The fastest that a body is at the end, m/s.
    pub(super) fn fastest_at_end(&self) -> f64 {
        let ends = (0..self.tracks.len()).map(|index| self.end(index));
        ends.map(|state| state.velocity.norm()).fold(0.0, f64::max)
    }

    /// The states of all bodies.
    pub(super) fn all_states(&self) -> impl Iterator<Item = &State> {
        self.tracks.iter().flat_map(|track| &track.states)
    }
}
