//! Shooting: the controls alone are unknown, every iterate is a run of the simulator, and derivatives are exact.
//!
//! Levenberg's and Marquardt's method within bounds. With the rows ρ of a run, their derivatives J (P5), both in parts of the
//! bounds, and the efforts E,
//!
//! ```text
//! (JᵀJ + E + κ D) d = −(Jᵀρ + E x),   x + d within its bounds                        (P6)
//! ```
//!
//! where variables whose bound the step would pass are put on it and the others solved for again. Of several κ the one
//! counts whose *run* is cheapest: beyond a kink the derivative knows nothing. Where none is, differences of runs take its
//! place for an iteration. Where no derivative moves anything, as of a body that sticks, it ends at once and says so.

use super::leg::{Leg, LegEnd, Progress, Watch};
use super::{PlanError, Problem, Replay};
use nalgebra::{DMatrix, DVector};

/// Shooting by exact derivatives.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Shoot {
    /// The most iterations.
    pub iterations: u64,
}

impl Default for Shoot {
    fn default() -> Self {
        Self { iterations: 100 }
    }
}

/// Of D in (P6), what every variable has at least, in parts of the largest: those that move nothing must not move
/// without end.
const LEAST_DAMPING: f64 = 1e-9;

/// What κ is tried, in parts of the last that was good.
const TRIED: [f64; 4] = [0.1, 1.0, 10.0, 100.0];

/// The last κ: then no step along the derivative makes the cost less.
const LARGEST_DAMPING: f64 = 1e10;

/// A control that over all of its bounds would move the rows by less than this part of them moves nothing.
const NOTHING: f64 = 1e-6;

/// Two iterations that make the cost less by no more than this part of it are the end.
const LITTLE: f64 = 1e-10;

/// More numbers than this are not sought: (P6) is a matrix of their square.
const MOST: usize = 4000;

/// More entries than this J does not have.
const MOST_ENTRIES: usize = 1 << 27;

impl Leg for Shoot {
    fn name(&self) -> &'static str {
        "shoot"
    }

    fn check(&self, problem: &Problem) -> Result<(), PlanError> {
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
        let variables = problem.variables();
        if variables.is_empty() {
            return Ok("there is nothing to look for".to_owned());
        }
        let scales = DVector::from_iterator(variables.len(), variables.iter().map(|v| v.scale()));
        let efforts = variables.iter().zip(&scales).map(|(v, scale)| v.effort * scale * scale);
        let efforts = DVector::from_iterator(variables.len(), efforts);
        let mut cost = problem.run_cost(&end.controls, Some(watch.interrupt))?.judged();
        end.runs += 1;
        let (mut damping, mut little, mut differences) = (1e-3, 0, false);
        for iteration in 0..self.iterations {
            let (slopes, runs) = problem.slopes(&end.controls, differences, watch.interrupt)?;
            end.runs += runs;
            end.iterations = iteration + 1;
            let mut by = slopes.by;
            for (mut column, scale) in by.column_iter_mut().zip(&scales) {
                column *= *scale;
            }
            let x = DVector::from_column_slice(&end.controls).component_div(&scales);
            let gradient = by.tr_mul(&slopes.rows) + efforts.component_mul(&x);
            let mut matrix = by.tr_mul(&by);
            for (k, effort) in efforts.iter().enumerate() {
                matrix[(k, k)] += effort;
            }
            let room = Room::of(problem, &x);
            if room.projected(&gradient) <= 1e-14 * (1.0 + cost) {
                let moves = by.amax() > NOTHING * slopes.rows.norm();
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
            let quadratic = Quadratic { matrix: &matrix, gradient: &gradient };
            let found = loop {
                let mut best: Option<(Vec<f64>, f64, f64)> = None;
                for factor in TRIED {
                    let kappa = damping * factor;
                    let Some(step) = quadratic.step(kappa, &room) else { continue };
                    let next = (&x + step).component_mul(&scales);
                    let next = problem.clipped(next.as_slice())?;
                    end.runs += 1;
                    let next_cost = match problem.run_cost(&next, Some(watch.interrupt)) {
                        Ok(cost) => cost.judged(),
                        Err(PlanError::Step(_)) => f64::INFINITY,
                        Err(error) => return Err(error),
                    };
                    if next_cost < best.as_ref().map_or(cost, |best| best.1) {
                        best = Some((next, next_cost, kappa));
                    }
                }
                if best.is_some() || damping > LARGEST_DAMPING {
                    break best;
                }
                damping *= 1e3;
            };
            let Some((controls, next_cost, kappa)) = found else {
                if differences {
                    return Ok("no step along the derivative makes the cost less".to_owned());
                }
                // At a kink, and where features are not known as functions of the poses, differences see more.
                (differences, damping) = (true, 1e-3);
                continue;
            };
            differences = false;
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
}

/// How far every variable may go, in parts of its bounds.
struct Room {
    down: DVector<f64>,
    up: DVector<f64>,
}

impl Room {
    fn of(problem: &Problem, x: &DVector<f64>) -> Self {
        let count = x.len();
        let far = |end: usize| {
            let bounds = problem.variables().iter().map(|v| v.bounds[end] / v.scale());
            DVector::from_iterator(count, bounds.zip(x).map(|(bound, x)| bound - x))
        };
        Self { down: far(0), up: far(1) }
    }

    /// Whether the variable can go on against the gradient.
    fn is_free(&self, k: usize, gradient: f64) -> bool {
        let edge = 1e-12;
        !(gradient > 0.0 && self.down[k] > -edge || gradient < 0.0 && self.up[k] < edge)
    }

    /// The largest component of the gradient that a step within the bounds can follow.
    fn projected(&self, gradient: &DVector<f64>) -> f64 {
        let free = gradient.iter().enumerate().filter(|(k, g)| self.is_free(*k, **g));
        free.map(|(_, g)| g.abs()).fold(0.0, f64::max)
    }
}

/// The quadratic model of the cost.
struct Quadratic<'a> {
    matrix: &'a DMatrix<f64>,
    gradient: &'a DVector<f64>,
}

impl Quadratic<'_> {
    /// The step of (P6) with this κ: variables whose bounds it would pass are put on them, until none is.
    fn step(&self, kappa: f64, room: &Room) -> Option<DVector<f64>> {
        let count = self.gradient.len();
        let largest = self.matrix.diagonal().amax();
        let damping = |k: usize| kappa * self.matrix[(k, k)].max(LEAST_DAMPING * largest);
        let mut step = DVector::zeros(count);
        let mut free: Vec<usize> =
            (0..count).filter(|&k| room.is_free(k, self.gradient[k])).collect();
        while !free.is_empty() {
            let put = self.matrix * &step;
            let right = free.iter().map(|&k| -self.gradient[k] - put[k]);
            let right = DVector::from_iterator(free.len(), right);
            let matrix = DMatrix::from_fn(free.len(), free.len(), |i, j| {
                let (i, j) = (free[i], free[j]);
                self.matrix[(i, j)] + if i == j { damping(i) } else { 0.0 }
            });
            let solved = matrix.cholesky()?.solve(&right);
            let mut beyond = false;
            let mut left = Vec::with_capacity(free.len());
            for (&k, &d) in free.iter().zip(&solved) {
                if d < room.down[k] || d > room.up[k] {
                    step[k] = d.clamp(room.down[k], room.up[k]);
                    beyond = true;
                } else {
                    left.push(k);
                }
            }
            if !beyond {
                for (&k, &d) in free.iter().zip(&solved) {
                    step[k] = d;
                }
                break;
            }
            free = left;
        }
        step.iter().all(|d| d.is_finite()).then_some(step)
    }
}
