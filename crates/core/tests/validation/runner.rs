//! Simulation of the problems' setups with the solver under test.

use crate::Refusal;
use crate::quantity::{Convergence, QuantityLabel, TestQuantity, equal, order};
use crate::residual::ResidualCheck;
use crate::turning::{step_attitude, turned_momentum};
use nalgebra::Vector3;
use tumble_core::contact::detection::Detection;
use tumble_core::contact::{Partner, Plane};
use tumble_core::error::Error;
use tumble_core::geometry::Piece;
use tumble_core::joint::{Drive, Joint, JointAxis, JointForce};
use tumble_core::mechanics::quaternion::rotation;
use tumble_core::mechanics::{Load, Polyline, RigidBody, State};
use tumble_core::simulation::{Motion, Simulation, StepRecord};
use tumble_core::step::{ContactForce, StepSolver, StepStatus};
use tumble_core::world::{Coefficient, Integrator, Parameters, World};

/// Makes the solver under test for a world.
pub type MakeSolver<'a> = dyn Fn(&World) -> Result<Box<dyn StepSolver>, Error> + 'a;

/// A body of a run.
#[derive(Debug, Clone)]
pub(crate) struct Subject {
    pub body: RigidBody,
    /// The start in the ground's frame: x downhill, z along the normal.
    pub start: State,
    pub load: Load,
}

/// A torque about a joint's z axis as a function of the states, N m.
pub(crate) type Torque = fn(&[State]) -> f64;

/// One run of a problem.
#[derive(Debug, Clone, Default)]
pub(crate) struct Setup {
    pub bodies: Vec<Subject>,
    /// Fixed pieces, on level ground.
    pub fixed: Vec<Piece>,
    /// Joints, on level ground.
    pub joints: Vec<Joint>,
    /// Joints driven by a torque, evaluated at the start of each step.
    pub torques: Vec<(usize, Torque)>,
    /// Coefficients of friction of pairs that differ from `friction`.
    pub frictions: Vec<(usize, Partner, f64)>,
    /// Slope of the ground, degrees; it falls towards +x.
    pub slope: f64,
    /// g, m/s², downwards.
    pub gravity: f64,
    /// μ.
    pub friction: f64,
    /// e.
    pub restitution: f64,
    /// Simulated time, s.
    pub duration: f64,
}

impl Subject {
    /// A body without a load.
    pub fn new(body: RigidBody, start: State) -> Self {
        Self { body, start, load: Load::none() }
    }

    /// A solid box; mass in kg, `half_sides` in m.
    pub fn solid_box(mass: f64, half_sides: Vector3<f64>, start: State) -> Result<Self, Error> {
        Ok(Self::new(RigidBody::solid_box(mass, half_sides)?, start))
    }

    /// The body with a force (N, world) at its centre of mass.
    pub fn pulled(self, force: Polyline) -> Result<Self, Error> {
        Ok(Self { load: Load::new(force, Polyline::default(), Vector3::zeros())?, ..self })
    }

    /// Equal balls of this `radius` (m), one for each start.
    pub fn balls(
        mass: f64,
        radius: f64,
        starts: impl IntoIterator<Item = State>,
    ) -> Result<Vec<Self>, Error> {
        let (ball, _) = RigidBody::solid(mass, &[Piece::sphere(radius)?])?;
        Ok(starts.into_iter().map(|start| Self::new(ball.clone(), start)).collect())
    }
}

impl Setup {
    /// These bodies on level ground.
    pub fn new(bodies: Vec<Subject>, gravity: f64, friction: f64, duration: f64) -> Self {
        Self { bodies, gravity, friction, duration, ..Self::default() }
    }

    /// A solid box on level ground.
    pub fn from_box(
        mass: f64,
        half_sides: Vector3<f64>,
        start: State,
        gravity: f64,
        friction: f64,
        duration: f64,
    ) -> Result<Self, Error> {
        let bodies = vec![Subject::solid_box(mass, half_sides, start)?];
        Ok(Self::new(bodies, gravity, friction, duration))
    }
}

/// A step of a run, in the ground's frame.
#[derive(Debug, Clone, Copy)]
pub(crate) struct TestStep<'a> {
    /// States at the start of the step, one a body.
    pub before: &'a [State],
    /// States at the end.
    pub after: &'a [State],
    pub contacts: &'a [ContactForce],
    pub joints: &'a [JointForce],
    pub residual: ResidualCheck,
}

