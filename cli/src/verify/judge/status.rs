//! Statuses that a step cannot have.

use super::{JudgedStep, StepJudge};
use tumble::solver::Rung;
use tumble_core::solver::native::STARTS;
use tumble_core::step::StepStatus;
use tumble_model::shown;
use tumble_scene::output::tables::IntervalRows;

/// True if the column `start` may have this value.
fn is_start(word: &str) -> bool {
    word.is_empty() || STARTS.contains(&word) || Rung::ALL.iter().any(|rung| rung.name() == word)
}

impl StepJudge {
    /// Reason why an interval, correct otherwise, cannot have the status in its row. `makes_energy` is true
    /// for the last one of a substepped step that gains energy.
    pub(super) fn another_status(
        &self,
        judged: &JudgedStep<'_>,
        lost: f64,
        makes_energy: bool,
    ) -> Option<String> {
        let IntervalRows { row, joints, .. } = judged.step;
        let status = row.status;
        if !is_start(&row.start) {
            let start = shown::line(&row.start);
            return Some(format!("its start is `{start}`, which is unknown"));
        }
        let is_solved =
            matches!(status, StepStatus::Converged | StepStatus::Retried | StepStatus::Fallback);
        let has_start = !row.start.is_empty();
        let touches = row.contacts > 0 || !joints.is_empty();
        let pushed = judged.loads.iter().any(|load| load.force.amax() > 0.0);
        let why = if status == StepStatus::Free && pushed {
            "it has forces"
        } else if status == StepStatus::Free && (row.iterations > 0 || has_start) {
            "it was solved"
        } else if status == StepStatus::Free && touches {
            "bodies can touch"
        } else if is_solved && !(touches && has_start) {
            "nothing can touch, and no problem was solved"
        } else if (is_solved || matches!(status, StepStatus::Substepped | StepStatus::Wild))
            && row.residual > self.accepted.max(lost)
        {
            "its residual is above the limit of a solved step"
        } else if makes_energy {
            "its energy rises by more than loads and drives supply"
        } else {
            return None;
        };
        Some(format!("its status is `{}`, but {why}", status.name()))
    }
}
