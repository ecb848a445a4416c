//! Shooting: the controls alone are unknown, every iterate is a run of the simulator, and derivatives are exact.
//!
//! One loop for two models of the cost about a run. That of Levenberg and Marquardt has all controls at once: with the rows ρ of a
//! run, their derivatives J (P5), both in parts of the bounds, and the efforts E,
//!
//! ```text
//! (JᵀJ + E + κ D) d = −(Jᵀρ + E x),   x + d within its bounds                        (P6)
//! ```
//!
//! where variables whose bound the step would pass are put on it and the others solved for again. That of differential dynamic
//! programming (`ddp.rs`) has those of one stage after the other, and how they follow the states. Of several κ the one
//! counts whose *run* is cheapest: beyond a kink the derivative knows nothing. Where none is, rougher derivatives take the place of the
//! exact ones for an iteration. Where no derivative moves anything, as of a body that sticks, it ends at once and says so.

use super::boxed::{Quadratic, Room};
use super::ddp::{ROUGH, Stages};
use super::leg::{Leg, LegEnd, Progress, Watch};
use super::model::{Centre, Model, NOTHING, Trials, efforts, scales};
use super::slopes::Slopes;
use super::{PlanError, Problem, Replay};
use nalgebra::{DMatrix, DVector};

/// Shooting by exact derivatives.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Shoot {
    /// The most iterations.
    pub iterations: u64,
    /// What an iteration takes its step from.
    pub method: Method,
}

/// What an iteration of a shooting takes its step from.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Method {
    /// All controls as one vector, after Levenberg and Marquardt: the leg `shoot`. Where no step is cheaper, differences of runs.
    LevenbergMarquardt,
    /// Controls stage by stage with feedback of the states, within their bounds: the leg `ddp`, after Tassa, Mansard and Todorov
    /// (2014). Where no step is cheaper, and where no derivative moves anything, derivatives of steps with compliance.
    DynamicProgramming,
}

impl Method {
    /// How many kinds of rougher derivatives there are.
    fn roughest(self) -> usize {
        match self {
            Self::LevenbergMarquardt => 1,
            Self::DynamicProgramming => ROUGH.len(),
        }
    }

    /// Whether rougher derivatives may move something where these move nothing: those of steps with compliance do, differences do not.
    fn goes_on_after(self, rough: usize) -> bool {
        self == Self::DynamicProgramming && rough < self.roughest()
    }
}

impl Default for Shoot {
    fn default() -> Self {
        Self { iterations: 100, method: Method::LevenbergMarquardt }
    }
}

/// What κ is tried, in parts of the last that was good.
const TRIED: [f64; 4] = [0.1, 1.0, 10.0, 100.0];

/// The last κ: then no step along the derivative makes the cost less.
const LARGEST_DAMPING: f64 = 1e10;

/// Two iterations that make the cost less by no more than this part of it are the end.
const LITTLE: f64 = 1e-10;

/// More numbers than this are not sought at once: (P6) is a matrix of their square.
const MOST: usize = 4000;

/// More entries than this J does not have, nor do the derivatives of all steps.
const MOST_ENTRIES: usize = 1 << 27;

impl Leg for Shoot {
    fn name(&self) -> &'static str {
        match self.method {
            Method::LevenbergMarquardt => "shoot",
            Method::DynamicProgramming => "ddp",
        }
    }

    fn check(&self, problem: &Problem) -> Result<(), PlanError> {
        if self.method == Method::DynamicProgramming {
            return Stages::check(problem, MOST_ENTRIES);
        }
        let count = problem.variables().len();
        if count > MOST {
            return Err(PlanError::Problem(format!(
                "shoot: {count} numbers are sought; it seeks up to {MOST}, as fewer knots have"
            )));
        }
        let rows = problem.keeps().len() * problem.steps();
        if rows.saturating_mul(count) > MOST_ENTRIES {
            return Err(PlanError::Problem(format!(
                "shoot: {rows} rows to keep by {count} numbers are too many derivatives; fewer steps, keeps or knots \
                 are needed"
            )));
        }
        Ok(())
    }

    fn run(
        &self,
        problem: &Problem,
        from: &Replay,
        watch: &mut Watch<'_>,
    ) -> Result<LegEnd, PlanError> {
        let mut end = LegEnd { controls: from.controls.clone(), ..LegEnd::default() };
        end.message = match self.search(problem, &mut end, watch) {
            Ok(message) => message,
            Err(PlanError::Interrupted) => "interrupted".to_owned(),
            Err(error) => return Err(error),
        };
        Ok(end)
    }
}

