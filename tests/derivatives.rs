//! The step problem's functions and derivatives: against CasADi at 250 points, and
//! against central differences for bodies of any shape.

mod common;

use common::{any_state, any_world, any_wrench, cases, reference, state};
use nalgebra::{DMatrix, DVector, Matrix3, Vector3};
use proptest::prelude::*;
use serde::Deserialize;
use std::collections::HashMap;
use tumble::mechanics::{RigidBody, Wrench};
use tumble::sparsity::SparsityPattern;
use tumble::step_nlp::{SMOOTHING, StepNlp};
use tumble::world::{Parameters, World};

/// One line of `data/derivatives.jsonl.gz`.
#[derive(Deserialize)]
struct Point {
    name: String,
    input: Input,
    output: Output,
}

#[derive(Deserialize)]
struct Input {
    state: Vec<f64>,
    alpha: Vec<f64>,
    x: Vec<f64>,
    obj_factor: f64,
    multipliers: Vec<f64>,
    dt: Option<f64>,
    mu: Option<f64>,
    mass: Option<f64>,
    inertia: Option<[[f64; 3]; 3]>,
    gravity: Option<[f64; 3]>,
    epsilon: Option<f64>,
}

#[derive(Deserialize)]
struct Output {
    objective: f64,
    gradient: Vec<f64>,
    constraints: Vec<f64>,
    jacobian: Triplets,
    hessian: Triplets,
}

#[derive(Deserialize)]
struct Triplets {
    rows: Vec<usize>,
    cols: Vec<usize>,
    values: Vec<f64>,
}

impl Triplets {
    fn entries(&self) -> impl Iterator<Item = (usize, usize, f64)> {
        let positions = self.rows.iter().zip(&self.cols);
        positions.zip(&self.values).map(|((&row, &col), &value)| (row, col, value))
    }
}

fn points() -> Vec<Point> {
    let text = reference("derivatives.jsonl.gz");
    text.lines().map(|line| serde_json::from_str(line).unwrap()).collect()
}

impl Input {
    /// The problem of this step, a constant being the tutorial's where none is given.
    fn nlp(&self) -> StepNlp {
        let (given, usual) = (self, common::tutorial_parameters());
        let cube = &usual.bodies[0];
        // The matrix is symmetric: rows and columns are the same.
        let inertia = given.inertia.map_or(*cube.inertia(), Matrix3::from);
        let mass = given.mass.unwrap_or(cube.mass());
        let body = RigidBody::with_box_corners(mass, inertia, Vector3::repeat(1.0)).unwrap();
        let parameters = Parameters {
            bodies: vec![body],
            gravity: given.gravity.map_or(usual.gravity, Vector3::from),
            friction: given.mu.unwrap_or(usual.friction),
            time_step: given.dt.unwrap_or(usual.time_step),
            ..usual
        };
        let smoothing = given.epsilon.unwrap_or(SMOOTHING);
        let mut nlp = StepNlp::new(World::new(parameters).unwrap(), smoothing).unwrap();
        nlp.set_step(&state(&given.state), &Wrench::zero(), given.alpha.iter().copied());
        nlp
    }
}

/// The numbers that `write` puts into an array of `len`.
fn written(len: usize, write: impl FnOnce(&mut [f64])) -> Vec<f64> {
    let mut values = vec![f64::NAN; len];
    write(&mut values);
    values
}

fn constraints(nlp: &StepNlp, x: &[f64]) -> Vec<f64> {
    written(nlp.layout().constraints(), |rows| nlp.constraints(x, rows))
}

fn jacobian(nlp: &StepNlp, x: &[f64]) -> Vec<f64> {
    written(nlp.jacobian_pattern().len(), |values| nlp.jacobian(x, values))
}

fn hessian(nlp: &StepNlp, x: &[f64], factor: f64, multipliers: &[f64]) -> Vec<f64> {
    written(nlp.hessian_pattern().len(), |values| nlp.hessian(x, factor, multipliers, values))
}

/// A matrix of the problem's, whole.
fn dense(pattern: &SparsityPattern, values: &[f64], (rows, cols): (usize, usize)) -> DMatrix<f64> {
    let mut matrix = DMatrix::zeros(rows, cols);
    for (at, value) in pattern.positions().zip(values) {
        matrix[at] += value;
    }
    matrix
}

