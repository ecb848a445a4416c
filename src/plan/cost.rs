//! What a run costs, and by what it misses.

use super::PlanError;
use super::control::Control;
use super::keep::Keep;
use super::problem::{Choose, Problem};
use super::replay::Miss;
use super::target::Target;
use crate::mechanics::State;
use crate::step::StepStatus;
use std::sync::Arc;
use std::sync::atomic::AtomicBool;

/// What a run costs.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct RunCost {
    /// What targets and rows to keep do.
    pub task: f64,
    /// What the effort does.
    pub effort: f64,
    /// Steps that failed or are wild.
    pub unsolved: usize,
}

impl RunCost {
    /// What searches make least: the cost, and more where the run is none.
    pub fn judged(&self) -> f64 {
        (self.task + self.effort) * (1.0 + self.unsolved as f64)
    }
}

impl Problem {
    /// The cost (P1) of a run with these `states`, from the start on. Infinite where it is no number.
    #[must_use]
    pub fn cost_of(&self, states: &[Vec<State>], controls: &[f64]) -> f64 {
        let steps = states.iter().enumerate().skip(1);
        let cost: f64 = steps.map(|(after, states)| self.cost_after(after, states)).sum();
        let cost = cost + self.effort_of(controls);
        if cost.is_nan() { f64::INFINITY } else { cost }
    }

    /// The part of the cost that the states after so many steps have.
    pub(super) fn cost_after(&self, after: usize, states: &[State]) -> f64 {
        let mut cost = 0.0;
        for target in self.targets().iter().filter(|target| target.after == after) {
            let rows = target.kind.rows(&states[target.body]);
            cost += target.weight * rows.iter().map(|row| row.value * row.value).sum::<f64>();
        }
        for keep in self.keeps() {
            let below = keep.kind.at(&states[keep.body].position).0.min(0.0);
            cost += keep.weight * below * below;
        }
        cost
    }

    /// The part of the cost that is effort.
    #[must_use]
    pub fn effort_of(&self, controls: &[f64]) -> f64 {
        let pairs = self.variables().iter().zip(controls);
        let free = pairs.map(|(variable, value)| variable.effort * value * value);
        let fixed = |control: &Control| {
            let components = control.bounds.iter().enumerate();
            let of = |(k, bounds): (usize, &[f64; 2])| {
                let is_fixed = bounds[0] == bounds[1] && control.kind.costs(k);
                if is_fixed { bounds[0] * bounds[0] } else { 0.0 }
            };
            control.effort * self.steps as f64 * components.map(of).sum::<f64>()
        };
        // An empty sum is -0, and nothing is spent then.
        0.0 + free.sum::<f64>() + self.controls().iter().map(fixed).sum::<f64>()
    }

    /// The run under `controls`, which are within their bounds, as its cost alone.
    pub(super) fn run_cost(
        &self,
        controls: &[f64],
        interrupt: Option<&Arc<AtomicBool>>,
    ) -> Result<RunCost, PlanError> {
        self.run_cost_choosing(&mut controls.to_vec(), &mut |_, _, _| {}, interrupt)
    }

    /// The same of controls that are chosen on the way.
    pub(super) fn run_cost_choosing(
        &self,
        controls: &mut [f64],
        choose: &mut Choose<'_>,
        interrupt: Option<&Arc<AtomicBool>>,
    ) -> Result<RunCost, PlanError> {
        let (mut after, mut task, mut unsolved) = (0, 0.0, 0);
        self.simulate_choosing(controls, choose, interrupt, &mut |simulation, _, record| {
            after += 1;
            task += self.cost_after(after, simulation.states());
            let status = record.report.status;
            unsolved += usize::from(matches!(status, StepStatus::Failed | StepStatus::Wild));
            Ok(())
        })?;
        let task = if task.is_nan() { f64::INFINITY } else { task };
        Ok(RunCost { task, effort: self.effort_of(controls), unsolved })
    }

    /// How far every target and every row to keep is missed by these `states`.
    #[must_use]
    pub fn misses(&self, states: &[Vec<State>]) -> Vec<Miss> {
        let target = |target: &Target| Miss {
            name: target.name.clone(),
            by: target.miss(&states[target.after][target.body]),
            tolerance: target.tolerance,
            unit: target.kind.unit(),
            after: target.after,
        };
        let keep = |keep: &Keep| {
            let below = |states: &Vec<State>| -keep.kind.at(&states[keep.body].position).0;
            let mut most = (0.0, 0);
            for (after, states) in states.iter().enumerate().skip(1) {
                let by = below(states);
                if by > most.0 || by.is_nan() {
                    most = (by, after);
                }
            }
            let (name, tolerance) = (keep.name.clone(), keep.tolerance);
            Miss { name, by: most.0, tolerance, unit: "m", after: most.1 }
        };
        self.targets().iter().map(target).chain(self.keeps().iter().map(keep)).collect()
    }
}
