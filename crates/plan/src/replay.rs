//! The simulator's run of a plan's controls.

use super::mode::{ContactMode, modes_of};
use super::{PlanError, PlanProblem};
use std::sync::Arc;
use std::sync::atomic::AtomicBool;
use tumble_core::mechanics::{State, Wrench};
use tumble_core::simulation::StepRecord;

/// Run of a problem with given controls.
#[derive(Debug, Clone)]
pub struct Replay {
    /// Controls, within their bounds.
    pub controls: Vec<f64>,
    /// Steps of the simulator.
    pub records: Vec<StepRecord>,
    /// States at the start of each step, and at the end.
    pub states: Vec<Vec<State>>,
    /// Wrenches of the controls on each body in each step.
    pub wrenches: Vec<Vec<Wrench>>,
    /// Modes of the contacts of each step.
    pub modes: Vec<Vec<ContactMode>>,
    /// Cost J of (P1).
    pub cost: f64,
    /// Part of the cost that is effort.
    pub effort: f64,
    /// Misses of the targets, then of the path constraints.
    pub misses: Vec<Miss>,
    /// Largest residual of a step, m/s.
    pub residual: f64,
    /// Number of steps that are not [solved as one problem](tumble_core::step::StepStatus::is_one_problem).
    pub unsolved: usize,
    /// Smallest margin of a contact mode, m/s, and its step.
    pub margin: Option<(f64, usize)>,
    /// Indices of the variables at a bound.
    pub at_bounds: Vec<usize>,
}

/// Distance of a replay from a target or a path constraint.
#[derive(Debug, Clone, PartialEq)]
pub struct Miss {
    /// Name of the target or path constraint.
    pub name: String,
    /// Distance, in `unit`.
    pub by: f64,
    /// Largest allowed distance.
    pub tolerance: f64,
    /// Unit of `by` and `tolerance`.
    pub unit: &'static str,
    /// Number of steps after which it is measured: a path constraint's worst step, or the target's step.
    pub after: usize,
}

impl Miss {
    /// True if the distance is within the tolerance. False for a NaN.
    pub fn is_met(&self) -> bool {
        self.by <= self.tolerance
    }
}

impl Replay {
    /// True if every step was solved, and all targets and path constraints are met.
    pub fn meets(&self) -> bool {
        self.unsolved == 0 && self.misses.iter().all(Miss::is_met)
    }

    /// True if this replay is better. A replay that meets its targets is better than one that does
    /// not. Otherwise the lower cost is better.
    pub fn is_better(&self, other: &Self) -> bool {
        match (self.meets(), other.meets()) {
            (true, false) => true,
            (false, true) => false,
            _ => self.cost < other.cost,
        }
    }
}

impl PlanProblem {
    /// Runs `controls`, clipped to their bounds.
    ///
    /// # Errors
    /// A step that cannot be posed, or a wrong number of controls.
    pub fn replay(&self, controls: &[f64]) -> Result<Replay, PlanError> {
        self.replay_until(controls, None)
    }

    /// Runs `controls` as [`PlanProblem::replay`] does, until `interrupt` is raised.
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
            modes: Vec::with_capacity(self.steps),
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
            replay.states.push(record.states().to_vec());
            let step = replay.records.len();
            replay.wrenches.push(self.without_loads(step, record.states(), wrenches));
            // Margin: the least distance from another piece of the contact law, and its step
            let modes = modes_of(simulation.world(), record);
            for of in &modes {
                if replay.margin.is_none_or(|(least, _)| of.margin < least) {
                    replay.margin = Some((of.margin, step));
                }
            }
            replay.modes.push(modes);
            // The largest residual, or NaN
            let residual = record.residual();
            if replay.residual < residual || residual.is_nan() {
                replay.residual = residual;
            }
            replay.unsolved += usize::from(!record.status().is_one_problem());
            replay.records.push(record.clone());
            Ok(())
        })?;
        // Cost and misses follow from the states.
        if let Some(last) = replay.records.last() {
            replay.states.push(last.next_states().to_vec());
        }
        replay.misses = self.misses(&replay.states);
        replay.cost = self.cost_of(&replay.states, &replay.controls);
        Ok(replay)
    }
}