/// Compares to 1e-12 of the larger of 1 and the entry, and to 1e-12 of the largest entry
/// of its row (in a Hessian also of its column), whichever is stricter. An entry is a sum
/// of a few products, some of them larger than it; measured: 1.4e-13 and 4e-14.
fn compare(name: &str, pattern: &SparsityPattern, ours: &[f64], theirs: &Triplets) {
    let ours: HashMap<_, _> = pattern.positions().zip(ours).collect();
    assert_eq!(ours.len(), pattern.len(), "{name}: no entry stands twice");
    let symmetric = theirs.rows.iter().zip(&theirs.cols).all(|(row, col)| row >= col);
    let mut largest = vec![0.0_f64; 62];
    for (row, col, value) in theirs.entries() {
        largest[row] = largest[row].max(value.abs());
        if symmetric {
            largest[col] = largest[col].max(value.abs());
        }
    }
    let mut common = 0;
    for (row, col, value) in theirs.entries() {
        let Some(&&found) = ours.get(&(row, col)) else {
            assert_eq!(value, 0.0, "{name}: entry ({row}, {col}) is missing");
            continue;
        };
        common += 1;
        let near = if symmetric { largest[row].min(largest[col]) } else { largest[row] };
        let tolerance = 1e-12 * near.min(value.abs().max(1.0));
        let error = (found - value).abs();
        assert!(error <= tolerance, "{name}: ({row}, {col}) is {found:e}, not {value:e}");
    }
    assert_eq!(common, ours.len(), "{name}: CasADi has every entry of ours");
}

#[test]
fn values_and_derivatives_are_those_of_casadi() {
    let points = points();
    assert_eq!(points.len(), 250);
    for Point { name, input, output } in &points {
        let (nlp, x) = (input.nlp(), &input.x);
        // A sum of 16 squares and its derivative: nothing cancels. serde_json may read a
        // number one unit in the last place off, so that even 2 s is not exact.
        let error = (nlp.objective(x) - output.objective).abs();
        assert!(error <= 4e-15 * output.objective, "{name}: objective");
        let gradient = written(x.len(), |gradient| nlp.gradient(x, gradient));
        for (ours, theirs) in gradient.iter().zip(&output.gradient) {
            assert!((ours - theirs).abs() <= 4e-16 * theirs.abs(), "{name}: gradient");
        }
        // What x's own rounding does to a row is ε Σ |∂g/∂x_j x_j|. To 1e-14 of that sum
        // (measured: 6e-16; 1e-20 for rows of zeros), although heights cancel and slips are
        // divided by h.
        let mut scale: Vec<f64> = output.constraints.iter().map(|row| row.abs()).collect();
        for (row, col, entry) in output.jacobian.entries() {
            scale[row] += (entry * x[col]).abs();
        }
        for (i, ours) in constraints(&nlp, x).iter().enumerate() {
            let error = (ours - output.constraints[i]).abs();
            assert!(error <= 1e-14 * scale[i] + 1e-20, "{name}: row {i} is {error:e} off");
        }
        compare(name, nlp.jacobian_pattern(), &jacobian(&nlp, x), &output.jacobian);
        let values = hessian(&nlp, x, input.obj_factor, &input.multipliers);
        compare(name, nlp.hessian_pattern(), &values, &output.hessian);
    }
}

/// For each kind of world (isotropic inertia or not, friction or none) every entry differs
/// from zero somewhere; that none is missing, `compare` has shown.
#[test]
fn the_patterns_hold_no_entry_that_is_always_zero() {
    let mut used: Vec<(SparsityPattern, Vec<bool>)> = Vec::new();
    for Point { input, .. } in &points() {
        let nlp = input.nlp();
        let hessian = hessian(&nlp, &input.x, input.obj_factor, &input.multipliers);
        for (pattern, values) in
            [(nlp.jacobian_pattern(), jacobian(&nlp, &input.x)), (nlp.hessian_pattern(), hessian)]
        {
            if !used.iter().any(|(known, _)| known == pattern) {
                used.push((pattern.clone(), vec![false; pattern.len()]));
            }
            let (_, used) = used.iter_mut().find(|(known, _)| known == pattern).unwrap();
            used.iter_mut().zip(values).for_each(|(used, value)| *used |= value != 0.0);
        }
    }
    // Without friction the data has isotropic inertia only; no Hessian depends on it.
    assert_eq!(used.len(), 3 + 2, "Jacobians and Hessians");
    for (pattern, used) in used {
        for (at, used) in pattern.positions().zip(used) {
            assert!(used, "{at:?} is zero wherever the pattern of {} holds", pattern.len());
        }
    }
}

