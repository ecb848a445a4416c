//! How well the values are known: the loss around them, and the bootstrap over tosses.
//!
//! The scores of one set of values hang on chance: a toss that lands on an edge goes one way or the
//! other. ParameterValues are drawn around the found ones, u_j uniform in ±1, the friction a tenth of itself
//! and every other parameter a sixth of its bounds' distance to both sides, and a quadratic surface
//! is laid through the losses by least squares:
//!
//! ```text
//! L(u) ≈ c + gᵀu + ½ uᵀ H u
//! ```
//!
//! Its value at u = 0 is the loss with chance averaged away; what is left of the points beside it
//! is the roughness. For the uncertainty the tosses are drawn again with replacement, the surface
//! laid through the losses of the sample, and its lowest point in the box taken: the spread of
//! these is the interval.

use super::error::FitError;
use super::evaluator::{Evaluator, Query};
use super::loss::TossScore;
use super::parameter::ParameterValues;
use super::plan::{Plan, Sought};
use nalgebra::{DMatrix, DVector};
use rand_mt::Mt;

/// Samples of the bootstrap.
const SAMPLES: usize = 1000;

/// What is found around the found values.
#[derive(Debug, Clone, PartialEq)]
pub struct Neighbourhood {
    /// One for each parameter that was sought.
    pub intervals: Vec<Interval>,
    /// The loss.
    pub loss: Smoothed,
    /// The mean of the tosses' distances, in parts of the length.
    pub position: Smoothed,
    /// The mean of the tosses' angles, rad.
    pub rotation: Smoothed,
    /// Points that the surfaces are laid through.
    pub points: usize,
}

/// Where a parameter lies.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Interval {
    /// The lowest and highest value that were looked at.
    pub looked: [f64; 2],
    /// The bootstrap's quantiles of 2.5, 16, 50, 84 and 97.5 %.
    pub quantiles: [f64; 5],
    /// The part of the samples whose lowest point is on the border of what was looked at: above a
    /// few hundredths the parameter is not determined, or lies farther off.
    pub on_border: f64,
}

/// A mean over tosses with chance averaged away.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Smoothed {
    /// The surface at the found values.
    pub value: f64,
    /// The root mean square of what single points are off the surface.
    pub roughness: f64,
}

impl Neighbourhood {
    /// Checks that `points` are enough.
    ///
    /// # Errors
    /// Fewer than twice the coefficients of a quadratic surface.
    pub fn check(plan: &Plan, points: usize) -> Result<(), FitError> {
        let n = plan.sought.len();
        let least = (n + 1) * (n + 2);
        if points >= least {
            return Ok(());
        }
        Err(FitError::Request(format!(
            "{points} neighbours are too few for {n} parameters; {least} or more are needed"
        )))
    }

    /// Looks at `points` values around `centre`.
    ///
    /// # Errors
    /// As [`Neighbourhood::check`] and [`Evaluator::evaluate`].
    pub fn look(
        plan: &Plan,
        centre: &ParameterValues,
        points: usize,
        evaluator: &mut Evaluator<'_>,
    ) -> Result<Self, FitError> {
        Self::check(plan, points)?;
        let n = plan.sought.len();
        let boxes: Vec<_> = plan.sought.iter().map(|sought| around(sought, centre)).collect();
        let all: Vec<usize> = (0..evaluator.tosses().len()).collect();
        let substeps = evaluator.protocol().substeps;
        let mut draws = Mt::new(plan.seed ^ 0x6e65_6967);
        let (mut places, mut scores): (Vec<Vec<f64>>, Vec<Vec<TossScore>>) = Default::default();
        for _ in 0..points {
            let place: Vec<f64> = (0..n).map(|_| 2.0 * unit(&mut draws) - 1.0).collect();
            let values = plan.sought.iter().zip(&boxes).zip(&place).fold(
                centre.clone(),
                |values, ((sought, [low, high]), u)| {
                    values.with(sought.parameter, 0.5 * (low + high) + 0.5 * (high - low) * u)
                },
            );
            let query = Query { values: &values, substeps, tosses: &all };
            match evaluator.evaluate(&query) {
                Ok(found) => {
                    places.push(place);
                    scores.push(found);
                }
                // A body that the library refuses: the border of what is possible.
                Err(FitError::Rollout { .. }) => {}
                Err(error) => return Err(error),
            }
        }
        let surface = Surface::through(&places).ok_or_else(|| {
            FitError::Request("too few values around the found ones can be simulated".to_owned())
        })?;
        let at_centre: Vec<f64> = plan
            .sought
            .iter()
            .zip(&boxes)
            .map(|(sought, [low, high])| {
                let value = centre.get(sought.parameter);
                (2.0 * value - low - high) / (high - low)
            })
            .collect();
        let smoothed = |of: &dyn Fn(&TossScore) -> f64| {
            let means = scores
                .iter()
                .map(|scores| scores.iter().map(of).sum::<f64>() / scores.len() as f64);
            surface.smoothed(&DVector::from_iterator(scores.len(), means), &at_centre)
        };
        let intervals = bootstrap(plan, &surface, &scores, &boxes, &mut draws);
        Ok(Self {
            intervals,
            loss: smoothed(&|score| plan.loss.of(score)),
            position: smoothed(&|score| score.position),
            rotation: smoothed(&|score| score.rotation),
            points: places.len(),
        })
    }
}

fn unit(draws: &mut Mt) -> f64 {
    f64::from(draws.next_u32()) / f64::from(u32::MAX)
}

