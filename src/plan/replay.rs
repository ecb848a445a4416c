//! What the simulator makes of controls: all that is said of a plan.

use super::axis::axis_modes_of;
use super::mode::{Modes, modes_of};
use super::{PlanError, Problem};
use crate::mechanics::{State, Wrench};
use crate::simulation::StepRecord;
use crate::step::StepStatus;
use std::sync::Arc;
use std::sync::atomic::AtomicBool;

/// The run of a problem under given controls.
#[derive(Debug, Clone)]
pub struct Replay {
    /// The controls, within their bounds.
    pub controls: Vec<f64>,
    /// Every step as the simulator took it.
    pub records: Vec<StepRecord>,
    /// The states, one list a step and one at the end.
    pub states: Vec<Vec<State>>,
    /// What the controls put on each body in each step.
    pub wrenches: Vec<Vec<Wrench>>,
    /// The modes of contacts and of the drives of joints.
    pub modes: Modes,
    /// The sum of the parts of the cost.
    pub cost: f64,
    /// That of the effort.
    pub effort: f64,
    /// How far each target is missed, and each row to keep.
    pub misses: Vec<Miss>,
    /// The largest residual of a step, m/s.
    pub residual: f64,
    /// Steps that failed or are wild.
    pub unsolved: usize,
    /// The smallest margin of a contact's mode, m/s, and its step.
    pub margin: Option<(f64, usize)>,
    /// The variables that are at a bound.
    pub at_bounds: Vec<usize>,
}

/// How far something is from what it is to be.
#[derive(Debug, Clone, PartialEq)]
pub struct Miss {
    /// The target or row.
    pub name: String,
    /// By how much it is missed, in its unit.
    pub by: f64,
    /// What is allowed.
    pub tolerance: f64,
    /// The unit.
    pub unit: &'static str,
    /// The step of a row to keep at which it is missed most, or that of the target's state.
    pub after: usize,
}

impl Miss {
    /// Whether it is no more than is allowed. A NaN is more.
    #[must_use]
    pub fn is_met(&self) -> bool {
        self.by <= self.tolerance
    }
}

impl Replay {
    /// Whether every step was solved, and all targets and rows are met.
    #[must_use]
    pub fn meets(&self) -> bool {
        self.unsolved == 0 && self.misses.iter().all(Miss::is_met)
    }

    /// How much this is better than another: one that meets its targets than one that does not, then the one of less cost.
    #[must_use]
    pub fn is_better(&self, other: &Self) -> bool {
        match (self.meets(), other.meets()) {
            (true, false) => true,
            (false, true) => false,
            _ => self.cost < other.cost,
        }
    }

    /// The largest distance of a centre of mass from that of other `states`, m.
    #[must_use]
    pub fn apart(&self, states: &[Vec<State>]) -> f64 {
        let pairs = self.states.iter().flatten().zip(states.iter().flatten());
        let far = pairs.map(|(a, b)| (a.position - b.position).norm());
        // A NaN is as far as can be.
        far.fold(0.0, |most, far| if far <= most { most } else { far })
    }
}

impl Problem {
    /// The run under `controls`, clipped to their bounds.
    ///
    /// # Errors
    /// A step that cannot be posed; another count of numbers than the problem's.
    pub fn replay(&self, controls: &[f64]) -> Result<Replay, PlanError> {
        self.replay_until(controls, None)
    }

    /// The same, given up when `interrupt` is raised.
    pub(super) fn replay_until(
        &self,
        controls: &[f64],
        interrupt: Option<&Arc<AtomicBool>>,
    ) -> Result<Replay, PlanError> {
        let controls = self.clipped(controls)?;
        let mut replay = Replay {
            records: Vec::with_capacity(self.steps),
            states: Vec::with_capacity(self.steps + 1),
            wrenches: Vec::with_capacity(self.steps),
            modes: Modes::default(),
            cost: 0.0,
            effort: self.effort_of(&controls),
            misses: Vec::new(),
            residual: 0.0,
            unsolved: 0,
            margin: None,
            at_bounds: self.at_bounds(&controls),
            controls,
        };
        let controls = replay.controls.clone();
        self.simulate(&controls, interrupt, &mut |simulation, wrenches, record| {
            replay.states.push(record.states.clone());
            let step = replay.records.len();
            replay.wrenches.push(self.without_loads(step, &record.states, wrenches));
            let modes = modes_of(simulation.world(), record);
            for of in &modes {
                if replay.margin.is_none_or(|(least, _)| of.margin < least) {
                    replay.margin = Some((of.margin, step));
                }
            }
            replay.modes.contacts.push(modes);
            let last = replay.records.last().map(|last| &last.solution.joints[..]);
            let before: Vec<_> = last.unwrap_or(&[]).iter().map(|joint| joint.angles).collect();
            replay.modes.axes.push(axis_modes_of(simulation.world(), record, &before));
            let residual = record.certificate.residual();
            if replay.residual < residual || residual.is_nan() {
                replay.residual = residual;
            }
            let status = record.report.status;
            replay.unsolved += usize::from(matches!(status, StepStatus::Failed | StepStatus::Wild));
            replay.records.push(record.clone());
            Ok(())
        })?;
        if let Some(last) = replay.records.last() {
            replay.states.push(last.solution.states.clone());
        }
        replay.misses = self.misses(&replay.states);
        replay.cost = self.cost_of(&replay.states, &replay.controls);
        Ok(replay)
    }
}
