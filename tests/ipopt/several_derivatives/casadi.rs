//! The 24 points of `data/several.jsonl.gz`: CasADi's values for scenes of two and three bodies.

use crate::casadi::{Asked, Meeting, Point};
use crate::common::{reference, state};
use nalgebra::{Matrix3, Vector3};
use serde::Deserialize;
use tumble::step_nlp::several::{PosedStep, SeveralNlp};
use tumble_core::contact::Plane;
use tumble_core::mechanics::{RigidBody, Rotation, State, Wrench};
use tumble_core::world::{Parameters, World};

#[derive(Deserialize)]
struct Input {
    bodies: Vec<Body>,
    contacts: Vec<Anchored>,
    gravity: [f64; 3],
    dt: f64,
    epsilon: f64,
    share: f64,
    stiffness: f64,
    #[serde(flatten)]
    asked: Asked,
}

#[derive(Deserialize)]
struct Body {
    mass: f64,
    /// Inertia matrix. It is symmetric, so rows and columns are the same.
    inertia: [[f64; 3]; 3],
    state: Vec<f64>,
    wrench: [f64; 6],
}

#[derive(Deserialize)]
struct Anchored {
    #[serde(flatten)]
    meeting: Meeting,
    anchor: [f64; 3],
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
        let contacts = self.contacts.iter().map(|of| of.meeting.contact(0, world.bodies(), &poses));
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
        let anchors = self.contacts.iter().map(|of| of.anchor.into());
        nlp.anchor(self.share, self.stiffness, anchors);
        nlp
    }
}

/// Tolerance relative to the largest number of a kind. The numbers are sums of up to some hundred
/// products, and the sides round in a different order.
const ROUNDING: f64 = 1e-13;

#[test]
fn values_and_derivatives_are_those_of_casadi() {
    let text = reference("several.jsonl.gz");
    let points: Vec<Point<Input>> =
        text.lines().map(|line| serde_json::from_str(line).unwrap()).collect();
    assert_eq!(points.len(), 24);
    for Point { name, input, output } in &points {
        let nlp = input.nlp();
        output.compare(name, &nlp, &input.asked, nlp.objective(&input.asked.x), ROUNDING);
    }
}
