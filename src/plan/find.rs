//! A plan: the legs one after the other, each judged by the replay of what it found.

use super::leg::{Leg, LegReport, Watch};
use super::{PlanError, Problem, Replay};
use crate::mechanics::State;
use std::fmt;

/// How far the own run of the leg that found a plan may be from its replay for the plan to be exact, m.
pub const EXACTLY: f64 = 1e-9;

/// By which part of its cost a plan may be worse that is exact, or of what it costs to miss all by their tolerances.
const WORTH: f64 = 1e-6;

/// What is to be said of a plan, by its replay.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub enum PlanStatus {
    /// All is met, and the program that found it, with the modes of all contacts fixed, is its replay: modes are the same,
    /// and no centre of mass is more than [`EXACTLY`] apart.
    Exact,
    /// All is met.
    Replayed,
    /// Something is missed.
    Missed,
    /// A step of the replay was not solved, so that it says nothing.
    Failed,
}

impl PlanStatus {
    /// The word of files.
    #[must_use]
    pub fn name(self) -> &'static str {
        match self {
            Self::Exact => "exact",
            Self::Replayed => "replayed",
            Self::Missed => "missed",
            Self::Failed => "failed",
        }
    }
}

impl fmt::Display for PlanStatus {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(self.name())
    }
}

/// The best controls that were found, and what the simulator makes of them.
#[derive(Debug, Clone)]
pub struct Plan {
    /// By the replay.
    pub status: PlanStatus,
    /// The run under the controls, and the controls.
    pub replay: Replay,
    /// What each leg came to.
    pub legs: Vec<LegReport>,
    /// The own run of the leg that found it, as states from the start on; of a leg without one, none.
    pub own: Option<Vec<Vec<State>>>,
    /// How far that is from the replay at most, m.
    pub apart: Option<f64>,
    /// What is missed, and what the last leg said of it; empty of a plan that meets all.
    pub reason: String,
}

impl Problem {
    /// Looks for controls by `legs`, from `start`. The best replay is kept: whatever a leg claims, a plan is what the
    /// simulator makes of it.
    ///
    /// # Errors
    /// Controls of another count, or that are no numbers; a start that cannot be simulated; a problem that a leg
    /// [refuses](Leg::check). An interrupt before the start's own run is at its end; a later one is none: what was found until
    /// then is the plan.
    pub fn plan(
        &self,
        start: &[f64],
        legs: &[Box<dyn Leg>],
        watch: &mut Watch<'_>,
    ) -> Result<Plan, PlanError> {
        legs.iter().try_for_each(|leg| leg.check(self))?;
        let mut best = self.replay_until(start, Some(watch.interrupt))?;
        let mut reports = Vec::new();
        let (mut own, mut apart, mut exact) = (None, None, false);
        for leg in legs {
            if watch.is_interrupted() {
                break;
            }
            let end = leg.run(self, &best, watch)?;
            let mut report = LegReport {
                name: leg.name(),
                iterations: end.iterations,
                runs: end.runs,
                message: end.message,
                claimed: end.cost,
                cost: f64::INFINITY,
                meets: false,
                apart: None,
                other_modes: None,
                kept: false,
            };
            match self.replay(&end.controls) {
                Ok(replay) => {
                    report.cost = replay.cost;
                    report.meets = replay.meets();
                    report.apart = end.states.as_ref().map(|states| replay.apart(states));
                    report.other_modes = end.modes.as_ref().map(|modes| replay.modes.others(modes));
                    let confirmed = report.other_modes == Some(0)
                        && report.apart.is_some_and(|apart| apart <= EXACTLY);
                    // A confirmed plan is worth a little.
                    let cost = best.cost + WORTH * (best.cost + self.cost_of_tolerances());
                    let confirms =
                        confirmed && replay.meets() == best.meets() && replay.cost <= cost;
                    if replay.is_better(&best) || confirms {
                        report.kept = true;
                        (own, apart, exact) = (end.states, report.apart, confirmed);
                        best = replay;
                    }
                }
                Err(PlanError::Step(error)) => {
                    report.message += &format!("; its controls cannot be replayed: {error}");
                }
                Err(error) => return Err(error),
            }
            reports.push(report);
        }
        let status = match (best.unsolved > 0, best.meets(), exact) {
            (true, ..) => PlanStatus::Failed,
            (false, true, true) => PlanStatus::Exact,
            (false, true, false) => PlanStatus::Replayed,
            (false, false, _) => PlanStatus::Missed,
        };
        let reason = self.reason(&best, &reports);
        Ok(Plan { status, replay: best, legs: reports, own, apart, reason })
    }

    /// What it costs to miss every target and every row to keep by its tolerance.
    fn cost_of_tolerances(&self) -> f64 {
        let targets = self.targets().iter().map(|of| of.weight * of.tolerance * of.tolerance);
        let keeps = self.keeps().iter().map(|of| of.weight * of.tolerance * of.tolerance);
        targets.chain(keeps).sum()
    }

    /// Why a replay is no plan: in one sentence what is missed, what is at its bounds, and what the last leg said.
    fn reason(&self, replay: &Replay, legs: &[LegReport]) -> String {
        if replay.meets() {
            return String::new();
        }
        let mut parts = Vec::new();
        if replay.unsolved > 0 {
            parts.push(format!("{} steps of the replay were not solved", replay.unsolved));
        }
        parts.extend(replay.misses.iter().filter(|miss| !miss.is_met()).map(|miss| {
            let super::Miss { name, by, tolerance, unit, after } = miss;
            format!(
                "{name} is missed by {by:.3e} {unit} after {after} steps ({tolerance} is allowed)"
            )
        }));
        let (at, all) = (replay.at_bounds.len(), self.variables().len());
        if at > 0 {
            parts.push(format!("{at} of {all} controls are at their bounds"));
        }
        if let Some(leg) = legs.last() {
            parts.push(format!("{}: {}", leg.name, leg.message));
        }
        parts.join("; ")
    }
}
