//! Comparison of a program's values and derivatives with CasADi's, at the points of `data/`.

use crate::slopes::Program;
use nalgebra::Matrix3;
use serde::Deserialize;
use std::collections::HashMap;
use tumble::sparsity::SparsityPattern;
use tumble_core::contact::{Contact, ContactKey, ContactLaw, Features, Partner};
use tumble_core::mechanics::{Pose, RigidBody};

/// One line of a reference file. `input` defines the program.
#[derive(Deserialize)]
pub struct Point<I> {
    pub name: String,
    pub input: I,
    pub output: Output,
}

/// Point at which a program is evaluated.
#[derive(Deserialize)]
pub struct Asked {
    pub x: Vec<f64>,
    pub obj_factor: f64,
    pub multipliers: Vec<f64>,
}

/// Values and derivatives that CasADi computed at that point.
#[derive(Deserialize)]
pub struct Output {
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

/// Contact of a point with a plane.
#[derive(Deserialize)]
pub struct Meeting {
    a: usize,
    b: Option<usize>,
    point: [f64; 3],
    radius: f64,
    /// Frame of the plane: tangents and normal as rows.
    frame: [[f64; 3]; 3],
    offset: f64,
    friction: f64,
}

impl Meeting {
    /// Builds the contact for bodies at the given poses. `index` is the index of the contact point.
    pub fn contact(&self, index: usize, bodies: &[RigidBody], poses: &[Pose]) -> Contact {
        let partner = self.b.map_or(Partner::Ground, Partner::Body);
        let key = ContactKey { body: self.a, point: index, partner, pair: None };
        let frame = Matrix3::from(self.frame).transpose();
        let features = Features::of_plane(self.point.into(), self.radius, frame, self.offset);
        let placed = |body: usize| (&bodies[body], &poses[body]);
        let law = ContactLaw::plastic(self.friction);
        Contact::new(key, features, law, placed(self.a), self.b.map(placed))
    }
}

impl Output {
    /// Compares every number. The allowed error is `rounding` times the largest number of the same
    /// kind or 1. `objective` is our program's value.
    pub fn compare(
        &self,
        name: &str,
        program: &impl Program,
        at: &Asked,
        objective: f64,
        rounding: f64,
    ) {
        let x = &at.x;
        let what = |kind: &str| format!("{name}: {kind}");
        let numbers =
            |kind: &str, found: &[f64], known: &[f64]| near(&what(kind), found, known, rounding);
        numbers("f", &[objective], &[self.objective]);
        numbers("∇f", &program.gradient_at(x), &self.gradient);
        numbers("row", &program.constraints_at(x), &self.constraints);
        let [jacobian, hessian] = program.patterns();
        self.jacobian.compare(&what("∂g/∂x"), jacobian, &program.jacobian_at(x), rounding);
        let entries = program.hessian_at(x, at.obj_factor, &at.multipliers);
        self.hessian.compare(&what("∇²L"), hessian, &entries, rounding);
    }
}

impl Triplets {
    /// Checks that CasADi's entries agree with ours. Entries that only we have must be zero.
    fn compare(&self, what: &str, pattern: &SparsityPattern, found: &[f64], rounding: f64) {
        let mut entries: HashMap<_, _> = pattern.positions().zip(found.iter().copied()).collect();
        assert_eq!(entries.len(), found.len(), "{what} has an entry twice");
        let positions = self.rows.iter().copied().zip(self.cols.iter().copied());
        let ours: Vec<_> = positions.map(|at| entries.remove(&at).unwrap_or_default()).collect();
        near(what, &ours, &self.values, rounding);
        let allowed = rounding * largest(&self.values);
        let zero = entries.values().all(|value| value.abs() <= allowed);
        assert!(zero, "{what} has entries of its own");
    }
}

fn largest(values: &[f64]) -> f64 {
    values.iter().fold(1.0, |largest, value| value.abs().max(largest))
}

fn near(what: &str, found: &[f64], known: &[f64], rounding: f64) {
    assert_eq!(found.len(), known.len(), "{what}");
    let allowed = rounding * largest(known);
    for (index, (found, known)) in found.iter().zip(known).enumerate() {
        let error = (found - known).abs();
        assert!(error <= allowed, "{what} {index}: {found:e}, not {known:e}, {allowed:e} allowed");
    }
}
