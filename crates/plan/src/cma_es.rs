//! The covariance matrix adaptation evolution strategy with negative weights.
//!
//! The points of a generation are normal, x = m + σ y with y ~ N(0, C). They are sorted by cost.
//! Mean m, step size σ and covariance C then follow the better ones. Equation numbers are those of
//! N. Hansen, *The CMA Evolution Strategy: A Tutorial*, arXiv:1604.00772v2, table 1 and appendix A.

use nalgebra::{DMatrix, DVector};
use tumble_core::simulation::random::Draws;

/// Smallest step in any direction, relative to the initial one, after which a search has converged.
const SMALLEST_STEP: f64 = 1e-12;

/// Relative difference of costs below which they are equal.
const SAME_COST: f64 = 1e-12;

/// Largest ratio of variances in two directions. Its square root loses half of the digits.
const LARGEST_CONDITION: f64 = 1e14;

/// State of a search.
pub struct CmaEs {
    draws: Draws,
    constants: Constants,
    generation: i32,
    mean: DVector<f64>,
    step_size: f64,
    first_step_size: f64,
    covariance: DMatrix<f64>,
    /// Eigenvectors of the covariance, and the roots of its eigenvalues.
    axes: DMatrix<f64>,
    widths: DVector<f64>,
    path_covariance: DVector<f64>,
    path_step: DVector<f64>,
    /// Steps y of the points of this generation.
    steps: Vec<DVector<f64>>,
    /// Number of generations since the best cost has improved.
    stalled: usize,
    best: f64,
}

/// Weights w, learning rates c and damping d (table 1).
struct Constants {
    weights: Vec<f64>,
    /// Effective number μ_eff of points with positive weights.
    effective: f64,
    rank_one: f64,
    rank_mu: f64,
    path: f64,
    step: f64,
    damping: f64,
    /// Expected length of a standard normal vector.
    length: f64,
}

impl Constants {
    fn new(dimension: usize, population: usize) -> Self {
        let n = dimension as f64;
        let lambda = population as f64;
        let raw = |i: usize| libm::log(0.5 * (lambda + 1.0)) - libm::log(i as f64);
        let raw: Vec<f64> = (1..=population).map(raw).collect();
        let (good, bad) = raw.split_at(population / 2);
        let effective = |part: &[f64]| {
            let sum: f64 = part.iter().sum();
            sum * sum / part.iter().map(|w| w * w).sum::<f64>()
        };
        let mu = effective(good);
        let rank_one = 2.0 / ((n + 1.3).powi(2) + mu);
        let rank_mu = 2.0 * (0.25 + mu + 1.0 / mu - 2.0) / ((n + 2.0).powi(2) + mu);
        let rank_mu = rank_mu.min(1.0 - rank_one);
        // Sum of the negative weights (50) to (53). The last keeps C positive definite.
        let least = (1.0 + rank_one / rank_mu)
            .min(1.0 + 2.0 * effective(bad) / (mu + 2.0))
            .min((1.0 - rank_one - rank_mu) / (n * rank_mu));
        let [sum_good, sum_bad] = [good, bad].map(|part| part.iter().map(|w| w.abs()).sum::<f64>());
        let weight = |w: &f64| if *w >= 0.0 { w / sum_good } else { least * w / sum_bad };
        let step = (mu + 2.0) / (n + mu + 5.0);
        Self {
            weights: raw.iter().map(weight).collect(),
            effective: mu,
            rank_one,
            rank_mu,
            path: (4.0 + mu / n) / (n + 4.0 + 2.0 * mu / n),
            step,
            damping: 1.0 + 2.0 * (((mu - 1.0) / (n + 1.0)).sqrt() - 1.0).max(0.0) + step,
            length: n.sqrt() * (1.0 - 1.0 / (4.0 * n) + 1.0 / (21.0 * n * n)),
        }
    }
}

impl CmaEs {
    /// Starts at zero in `dimension` coordinates with points of standard deviation `step_size`. The
    /// `seed` determines all draws. `dimension` is at least 1, and `population` at least 4.
    pub fn new(dimension: usize, population: usize, step_size: f64, seed: u32) -> Self {
        Self {
            draws: Draws::new(seed),
            constants: Constants::new(dimension, population),
            generation: 0,
            mean: DVector::zeros(dimension),
            step_size,
            first_step_size: step_size,
            covariance: DMatrix::identity(dimension, dimension),
            axes: DMatrix::identity(dimension, dimension),
            widths: DVector::repeat(dimension, 1.0),
            path_covariance: DVector::zeros(dimension),
            path_step: DVector::zeros(dimension),
            steps: Vec::new(),
            stalled: 0,
            best: f64::INFINITY,
        }
    }

    /// Draws the points of the next generation.
    ///
    /// ```text
    /// x = m + σ y,   y = B D z,   z ~ N(0, 1)                            (38) to (40)
    /// ```
    pub fn draw(&mut self) -> Vec<DVector<f64>> {
        let population = self.constants.weights.len();
        self.steps = (0..population)
            .map(|_| {
                let z = DVector::from_fn(self.mean.len(), |_, _| normal(&mut self.draws));
                &self.axes * z.component_mul(&self.widths)
            })
            .collect();
        self.steps.iter().map(|y| &self.mean + y * self.step_size).collect()
    }