/// A step problem of any body and a point to differentiate at: x and multipliers.
#[derive(Debug, Clone)]
struct Anywhere {
    nlp: StepNlp,
    x: Vec<f64>,
    multipliers: Vec<f64>,
}

fn anywhere() -> impl Strategy<Value = Anywhere> {
    let step = (any_world(), any_state(), any_wrench(), any_state());
    let numbers = proptest::collection::vec(-1.0..1.0, 2 * 86);
    // A smoothing so large that differences can follow the derivatives.
    (step, 0.5..1.0, numbers).prop_map(|((world, old, wrench, new), smoothing, numbers)| {
        let numbers: Vec<f64> = numbers;
        let mut nlp = StepNlp::new(world, smoothing).unwrap();
        let layout = nlp.layout();
        let mut x = new.to_vector().as_slice().to_vec();
        // f_x, f_y ±5 N, comparable to the smoothing; f_z 0…50 N; the rest 0…5.
        x.extend(numbers.iter().map(|u| 5.0 * u).take(2 * layout.contacts()));
        x.extend(numbers[24..].iter().map(|u| 50.0 * u.abs()).take(layout.contacts()));
        x.extend(numbers[36..].iter().map(|u| 5.0 * u.abs()).take(3 * layout.contacts()));
        nlp.set_step(&old, &wrench, numbers[72..84].iter().map(|u| u.abs()));
        Anywhere { nlp, x, multipliers: numbers[86..][..layout.constraints()].to_vec() }
    })
}

/// Central differences of `values`, column by column. With δ = 1e-5 and numbers of order
/// 1 to 50 in x, rounding leaves ε/δ = 2e-11 of the terms, and the third derivatives, at
/// most some hundred times the first for a smoothing of 0.5 N, leave δ²/6 = 2e-11 of them:
/// some 1e-9 where terms outweigh their sum (measured: up to 2.3e-9 at 10 000 points).
fn differences(x: &[f64], values: impl Fn(&[f64]) -> Vec<f64>) -> DMatrix<f64> {
    const DELTA: f64 = 1e-5;
    let columns: Vec<_> = (0..x.len())
        .map(|j| {
            let (mut more, mut less) = (x.to_vec(), x.to_vec());
            more[j] += DELTA;
            less[j] -= DELTA;
            let change = DVector::from(values(&more)) - DVector::from(values(&less));
            change / (more[j] - less[j])
        })
        .collect();
    DMatrix::from_columns(&columns)
}

/// The largest difference in a row, as a share of the row's largest entry or of 1.
fn row_error(ours: &DMatrix<f64>, theirs: &DMatrix<f64>) -> f64 {
    let rows = ours.row_iter().zip(theirs.row_iter());
    rows.map(|(a, b)| (a - b).amax() / b.amax().max(1.0)).fold(0.0, f64::max)
}

proptest! {
    #![proptest_config(cases(64))]

    #[test]
    fn the_jacobian_is_the_slope_of_the_constraints(point in anywhere()) {
        let Anywhere { nlp, x, .. } = &point;
        let (size, values) = ((nlp.layout().constraints(), x.len()), jacobian(nlp, x));
        let ours = dense(nlp.jacobian_pattern(), &values, size);
        let error = row_error(&ours, &differences(x, |x| constraints(nlp, x)));
        prop_assert!(error < 1e-7, "{error:e}");
    }

    #[test]
    fn the_hessian_is_the_slope_of_the_lagrangians_gradient(
        point in anywhere(), factor in 0.0..2.0
    ) {
        let Anywhere { nlp, x, multipliers } = &point;
        let (size, values) = ((x.len(), x.len()), hessian(nlp, x, factor, multipliers));
        let lower = dense(nlp.hessian_pattern(), &values, size);
        let ours = &lower + lower.transpose() - DMatrix::from_diagonal(&lower.diagonal());
        let slope = |x: &[f64]| {
            let mut slope = written(x.len(), |slope| nlp.gradient(x, slope));
            slope.iter_mut().for_each(|entry| *entry *= factor);
            let entries = jacobian(nlp, x);
            for ((row, col), entry) in nlp.jacobian_pattern().positions().zip(entries) {
                slope[col] += multipliers[row] * entry;
            }
            slope
        };
        let error = row_error(&ours, &differences(x, slope));
        prop_assert!(error < 1e-7, "{error:e}");
    }
}