impl Shoot {
    /// How it ended; the best controls are in `end` at any time.
    fn search(
        &self,
        problem: &Problem,
        end: &mut LegEnd,
        watch: &mut Watch<'_>,
    ) -> Result<String, PlanError> {
        if problem.variables().is_empty() {
            return Ok("there is nothing to look for".to_owned());
        }
        let mut trials = Trials { problem, interrupt: watch.interrupt, runs: 1 };
        let mut cost = problem.run_cost(&end.controls, Some(watch.interrupt))?.judged();
        let (mut damping, mut little, mut rough) = (1e-3, 0, 0);
        for iteration in 0..self.iterations {
            let model = self.model(&end.controls, rough, &mut trials)?;
            (end.runs, end.iterations) = (trials.runs, iteration + 1);
            let Some(model) = model else {
                if rough == self.method.roughest() {
                    return Ok("steps of the run have no derivatives".to_owned());
                }
                rough += 1;
                continue;
            };
            if model.centre().projected() <= 1e-14 * (1.0 + cost) {
                let moves = model.centre().moves;
                if !moves && cost > 1e-20 && self.method.goes_on_after(rough) {
                    rough += 1;
                    continue;
                }
                return Ok(if cost <= 1e-20 {
                    "everything is reached".to_owned()
                } else if moves {
                    "no direction within the bounds makes the cost less".to_owned()
                } else {
                    "no control moves what is to be reached: all derivatives are zero, as of what \
                     sticks, or flies beyond reach"
                        .to_owned()
                });
            }
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
                    return Ok("no step along the derivative makes the cost less".to_owned());
                }
                // At a kink, and where features are not known as functions of the poses, rougher derivatives see more.
                (rough, damping) = (rough + 1, 1e-3);
                continue;
            };
            rough = 0;
            little = if cost - next_cost <= LITTLE * cost { little + 1 } else { 0 };
            (end.controls, cost, damping) = (controls, next_cost, kappa.max(1e-12));
            let progress = Progress { leg: self.name(), iteration, cost, controls: &end.controls };
            if !watch.goes_on(&progress) {
                return Ok("stopped".to_owned());
            }
            if little == 2 {
                return Ok("converged".to_owned());
            }
        }
        Ok(format!("{} iterations", self.iterations))
    }

    /// The model about the run under `controls`, by exact derivatives (0) or by the rougher ones of this index; none where its steps
    /// have no such.
    fn model(
        &self,
        controls: &[f64],
        rough: usize,
        trials: &mut Trials<'_>,
    ) -> Result<Option<Box<dyn Model>>, PlanError> {
        Ok(match self.method {
            Method::LevenbergMarquardt => Some(Box::new(Whole::of(controls, rough > 0, trials)?)),
            Method::DynamicProgramming => {
                let stages = Stages::of(controls, rough, trials)?;
                stages.map(|stages| Box::new(stages) as Box<dyn Model>)
            }
        })
    }
}

/// The model of (P6).
struct Whole {
    centre: Centre,
    matrix: DMatrix<f64>,
}

impl Whole {
    fn of(controls: &[f64], differences: bool, trials: &mut Trials<'_>) -> Result<Self, PlanError> {
        let problem = trials.problem;
        let scales = scales(problem);
        let efforts = efforts(problem, &scales);
        let (slopes, runs) = problem.slopes(controls, differences, trials.interrupt)?;
        trials.runs += runs;
        let Slopes { rows, mut by } = slopes;
        for (mut column, scale) in by.column_iter_mut().zip(&scales) {
            column *= *scale;
        }
        let x = DVector::from_column_slice(controls).component_div(&scales);
        let gradient = by.tr_mul(&rows) + efforts.component_mul(&x);
        let mut matrix = by.tr_mul(&by);
        for (k, effort) in efforts.iter().enumerate() {
            matrix[(k, k)] += effort;
        }
        let room = Room::of(problem, &x);
        let moves = by.amax() > NOTHING * rows.norm();
        Ok(Self { centre: Centre { x, scales, room, gradient, moves }, matrix })
    }
}

impl Model for Whole {
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
