//! Small problems with known optima.

use tumble::ipopt::{Bounds, NonlinearProgram};
use tumble::sparsity::SparsityPattern;

const FREE: f64 = f64::INFINITY;

/// Problem as a table entry. Its functions write into the last slice.
#[derive(Clone)]
pub struct Problem {
    pub name: &'static str,
    pub jacobian: SparsityPattern,
    pub hessian: SparsityPattern,
    pub bounds: Bounds,
    pub start: Vec<f64>,
    pub objective: fn(&[f64]) -> f64,
    pub gradient: fn(&[f64], &mut [f64]),
    pub constraints: fn(&[f64], &mut [f64]),
    pub jacobian_values: fn(&[f64], &mut [f64]),
    pub hessian_values: fn(&[f64], f64, &[f64], &mut [f64]),
    /// Known optimal objective value.
    pub optimum: f64,
    pub solution: Vec<f64>,
}

pub fn pattern(positions: &[(usize, usize)]) -> SparsityPattern {
    let mut pattern = SparsityPattern::new();
    for &(row, col) in positions {
        pattern.push(row, col);
    }
    pattern
}

/// All positions of a dense `rows` × `cols` matrix, or of its lower triangle.
fn dense(rows: usize, cols: usize, lower: bool) -> SparsityPattern {
    let all = (0..rows).flat_map(|row| (0..cols).map(move |col| (row, col)));
    pattern(&all.filter(|(row, col)| !lower || col <= row).collect::<Vec<_>>())
}

fn bounds(variables: &[(f64, f64)], constraints: &[(f64, f64)]) -> Bounds {
    Bounds {
        lower: variables.iter().map(|pair| pair.0).collect(),
        upper: variables.iter().map(|pair| pair.1).collect(),
        constraint_lower: constraints.iter().map(|pair| pair.0).collect(),
        constraint_upper: constraints.iter().map(|pair| pair.1).collect(),
    }
}

/// Problem 71 of Hock and Schittkowski: two constraints, all variables bounded.
pub fn hs071() -> Problem {
    Problem {
        name: "HS071",
        jacobian: dense(2, 4, false),
        hessian: dense(4, 4, true),
        bounds: bounds(&[(1.0, 5.0); 4], &[(25.0, FREE), (40.0, 40.0)]),
        start: vec![1.0, 5.0, 5.0, 1.0],
        objective: |x| x[0] * x[3] * (x[0] + x[1] + x[2]) + x[2],
        gradient: |x, out| {
            out.copy_from_slice(&[
                x[3] * (2.0 * x[0] + x[1] + x[2]),
                x[0] * x[3],
                x[0] * x[3] + 1.0,
                x[0] * (x[0] + x[1] + x[2]),
            ]);
        },
        constraints: |x, out| {
            out[0] = x.iter().product();
            out[1] = x.iter().map(|x| x * x).sum();
        },
        jacobian_values: |x, out| {
            for k in 0..4 {
                out[k] = (0..4).filter(|&other| other != k).map(|other| x[other]).product();
                out[4 + k] = 2.0 * x[k];
            }
        },
        hessian_values: |x, factor, y, out| {
            out.copy_from_slice(&[
                factor * 2.0 * x[3] + y[1] * 2.0,
                factor * x[3] + y[0] * x[2] * x[3],
                y[1] * 2.0,
                factor * x[3] + y[0] * x[1] * x[3],
                y[0] * x[0] * x[3],
                y[1] * 2.0,
                factor * (2.0 * x[0] + x[1] + x[2]) + y[0] * x[1] * x[2],
                factor * x[0] + y[0] * x[0] * x[2],
                factor * x[0] + y[0] * x[0] * x[1],
                y[1] * 2.0,
            ]);
        },
        optimum: 17.014_017_289_156_3,
        solution: vec![1.0, 4.742_999_6, 3.821_149_9, 1.379_408_3],
    }
}

/// Problem 35: a convex quadratic with one linear inequality.
pub fn hs035() -> Problem {
    Problem {
        name: "HS035",
        jacobian: dense(1, 3, false),
        hessian: pattern(&[(0, 0), (1, 0), (1, 1), (2, 0), (2, 2)]),
        bounds: bounds(&[(0.0, FREE); 3], &[(-FREE, 3.0)]),
        start: vec![0.5; 3],
        objective: |x| {
            9.0 - 8.0 * x[0] - 6.0 * x[1] - 4.0 * x[2]
                + 2.0 * x[0] * x[0]
                + 2.0 * x[1] * x[1]
                + x[2] * x[2]
                + 2.0 * x[0] * (x[1] + x[2])
        },
        gradient: |x, out| {
            out.copy_from_slice(&[
                -8.0 + 4.0 * x[0] + 2.0 * (x[1] + x[2]),
                -6.0 + 4.0 * x[1] + 2.0 * x[0],
                -4.0 + 2.0 * x[2] + 2.0 * x[0],
            ]);
        },
        constraints: |x, out| out[0] = x[0] + x[1] + 2.0 * x[2],
        jacobian_values: |_, out| out.copy_from_slice(&[1.0, 1.0, 2.0]),
        hessian_values: |_, factor, _, out| {
            out.copy_from_slice(&[4.0, 2.0, 4.0, 2.0, 2.0].map(|value| factor * value));
        },
        optimum: 1.0 / 9.0,
        solution: vec![4.0 / 3.0, 7.0 / 9.0, 4.0 / 9.0],
    }
}

