//! The program of several steps against CasADi at the points of `data/plan.jsonl.gz`.

use super::{Whole, problem};
use crate::common::reference;
use crate::slopes::Program;
use nalgebra::Matrix3;
use serde::Deserialize;
use std::collections::HashMap;
use tumble::contact::{Contact, ContactKey, ContactLaw, Features, Partner};
use tumble::plan::program::{PlanNlp, Smoothing};
use tumble::sparsity::SparsityPattern;

/// The first line.
#[derive(Deserialize)]
struct Head {
    scene: String,
    problem: String,
}

#[derive(Deserialize)]
struct Point {
    name: String,
    input: Input,
    output: Output,
}

#[derive(Deserialize)]
struct Input {
    /// Of each step.
    contacts: Vec<Vec<Meeting>>,
    delta: f64,
    compliance: f64,
    x: Vec<f64>,
    obj_factor: f64,
    multipliers: Vec<f64>,
}

#[derive(Deserialize)]
struct Meeting {
    a: usize,
    b: Option<usize>,
    point: [f64; 3],
    radius: f64,
    /// Rows.
    frame: [[f64; 3]; 3],
    offset: f64,
    friction: f64,
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

/// As a part of the largest number of a kind: sums of some hundred products, rounded in another order.
const ROUNDING: f64 = 1e-12;

fn largest(values: &[f64]) -> f64 {
    values.iter().fold(1.0, |largest, value| value.abs().max(largest))
}

fn compare(what: &str, found: &[f64], known: &[f64]) {
    assert_eq!(found.len(), known.len(), "{what}");
    let allowed = ROUNDING * largest(known);
    for (index, (found, known)) in found.iter().zip(known).enumerate() {
        let error = (found - known).abs();
        assert!(error <= allowed, "{what} {index}: {found:e}, not {known:e}, {allowed:e} allowed");
    }
}

/// Every entry of CasADi's is one of ours, and where we have one more it is zero.
fn compare_matrix(what: &str, pattern: &SparsityPattern, found: &[f64], known: &Triplets) {
    let mut entries: HashMap<_, _> = pattern.positions().zip(found.iter().copied()).collect();
    assert_eq!(entries.len(), found.len(), "{what} has an entry twice");
    let positions = known.rows.iter().copied().zip(known.cols.iter().copied());
    let ours: Vec<_> = positions.map(|at| entries.remove(&at).unwrap_or_default()).collect();
    compare(what, &ours, &known.values);
    let allowed = ROUNDING * largest(&known.values);
    assert!(entries.values().all(|value| value.abs() <= allowed), "{what} has entries of its own");
}

#[test]
fn values_and_derivatives_are_those_of_casadi() {
    let text = reference("plan.jsonl.gz");
    let mut lines = text.lines();
    let head: Head = serde_json::from_str(lines.next().unwrap()).unwrap();
    let problem = problem(&head.scene, &head.problem).problem;
    let replay = problem.replay(&problem.zero()).unwrap();
    let points: Vec<Point> = lines.map(|line| serde_json::from_str(line).unwrap()).collect();
    assert_eq!(points.len(), 12);
    for Point { name, input, output } in &points {
        let bodies = problem.scene().world.bodies();
        let made = |(step, meetings): (usize, &Vec<Meeting>)| {
            let poses: Vec<_> = replay.states[step].iter().map(|state| state.pose()).collect();
            let contact = |(index, of): (usize, &Meeting)| {
                let partner = of.b.map_or(Partner::Ground, Partner::Body);
                let key = ContactKey { body: of.a, point: index, partner, pair: None };
                let frame = Matrix3::from(of.frame).transpose();
                let features = Features::of_plane(of.point.into(), of.radius, frame, of.offset);
                let placed = |body: usize| (&bodies[body], &poses[body]);
                let law = ContactLaw::plastic(of.friction);
                Contact::new(key, features, law, placed(of.a), of.b.map(placed))
            };
            meetings.iter().enumerate().map(contact).collect::<Vec<_>>()
        };
        let contacts: Vec<_> = input.contacts.iter().enumerate().map(made).collect();
        let smoothing = Smoothing { delta: input.delta, compliance: input.compliance };
        let nlp = PlanNlp::smoothed_with(&problem, &replay, &contacts, smoothing).unwrap();
        let (nlp, x) = (Whole(nlp), &input.x);
        let what = |kind: &str| format!("{name}: {kind}");
        assert_eq!((nlp.0.variables(), nlp.0.rows()), (x.len(), input.multipliers.len()));
        compare(&what("f"), &[nlp.0.objective(x)], &[output.objective]);
        compare(&what("∇f"), &nlp.gradient_at(x), &output.gradient);
        compare(&what("row"), &nlp.constraints_at(x), &output.constraints);
        let entries = nlp.jacobian_at(x);
        compare_matrix(&what("∂g/∂x"), nlp.0.jacobian_pattern(), &entries, &output.jacobian);
        let entries = nlp.hessian_at(x, input.obj_factor, &input.multipliers);
        compare_matrix(&what("∇²L"), nlp.0.hessian_pattern(), &entries, &output.hessian);
    }
}
