//! The simulation loop: one step after another, each with its report and certificate.
//!
//! States, forces and loads are in the world's frame here; the steps between are solved in
//! the ground's ([`crate::plane`]) by a [solver](crate::solver) and judged by their
//! [certificate](crate::certificate).

use crate::certificate::{Certificate, certify_contact_step, certify_rk4_step};
use crate::detection::Detection;
use crate::dynamics::rk4_step;
use crate::error::Error;
use crate::load::Load;
use crate::model::ContactModel;
use crate::solver::native::NativeSolver;
use crate::solver::{Decision, Step, StepReport, StepSolver, StepStatus};
use crate::state::{State, Wrench};
use nalgebra::Vector3;

/// One step k → k+1 of a simulation, as it is written to a file.
#[derive(Debug, Clone, PartialEq)]
pub struct StepRecord {
    /// k.
    pub index: u64,
    /// X at step k, world.
    pub state: State,
    /// The solution of the step, its X at k+1 and forces in the world's frame; the slacks
    /// and multipliers are the same in every frame.
    pub solution: Decision,
    /// α of the step.
    pub active: Vec<bool>,
    /// How the step ended.
    pub report: StepReport,
    /// How exact the step is.
    pub certificate: Certificate,
}

impl StepRecord {
    /// A record to be filled by [`Simulation::step`].
    #[must_use]
    pub fn new(state: &State, contacts: usize) -> Self {
        Self {
            index: 0,
            state: *state,
            solution: Decision::at_rest_in(state, contacts),
            active: vec![false; contacts],
            report: StepReport::without_problem(StepStatus::End),
            certificate: Certificate::default(),
        }
    }
}

/// What moves the body from one step to the next. Its solver must be made for the model of the
/// simulation.
pub enum Motion<'a> {
    /// The contact step, with a rule for the contact flags and a solver.
    Contact {
        /// Which points may carry a force.
        detection: Detection,
        /// Who solves the step.
        solver: Box<dyn StepSolver + 'a>,
    },
    /// Fourth-order Runge–Kutta, no ground.
    Floating,
}

impl<'a> Motion<'a> {
    /// Contact by `solver`, with the usual rule for the contact flags.
    #[must_use]
    pub fn contact(solver: impl StepSolver + 'a) -> Self {
        Self::Contact { detection: Detection::default(), solver: Box::new(solver) }
    }

    /// Contact by tumble's own solver, with the usual rule for the contact flags.
    #[must_use]
    pub fn native(model: &ContactModel) -> Self {
        Self::contact(NativeSolver::new(model))
    }
}

/// A running simulation.
pub struct Simulation<'a> {
    model: ContactModel,
    motion: Motion<'a>,
    /// World, besides the load.
    wrench: Wrench,
    load: Load,
    index: u64,
    /// X at step k, ground's frame.
    state: State,
    /// X at step k − 1, ground's frame, where the last step can be taken back.
    state_before: Option<State>,
    /// The step's solution, ground's frame.
    solution: Decision,
    /// The previous step's solution, the start of the next.
    previous: Decision,
    forces: Vec<Vector3<f64>>,
}

impl<'a> Simulation<'a> {
    /// A simulation of `model` from `state` (world).
    ///
    /// # Errors
    /// A state that [`State::validate`] refuses.
    pub fn new(model: ContactModel, state: State, motion: Motion<'a>) -> Result<Self, Error> {
        state.validate()?;
        let contacts = model.contact_count();
        let state = model.plane().state_to_ground(&state);
        Ok(Self {
            motion,
            wrench: Wrench::zero(),
            load: Load::none(),
            index: 0,
            state,
            state_before: None,
            solution: Decision::at_rest_in(&state, contacts),
            previous: Decision::at_rest_in(&state, contacts),
            forces: vec![Vector3::zeros(); contacts],
            model,
        })
    }

    /// The model.
    #[must_use]
    pub fn model(&self) -> &ContactModel {
        &self.model
    }

    /// X at the current step, world.
    #[must_use]
    pub fn state(&self) -> State {
        self.model.plane().state_to_world(&self.state)
    }

    /// k.
    #[must_use]
    pub fn index(&self) -> u64 {
        self.index
    }

    /// A record to be filled by [`Simulation::step`], of as many contacts as the model has.
    #[must_use]
    pub fn record(&self) -> StepRecord {
        StepRecord::new(&self.state(), self.model.contact_count())
    }

