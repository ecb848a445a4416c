//! From the values of a search on, by Gauss–Newton steps; and what their slopes say of how well the values are known.
//!
//! With the slopes of every toss ([`slopes`](super::slopes)), their mean g and the means M and H of their matrices, a step is
//!
//! ```text
//! δ = −(M + κ diag M)⁻¹ g,
//! ```
//!
//! κ being a fifth of what it was after a step that makes the loss less, and eight times as much after one that does not, which is not
//! taken. What lies on a bound and would leave is held, and a toss whose slopes there are none of ends the steps. Tosses are drawn from
//! those that could be, so that the values have, to first order, the covariance
//!
//! ```text
//! C = H⁻¹ (Σ gₜ gₜᵀ/T²) H⁻¹,
//! ```
//!
//! which there is only where the loss bends upwards in all that is free.
//!
//! Motions with impacts are chaotic: where a slope tells of the next small dent alone, the steps end soon and C says less than there
//! is to doubt. The bootstrap looks farther.

use super::error::FitError;
use super::evaluator::{Evaluator, Query};
use super::parameter::{Parameter, ParameterValues};
use super::plan::Plan;
use nalgebra::{DMatrix, DVector};

/// What the steps came to.
#[derive(Debug, Clone, PartialEq)]
pub struct Polish {
    /// The loss where they began.
    pub loss_before: f64,
    /// Steps that made the loss less, and were taken.
    pub steps: usize,
    /// Steps that were tried.
    pub tried: usize,
    /// The largest last change of a parameter, in parts of its bounds' distance.
    pub last: f64,
    /// Of the gradient at the end the largest derivative, of the loss by a parameter over its bounds' distance, of what is on no
    /// bound.
    pub slope: f64,
    /// C, by the parameters that are sought, in their order; NaN of one that is held on its bound, of one that the tosses do not show,
    /// and of all where the loss does not bend upwards, or of a single toss.
    pub covariance: DMatrix<f64>,
    /// How far the motions go with each parameter, to first order over its bounds' distance, in the unit of a toss' error: below
    /// [`Polish::SHOWN`] the tosses do not show it.
    pub shown: Vec<f64>,
    /// Why the steps ended where a toss has no slopes.
    pub ended: Option<String>,
    /// Simulated steps of the last slopes of which the derivative is none.
    pub blind: u32,
    /// Those that took a part of their restitution, which is taken for a constant.
    pub limited: u32,
}

impl Polish {
    /// Of what moves less than this with a parameter nothing is left beside rounding.
    pub const SHOWN: f64 = 1e-7;

    /// Whether the tosses show a parameter, by its place among those that are sought; also where nobody knows.
    #[must_use]
    pub fn shows(&self, parameter: usize) -> bool {
        self.shown.get(parameter).is_none_or(|shown| *shown >= Self::SHOWN)
    }
}

/// The slopes of all tosses together.
struct Mean {
    gradient: DVector<f64>,
    matrix: DMatrix<f64>,
    bend: DMatrix<f64>,
    /// Σ gₜ gₜᵀ/T².
    scatter: DMatrix<f64>,
    shown: DVector<f64>,
    tosses: usize,
    blind: u32,
    limited: u32,
}

/// What is on a bound and would leave counts no more.
fn held(plan: &Plan, values: &ParameterValues, gradient: &DVector<f64>) -> Vec<bool> {
    let each = plan.sought.iter().zip(gradient.iter());
    each.map(|(sought, slope)| {
        let (value, [low, high]) = (values.get(sought.parameter), sought.bounds);
        (value <= low && *slope > 0.0) || (value >= high && *slope < 0.0)
    })
    .collect()
}

/// What is free and has a slope.
fn free(matrix: &DMatrix<f64>, held: &[bool]) -> Vec<usize> {
    (0..held.len()).filter(|k| !held[*k] && matrix[(*k, *k)] > 0.0).collect()
}

/// Rows and columns `free` of a matrix, of one scale, so that parameters of any size are alike: each over the roots of its
/// `sizes`.
fn scaled(matrix: &DMatrix<f64>, free: &[usize], sizes: &DMatrix<f64>) -> DMatrix<f64> {
    let scale = |k: usize| sizes[(k, k)].sqrt();
    DMatrix::from_fn(free.len(), free.len(), |i, j| {
        let (a, b) = (free[i], free[j]);
        matrix[(a, b)] / (scale(a) * scale(b))
    })
}

/// −(M + κ diag M)⁻¹ g of what is free and has a slope; zero of the rest.
fn step(mean: &Mean, held: &[bool], damping: f64) -> DVector<f64> {
    let (matrix, free) = (&mean.matrix, free(&mean.matrix, held));
    let mut full = DVector::zeros(held.len());
    if free.is_empty() {
        return full;
    }
    let scale = |k: usize| matrix[(k, k)].sqrt();
    let mut damped = scaled(matrix, &free, matrix);
    for k in 0..free.len() {
        damped[(k, k)] += damping;
    }
    let gradient = DVector::from_fn(free.len(), |k, _| mean.gradient[free[k]] / scale(free[k]));
    if let Ok(inverse) = damped.pseudo_inverse(1e-12) {
        let solved = inverse * gradient;
        for (k, &parameter) in free.iter().enumerate() {
            full[parameter] = -solved[k] / scale(parameter);
        }
    }
    full
}

