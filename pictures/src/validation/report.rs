//! What the page is made of.

/// All that was validated.
#[derive(Debug, Clone, PartialEq)]
pub struct Report {
    /// Which version of what was validated.
    pub program: String,
    /// The flags that changed inputs or time steps; empty where all are the usual ones.
    pub given: String,
    /// One a problem.
    pub experiments: Vec<Experiment>,
}

/// One problem, by every solver.
#[derive(Debug, Clone, PartialEq)]
pub struct Experiment {
    /// Of the problem: a word of an address, which needs no escaping.
    pub name: String,
    /// What happens in it and what the answer is.
    pub about: String,
    /// In words: `mass 2 kg, mu 0.3`.
    pub inputs: String,
    /// One a solver, with the same quantities; at least one.
    pub series: Vec<Series>,
}

/// One problem by one solver, at a time step and its halves.
#[derive(Debug, Clone, PartialEq)]
pub struct Series {
    /// Who solved it.
    pub solver: Solver,
    /// The coarsest first, each at half the step of the one before; at least one.
    pub trials: Vec<Trial>,
    /// Of the first trial.
    pub curve: Curve,
}

/// One problem by one solver at one time step.
#[derive(Debug, Clone, PartialEq)]
pub struct Trial {
    /// h, s.
    pub time_step: f64,
    /// Measured against exact.
    pub quantities: Vec<Quantity>,
    /// Steps in all.
    pub steps: u64,
    /// Steps that did not converge.
    pub failed: u64,
    /// Steps for which another solver's answer stands in.
    pub fallback: u64,
    /// How far a step is from an exact solution at most, m/s.
    pub worst_residual: f64,
}

/// A number that was measured, and what it should be.
#[derive(Debug, Clone, PartialEq)]
pub struct Quantity {
    /// In words.
    pub name: String,
    /// Its unit; `1` for a number.
    pub unit: String,
    /// From the simulation.
    pub measured: f64,
    /// What the steps must give.
    pub discrete: f64,
    /// From the closed form in continuous time.
    pub exact: f64,
    /// How far rounding and the residuals of the steps may take `measured` from `discrete`.
    pub slack: f64,
    /// What is wrong with it, in words; `None` where it holds.
    pub fault: Option<String>,
    /// What is to be said of its order in the time step, from the trial before.
    pub order: String,
    /// Whether it comes to the exact value with the first power of the time step.
    pub first_order: bool,
}

/// A quantity over time, as it was simulated and as the closed form has it.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Curve {
    /// What is drawn, in words.
    pub name: String,
    /// Its unit.
    pub unit: String,
    /// t, s.
    pub times: Vec<f64>,
    /// From the simulation.
    pub measured: Vec<f64>,
    /// From the closed form; NaN where it says nothing.
    pub exact: Vec<f64>,
}

/// Who solved the steps.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Solver {
    /// Newton's method on the contact law.
    Native,
    /// Ipopt on the nonlinear program.
    Ipopt,
}

impl Solver {
    /// In one word.
    #[must_use]
    pub fn name(self) -> &'static str {
        match self {
            Self::Native => "native",
            Self::Ipopt => "ipopt",
        }
    }
}

impl Series {
    /// Whether the quantity `i` holds at every time step.
    #[must_use]
    pub fn holds(&self, i: usize) -> bool {
        self.trials.iter().all(|trial| trial.quantities[i].fault.is_none())
    }

    /// How many quantities hold, and how many there are.
    #[must_use]
    pub fn holding(&self) -> (usize, usize) {
        let count = self.trials[0].quantities.len();
        ((0..count).filter(|&i| self.holds(i)).count(), count)
    }

    /// What is said of the order of the quantity `i` in the trial `k`; nothing without one.
    #[must_use]
    pub fn order(&self, i: usize, k: usize) -> &str {
        self.trials.get(k).map_or("", |trial| &trial.quantities[i].order)
    }

    /// A count of all trials.
    pub fn sum(&self, count: impl Fn(&Trial) -> u64) -> u64 {
        self.trials.iter().map(count).sum()
    }

    /// The largest residual, m/s; NaN counts as largest.
    #[must_use]
    pub fn worst_residual(&self) -> f64 {
        let residuals = self.trials.iter().map(|trial| trial.worst_residual);
        residuals.max_by(f64::total_cmp).unwrap_or(0.0)
    }
}

impl Report {
    /// How many quantities hold, and how many there are, each once a solver.
    #[must_use]
    pub fn holding(&self) -> (usize, usize) {
        let series = self.experiments.iter().flat_map(|experiment| &experiment.series);
        series.map(Series::holding).fold((0, 0), |a, b| (a.0 + b.0, a.1 + b.1))
    }
}

impl Quantity {
    /// measured − discrete.
    #[must_use]
    pub fn error(&self) -> f64 {
        self.measured - self.discrete
    }
}
