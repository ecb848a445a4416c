//! Statuses that a step cannot have.

use super::{StepContacts, StepJudge};
use crate::recording::RecordedStep;
use tumble::solver::Rung;
use tumble_core::mechanics::{State, Wrench};
use tumble_core::solver::native::STARTS;
use tumble_core::step::StepStatus;
use tumble_model::shown;

/// True if the column `start` may have this value.
fn is_start(word: &str) -> bool {
    word.is_empty() || STARTS.contains(&word) || Rung::ALL.iter().any(|rung| rung.name() == word)
}

impl StepJudge {
    /// Reason why a step, correct otherwise, cannot have the status in its row.
    pub(super) fn another_status(
        &mut self,
        step: &RecordedStep,
        next: &[State],
        wrenches: &[Wrench],
        touching: &StepContacts,
        lost: f64,
    ) -> Option<String> {
        let status = step.status();
        let is_solved =
            matches!(status, StepStatus::Converged | StepStatus::Retried | StepStatus::Fallback);
        let (iterations, started) = match step {
            RecordedStep::Trajectory(row) => (row.iterations, None),
            RecordedStep::Tables(step) => (step.row.iterations, Some(!step.row.start.is_empty())),
        };
        let touches = match step {
            // An invalid state has no candidates.
            RecordedStep::Trajectory(row) => row.state.checked().ok().and_then(|_| {
                let (states, rule) = (step.states(), self.detection?);
                let free = self.free_flight(states, wrenches);
                Some(self.candidates.find(rule, &self.world, states, &free))
            }),
            RecordedStep::Tables(step) => Some(step.row.contacts > 0 || !step.joints.is_empty()),
        };
        let pushed = touching.forces.iter().any(|force| force.amax() > 0.0);
        if let RecordedStep::Tables(step) = step
            && !is_start(&step.row.start)
        {
            let start = shown::line(&step.row.start);
            return Some(format!("its start is `{start}`, which is unknown"));
        }
        let why = if status == StepStatus::Free && pushed {
            "it has forces"
        } else if status == StepStatus::Free && (iterations > 0 || started == Some(true)) {
            "it was solved"
        } else if status == StepStatus::Free && touches == Some(true) {
            "bodies can touch"
        } else if is_solved && (touches == Some(false) || started == Some(false)) {
            "nothing can touch, and no problem was solved"
        } else if is_solved && step.residual() > self.accepted.max(lost) {
            "its residual is above the limit of a solved step"
        } else if status == StepStatus::Substepped
            && self.makes_energy(step.states(), next, wrenches, touching)
        {
            "its energy rises by more than loads and drives supply"
        } else {
            return None;
        };
        Some(format!("its status is `{}`, but {why}", status.name()))
    }
}
