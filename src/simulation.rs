//! The simulation loop: one step after another, each with its report and certificate.

use crate::certificate::{Certificate, certify_contact_step, certify_rk4_step};
use crate::detection::Detection;
use crate::dynamics::rk4_step;
use crate::error::Error;
use crate::model::ContactModel;
use crate::solver::{Decision, Step, StepReport, StepSolver, StepStatus};
use crate::state::{State, Wrench};
use nalgebra::Vector3;

/// One step k → k+1 of a simulation, as it is written to a file.
#[derive(Debug, Clone, PartialEq)]
pub struct StepRecord {
    /// k.
    pub index: u64,
    /// X at step k.
    pub state: State,
    /// The solution of the step: X at k+1, forces, slacks, multipliers.
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

/// What moves the body from one step to the next.
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

/// A running simulation.
pub struct Simulation<'a> {
    model: ContactModel,
    motion: Motion<'a>,
    wrench: Wrench,
    index: u64,
    state: State,
    /// The previous step's solution, the start of the next.
    previous: Decision,
    forces: Vec<Vector3<f64>>,
}

impl<'a> Simulation<'a> {
    /// A simulation of `model` from `state`.
    ///
    /// # Errors
    /// A state that [`State::validate`] refuses.
    pub fn new(model: ContactModel, state: State, motion: Motion<'a>) -> Result<Self, Error> {
        state.validate()?;
        let contacts = model.contact_count();
        Ok(Self {
            motion,
            wrench: Wrench::zero(),
            index: 0,
            state,
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

    /// X at the current step.
    #[must_use]
    pub fn state(&self) -> &State {
        &self.state
    }

    /// k.
    #[must_use]
    pub fn index(&self) -> u64 {
        self.index
    }

    /// Sets the external wrench of the steps to come, gravity apart.
    pub fn set_wrench(&mut self, wrench: Wrench) {
        self.wrench = wrench;
    }

    /// Advances by one step and describes it in `record`. A step that did not converge
    /// is taken all the same, with its status in the report.
    ///
    /// # Errors
    /// Only where a step could not be posed; the simulation stays where it was.
    pub fn step(&mut self, record: &mut StepRecord) -> Result<(), Error> {
        record.index = self.index;
        record.state = self.state;
        let Self { model, motion, wrench, state, previous, .. } = self;
        record.report = match motion {
            Motion::Floating => {
                let mut total = *wrench;
                total.force += model.gravity() * model.body().mass();
                let next = rk4_step(model.body(), state, &total, model.time_step());
                record.solution.set_free_flight(&next);
                record.active.fill(false);
                record.certificate = certify_rk4_step(model, state, &next, &total);
                StepReport::without_problem(StepStatus::Free)
            }
            Motion::Contact { detection, solver } => {
                let free = model.free_flight(state, wrench);
                let mut report = if detection.flag(model, state, &free, &mut record.active) {
                    let step = Step { model, state, wrench, free: &free, previous };
                    solver.solve(&step, &mut record.active, &mut record.solution)?
                } else {
                    record.solution.set_free_flight(&free);
                    StepReport::without_problem(StepStatus::Free)
                };
                for (slot, force) in self.forces.iter_mut().zip(record.solution.forces()) {
                    *slot = force;
                }
                let next = record.solution.state();
                record.certificate =
                    certify_contact_step(model, state, &next, &self.forces, wrench);
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
        self.state = record.solution.state();
        self.previous.copy_from(&record.solution);
        self.index += 1;
        Ok(())
    }

    /// Goes back to before the step that `record` describes, which must be the last one
    /// taken: for a run that ends there. The start of a further step stays the undone
    /// step's solution.
    pub fn take_back(&mut self, record: &StepRecord) {
        self.state = record.state;
        self.index = record.index;
    }

    /// Describes the current state as the last row of a trajectory: no step follows.
    pub fn end(&self, record: &mut StepRecord) {
        *record = StepRecord::new(&self.state, self.model.contact_count());
        record.index = self.index;
    }
}
