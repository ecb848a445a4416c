//! Motion of contacts between bodies at the 24 points of `data/several.jsonl.gz`, with CasADi's
//! values and derivatives. The points have scenes of two and three bodies.
//!
//! The rows of a point are (`data/generate/several.py`)
//!
//! ```text
//! 13 of the dynamics per body; u_t + κ h (Σ 1/m) (f_t − f_0) + λ f_t/(‖f_t‖_ε + ε), two per
//! contact with friction; φ⁺, one per contact; others
//! ```

use crate::common::{reference, state};
use nalgebra::{Matrix3, Vector2, Vector3};
use serde::Deserialize;
use tumble_core::contact::{Contact, ContactKey, ContactLaw, Features, Partner};
use tumble_core::mechanics::{Pose, RigidBody, Rotation, State, StepMap};

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
    dt: f64,
    epsilon: f64,
    /// Compliance of friction, relative to the response of the bodies.
    share: f64,
    x: Vec<f64>,
}

#[derive(Deserialize)]
struct Body {
    mass: f64,
    state: Vec<f64>,
}

/// Contact of a point of A with a plane of B or of the ground.
#[derive(Deserialize)]
struct Meeting {
    a: usize,
    b: Option<usize>,
    point: [f64; 3],
    radius: f64,
    /// Frame of the plane: tangents and normal as rows.
    frame: [[f64; 3]; 3],
    offset: f64,
    friction: f64,
    anchor: [f64; 3],
}

#[derive(Deserialize)]
struct Output {
    constraints: Vec<f64>,
    jacobian: Triplets,
}

#[derive(Deserialize)]
struct Triplets {
    rows: Vec<usize>,
    cols: Vec<usize>,
    values: Vec<f64>,
}

/// Numbers of a state in x.
const STATE: usize = 13;
/// Numbers of a pose in a state.
const POSE: usize = 7;

impl Input {
    /// States of the bodies at the start of the step.
    fn starts(&self) -> Vec<State> {
        self.bodies.iter().map(|body| state(&body.state)).collect()
    }

    /// Contact `i` at the start of the step.
    fn contact(&self, i: usize) -> Contact {
        let Meeting { a, b, point, radius, frame, offset, friction, .. } = &self.contacts[i];
        let bodies: Vec<_> = self.bodies.iter().map(Body::rigid).collect();
        let poses: Vec<_> = self.starts().iter().map(State::pose).collect();
        let partner = b.map_or(Partner::Ground, Partner::Body);
        let key = ContactKey { body: *a, point: 0, partner, pair: None };
        let frame = Matrix3::from(*frame).transpose();
        let features = Features::from_plane((*point).into(), *radius, frame, *offset);
        let placed = |body: usize| (&bodies[body], &poses[body]);
        let law = ContactLaw::plastic(*friction);
        Contact::new(key, features, law, placed(*a), b.map(placed))
    }

    /// Slip along both tangents (m/s) and gap (m) of contact `i` for the end states in `x`.
    fn motion(&self, i: usize, x: &[f64]) -> [f64; 3] {
        let (contact, starts) = (self.contact(i), self.starts());
        let poses = |body: usize| -> [Pose; 2] {
            [starts[body].pose(), state(&x[body * STATE..][..STATE]).pose()]
        };
        let (a, b) = (poses(self.contacts[i].a), self.contacts[i].b.map(poses));
        let b = b.as_ref().map(|[from, to]| [from, to]);
        let map = StepMap { form: Rotation::Tutorial, time_step: self.dt };
        let u = contact.frame.tr_mul(&contact.motion([&a[0], &a[1]], b, &map));
        [u[0], u[1], u[2] * self.dt]
    }

    /// Central differences of [`Self::motion`] over the poses, exact to rounding: the motion is
    /// quadratic in every coordinate.
    fn slopes(&self, i: usize) -> Vec<(usize, [f64; 3])> {
        let columns = (0..self.bodies.len()).flat_map(|body| body * STATE..body * STATE + POSE);
        let slope = |column: usize| {
            let across = [1.0, -1.0].map(|by| {
                let mut x = self.x.clone();
                x[column] += by;
                Vector3::from(self.motion(i, &x))
            });
            (column, ((across[0] - across[1]) / 2.0).into())
        };
        columns.map(slope).collect()
    }

