//! Quadratic models within bounds, and their steps.

use super::PlanProblem;
use nalgebra::{Cholesky, DMatrix, DVector, Dyn};

/// Least entry of D in (P5), relative to the largest: it bounds the step of a variable that moves no row.
pub(super) const LEAST_DAMPING: f64 = 1e-9;

/// Distances of the variables from their bounds, in units of the bounds.
pub(super) struct Room {
    pub down: DVector<f64>,
    pub up: DVector<f64>,
}

impl Room {
    pub(super) fn new(problem: &PlanProblem, x: &DVector<f64>) -> Self {
        let count = x.len();
        let far = |end: usize| {
            let bounds = problem.variables().iter().map(|v| v.bounds[end] / v.scale());
            DVector::from_iterator(count, bounds.zip(x).map(|(bound, x)| bound - x))
        };
        Self { down: far(0), up: far(1) }
    }

    /// True if the variable can move against the gradient.
    fn is_free(&self, k: usize, gradient: f64) -> bool {
        let edge = 1e-12;
        !(gradient > 0.0 && self.down[k] > -edge || gradient < 0.0 && self.up[k] < edge)
    }

    /// Largest component of the gradient that a step within the bounds can follow.
    pub(super) fn projected(&self, gradient: &DVector<f64>) -> f64 {
        let free = gradient.iter().enumerate().filter(|(k, g)| self.is_free(*k, **g));
        free.map(|(_, g)| g.abs()).fold(0.0, f64::max)
    }
}

/// Quadratic model of the cost.
pub(super) struct Quadratic<'a> {
    pub matrix: &'a DMatrix<f64>,
    pub gradient: &'a DVector<f64>,
}

impl Quadratic<'_> {
    /// Step of (P5) with this κ: variables that would pass a bound are set to it, until none would.
    pub(super) fn step(&self, kappa: f64, room: &Room) -> Option<DVector<f64>> {
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

/// Minimum of ½ dᵀQd + qᵀd within a box, and its free components.
pub(super) struct Boxed {
    pub step: DVector<f64>,
    /// Components between their bounds, or with a gradient that points off their bound.
    pub free: Vec<usize>,
    /// Factor of the rows and columns of Q for the free components.
    pub factor: Option<Cholesky<f64, Dyn>>,
}

/// Largest number of Newton steps; few of them change the free components.
const MOST_NEWTON: usize = 100;

/// Least decrease of a step, relative to the decrease along the gradient.
const ENOUGH: f64 = 0.1;

/// Projected Newton method for a box (Bertsekas 1982).
///
/// Components at a bound with a step beyond it stay. The others take a Newton step, clipped and shortened until it
/// decreases the objective. `None` if the free part of Q is not positive definite.
pub(super) fn least_in_box(
    matrix: &DMatrix<f64>,
    gradient: &DVector<f64>,
    low: &DVector<f64>,
    high: &DVector<f64>,
) -> Option<Boxed> {
    let count = gradient.len();
    let clipped = |d: DVector<f64>| d.zip_zip_map(low, high, |d, low, high| d.clamp(low, high));
    let value = |d: &DVector<f64>| d.dot(&(0.5 * (matrix * d) + gradient));
    let mut step = clipped(DVector::zeros(count));
    let mut now = value(&step);
    let mut known: Option<(Vec<usize>, Cholesky<f64, Dyn>)> = None;
    for _ in 0..MOST_NEWTON {
        // A component at a bound stays if the slope Qd + q points beyond it.
        let slope = matrix * &step + gradient;
        let is_free = |&k: &usize| {
            !(slope[k] > 0.0 && step[k] <= low[k] || slope[k] < 0.0 && step[k] >= high[k])
        };
        let free: Vec<usize> = (0..count).filter(is_free).collect();
        if free.is_empty() {
            return Some(Boxed { step, free, factor: None });
        }
        // Newton's step of the free components. Their factor is kept while they stay the same.
        let (free, factor) = match known.take() {
            Some(same) if same.0 == free => same,
            _ => {
                let part =
                    DMatrix::from_fn(free.len(), free.len(), |i, j| matrix[(free[i], free[j])]);
                (free, part.cholesky()?)
            }
        };
        let right = DVector::from_iterator(free.len(), free.iter().map(|&k| -slope[k]));
        let mut way = DVector::zeros(count);
        for (&k, d) in free.iter().zip(&factor.solve(&right)) {
            way[k] = *d;
        }
        // Armijo's rule along the clipped step
        let mut part = 1.0;
        let next = loop {
            let next = clipped(&step + &way * part);
            let found = value(&next);
            let promised = slope.dot(&(&next - &step));
            if found - now <= ENOUGH * promised && found < now {
                break Some((next, found));
            }
            part *= 0.5;
            if part < 1e-8 {
                break None;
            }
        };
        let Some((next, found)) = next else {
            return Some(Boxed { step, free, factor: Some(factor) });
        };
        (step, now) = (next, found);
        known = Some((free, factor));
    }
    let (free, factor) = known?;
    Some(Boxed { step, free, factor: Some(factor) })
}

#[cfg(test)]
#[path = "tests/boxed.rs"]
mod tests;