impl Mean {
    /// C, of what is free and has a slope.
    fn covariance(&self, held: &[bool]) -> DMatrix<f64> {
        let free = free(&self.matrix, held);
        let mut full = DMatrix::from_element(held.len(), held.len(), f64::NAN);
        if free.is_empty() || self.tosses < 2 {
            return full;
        }
        let Some(bend) = scaled(&self.bend, &free, &self.matrix).cholesky() else { return full };
        let back = bend.inverse();
        let covariance = &back * scaled(&self.scatter, &free, &self.matrix) * &back;
        let scale = |k: usize| self.matrix[(k, k)].sqrt();
        for (i, &a) in free.iter().enumerate() {
            for (j, &b) in free.iter().enumerate() {
                full[(a, b)] = covariance[(i, j)] / (scale(a) * scale(b));
            }
        }
        full
    }
}

impl Plan {
    /// Goes on from `values`, of which the loss with all substeps is `loss`; what was found, its loss, and what there is to say.
    ///
    /// # Errors
    /// As [`Evaluator::slopes`], but for a toss without slopes.
    pub(super) fn polished(
        &self,
        (mut values, mut loss): (ParameterValues, f64),
        evaluator: &mut Evaluator<'_>,
        tosses: &[usize],
    ) -> Result<(ParameterValues, f64, Polish), FitError> {
        /// Below this part of its bounds' distance a parameter does not change.
        const STILL: f64 = 1e-12;
        const MOST_DAMPING: f64 = 1e8;
        let substeps = evaluator.protocol().substeps;
        let parameters: Vec<Parameter> =
            self.sought.iter().map(|sought| sought.parameter).collect();
        let width = |k: usize| self.sought[k].bounds[1] - self.sought[k].bounds[0];
        let (before, mut taken, mut tried, mut last) = (loss, 0, 0, 0.0);
        let mut damping = 1e-3;
        loop {
            let query = Query { values: &values, substeps, tosses };
            let mean = match self.mean(&query, &parameters, evaluator) {
                Ok(mean) => mean,
                Err(error @ FitError::Rollout { .. }) => {
                    let unknown =
                        DMatrix::from_element(parameters.len(), parameters.len(), f64::NAN);
                    let polish = Polish {
                        loss_before: before,
                        steps: taken,
                        tried,
                        last,
                        slope: f64::NAN,
                        covariance: unknown,
                        shown: Vec::new(),
                        ended: Some(error.to_string()),
                        blind: 0,
                        limited: 0,
                    };
                    return Ok((values, loss, polish));
                }
                Err(error) => return Err(error),
            };
            let shown: Vec<f64> =
                mean.shown.iter().enumerate().map(|(k, shown)| shown * width(k)).collect();
            let mut held = held(self, &values, &mean.gradient);
            for (held, shown) in held.iter_mut().zip(&shown) {
                *held |= *shown < Polish::SHOWN;
            }
            let mut is_less = false;
            while tried < self.polish && damping <= MOST_DAMPING && !is_less {
                let step = step(&mean, &held, damping);
                let wanted = self.sought.iter().zip(step.iter()).fold(
                    values.clone(),
                    |to, (sought, step)| {
                        let [low, high] = sought.bounds;
                        let value = (values.get(sought.parameter) + step).clamp(low, high);
                        to.with(sought.parameter, value)
                    },
                );
                let change = parameters.iter().enumerate().map(|(k, &parameter)| {
                    (wanted.get(parameter) - values.get(parameter)).abs() / width(k)
                });
                let change = change.fold(0.0, f64::max);
                if change < STILL {
                    break;
                }
                tried += 1;
                let query = Query { values: &wanted, substeps, tosses };
                let found = match evaluator.evaluate(&query) {
                    Ok(scores) => self.loss.mean(&scores),
                    Err(FitError::Rollout { .. }) => f64::INFINITY,
                    Err(error) => return Err(error),
                };
                if found < loss {
                    (values, loss, last, is_less) = (wanted, found, change, true);
                    taken += 1;
                    damping = (damping / 5.0).max(1e-12);
                } else {
                    damping *= 8.0;
                }
            }
            if !is_less {
                let slopes = mean.gradient.iter().enumerate().filter(|(k, _)| !held[*k]);
                let slope = slopes.map(|(k, slope)| (slope * width(k)).abs()).fold(0.0, f64::max);
                let covariance = mean.covariance(&held);
                let (loss_before, steps, ended) = (before, taken, None);
                let Mean { blind, limited, .. } = mean;
                let polish = Polish {
                    loss_before,
                    steps,
                    tried,
                    last,
                    slope,
                    covariance,
                    shown,
                    ended,
                    blind,
                    limited,
                };
                return Ok((values, loss, polish));
            }
        }
    }

    fn mean(
        &self,
        query: &Query<'_>,
        parameters: &[Parameter],
        evaluator: &mut Evaluator<'_>,
    ) -> Result<Mean, FitError> {
        let all = evaluator.slopes(query, parameters, self.loss)?;
        let (count, each) = (parameters.len(), 1.0 / all.len() as f64);
        let mut mean = Mean {
            gradient: DVector::zeros(count),
            matrix: DMatrix::zeros(count, count),
            bend: DMatrix::zeros(count, count),
            scatter: DMatrix::zeros(count, count),
            shown: DVector::zeros(count),
            tosses: all.len(),
            blind: 0,
            limited: 0,
        };
        for toss in &all {
            mean.gradient += &toss.gradient * each;
            mean.matrix += &toss.matrix * each;
            mean.bend += &toss.bend * each;
            mean.scatter += &toss.gradient * toss.gradient.transpose() * (each * each);
            mean.shown += &toss.shown * each;
            mean.blind += toss.blind;
            mean.limited += toss.limited;
        }
        Ok(mean)
    }
}