    /// Adapts mean, step size and covariance to the costs of the drawn points.
    pub fn adapt(&mut self, costs: &[f64]) {
        let Constants { weights, effective, rank_one, rank_mu, path, step, damping, length } =
            &self.constants;
        let mut order: Vec<usize> = (0..self.steps.len()).collect();
        order.sort_by(|a, b| costs[*a].total_cmp(&costs[*b]));
        self.generation = self.generation.saturating_add(1);
        let n = self.mean.len() as f64;
        let whiten = |y: &DVector<f64>| self.axes.tr_mul(y).component_div(&self.widths);
        // Mean of the better half: y_w = Σ w y, m += σ y_w                 (41), (42)
        let mut mean_step = DVector::zeros(self.mean.len());
        for (i, weight) in order.iter().zip(weights).filter(|(_, weight)| **weight > 0.0) {
            mean_step.axpy(*weight, &self.steps[*i], 1.0);
        }
        self.mean.axpy(self.step_size, &mean_step, 1.0);
        // Step size: p_σ = (1 − c_σ) p_σ + √(c_σ (2 − c_σ) μ_eff) C^(−½) y_w,
        // σ *= exp((c_σ/d_σ) (‖p_σ‖/E − 1))                               (43), (44)
        self.path_step *= 1.0 - step;
        let whitened = &self.axes * whiten(&mean_step);
        self.path_step.axpy((step * (2.0 - step) * effective).sqrt(), &whitened, 1.0);
        let relative = self.path_step.norm() / length;
        // Covariance: p_c = (1 − c_c) p_c + h √(c_c (2 − c_c) μ_eff) y_w, where h = 0 stops the path
        // while the step size grows fast                                   (45)
        let seen = 1.0 - libm::pow(1.0 - step, 2.0 * f64::from(self.generation));
        let grows = relative / seen.sqrt() >= 1.4 + 2.0 / (n + 1.0);
        self.path_covariance *= 1.0 - path;
        let along = (path * (2.0 - path) * effective).sqrt();
        self.path_covariance.axpy(if grows { 0.0 } else { along }, &mean_step, 1.0);
        // C = (1 + c₁ δ − c₁ − c_μ Σ w) C + c₁ p_c p_cᵀ + c_μ Σ w° y yᵀ,
        // w° = w n/‖C^(−½) y‖² for negative w                              (46), (47)
        let lost = if grows { path * (2.0 - path) } else { 0.0 };
        let kept = 1.0 + rank_one * (lost - 1.0) - rank_mu * weights.iter().sum::<f64>();
        let mut covariance = &self.covariance * kept;
        covariance.ger(*rank_one, &self.path_covariance, &self.path_covariance, 1.0);
        for (i, weight) in order.iter().zip(weights) {
            let y = &self.steps[*i];
            let size = || n / whiten(y).norm_squared().max(f64::MIN_POSITIVE);
            let weight = if *weight < 0.0 { weight * size() } else { *weight };
            covariance.ger(rank_mu * weight, y, y, 1.0);
        }
        self.covariance = covariance;
        self.step_size *= libm::exp(step / damping * (relative - 1.0));
        let best = costs[order[0]];
        let is_better = best < self.best - SAME_COST * self.best.abs();
        self.stalled = if is_better { 0 } else { self.stalled + 1 };
        self.best = self.best.min(best);
        self.decompose();
    }

    /// Computes the axes and widths, at most once in n/10 generations by cost.
    fn decompose(&mut self) {
        let rates = self.constants.rank_one + self.constants.rank_mu;
        let every = (0.1 / (rates * self.mean.len() as f64)) as i32;
        if self.generation % every.max(1) != 0 {
            return;
        }
        let eigen = self.covariance.clone().symmetric_eigen();
        // Rounding can make the smallest variance negative.
        let least = eigen.eigenvalues.max() / LARGEST_CONDITION;
        self.widths = eigen.eigenvalues.map(|variance| variance.max(least).sqrt());
        self.axes = eigen.eigenvectors;
    }

    /// True if steps are at the limit of rounding, or the best cost has been the same for
    /// 10 + 30 n/λ generations.
    pub fn has_converged(&self) -> bool {
        let patience = 10 + 30 * self.mean.len() / self.steps.len().max(1);
        let is_moving = self.step_size * self.widths.max() > SMALLEST_STEP * self.first_step_size;
        !is_moving || self.stalled > patience
    }
}

/// Standard normal number, by the method of Box and Muller.
fn normal(draws: &mut Draws) -> f64 {
    let radius = (-2.0 * libm::log(1.0 - draws.unit())).sqrt();
    radius * libm::cos(std::f64::consts::TAU * draws.unit())
}

#[cfg(test)]
#[path = "tests/cma_es.rs"]
mod tests;
