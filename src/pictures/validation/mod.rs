//! A validation as a page: problems with closed-form answers, and what each solver made of
//! them.

mod chart;
pub mod number;
mod page;
mod style;
mod table;

pub use page::page;

use tumble::validation::{Curve, Inputs, Problem, Quantity};

/// All that was validated.
pub struct Report {
    /// The flags that changed inputs or time steps; empty where all are the usual ones.
    pub given: String,
    pub experiments: Vec<Experiment>,
}

/// One problem, by every solver.
pub struct Experiment {
    pub problem: &'static dyn Problem,
    pub inputs: Inputs,
    pub series: Vec<Series>,
}

/// One problem by one solver, at a time step and its halves.
pub struct Series {
    pub solver: Solver,
    /// The coarsest first, each at half the step of the one before; at least one.
    pub trials: Vec<Trial>,
    /// Of the first trial.
    pub curve: Curve,
}

/// One problem by one solver at one time step.
pub struct Trial {
    /// h, s.
    pub time_step: f64,
    pub quantities: Vec<Quantity>,
    pub steps: u64,
    /// Steps that did not converge.
    pub failed: u64,
    /// Steps for which another solver's answer stands in.
    pub fallback: u64,
    /// m/s.
    pub worst_certificate: f64,
}

/// Who solved the steps.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Solver {
    Native,
    Ipopt,
}

impl Solver {
    /// The word of the command line.
    pub fn name(self) -> &'static str {
        match self {
            Self::Native => "native",
            Self::Ipopt => "ipopt",
        }
    }
}

impl Series {
    /// Whether the quantity `i` holds at every time step and converges as it is declared to.
    pub fn holds(&self, i: usize) -> bool {
        self.trials.iter().all(|trial| trial.quantities[i].holds())
            && (1..self.trials.len()).all(|k| self.converges(i, k))
    }

    /// Whether the quantity `i` converges as it is declared to from the trial before `k` to
    /// `k`; so does the first, which has none before it.
    pub fn converges(&self, i: usize, k: usize) -> bool {
        let Some(before) = k.checked_sub(1) else { return true };
        self.trials[before].quantities[i].converges(&self.trials[k].quantities[i])
    }

    /// How many quantities hold, and how many there are.
    pub fn holding(&self) -> (usize, usize) {
        let count = self.trials[0].quantities.len();
        ((0..count).filter(|&i| self.holds(i)).count(), count)
    }

    /// What the quantity `i` shows of its order from the trial before `k` to `k`.
    pub fn order(&self, i: usize, k: usize) -> String {
        let quantity = |k: usize| self.trials.get(k).map(|trial| &trial.quantities[i]);
        let before = k.checked_sub(1).and_then(quantity);
        match (before, quantity(k)) {
            (Some(whole), half) => number::order(whole, half),
            (None, Some(first)) => number::order(first, None),
            (None, None) => String::new(),
        }
    }

    /// A count of all trials.
    pub fn sum(&self, count: impl Fn(&Trial) -> u64) -> u64 {
        self.trials.iter().map(count).sum()
    }

    /// The largest certificate, m/s; NaN counts as largest.
    pub fn worst_certificate(&self) -> f64 {
        let certificates = self.trials.iter().map(|trial| trial.worst_certificate);
        certificates.max_by(f64::total_cmp).unwrap_or(0.0)
    }
}

impl Report {
    /// How many quantities hold, and how many there are, each once a solver.
    pub fn holding(&self) -> (usize, usize) {
        let series = self.experiments.iter().flat_map(|experiment| &experiment.series);
        series.map(Series::holding).fold((0, 0), |a, b| (a.0 + b.0, a.1 + b.1))
    }
}

impl Experiment {
    /// The inputs in words: `mass 2 kg, mu 0.3`.
    pub fn inputs_in_words(&self) -> String {
        let word = |&(input, value): &(_, f64)| {
            let input: tumble::validation::Input = input;
            let unit = self.problem.unit(input);
            format!("{} {value} {unit}", input.name()).trim_end().to_owned()
        };
        self.inputs.values().iter().map(word).collect::<Vec<_>>().join(", ")
    }
}
