//! Cost and misses of a run.

use super::PlanError;
use super::control::Control;
use super::path_constraint::PathConstraint;
use super::problem::{Choose, PlanProblem};
use super::replay::Miss;
use super::target::Target;
use std::sync::Arc;
use std::sync::atomic::AtomicBool;
use tumble_core::mechanics::State;

#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct RunCost {
    /// Part of the targets and path constraints.
    pub task: f64,
    /// Part of the effort.
    pub effort: f64,
    /// Number of steps that are not [solved as one problem](tumble_core::step::StepStatus::is_one_problem).
    pub unsolved: usize,
}

impl RunCost {
    /// Objective of a search: the cost, times 1 plus the number of unsolved steps.
    pub fn judged(&self) -> f64 {
        (self.task + self.effort) * (1.0 + self.unsolved as f64)
    }
}

impl PlanProblem {
    /// Cost (P1) of a run with these `states`, including the initial ones. A NaN becomes infinity.
    pub fn cost_of(&self, states: &[Vec<State>], controls: &[f64]) -> f64 {
        let steps = states.iter().enumerate().skip(1);
        let cost: f64 = steps.map(|(after, states)| self.cost_after(after, states)).sum();
        let cost = cost + self.effort_of(controls);
        if cost.is_nan() { f64::INFINITY } else { cost }
    }

    /// Part of the cost that depends on the states after `after` steps.
    pub(super) fn cost_after(&self, after: usize, states: &[State]) -> f64 {
        let mut cost = 0.0;
        for target in self.targets().iter().filter(|target| target.after == after) {
            let rows = target.kind.rows(&states[target.body]);
            cost += target.weight * rows.iter().map(|row| row.value * row.value).sum::<f64>();
        }
        for constraint in self.path_constraints() {
            let below = constraint.kind.at(&states[constraint.body].position).0.min(0.0);
            cost += constraint.weight * below * below;
        }
        cost
    }

    /// Part of the cost that is effort.
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
        // An empty sum is -0.
        0.0 + free.sum::<f64>() + self.controls().iter().map(fixed).sum::<f64>()
    }

    /// Cost of the run of `controls`, which are within their bounds.
    pub(super) fn run_cost(
        &self,
        controls: &[f64],
        interrupt: Option<&Arc<AtomicBool>>,
    ) -> Result<RunCost, PlanError> {
        self.run_cost_choosing(&mut controls.to_vec(), &mut |_, _, _| {}, interrupt)
    }

    /// Cost of a run whose controls `choose` sets before each step.
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
            unsolved += usize::from(!record.status().is_one_problem());
            Ok(())
        })?;
        let task = if task.is_nan() { f64::INFINITY } else { task };
        Ok(RunCost { task, effort: self.effort_of(controls), unsolved })
    }

    /// Misses of `states`: the targets', then the path constraints'.
    pub fn misses(&self, states: &[Vec<State>]) -> Vec<Miss> {
        let target = |target: &Target| Miss {
            name: target.name.clone(),
            by: target.miss(&states[target.after][target.body]),
            tolerance: target.tolerance,
            unit: target.kind.unit(),
            after: target.after,
        };
        let path = |constraint: &PathConstraint| {
            let below =
                |states: &Vec<State>| -constraint.kind.at(&states[constraint.body].position).0;
            let mut most = (0.0, 0);
            for (after, states) in states.iter().enumerate().skip(1) {
                let by = below(states);
                if by > most.0 || by.is_nan() {
                    most = (by, after);
                }
            }
            let name = constraint.name.clone();
            let tolerance = constraint.tolerance;
            Miss { name, by: most.0, tolerance, unit: "m", after: most.1 }
        };
        self.targets().iter().map(target).chain(self.path_constraints().iter().map(path)).collect()
    }
}
