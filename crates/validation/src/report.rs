//! Findings for several solvers and time steps.

use crate::quantity::{Convergence, TestQuantity};
use crate::{ProblemFindings, StepCounts, TestProblem};
use tumble_view::page::brief;

/// A whole validation.
#[derive(Debug, Clone)]
pub struct ValidationReport {
    /// The version of the program and its solvers.
    pub program: String,
    /// The flags that changed inputs or time steps; empty with the usual ones.
    pub given: String,
    /// The experiments, one for each problem.
    pub experiments: Vec<Experiment>,
}

/// One problem with all its solvers.
#[derive(Debug, Clone)]
pub struct Experiment {
    /// The problem.
    pub problem: TestProblem,
    /// The inputs in words: `mass 2 kg, mu 0.3`.
    pub inputs: String,
    /// The series of each solver, with the same quantities. There is at least one.
    pub series: Vec<ErrorSeries>,
}

/// One problem with one solver, at a time step and its halves.
#[derive(Debug, Clone)]
pub struct ErrorSeries {
    /// The solver.
    pub solver: ReportedSolver,
    /// The trials, each with half the time step of the previous one. There is at least one.
    pub trials: Vec<Trial>,
}

/// One problem with one solver at one time step.
#[derive(Debug, Clone)]
pub struct Trial {
    /// h, s.
    pub time_step: f64,
    /// The results.
    pub findings: ProblemFindings,
    /// The statistics of the steps.
    pub counts: StepCounts,
}

/// A solver of the contact step.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum ReportedSolver {
    /// Newton's method on the contact law.
    Native,
    /// Ipopt on the nonlinear program.
    Ipopt,
}

impl ReportedSolver {
    /// The name.
    #[must_use]
    pub fn name(self) -> &'static str {
        match self {
            Self::Native => "native",
            Self::Ipopt => "ipopt",
        }
    }
}

impl ValidationReport {
    /// The numbers of quantities that hold and of all, each counted once a solver.
    #[must_use]
    pub fn holding(&self) -> (usize, usize) {
        let series = self.experiments.iter().flat_map(|experiment| &experiment.series);
        series.map(ErrorSeries::holding).fold((0, 0), |a, b| (a.0 + b.0, a.1 + b.1))
    }
}

impl ErrorSeries {
    /// Quantity `i` of trial `k`.
    #[must_use]
    pub fn quantity(&self, i: usize, k: usize) -> &TestQuantity {
        &self.trials[k].findings.quantities[i]
    }

    /// Quantity `i` at twice the time step of trial `k`.
    fn coarser(&self, i: usize, k: usize) -> Option<&TestQuantity> {
        k.checked_sub(1).map(|k| self.quantity(i, k))
    }

    /// The number of quantities.
    #[must_use]
    pub fn count(&self) -> usize {
        self.trials[0].findings.quantities.len()
    }

    /// True if quantity `i` holds at every time step.
    #[must_use]
    pub fn holds(&self, i: usize) -> bool {
        (0..self.trials.len()).all(|k| self.fault(i, k).is_none())
    }

    /// The numbers of quantities that hold and of all.
    #[must_use]
    pub fn holding(&self) -> (usize, usize) {
        ((0..self.count()).filter(|&i| self.holds(i)).count(), self.count())
    }

    /// The fault of quantity `i` in trial `k`: the claim does not hold, or the values do not converge
    /// as declared.
    #[must_use]
    pub fn fault(&self, i: usize, k: usize) -> Option<String> {
        let quantity = self.quantity(i, k);
        if !quantity.holds() {
            let (error, allowed, unit) =
                (brief(quantity.error()), brief(quantity.tolerance), quantity.unit);
            return Some(format!("error {error} {unit}, allowed {allowed} {unit}"));
        }
        let coarser = self.coarser(i, k).filter(|coarser| !coarser.converges(quantity))?;
        let apart = brief(coarser.discrete - coarser.exact);
        Some(match coarser.convergence {
            Convergence::Order(p) => format!("order {}, declared {p}", self.order(i, k)),
            Convergence::Within(bound) => {
                format!("discrete − exact {apart} before, declared ≤{}", brief(bound))
            }
            _ => format!("discrete − exact {apart} before, declared exact"),
        })
    }

    /// The observed order of quantity `i` from trial `k` and the previous one, or the reason why it
    /// is unknown.
    #[must_use]
    pub fn order(&self, i: usize, k: usize) -> String {
        let (quantity, coarser) = (self.quantity(i, k), self.coarser(i, k));
        match (coarser.unwrap_or(quantity).convergence, coarser) {
            (Convergence::Order(_), None) => "—".to_owned(),
            (Convergence::Order(_), Some(coarser)) => {
                coarser.order(quantity).map_or("hidden".to_owned(), |order| format!("{order:.2}"))
            }
            (Convergence::Exact, _) => "exact".to_owned(),
            (Convergence::Within(bound), _) => format!("≤{}", brief(bound)),
            (Convergence::Unresolved, _) => "coarse".to_owned(),
        }
    }

    /// The sum of a count over all trials.
    pub fn sum(&self, count: impl Fn(&StepCounts) -> u64) -> u64 {
        self.trials.iter().map(|trial| count(&trial.counts)).sum()
    }

    /// The largest residual, m/s; NaN counts as largest.
    #[must_use]
    pub fn worst_residual(&self) -> f64 {
        let residuals = self.trials.iter().map(|trial| trial.counts.worst_residual);
        residuals.max_by(f64::total_cmp).unwrap_or(0.0)
    }
}