/// What is looked at around a value, within the bounds.
fn around(sought: &Sought, centre: &ParameterValues) -> [f64; 2] {
    let value = centre.get(sought.parameter);
    let half = sought.usual_reach(value);
    [(value - half).max(sought.bounds[0]), (value + half).min(sought.bounds[1])]
}

/// The lowest points of the surfaces of samples of the tosses.
fn bootstrap(
    plan: &Plan,
    surface: &Surface,
    scores: &[Vec<TossScore>],
    boxes: &[[f64; 2]],
    draws: &mut Mt,
) -> Vec<Interval> {
    let tosses = scores[0].len();
    let losses =
        DMatrix::from_fn(scores.len(), tosses, |point, toss| plan.loss.of(&scores[point][toss]));
    // The coefficients of each toss's own surface; those of a sample are their mean.
    let of_tosses = &surface.operator * losses;
    let lowest: Vec<Vec<f64>> = (0..SAMPLES)
        .map(|_| {
            let mut sum = DVector::zeros(of_tosses.nrows());
            for _ in 0..tosses {
                sum += of_tosses.column(draws.next_u32() as usize % tosses);
            }
            surface.lowest(&sum)
        })
        .collect();
    boxes
        .iter()
        .enumerate()
        .map(|(j, &[low, high])| {
            let mut values: Vec<f64> =
                lowest.iter().map(|u| 0.5 * (low + high) + 0.5 * (high - low) * u[j]).collect();
            let on_border = lowest.iter().filter(|u| u[j].abs() >= 1.0).count();
            values.sort_by(f64::total_cmp);
            let quantile = |part: f64| values[(part * (SAMPLES - 1) as f64).round() as usize];
            Interval {
                looked: [low, high],
                quantiles: [0.025, 0.16, 0.5, 0.84, 0.975].map(quantile),
                on_border: on_border as f64 / SAMPLES as f64,
            }
        })
        .collect()
}

/// Quadratic surfaces through values at fixed places.
struct Surface {
    n: usize,
    places: DMatrix<f64>,
    /// ParameterValues → coefficients: (AᵀA)⁻¹ Aᵀ.
    operator: DMatrix<f64>,
}

/// 1, u_j, u_j u_k (j ≤ k).
fn monomials(u: &[f64]) -> Vec<f64> {
    let squares = (0..u.len()).flat_map(|j| (j..u.len()).map(move |k| u[j] * u[k]));
    std::iter::once(1.0).chain(u.iter().copied()).chain(squares).collect()
}

impl Surface {
    /// `None` where the places do not determine one.
    fn through(places: &[Vec<f64>]) -> Option<Self> {
        let n = places.first()?.len();
        let rows: Vec<Vec<f64>> = places.iter().map(|u| monomials(u)).collect();
        let a = DMatrix::from_fn(rows.len(), rows[0].len(), |i, j| rows[i][j]);
        let operator = (a.transpose() * &a).cholesky()?.solve(&a.transpose());
        Some(Self { n, places: a, operator })
    }

    fn smoothed(&self, values: &DVector<f64>, at: &[f64]) -> Smoothed {
        let coefficients = &self.operator * values;
        let left = values - &self.places * &coefficients;
        let spare = (values.len() - coefficients.len()).max(1) as f64;
        Smoothed {
            value: DVector::from_vec(monomials(at)).dot(&coefficients),
            roughness: (left.norm_squared() / spare).sqrt(),
        }
    }

    /// The lowest point in the box |u_j| ≤ 1, by descent along one coordinate after the other; a
    /// surface that is not bowed upwards there has it on the border.
    fn lowest(&self, coefficients: &DVector<f64>) -> Vec<f64> {
        let mut u = vec![0.0; self.n];
        let square = |j: usize, k: usize| {
            let (j, k) = (j.min(k), j.max(k));
            coefficients[1 + self.n + j * self.n - j * (j + 1) / 2 + k]
        };
        for _ in 0..200 {
            for j in 0..self.n {
                let others: f64 =
                    (0..self.n).filter(|&k| k != j).map(|k| square(j, k) * u[k]).sum();
                let (slope, bow) = (coefficients[1 + j] + others, square(j, j));
                u[j] =
                    if bow > 0.0 { (-0.5 * slope / bow).clamp(-1.0, 1.0) } else { -slope.signum() };
            }
        }
        u
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_surface_through_a_bowl_finds_its_bottom() {
        let mut draws = Mt::new(3);
        let places: Vec<Vec<f64>> =
            (0..40).map(|_| (0..3).map(|_| 2.0 * unit(&mut draws) - 1.0).collect()).collect();
        let bowl = |u: &[f64]| {
            let (x, y, z) = (u[0] - 0.3, u[1] + 0.5, u[2] - 0.1);
            2.0 + x * x + 3.0 * y * y + 0.5 * z * z + 0.7 * x * y
        };
        let surface = Surface::through(&places).unwrap();
        let values = DVector::from_iterator(40, places.iter().map(|u| bowl(u)));
        let smoothed = surface.smoothed(&values, &[0.3, -0.5, 0.1]);
        assert!((smoothed.value - 2.0).abs() < 1e-12 && smoothed.roughness < 1e-12);
        let lowest = surface.lowest(&(&surface.operator * &values));
        for (found, expected) in lowest.iter().zip([0.3, -0.5, 0.1]) {
            assert!((found - expected).abs() < 1e-10, "{lowest:?}");
        }
    }
}
