//! The search of a plan: stages one after the other, each judged by the replay of its controls.

use super::stage::{SearchWatch, Stage, StageReport};
use super::{Miss, PlanError, PlanProblem, Replay};
use std::fmt;

/// Outcome of a search, by its best replay.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub enum PlanStatus {
    /// The replay meets all targets and path constraints.
    Replayed,
    /// The replay misses a target or a path constraint.
    Missed,
    /// A step of the replay is not [solved as one problem](tumble_core::step::StepStatus::is_one_problem).
    Failed,
}

impl PlanStatus {
    /// Name in files.
    pub fn name(self) -> &'static str {
        match self {
            Self::Replayed => "replayed",
            Self::Missed => "missed",
            Self::Failed => "failed",
        }
    }

    fn from_replay(replay: &Replay) -> Self {
        match replay {
            _ if replay.unsolved > 0 => Self::Failed,
            _ if replay.meets() => Self::Replayed,
            _ => Self::Missed,
        }
    }
}

impl fmt::Display for PlanStatus {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(self.name())
    }
}

/// The best controls of a search and the simulator's run of them.
#[derive(Debug, Clone)]
pub struct Plan {
    /// Status of the replay.
    pub status: PlanStatus,
    /// Run of the controls, and the controls.
    pub replay: Replay,
    /// One report for each stage that ran or was skipped.
    pub stages: Vec<StageReport>,
    /// Missed targets and the message of the last stage; empty when all targets are met.
    pub reason: String,
}

impl PlanProblem {
    /// Searches by `stages` from the controls `start`, and returns the best replay.
    ///
    /// Each stage starts at the best replay of its attempt. A [fallback](Stage::is_fallback) after other stages is skipped if
    /// they have met the targets; otherwise it starts a new attempt from `start`. The plan is the best replay of all
    /// attempts.
    ///
    /// # Errors
    /// - Controls of another count, or controls that are not finite.
    /// - A start that cannot be simulated.
    /// - A problem that a stage [refuses](Stage::check).
    /// - An interrupt before the run of `start` is complete. A later interrupt ends the search with the best plan so far.
    pub fn plan(
        &self,
        start: &[f64],
        stages: &[Box<dyn Stage>],
        watch: &mut SearchWatch<'_>,
    ) -> Result<Plan, PlanError> {
        stages.iter().try_for_each(|stage| stage.check(self))?;
        let start = self.replay_until(start, Some(watch.interrupt))?;
        let (mut best, mut current) = (start.clone(), start.clone());
        let mut reports: Vec<StageReport> = Vec::new();
        for stage in stages {
            if watch.is_interrupted() {
                break;
            }
            // A fallback begins a new attempt, unless the targets are met.
            if stage.is_fallback() && !reports.is_empty() {
                if best.meets() {
                    reports.push(StageReport {
                        name: stage.name(),
                        message: "skipped: the targets are met".to_owned(),
                        cost: best.cost,
                        meets: true,
                        ..StageReport::default()
                    });
                    continue;
                }
                current = start.clone();
            }
            let result = stage.run(self, &current, watch)?;
            let mut report = StageReport {
                name: stage.name(),
                iterations: result.iterations,
                runs: result.runs,
                message: result.message,
                cost: f64::INFINITY,
                meets: false,
                kept: false,
            };
            // All figures of a stage are those of its replay.
            match self.replay(&result.controls) {
                Ok(replay) => {
                    report.cost = replay.cost;
                    report.meets = replay.meets();
                    if replay.is_better(&current) {
                        report.kept = true;
                        current = replay;
                    }
                }
                Err(PlanError::Step(error)) => {
                    report.message += &format!("; its controls cannot be replayed: {error}");
                }
                Err(error) => return Err(error),
            }
            if current.is_better(&best) {
                best = current.clone();
            }
            reports.push(report);
        }
        let reason = self.reason(&best, &reports);
        Ok(Plan { status: PlanStatus::from_replay(&best), replay: best, stages: reports, reason })
    }

    /// One sentence about a replay that misses: the misses, controls at bounds, and the message of the last stage.
    fn reason(&self, replay: &Replay, stages: &[StageReport]) -> String {
        if replay.meets() {
            return String::new();
        }
        let mut parts = Vec::new();
        if replay.unsolved > 0 {
            let steps = replay.unsolved;
            parts.push(format!(
                "{steps} steps of the replay are failed, wild or substepped; shorten the time step"
            ));
        }
        parts.extend(replay.misses.iter().filter(|miss| !miss.is_met()).map(|miss| {
            let Miss { name, by, tolerance, unit, after } = miss;
            format!("{name} is missed by {by:.3e} {unit} after {after} steps ({tolerance} allowed)")
        }));
        let (at, all) = (replay.at_bounds.len(), self.variables().len());
        if at > 0 {
            parts.push(format!("{at} of {all} controls are at their bounds"));
        }
        if let Some(stage) = stages.last() {
            parts.push(format!("{}: {}", stage.name, stage.message));
        }
        parts.join("; ")
    }
}
