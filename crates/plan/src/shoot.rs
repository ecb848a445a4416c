//! Shooting with exact derivatives: every iterate is a run of the simulator, and only the controls
//! are unknown.
//!
//! The cost is the sum of squared *rows* ρ and a quadratic *effort* of the controls. The rows are
//! deviations from the targets and violations of path constraints. Equation numbers refer to
//! `docs/planning.md`.
//!
//! One loop serves two models of the cost about a run. The model of the stage `shoot` (Levenberg
//! and Marquardt) has all controls at once. It uses the derivatives J of the rows (P4), the
//! diagonal matrix E of the weights of effort, and D, the diagonal of JᵀJ + E. The controls x are
//! in units of their bounds:
//!
//! ```text
//! (JᵀJ + E + κ D) d = −(Jᵀρ + E x),   x + d within its bounds                        (P5)
//! ```
//!
//! Variables that would pass a bound are set to it, and the others are solved for again. The model
//! of the stage `ddp` (`ddp.rs`) decides step by step.
//!
//! An iteration simulates the steps d of several κ and takes the cheapest run. The derivative is
//! not valid beyond a kink, for example where a contact opens or begins to slip. If no run is
//! cheaper, the next iteration uses *rougher* derivatives: differences of runs, or steps with
//! compliance. The loop ends if all derivatives are zero.

use super::boxed::{Quadratic, Room};
use super::ddp::{DdpModel, ROUGH};
use super::model::{Centre, CostModel, NOTHING, Trials, efforts, scales};
use super::slopes::RunSlopes;
use super::stage::{SearchProgress, SearchWatch, Stage, StageResult};
use super::{PlanError, PlanProblem, Replay};
use nalgebra::{DMatrix, DVector};

/// Shooting with exact derivatives.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Shoot {
    /// Largest number of iterations.
    pub iterations: u64,
    /// Model of the cost.
    pub method: Method,
}

/// Model of the cost about a run.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Method {
    /// All controls as one vector, after Levenberg and Marquardt: the stage `shoot`.
    ///
    /// The rougher derivatives are differences of runs.
    LevenbergMarquardt,
    /// Decisions step by step with feedback of the states: the stage `ddp`.
    ///
    /// The rougher derivatives use steps with compliance. They also replace exact derivatives that
    /// are all zero.
    DynamicProgramming,
}

impl Method {
    /// Number of kinds of rougher derivatives.
    fn roughest(self) -> usize {
        match self {
            Self::LevenbergMarquardt => 1,
            Self::DynamicProgramming => ROUGH.len(),
        }
    }

    /// True if a rougher kind than `rough` remains that can be non-zero where the current
    /// derivatives are zero. This holds for derivatives with compliance, not for differences.
    fn goes_on_after(self, rough: usize) -> bool {
        self == Self::DynamicProgramming && rough < self.roughest()
    }
}

impl Default for Shoot {
    fn default() -> Self {
        Self { iterations: 100, method: Method::LevenbergMarquardt }
    }
}

/// Values of κ in an iteration, as factors of the κ of the last accepted step.
const TRIED: [f64; 4] = [0.1, 1.0, 10.0, 100.0];

/// Value of κ above which an iteration gives up: its steps are too short to lower the cost.
const LARGEST_DAMPING: f64 = 1e10;

/// Relative decrease of the cost that is negligible. Two such iterations in a row end the loop.
const LITTLE: f64 = 1e-10;

/// Largest number n of variables: the matrix of (P5) has n² entries.
const MOST: usize = 4000;

/// Largest number of entries of J, or of the derivatives of all steps: 1 GiB of numbers.
const MOST_ENTRIES: usize = 1 << 27;

impl Stage for Shoot {
    fn name(&self) -> &'static str {
        match self.method {
            Method::LevenbergMarquardt => "shoot",
            Method::DynamicProgramming => "ddp",
        }
    }

    fn check(&self, problem: &PlanProblem) -> Result<(), PlanError> {
        if self.method == Method::DynamicProgramming {
            return DdpModel::check(problem, MOST_ENTRIES);
        }
        let count = problem.variables().len();
        if count > MOST {
            return Err(PlanError::Problem(format!(
                "shoot: there are {count} variables; allowed: up to {MOST}; use fewer knots"
            )));
        }
        let rows = problem.path_constraints().len() * problem.steps();
        if rows.saturating_mul(count) > MOST_ENTRIES {
            return Err(PlanError::Problem(format!(
                "shoot: {rows} rows of path constraints by {count} variables have too many \
                 derivatives; use fewer steps, path constraints or knots"
            )));
        }
        Ok(())
    }

    fn run(
        &self,
        problem: &PlanProblem,
        from: &Replay,
        watch: &mut SearchWatch<'_>,
    ) -> Result<StageResult, PlanError> {
        let mut end = StageResult { controls: from.controls.clone(), ..StageResult::default() };
        end.message = match self.search(problem, &mut end, watch) {
            Ok(message) => message,
            Err(PlanError::Interrupted) => "interrupted".to_owned(),
            Err(error) => return Err(error),
        };
        Ok(end)
    }
}

