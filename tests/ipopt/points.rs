//! Reads the 250 points of `data/derivatives.jsonl.gz` and compares values computed there with
//! CasADi's.

use super::sizes::Sizes;
use crate::common::{reference, tutorial_parameters};
use serde::Deserialize;
use std::collections::HashMap;

/// One line of `data/derivatives.jsonl.gz`.
#[derive(Deserialize)]
pub struct Point {
    pub name: String,
    pub input: Input,
    pub output: Output,
}

/// Point and constants. A missing constant has the tutorial's value.
#[derive(Deserialize)]
pub struct Input {
    pub state: Vec<f64>,
    pub alpha: Vec<f64>,
    pub x: Vec<f64>,
    pub obj_factor: f64,
    pub multipliers: Vec<f64>,
    dt: Option<f64>,
    mu: Option<f64>,
    mass: Option<f64>,
    inertia: Option<[[f64; 3]; 3]>,
    gravity: Option<[f64; 3]>,
    epsilon: Option<f64>,
}

/// Values and derivatives at a point, from CasADi or from the program.
#[derive(Deserialize)]
pub struct Output {
    pub objective: f64,
    pub gradient: Vec<f64>,
    pub constraints: Vec<f64>,
    pub jacobian: Triplets,
    pub hessian: Triplets,
}

/// Entries of a sparse matrix.
#[derive(Deserialize)]
pub struct Triplets {
    pub rows: Vec<usize>,
    pub cols: Vec<usize>,
    pub values: Vec<f64>,
}

impl Triplets {
    fn entries(&self) -> impl Iterator<Item = ((usize, usize), f64)> {
        let positions = self.rows.iter().copied().zip(self.cols.iter().copied());
        positions.zip(self.values.iter().copied())
    }
}

pub fn points() -> Vec<Point> {
    let text = reference("derivatives.jsonl.gz");
    let points: Vec<_> = text.lines().map(|line| serde_json::from_str(line).unwrap()).collect();
    assert_eq!(points.len(), 250);
    points
}

impl Input {
    pub fn dt(&self) -> f64 {
        self.dt.unwrap_or(tutorial_parameters().time_step)
    }

    pub fn mu(&self) -> f64 {
        self.mu.unwrap_or(tutorial_parameters().friction)
    }

    pub fn mass(&self) -> f64 {
        self.mass.unwrap_or(tutorial_parameters().bodies[0].mass())
    }

    /// Inertia matrix. It is symmetric, so rows and columns are the same.
    pub fn inertia(&self) -> [[f64; 3]; 3] {
        self.inertia.unwrap_or((*tutorial_parameters().bodies[0].inertia()).into())
    }

    pub fn gravity(&self) -> [f64; 3] {
        self.gravity.unwrap_or(tutorial_parameters().gravity.into())
    }

    pub fn epsilon(&self) -> f64 {
        self.epsilon.unwrap_or(tumble::step_nlp::SMOOTHING)
    }
}

/// Allowed error as a multiple of ε Σ|terms|.
///
/// Both sides evaluate exact formulas in double precision, summed in a different order. The terms
/// belong to the number itself ([`Sizes`]). A term is rounded by at most ε/2 for every factor and
/// every sum that contains it, mostly with different signs. The largest observed error is 2.4
/// (∂g/∂x of row 10). Where the terms cancel, CasADi's value is no better than ours.
const ROUNDINGS: f64 = 4.0;

fn assert_near(what: std::fmt::Arguments<'_>, found: f64, known: f64, size: f64) {
    let allowed = ROUNDINGS * f64::EPSILON * size;
    let error = (found - known).abs();
    assert!(error <= allowed, "{what} is {found:e}, not {known:e}; {allowed:e} is allowed");
}

/// Compares every number separately.
pub fn compare(point: &Point, found: &Output) {
    let Point { name, input, output: known } = point;
    let sizes = Sizes::from_input(input);
    // The objective is a sum of 16 squares. Its terms are all positive.
    assert_near(format_args!("{name}: f"), found.objective, known.objective, known.objective);
    assert_eq!(found.gradient, known.gradient, "{name}: ∇f");
    assert_eq!(found.constraints.len(), known.constraints.len(), "{name}");
    for (row, (&found, &known)) in found.constraints.iter().zip(&known.constraints).enumerate() {
        assert_near(format_args!("{name}: row {row}"), found, known, sizes.rows[row]);
    }
    for (matrix, found, known, sizes) in [
        ("∂g/∂x", &found.jacobian, &known.jacobian, &sizes.jacobian),
        ("∇²L", &found.hessian, &known.hessian, &sizes.hessian),
    ] {
        let mut entries: HashMap<_, _> = found.entries().collect();
        assert_eq!(entries.len(), found.values.len(), "{name}: {matrix} has an entry twice");
        for (at, known) in known.entries() {
            let what = format_args!("{name}: {matrix} at {at:?}");
            match entries.remove(&at) {
                Some(found) => assert_near(what, found, known, sizes[at]),
                None => assert_eq!(known, 0.0, "{what} is missing"),
            }
        }
        assert!(entries.is_empty(), "{name}: {matrix} has entries of its own, {entries:?}");
    }
}