impl<'a> TestStep<'a> {
    /// Contacts between body `body` and `partner`, in either order.
    pub fn between(
        &self,
        body: usize,
        partner: Partner,
    ) -> impl Iterator<Item = &'a ContactForce> + use<'a> {
        self.contacts.iter().filter(move |ContactForce { key, .. }| {
            key.body == body && key.partner == partner
                || key.partner == Partner::Body(body) && Partner::Body(key.body) == partner
        })
    }
}

/// The trajectory of a run, in the ground's frame.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct TestRun {
    /// h, s.
    pub time_step: f64,
    /// The residual of each step.
    pub residuals: Vec<ResidualCheck>,
    /// States of each body, one more than steps.
    states: Vec<Vec<State>>,
    /// The sum of the contact forces on each body in each step, N.
    forces: Vec<Vec<Vector3<f64>>>,
}

/// The trajectory is in memory, 0.2 kB a state.
const MOST_STEPS: f64 = 1e6;

/// Statistics of all runs of a problem.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct StepCounts {
    /// Steps.
    pub steps: u64,
    /// Steps that did not converge.
    pub failed: u64,
    /// Steps solved by a fallback solver.
    pub fallback: u64,
    /// The largest certificate residual, m/s.
    pub worst_residual: f64,
}

/// Simulates setups with one solver and one time step.
pub struct Runner<'a> {
    make_solver: &'a MakeSolver<'a>,
    smoothing: f64,
    /// h, s.
    pub(crate) time_step: f64,
    /// Statistics of the runs so far.
    pub counts: StepCounts,
    /// True if the solver of the last run has the selection rule
    /// ([`IslandSolver`](tumble_core::step::IslandSolver)).
    pub(crate) selects: bool,
}

impl<'a> Runner<'a> {
    /// A runner for a solver and a time step (s).
    pub fn new(make_solver: &'a MakeSolver<'a>, time_step: f64) -> Self {
        let counts = StepCounts::default();
        Self { make_solver, smoothing: 0.0, time_step, counts, selects: false }
    }

    /// The runner for a solver that smooths the norm of friction by ε (N).
    #[must_use]
    #[allow(dead_code)] // Ipopt's tests use it, in the package `tumble`.
    pub fn smoothed(self, smoothing: f64) -> Self {
        Self { smoothing, ..self }
    }

    /// Simulates `setup` for its duration.
    pub(crate) fn run(&mut self, setup: &Setup) -> Result<TestRun, Refusal> {
        self.run_until(setup, |_| false)
    }