impl Shoot {
    /// Iterates from `end.controls` and returns the reason for stopping. `end` holds the best
    /// controls at any time.
    fn search(
        &self,
        problem: &PlanProblem,
        end: &mut StageResult,
        watch: &mut SearchWatch<'_>,
    ) -> Result<String, PlanError> {
        if problem.variables().is_empty() {
            return Ok("the problem has no variables".to_owned());
        }
        let mut trials = Trials { problem, interrupt: watch.interrupt, runs: 1 };
        let mut cost = problem.run_cost(&end.controls, Some(watch.interrupt))?.judged();
        let (mut damping, mut little, mut rough) = (1e-3, 0, 0);
        for iteration in 0..self.iterations {
            let model = self.model(&end.controls, rough, &mut trials)?;
            (end.runs, end.iterations) = (trials.runs, iteration + 1);
            // Without a derivative a rougher one is tried.
            let Some(model) = model else {
                if rough == self.method.roughest() {
                    return Ok("steps of the run have no derivatives".to_owned());
                }
                rough += 1;
                continue;
            };
            // A gradient of zero within the bounds ends the search, unless a rougher derivative may see more.
            if model.centre().projected() <= 1e-14 * (1.0 + cost) {
                let moves = model.centre().moves;
                if !moves && cost > 1e-20 && self.method.goes_on_after(rough) {
                    rough += 1;
                    continue;
                }
                return Ok(if cost <= 1e-20 {
                    "the cost is zero".to_owned()
                } else if moves {
                    "converged: no direction within the bounds lowers the cost".to_owned()
                } else {
                    "all derivatives are zero: no control moves a target".to_owned()
                });
            }
            // Levenberg's damping: the best of a few, then larger ones until the cost falls
            let found = loop {
                let mut best: Option<(Vec<f64>, f64, f64)> = None;
                for factor in TRIED {
                    let kappa = damping * factor;
                    let least = best.as_ref().map_or(cost, |best| best.1);
                    if let Some((next, next_cost)) = model.tried(kappa, least, &mut trials)? {
                        best = Some((next, next_cost, kappa));
                    }
                    end.runs = trials.runs;
                }
                if best.is_some() || damping > LARGEST_DAMPING {
                    break best;
                }
                damping *= 1e3;
            };
            let Some((controls, next_cost, kappa)) = found else {
                if rough == self.method.roughest() {
                    return Ok("no step along the derivative lowers the cost".to_owned());
                }
                // Exact derivatives describe only one side of a kink.
                (rough, damping) = (rough + 1, 1e-3);
                continue;
            };
            // Two iterations with little progress end the search.
            rough = 0;
            little = if cost - next_cost <= LITTLE * cost { little + 1 } else { 0 };
            (end.controls, cost, damping) = (controls, next_cost, kappa.max(1e-12));
            let progress =
                SearchProgress { stage: self.name(), iteration, cost, controls: &end.controls };
            if !watch.goes_on(&progress) {
                return Ok("stopped".to_owned());
            }
            if little == 2 {
                return Ok("converged".to_owned());
            }
        }
        Ok(format!("{} iterations", self.iterations))
    }

    /// Model about the run of `controls`. Its derivatives are exact if `rough` is 0, otherwise of
    /// the `rough`-th rougher kind.
    ///
    /// `None` if steps of the run have no such derivatives.
    fn model(
        &self,
        controls: &[f64],
        rough: usize,
        trials: &mut Trials<'_>,
    ) -> Result<Option<Box<dyn CostModel>>, PlanError> {
        Ok(match self.method {
            Method::LevenbergMarquardt => Some(Box::new(Whole::new(controls, rough > 0, trials)?)),
            Method::DynamicProgramming => {
                let model = DdpModel::new(controls, rough, trials)?;
                model.map(|model| Box::new(model) as Box<dyn CostModel>)
            }
        })
    }
}

/// Model (P5) of all controls at once.
struct Whole {
    centre: Centre,
    /// JᵀJ + E.
    matrix: DMatrix<f64>,
}

impl Whole {
    /// Model about the run of `controls`, from exact derivatives or from differences of runs.
    fn new(
        controls: &[f64],
        differences: bool,
        trials: &mut Trials<'_>,
    ) -> Result<Self, PlanError> {
        let problem = trials.problem;
        let scales = scales(problem);
        let efforts = efforts(problem, &scales);
        let (slopes, runs) = problem.slopes(controls, differences, trials.interrupt)?;
        trials.runs += runs;
        let RunSlopes { rows, mut by } = slopes;
        for (mut column, scale) in by.column_iter_mut().zip(&scales) {
            column *= *scale;
        }
        let x = DVector::from_column_slice(controls).component_div(&scales);
        let gradient = by.tr_mul(&rows) + efforts.component_mul(&x);
        let mut matrix = by.tr_mul(&by);
        for (k, effort) in efforts.iter().enumerate() {
            matrix[(k, k)] += effort;
        }
        let room = Room::new(problem, &x);
        let moves = by.amax() > NOTHING * rows.norm();
        Ok(Self { centre: Centre { x, scales, room, gradient, moves }, matrix })
    }
}

impl CostModel for Whole {
    fn centre(&self) -> &Centre {
        &self.centre
    }

    fn tried(
        &self,
        kappa: f64,
        cost: f64,
        trials: &mut Trials<'_>,
    ) -> Result<Option<(Vec<f64>, f64)>, PlanError> {
        let Centre { x, scales, room, gradient, .. } = &self.centre;
        let quadratic = Quadratic { matrix: &self.matrix, gradient };
        let Some(step) = quadratic.step(kappa, room) else { return Ok(None) };
        let next = (x + step).component_mul(scales);
        let mut next = trials.problem.clipped(next.as_slice())?;
        let found = trials.cost(&mut next, &mut |_, _, _| {})?;
        Ok((found < cost).then_some((next, found)))
    }
}