/// Problem 6: one nonlinear equation, no bounds.
pub fn hs006() -> Problem {
    Problem {
        name: "HS006",
        jacobian: dense(1, 2, false),
        hessian: pattern(&[(0, 0)]),
        bounds: bounds(&[(-FREE, FREE); 2], &[(0.0, 0.0)]),
        start: vec![-1.2, 1.0],
        objective: |x| (1.0 - x[0]).powi(2),
        gradient: |x, out| out.copy_from_slice(&[-2.0 * (1.0 - x[0]), 0.0]),
        constraints: |x, out| out[0] = 10.0 * (x[1] - x[0] * x[0]),
        jacobian_values: |x, out| out.copy_from_slice(&[-20.0 * x[0], 10.0]),
        hessian_values: |_, factor, y, out| out[0] = 2.0 * factor - 20.0 * y[0],
        optimum: 0.0,
        solution: vec![1.0, 1.0],
    }
}

/// Rosenbrock's valley: no constraints, no bounds (problem 1 without its bound).
pub fn rosenbrock() -> Problem {
    Problem {
        name: "Rosenbrock",
        jacobian: SparsityPattern::new(),
        hessian: dense(2, 2, true),
        bounds: bounds(&[(-FREE, FREE); 2], &[]),
        start: vec![-2.0, 1.0],
        objective: |x| 100.0 * (x[1] - x[0] * x[0]).powi(2) + (1.0 - x[0]).powi(2),
        gradient: |x, out| {
            let valley = x[1] - x[0] * x[0];
            out.copy_from_slice(&[-400.0 * x[0] * valley - 2.0 * (1.0 - x[0]), 200.0 * valley]);
        },
        constraints: |_, out| assert!(out.is_empty()),
        jacobian_values: |_, out| assert!(out.is_empty()),
        hessian_values: |x, factor, _, out| {
            out[0] = factor * (1200.0 * x[0] * x[0] - 400.0 * x[1] + 2.0);
            out[1] = factor * -400.0 * x[0];
            out[2] = factor * 200.0;
        },
        optimum: 0.0,
        solution: vec![1.0, 1.0],
    }
}

/// Problem 1: Rosenbrock's valley with one bound.
pub fn hs001() -> Problem {
    let bounds = bounds(&[(-FREE, FREE), (-1.5, FREE)], &[]);
    Problem { name: "HS001", bounds, ..rosenbrock() }
}

/// Linear program: the Hessian has no entries.
pub fn linear() -> Problem {
    Problem {
        name: "linear",
        jacobian: dense(1, 2, false),
        hessian: SparsityPattern::new(),
        bounds: bounds(&[(0.0, 3.0), (0.0, FREE)], &[(-FREE, 4.0)]),
        start: vec![1.0, 1.0],
        objective: |x| -x[0] - x[1],
        gradient: |_, out| out.copy_from_slice(&[-1.0, -1.0]),
        constraints: |x, out| out[0] = x[0] + 2.0 * x[1],
        jacobian_values: |_, out| out.copy_from_slice(&[1.0, 2.0]),
        hessian_values: |_, _, _, out| assert!(out.is_empty()),
        optimum: -3.5,
        solution: vec![3.0, 0.5],
    }
}

pub fn all() -> Vec<Problem> {
    vec![hs071(), hs035(), hs006(), rosenbrock(), hs001(), linear()]
}

impl NonlinearProgram for Problem {
    fn variable_count(&self) -> usize {
        self.bounds.lower.len()
    }
    fn constraint_count(&self) -> usize {
        self.bounds.constraint_lower.len()
    }
    fn jacobian_pattern(&self) -> &SparsityPattern {
        &self.jacobian
    }
    fn hessian_pattern(&self) -> &SparsityPattern {
        &self.hessian
    }
    fn objective(&mut self, x: &[f64]) -> f64 {
        (self.objective)(x)
    }
    fn gradient(&mut self, x: &[f64], gradient: &mut [f64]) {
        (self.gradient)(x, gradient);
    }
    fn constraints(&mut self, x: &[f64], constraints: &mut [f64]) {
        (self.constraints)(x, constraints);
    }
    fn jacobian(&mut self, x: &[f64], values: &mut [f64]) {
        (self.jacobian_values)(x, values);
    }
    fn hessian(&mut self, x: &[f64], factor: f64, multipliers: &[f64], values: &mut [f64]) {
        (self.hessian_values)(x, factor, multipliers, values);
    }
}
