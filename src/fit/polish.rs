//! From the values of a search on, by Gauss–Newton steps; and what their slopes say of how well the values are known.
//!
//! With the slopes of every toss ([`slopes`](super::slopes)), their mean g and the mean M of their matrices, a step is
//!
//! ```text
//! δ = −(M + κ diag M)⁻¹ g,
//! ```
//!
//! κ being a fifth of what it was after a step that makes the loss less, and eight times as much after one that does not, which is not
//! taken. What lies on a bound and would leave is held. Tosses are drawn from those that could be, so that the
//! values have, to first order, the covariance
//!
//! ```text
//! C = M⁻¹ (Σ gₜ gₜᵀ/T²) M⁻¹.
//! ```
//!
//! Motions with impacts are chaotic: where a slope tells of the next small dent alone, the steps end soon and C says less than there
//! is to doubt. The bootstrap looks farther.

use super::error::FitError;
use super::model::{Constant, ParameterValues};
use super::rollout::{Evaluator, Query};
use super::search::Plan;
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
    /// C, by the parameters that are sought, in their order; zero of one that the tosses say nothing of, or that is held on
    /// its bound.
    pub covariance: DMatrix<f64>,
    /// Simulated steps of the last slopes of which the derivative is none.
    pub blind: u32,
    /// Those that took a part of their restitution, which is taken for a constant.
    pub limited: u32,
}

/// The slopes of all tosses together.
struct Mean {
    gradient: DVector<f64>,
    matrix: DMatrix<f64>,
    /// Σ gₜ gₜᵀ/T².
    scatter: DMatrix<f64>,
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

/// (M + κ diag M)⁻¹ of what is free and has a slope; zero of the rest.
fn inverse(matrix: &DMatrix<f64>, held: &[bool], damping: f64) -> DMatrix<f64> {
    let count = held.len();
    let free: Vec<usize> = (0..count).filter(|k| !held[*k] && matrix[(*k, *k)] > 0.0).collect();
    let mut full = DMatrix::zeros(count, count);
    if free.is_empty() {
        return full;
    }
    let scale = |k: usize| matrix[(k, k)].sqrt();
    // Of one scale, so that parameters of any size are alike.
    let scaled = DMatrix::from_fn(free.len(), free.len(), |i, j| {
        let (a, b) = (free[i], free[j]);
        matrix[(a, b)] / (scale(a) * scale(b)) + if i == j { damping } else { 0.0 }
    });
    let Ok(solved) = scaled.pseudo_inverse(1e-12) else { return full };
    for (i, &a) in free.iter().enumerate() {
        for (j, &b) in free.iter().enumerate() {
            full[(a, b)] = solved[(i, j)] / (scale(a) * scale(b));
        }
    }
    full
}

impl Plan {
    /// Goes on from `values`, of which the loss with all substeps is `loss`; what was found, its loss, and what there is to say.
    ///
    /// # Errors
    /// As [`Evaluator::slopes`].
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
        let parameters: Vec<Constant> = self.sought.iter().map(|sought| sought.parameter).collect();
        let width = |k: usize| self.sought[k].bounds[1] - self.sought[k].bounds[0];
        let (before, mut taken, mut tried, mut last) = (loss, 0, 0, 0.0);
        let mut damping = 1e-3;
        loop {
            let query = Query { values: &values, substeps, tosses };
            let mean = self.mean(&query, &parameters, evaluator)?;
            let held = held(self, &values, &mean.gradient);
            let mut is_less = false;
            while tried < self.polish && damping <= MOST_DAMPING && !is_less {
                let step = inverse(&mean.matrix, &held, damping) * -&mean.gradient;
                let wanted =
                    self.sought.iter().zip(step.iter()).fold(values, |to, (sought, step)| {
                        let [low, high] = sought.bounds;
                        let value = (values.get(sought.parameter) + step).clamp(low, high);
                        to.with(sought.parameter, value)
                    });
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
                let back = inverse(&mean.matrix, &held, 0.0);
                let covariance = &back * &mean.scatter * &back;
                let (loss_before, steps) = (before, taken);
                let Mean { blind, limited, .. } = mean;
                let polish =
                    Polish { loss_before, steps, tried, last, slope, covariance, blind, limited };
                return Ok((values, loss, polish));
            }
        }
    }

    fn mean(
        &self,
        query: &Query<'_>,
        parameters: &[Constant],
        evaluator: &mut Evaluator<'_>,
    ) -> Result<Mean, FitError> {
        let all = evaluator.slopes(query, parameters, self.loss)?;
        let (count, each) = (parameters.len(), 1.0 / all.len() as f64);
        let mut mean = Mean {
            gradient: DVector::zeros(count),
            matrix: DMatrix::zeros(count, count),
            scatter: DMatrix::zeros(count, count),
            blind: 0,
            limited: 0,
        };
        for toss in &all {
            mean.gradient += &toss.gradient * each;
            mean.matrix += &toss.matrix * each;
            mean.scatter += &toss.gradient * toss.gradient.transpose() * (each * each);
            mean.blind += toss.blind;
            mean.limited += toss.limited;
        }
        Ok(mean)
    }
}
