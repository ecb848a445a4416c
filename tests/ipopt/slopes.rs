//! The program of a step as a function of a point, and its derivatives by central differences.

use nalgebra::{DMatrix, DVector};
use tumble::sparsity::SparsityPattern;
use tumble::step_nlp::StepNlp;

/// Nonlinear program with all its functions at a point.
pub trait Program {
    fn gradient_at(&self, x: &[f64]) -> Vec<f64>;
    fn constraints_at(&self, x: &[f64]) -> Vec<f64>;
    /// Jacobian entries in the order of their pattern. The Hessian has the order of its own
    /// pattern.
    fn jacobian_at(&self, x: &[f64]) -> Vec<f64>;
    fn hessian_at(&self, x: &[f64], factor: f64, multipliers: &[f64]) -> Vec<f64>;
    /// Patterns of the Jacobian and the Hessian.
    fn patterns(&self) -> [&SparsityPattern; 2];
}

impl Program for StepNlp {
    fn gradient_at(&self, x: &[f64]) -> Vec<f64> {
        written(x.len(), |gradient| self.gradient(x, gradient))
    }

    fn constraints_at(&self, x: &[f64]) -> Vec<f64> {
        written(self.layout().constraints(), |rows| self.constraints(x, rows))
    }

    fn jacobian_at(&self, x: &[f64]) -> Vec<f64> {
        written(self.jacobian_pattern().len(), |values| self.jacobian(x, values))
    }

    fn hessian_at(&self, x: &[f64], factor: f64, multipliers: &[f64]) -> Vec<f64> {
        written(self.hessian_pattern().len(), |values| {
            self.hessian(x, factor, multipliers, values);
        })
    }

    fn patterns(&self) -> [&SparsityPattern; 2] {
        [self.jacobian_pattern(), self.hessian_pattern()]
    }
}

/// Array of `len` numbers filled by `write`.
fn written(len: usize, write: impl FnOnce(&mut [f64])) -> Vec<f64> {
    let mut values = vec![f64::NAN; len];
    write(&mut values);
    values
}

/// Dense matrix with the given pattern and values.
pub fn dense(
    pattern: &SparsityPattern,
    values: &[f64],
    (rows, cols): (usize, usize),
) -> DMatrix<f64> {
    let mut matrix = DMatrix::zeros(rows, cols);
    for (at, value) in pattern.positions().zip(values) {
        matrix[at] += value;
    }
    matrix
}

/// Error of the Jacobian at `x` against differences of the constraints: see [`row_error`].
pub fn jacobian_error(nlp: &impl Program, x: &[f64]) -> f64 {
    let theirs = differences(x, |x| nlp.constraints_at(x));
    let size = (theirs.nrows(), x.len());
    row_error(&dense(nlp.patterns()[0], &nlp.jacobian_at(x), size), &theirs)
}

/// Error of the Hessian of the Lagrangian at `x` against differences of its gradient: see
/// [`row_error`].
pub fn hessian_error(nlp: &impl Program, x: &[f64], factor: f64, multipliers: &[f64]) -> f64 {
    let [of_jacobian, of_hessian] = nlp.patterns();
    let values = nlp.hessian_at(x, factor, multipliers);
    let lower = dense(of_hessian, &values, (x.len(), x.len()));
    let ours = &lower + lower.transpose() - DMatrix::from_diagonal(&lower.diagonal());
    let slope = |x: &[f64]| {
        let mut slope = nlp.gradient_at(x);
        slope.iter_mut().for_each(|entry| *entry *= factor);
        for ((row, col), entry) in of_jacobian.positions().zip(nlp.jacobian_at(x)) {
            slope[col] += multipliers[row] * entry;
        }
        slope
    };
    row_error(&ours, &differences(x, slope))
}

/// Central differences of `values`, of fourth order and column by column:
///
/// ```text
/// (8 (f(x+δ) − f(x−δ)) − (f(x+2δ) − f(x−2δ))) / 12δ
/// ```
///
/// With δ = 1e-4 and numbers of order 1 to 50 in x, rounding leaves an error of 1.5 ε/δ = 3e-12 of
/// the terms. Truncation leaves δ⁴/30 = 3e-18 of the fifth derivatives. For an attitude of small
/// norm these are some 1e8 times the first derivatives.
pub fn differences(x: &[f64], values: impl Fn(&[f64]) -> Vec<f64>) -> DMatrix<f64> {
    const DELTA: f64 = 1e-4;
    let columns: Vec<_> = (0..x.len())
        .map(|j| {
            let across = |step: f64| {
                let (mut more, mut less) = (x.to_vec(), x.to_vec());
                more[j] += step;
                less[j] -= step;
                let change = DVector::from(values(&more)) - DVector::from(values(&less));
                change / (more[j] - less[j])
            };
            (across(DELTA) * 4.0 - across(2.0 * DELTA)) / 3.0
        })
        .collect();
    DMatrix::from_columns(&columns)
}

/// Largest difference in a row, divided by the row's largest entry or by 1.
fn row_error(ours: &DMatrix<f64>, theirs: &DMatrix<f64>) -> f64 {
    let rows = ours.row_iter().zip(theirs.row_iter());
    rows.map(|(a, b)| (a - b).amax() / b.amax().max(1.0)).fold(0.0, f64::max)
}
