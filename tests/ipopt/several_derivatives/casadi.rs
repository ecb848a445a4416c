//! The 24 points of `data/several.jsonl.gz`: what CasADi makes of scenes of two and three bodies.

use crate::common::{reference, state};
use crate::slopes::Program as _;
use nalgebra::{Matrix3, Vector3};
use serde::Deserialize;
use std::collections::HashMap;
use tumble::contact::{Contact, ContactKey, ContactLaw, Features, Partner, Plane};
use tumble::mechanics::{RigidBody, Rotation, State, Wrench};
use tumble::sparsity::SparsityPattern;
use tumble::step_nlp::several::{PosedStep, SeveralNlp};
use tumble::world::{Parameters, World};

#[derive(Deserialize)]
struct Point {
    name: String,
    input: Input,
    output: Output,
}

#[derive(Deserialize)]
struct Input {
    bodies: Vec<Body>,
    contacts: Vec<Meeting>,
    gravity: [f64; 3],
    dt: f64,
    epsilon: f64,
    share: f64,
    stiffness: f64,
    x: Vec<f64>,
    obj_factor: f64,
    multipliers: Vec<f64>,
}

#[derive(Deserialize)]
struct Body {
    mass: f64,
    /// Symmetric: rows and columns are the same.
    inertia: [[f64; 3]; 3],
    state: Vec<f64>,
    wrench: [f64; 6],
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
    anchor: [f64; 3],
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

impl Input {
    fn nlp(&self) -> SeveralNlp {
        let bodies = self.bodies.iter().map(|body| {
            RigidBody::new(body.mass, Matrix3::from(body.inertia), &[Vector3::x()]).unwrap()
        });
        let world = World::new(Parameters {
            bodies: bodies.collect(),
            ground: Some(Plane::level()),
            gravity: self.gravity.into(),
            friction: 0.3,
            time_step: self.dt,
            rotation: Rotation::Tutorial,
        })
        .unwrap();
        let states: Vec<_> = self.bodies.iter().map(|body| state(&body.state)).collect();
        let poses: Vec<_> = states.iter().map(State::pose).collect();
        let wrenches = self.bodies.iter().map(|Body { wrench: w, .. }| Wrench {
            force: Vector3::new(w[0], w[1], w[2]),
            torque: Vector3::new(w[3], w[4], w[5]),
        });
        let placed = |index: usize| (&world.bodies()[index], &poses[index]);
        let contacts = self.contacts.iter().map(|meeting| {
            let partner = meeting.b.map_or(Partner::Ground, Partner::Body);
            let key = ContactKey { body: meeting.a, point: 0, partner, pair: None };
            let frame = Matrix3::from(meeting.frame).transpose();
            let features =
                Features::of_plane(meeting.point.into(), meeting.radius, frame, meeting.offset);
            let law = ContactLaw::plastic(meeting.friction);
            Contact::new(key, features, law, placed(meeting.a), meeting.b.map(placed))
        });
        let (contacts, all): (Vec<_>, Vec<_>) = (contacts.collect(), (0..states.len()).collect());
        let wrenches: Vec<_> = wrenches.collect();
        let step = PosedStep {
            world: &world,
            states: &states,
            wrenches: &wrenches,
            bodies: &all,
            contacts: &contacts,
        };
        let mut nlp = SeveralNlp::new(&step, self.epsilon).unwrap();
        let anchors = self.contacts.iter().map(|meeting| meeting.anchor.into());
        nlp.anchor((self.share, self.stiffness), anchors);
        nlp
    }
}

/// Numbers of one kind are sums of up to some hundred products, none much larger than the largest
/// of the numbers, that both sides round in another order: 1e-13 of that (measured: less than 5e-15).
const ROUNDING: f64 = 1e-13;

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
    let ours: Vec<_> =
        positions.clone().map(|at| entries.remove(&at).unwrap_or_default()).collect();
    compare(what, &ours, &known.values);
    let allowed = ROUNDING * largest(&known.values);
    assert!(entries.values().all(|value| value.abs() <= allowed), "{what} has entries of its own");
}

#[test]
fn values_and_derivatives_are_those_of_casadi() {
    let text = reference("several.jsonl.gz");
    let points: Vec<Point> = text.lines().map(|line| serde_json::from_str(line).unwrap()).collect();
    assert_eq!(points.len(), 24);
    for Point { name, input, output } in &points {
        let (nlp, x) = (input.nlp(), &input.x);
        let what = |kind: &str| format!("{name}: {kind}");
        compare(&what("f"), &[nlp.objective(x)], &[output.objective]);
        compare(&what("∇f"), &nlp.gradient_at(x), &output.gradient);
        compare(&what("row"), &nlp.constraints_at(x), &output.constraints);
        let entries = nlp.jacobian_at(x);
        compare_matrix(&what("∂g/∂x"), nlp.jacobian_pattern(), &entries, &output.jacobian);
        let entries = nlp.hessian_at(x, input.obj_factor, &input.multipliers);
        compare_matrix(&what("∇²L"), nlp.hessian_pattern(), &entries, &output.hessian);
    }
}