    /// Rows of contact `i`: two of its dissipation if it has friction, and one of its gap.
    fn rows(&self, i: usize) -> (Option<usize>, usize) {
        let first = STATE * self.bodies.len();
        let rough = |contacts: &[Meeting]| contacts.iter().filter(|of| of.friction > 0.0).count();
        let dissipation = first + 2 * rough(&self.contacts[..i]);
        let gap = first + 2 * rough(&self.contacts) + i;
        ((self.contacts[i].friction > 0.0).then_some(dissipation), gap)
    }

    /// Terms of the forces in the dissipation rows of contact `i`, m/s.
    fn friction_terms(&self, i: usize) -> Vector2<f64> {
        let of = &self.contacts[i];
        let rough: Vec<_> =
            (0..self.contacts.len()).filter(|&i| self.contacts[i].friction > 0.0).collect();
        let (place, count) = (rough.iter().position(|&at| at == i).unwrap(), rough.len());
        let first = STATE * self.bodies.len();
        let slip_speed = self.x[first + 3 * count + 2 * self.contacts.len() + place];
        let force = Vector2::new(self.x[first + place], self.x[first + count + place]);
        let response = self.bodies[of.a].mass.recip()
            + of.b.map_or(0.0, |partner| self.bodies[partner].mass.recip());
        let anchor = Vector2::new(of.anchor[0], of.anchor[1]);
        self.share * self.dt * response * (force - anchor)
            + slip_speed * force / force.norm().hypot(self.epsilon)
    }
}

impl Body {
    /// Body of this mass. Its inertia does not affect the motion of a contact.
    fn rigid(&self) -> RigidBody {
        RigidBody::new(self.mass, Matrix3::identity(), &[Vector3::x()]).unwrap()
    }
}

impl Triplets {
    fn entry(&self, row: usize, col: usize) -> f64 {
        let at = self.rows.iter().zip(&self.cols).position(|at| at == (&row, &col));
        at.map_or(0.0, |at| self.values[at])
    }
}

fn largest(values: &[f64]) -> f64 {
    values.iter().fold(1.0, |largest, value| value.abs().max(largest))
}

/// Tolerance relative to the largest number of a kind. The numbers are sums of some ten products,
/// and both sides round in a different order.
const ROUNDING: f64 = 1e-13;

/// Compares gaps of all contacts, and slips of contacts without radius. The end poses of the points
/// do not belong to their spins, and the slip of a rounded point contains a rotation.
#[test]
fn motions_and_derivatives_are_those_of_casadi() {
    let text = reference("several.jsonl.gz");
    let points: Vec<Point> = text.lines().map(|line| serde_json::from_str(line).unwrap()).collect();
    assert_eq!(points.len(), 24);
    let (mut gaps, mut slips) = (0, 0);
    for Point { name, input, output } in &points {
        let of_rows = ROUNDING * largest(&output.constraints);
        let of_slopes = ROUNDING * largest(&output.jacobian.values);
        for i in 0..input.contacts.len() {
            let (motion, slopes) = (input.motion(i, &input.x), input.slopes(i));
            let (dissipation, gap) = input.rows(i);
            let mut compared = vec![(gap, 2, output.constraints[gap])];
            gaps += 1;
            if let Some(row) = dissipation.filter(|_| input.contacts[i].radius == 0.0) {
                let terms = input.friction_terms(i);
                for axis in 0..2 {
                    let slip = output.constraints[row + axis] - terms[axis];
                    compared.push((row + axis, axis, slip));
                }
                slips += 1;
            }
            for (row, axis, expected) in compared {
                let error = (motion[axis] - expected).abs();
                assert!(error <= of_rows, "{name}, contact {i}, row {row}: {error:e}");
                for (column, slope) in &slopes {
                    let error = (slope[axis] - output.jacobian.entry(row, *column)).abs();
                    assert!(error <= of_slopes, "{name}, ({row}, {column}): {error:e}");
                }
            }
        }
    }
    assert!(gaps > 100 && slips > 30, "{gaps} gaps, {slips} slips");
}