    /// Exchanges what moves the body from here on with `motion`, which must be made for this
    /// simulation's model: to repeat a step with another solver, after
    /// [`Simulation::take_back`].
    pub fn swap_motion(&mut self, motion: &mut Motion<'a>) {
        std::mem::swap(&mut self.motion, motion);
    }

    /// Sets the external wrench of the steps to come (force in N, world; torque in N m,
    /// body), gravity and the load apart: for a program that decides it from step to step.
    pub fn set_wrench(&mut self, wrench: Wrench) {
        self.wrench = wrench;
    }

    /// Sets the external load over time, counted from step 0.
    pub fn set_load(&mut self, load: Load) {
        self.load = load;
    }

    /// The wrench of the step to come, its force in the ground's frame.
    fn wrench_now(&self) -> Wrench {
        let plane = self.model.plane();
        let mut wrench = self.wrench;
        if !self.load.is_none() {
            let attitude = plane.state_to_world(&self.state).attitude;
            let load = self.load.wrench(self.index, self.model.time_step(), &attitude);
            wrench = wrench.plus(&load);
        }
        Wrench { force: plane.vector_to_ground(&wrench.force), torque: wrench.torque }
    }

    /// Advances by one step and describes it in `record`, which is made anew if it is not
    /// one of this simulation's. A step that did not converge is taken all the same, with
    /// its status in the report.
    ///
    /// # Errors
    /// Only where a step could not be posed; the simulation stays where it was.
    pub fn step(&mut self, record: &mut StepRecord) -> Result<(), Error> {
        let contacts = self.model.contact_count();
        if record.active.len() != contacts || record.solution.layout().contacts() != contacts {
            *record = self.record();
        }
        let wrench = self.wrench_now();
        let plane = self.model.plane();
        record.index = self.index;
        record.state = plane.state_to_world(&self.state);
        let Self { model, motion, state, previous, solution, .. } = self;
        record.report = match motion {
            Motion::Floating => {
                let mut total = wrench;
                total.force += model.gravity() * model.body().mass();
                let next = rk4_step(model.body(), state, &total, model.time_step());
                solution.set_free_flight(&next);
                record.active.fill(false);
                record.certificate = certify_rk4_step(model, state, &next, &total);
                StepReport::without_problem(StepStatus::Free)
            }
            Motion::Contact { detection, solver } => {
                let free = model.free_flight(state, &wrench);
                let mut report = if detection.flag(model, state, &free, &mut record.active) {
                    let step = Step { model, state, wrench: &wrench, free: &free, previous };
                    solver.solve(&step, &mut record.active, solution)?
                } else {
                    solution.set_free_flight(&free);
                    StepReport::without_problem(StepStatus::Free)
                };
                for (slot, force) in self.forces.iter_mut().zip(solution.forces()) {
                    *slot = force;
                }
                let next = solution.state();
                record.certificate =
                    certify_contact_step(model, state, &next, &self.forces, &wrench);
                // Free flight is exact but for an implicit gyroscopic equation without a
                // solution in reach; a solver may think better of a point than it is.
                let accepted = match report.status {
                    StepStatus::Free => 0.0,
                    _ => solver.accepted_certificate(),
                };
                let within = record.certificate.worst() <= accepted;
                if !within && !record.certificate.is_rounding(model, state, &next) {
                    report.status = StepStatus::Failed;
                }
                report
            }
        };
        record.solution.copy_from(solution);
        record.solution.turn_to_world(model.plane());
        self.state_before = Some(*state);
        self.state = solution.state();
        std::mem::swap(&mut self.previous, &mut self.solution);
        self.index += 1;
        Ok(())
    }

    /// Goes back to before the step that `record` describes, which must be the last one
    /// taken: for a run that ends there, or to repeat the step in another way. Any other
    /// record changes nothing.
    pub fn take_back(&mut self, record: &StepRecord) {
        if record.index + 1 != self.index {
            return;
        }
        if let Some(before) = self.state_before.take() {
            self.state = before;
            self.index = record.index;
            std::mem::swap(&mut self.previous, &mut self.solution);
        }
    }

    /// Describes the current state as the last row of a trajectory: no step follows.
    pub fn end(&self, record: &mut StepRecord) {
        *record = self.record();
        record.index = self.index;
    }
}