    /// Simulates `setup` for its duration, and collects the result of `look` for each step.
    pub(crate) fn watch<T>(
        &mut self,
        setup: &Setup,
        mut look: impl FnMut(&TestStep<'_>) -> T,
    ) -> Result<(TestRun, Vec<T>), Refusal> {
        let mut seen = Vec::new();
        let run = self.run_until(setup, |step| {
            seen.push(look(step));
            false
        })?;
        Ok((run, seen))
    }

    /// Simulates `setup` for its duration or until a step ends the run.
    pub(crate) fn run_until(
        &mut self,
        setup: &Setup,
        mut ends: impl FnMut(&TestStep<'_>) -> bool,
    ) -> Result<TestRun, Refusal> {
        let (h, duration) = (self.time_step, setup.duration);
        let steps = (duration / h).round();
        let why = format!(
            "the motion takes {duration:.3} s, more than a million steps of {h} s; use a larger \
             time step"
        );
        Refusal::when(steps > MOST_STEPS, why)?;
        let ground = Plane::sloping(setup.slope)?;
        let mut simulation = self.simulation(setup, &ground)?;
        let mut record = StepRecord::new();
        let mut before: Vec<State> = setup.bodies.iter().map(|subject| subject.start).collect();
        let mut run = TestRun {
            time_step: h,
            residuals: Vec::new(),
            states: before.iter().map(|start| vec![*start]).collect(),
            forces: vec![Vec::new(); before.len()],
        };
        for _ in 0..steps as usize {
            for (joint, torque) in &setup.torques {
                let drive = Drive { force: torque(&before), ..Drive::NONE };
                simulation.set_drive(*joint, JointAxis::Angular(2), drive)?;
            }
            simulation.step(&mut record)?;
            self.count(&record);
            let residual = self.residual(setup, &record);
            let mut solution = record.first().solution.clone();
            for state in &mut solution.states {
                *state = ground.state_to_ground(state);
            }
            for contact in &mut solution.contacts {
                contact.force = ground.vector_to_ground(&contact.force);
            }
            run.residuals.push(residual);
            for (index, state) in solution.states.iter().enumerate() {
                run.states[index].push(*state);
                run.forces[index].push(solution.total_force(index));
            }
            let (after, contacts, joints) =
                (&solution.states, &solution.contacts, &solution.joints);
            if ends(&TestStep { before: &before, after, contacts, joints, residual }) {
                break;
            }
            before.copy_from_slice(after);
        }
        Ok(run)
    }

    fn simulation(&mut self, setup: &Setup, ground: &Plane) -> Result<Simulation<'a>, Error> {
        let mut world = World::new(Parameters {
            ground: Some(ground.clone()),
            gravity: Vector3::new(0.0, 0.0, -setup.gravity),
            friction: setup.friction,
            time_step: self.time_step,
            ..Parameters::new(setup.bodies.iter().map(|subject| subject.body.clone()).collect())
        })?
        .with_integrator(Integrator::Euler)
        .with_coefficient(Coefficient::Restitution, setup.restitution)?
        .with_fixed(setup.fixed.clone());
        for &(body, partner, friction) in &setup.frictions {
            world =
                world.with_coefficient_between(Coefficient::Friction, body, partner, friction)?;
        }
        if !setup.joints.is_empty() {
            world = world.with_joints(setup.joints.clone())?;
        }
        let mut solver = (self.make_solver)(&world)?;
        self.selects = solver.islands().is_some();
        let motion = Motion::Contact { detection: Detection::default(), solver };
        let starts = setup.bodies.iter().map(|subject| ground.state_to_world(&subject.start));
        let mut simulation = Simulation::new(world, starts, motion)?;
        for (index, subject) in setup.bodies.iter().enumerate() {
            simulation.set_load(index, subject.load.clone())?;
        }
        Ok(simulation)
    }

    /// The excused part of a step's residual. Equations of motion contribute the largest residual
    /// of all bodies. Contact and joint laws contribute the certificate's residuals.
    fn residual(&self, setup: &Setup, record: &StepRecord) -> ResidualCheck {
        let certificate = record.certificate();
        let mut residual = ResidualCheck {
            normal: certificate.normal_law.max(certificate.penetration),
            friction: certificate.friction_law,
            ..ResidualCheck::default()
        };
        for index in 0..setup.bodies.len() {
            let (kinematics, momentum) = self.motion_residual(setup, record, index);
            residual.kinematics = residual.kinematics.max(kinematics);
            residual.momentum = residual.momentum.max(momentum);
        }
        if !setup.joints.is_empty() {
            residual.momentum = certificate.dynamics;
            residual.joint = certificate.joint.max(certificate.joint_law);
        }
        let lightest = setup.bodies.iter().map(|subject| subject.body.mass());
        let lightest = lightest.fold(f64::INFINITY, f64::min);
        residual.excused(self.time_step * self.smoothing / lightest)
    }

    /// Kinematics and momentum of body `index`, each a speed (ℓ is the body's reach):
    ///
    /// ```text
    /// kinematics = max(|r⁺ − r − h v⁺|/h, 2ℓ |8b|/h)
    /// momentum   = max(|v⁺ − v − h (F/m + g)|, ℓ |8d|)
    /// ```
    ///
    /// (A quaternion with the error δ is a rotation with the error 2 δ.)
    fn motion_residual(&self, setup: &Setup, record: &StepRecord, index: usize) -> (f64, f64) {
        let (h, Subject { body, load, .. }) = (self.time_step, &setup.bodies[index]);
        let (before, after) = (&record.states()[index], &record.next_states()[index]);
        let external = load.wrench(record.index, h, &before.attitude);
        let to_body = rotation(&before.attitude).transpose();
        let (mut force, mut torque) = (external.force, external.torque);
        for (contact, found) in
            record.first().contacts.iter().zip(&record.first().solution.contacts)
        {
            if contact.key.body == index {
                force += found.force;
                torque += contact.lever.cross(&(to_body * found.force));
            } else if contact.key.partner == Partner::Body(index) {
                let point = record.states()[contact.key.body].position + contact.arm;
                let lever = to_body * (point - before.position);
                force -= found.force;
                torque -= lever.cross(&(to_body * found.force));
            }
        }
        let momentum = |spin: &Vector3<f64>, h: f64| turned_momentum(body.inertia(), spin, h);
        let gravity = Vector3::new(0.0, 0.0, -setup.gravity);

        let position = after.position - before.position - h * after.velocity;
        let attitude = after.attitude - step_attitude(&before.attitude, &after.spin, h);
        let velocity = after.velocity - before.velocity - h * (force / body.mass() + gravity);
        let turning = momentum(&after.spin, h) - momentum(&before.spin, -h) - h * torque;
        let spin = body.inertia_inverse() * turning;
        (
            position.norm().max(2.0 * body.reach() * attitude.norm()) / h,
            velocity.norm().max(body.reach() * spin.norm()),
        )
    }

    fn count(&mut self, record: &StepRecord) {
        let counts = &mut self.counts;
        counts.steps += 1;
        counts.failed += u64::from(record.status() == StepStatus::Failed);
        counts.fallback += u64::from(record.status() == StepStatus::Fallback);
        let certificate = record.residual();
        if certificate.is_nan() || certificate > counts.worst_residual {
            counts.worst_residual = certificate;
        }
    }
}

impl TestRun {
    /// The number of steps.
    pub fn steps(&self) -> usize {
        self.residuals.len()
    }

    /// Time of state `k`, s.
    pub fn time(&self, k: usize) -> f64 {
        k as f64 * self.time_step
    }

    /// Time of the last state, s.
    pub fn end_time(&self) -> f64 {
        self.time(self.steps())
    }

    /// States of body `index`, one more than steps.
    pub fn states(&self, index: usize) -> &[State] {
        &self.states[index]
    }

    /// The sum of the contact forces on body `index` in each step, N.
    pub fn forces(&self, index: usize) -> &[Vector3<f64>] {
        &self.forces[index]
    }

    /// The last state of body `index`.
    pub fn end(&self, index: usize) -> &State {
        &self.states(index)[self.steps()]
    }

    /// The largest value of a function of the states of body `index`, at least 0.
    pub fn most(&self, index: usize, measured: impl Fn(&State) -> f64) -> f64 {
        largest(self.states(index).iter().map(measured))
    }

    /// The distance of the centre of body `index` from its start at the end, m.
    pub fn moved(&self, index: usize) -> f64 {
        (self.end(index).position - self.states(index)[0].position).norm()
    }

    /// The largest distance of the centre of body `index` from its start, m.
    pub fn strayed(&self, index: usize) -> f64 {
        let start = self.states(index)[0].position;
        self.most(index, |state| (state.position - start).norm())
    }

    /// The distance ½ a t² at the end of a run from rest with the acceleration `a`. The discrete
    /// value after N steps is ½ a h² N (N + 1).
    pub fn accelerated(
        &self,
        label: QuantityLabel,
        measured: f64,
        a: f64,
        tolerance: f64,
    ) -> TestQuantity {
        let (h, steps, t) = (self.time_step, self.steps() as f64, self.end_time());
        let convergence = if a > 0.0 { order(1, steps) } else { Convergence::Exact };
        equal(label, measured, 0.5 * a * t * t, tolerance)
            .stepped(0.5 * a * h * h * steps * (steps + 1.0), convergence)
    }

    /// The mean over all bodies of a function of state `k`.
    pub fn mean(&self, k: usize, measured: impl Fn(&State) -> f64) -> f64 {
        let values = self.states.iter().map(|states| measured(&states[k]));
        values.sum::<f64>() / self.states.len() as f64
    }

    /// The speed of the fastest body at the end, m/s.
    pub fn fastest_at_end(&self) -> f64 {
        largest((0..self.states.len()).map(|index| self.end(index).velocity.norm()))
    }

    /// The states of all bodies.
    pub fn all_states(&self) -> impl Iterator<Item = &State> {
        self.states.iter().flatten()
    }
}

/// The largest of `values`, at least 0.
pub(crate) fn largest(values: impl IntoIterator<Item = f64>) -> f64 {
    values.into_iter().fold(0.0, f64::max)
}
