//! The program of bodies with joints and gears at the 24 points of `data/joints.jsonl.gz`: its derivatives against what CasADi
//! makes of the same scenes, written in other formulas, and against central differences.

use crate::casadi::{Asked, Point};
use crate::common::{reference, state};
use crate::slopes::{hessian_error, jacobian_error};
use nalgebra::{Matrix3, Vector3, Vector4};
use serde::Deserialize;
use tumble::contact::Plane;
use tumble::joint::{Axis, Drive, Gear, GearAxis, Joint, JointAxis, JointFrame, Middle, Motor};
use tumble::mechanics::{RigidBody, Rotation, Wrench};
use tumble::step_nlp::several::{PosedStep, SeveralNlp};
use tumble::world::{Parameters, World};

#[derive(Deserialize)]
struct Input {
    bodies: Vec<Body>,
    joints: Vec<Tie>,
    gears: Vec<Wheels>,
    gravity: [f64; 3],
    dt: f64,
    #[serde(flatten)]
    asked: Asked,
}

#[derive(Deserialize)]
struct Body {
    mass: f64,
    inertia: [[f64; 3]; 3],
    state: Vec<f64>,
    wrench: [f64; 6],
}

#[derive(Deserialize)]
struct Tie {
    a: usize,
    b: Option<usize>,
    kind: String,
    frames: [([f64; 3], [f64; 4]); 2],
    linear: [Option<Driven>; 3],
    angular: [Option<Driven>; 3],
    length: Option<f64>,
    middle: Middle,
    turns: [f64; 3],
}

#[derive(Deserialize)]
struct Driven {
    limits: Option<[f64; 2]>,
    friction: f64,
    stiffness: f64,
    rest: f64,
    damping: f64,
    force: f64,
    armature: f64,
    motor: Option<Pull>,
}

#[derive(Deserialize)]
#[serde(untagged)]
enum Pull {
    Speed { speed: f64, most: f64 },
    Position { position: f64, stiffness: f64, damping: f64, most: f64 },
}

#[derive(Deserialize)]
struct Wheels {
    first: (usize, String, usize),
    second: (usize, String, usize),
    ratio: f64,
    offset: f64,
}

fn axis(of: &Option<Driven>) -> Axis {
    let Some(of) = of else { return Axis::Locked };
    let motor = of.motor.as_ref().map(|motor| match *motor {
        Pull::Speed { speed, most } => Motor::Speed { target: speed, most },
        Pull::Position { position, stiffness, damping, most } => {
            Motor::Position { target: position, stiffness, damping, most }
        }
    });
    Axis::Free(Drive {
        limits: of.limits,
        friction: of.friction,
        stiffness: of.stiffness,
        rest: of.rest,
        damping: of.damping,
        force: of.force,
        armature: of.armature,
        motor,
    })
}

impl Tie {
    fn joint(&self) -> Joint {
        let frame = |(anchor, attitude): ([f64; 3], [f64; 4])| JointFrame {
            anchor: anchor.into(),
            attitude: Vector4::from(attitude),
        };
        let axes = [&self.linear, &self.angular].map(|axes| axes.each_ref().map(axis));
        let joint = Joint::between(self.a, self.b, self.frames.map(frame));
        let mut joint = joint.with_axes(axes[0], axes[1]);
        if self.kind == "gimbal" {
            joint = joint.with_middle(self.middle);
        }
        match self.length {
            Some(length) => joint.with_length(length),
            None => joint,
        }
    }
}

impl Wheels {
    fn gear(&self) -> Gear {
        let axis = |(joint, which, k): &(usize, String, usize)| {
            let axis = match which.as_str() {
                "linear" => JointAxis::Linear(*k),
                _ => JointAxis::Angular(*k),
            };
            GearAxis { joint: *joint, axis }
        };
        Gear::new(axis(&self.first), axis(&self.second), self.ratio, self.offset)
    }
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
        });
        let world = world.unwrap().with_joints(self.joints.iter().map(Tie::joint).collect());
        let world = world.unwrap().with_gears(self.gears.iter().map(Wheels::gear).collect());
        let states: Vec<_> = self.bodies.iter().map(|body| state(&body.state)).collect();
        let wrenches = self.bodies.iter().map(|Body { wrench: w, .. }| Wrench {
            force: Vector3::new(w[0], w[1], w[2]),
            torque: Vector3::new(w[3], w[4], w[5]),
        });
        let (wrenches, all): (Vec<_>, Vec<_>) = (wrenches.collect(), (0..states.len()).collect());
        let angles: Vec<_> = self.joints.iter().map(|joint| joint.turns.into()).collect();
        let step = PosedStep {
            world: &world.unwrap(),
            states: &states,
            wrenches: &wrenches,
            angles: &angles,
            bodies: &all,
            contacts: &[],
        };
        SeveralNlp::new(&step, 1e-6).unwrap()
    }
}

fn points() -> Vec<Point<Input>> {
    let text = reference("joints.jsonl.gz");
    let points: Vec<_> = text.lines().map(|line| serde_json::from_str(line).unwrap()).collect();
    assert_eq!(points.len(), 24);
    points
}

/// As of contacts (`several_derivatives/casadi.rs`), and an arc sine near a quarter turn, or an arc cosine near none, loses
/// digits by one over its distance, of which the points keep a twentieth at least.
const ROUNDING: f64 = 1e-12;

#[test]
fn values_and_derivatives_are_those_of_casadi() {
    for Point { name, input, output } in &points() {
        let nlp = input.nlp();
        output.compare(name, &nlp, &input.asked, nlp.objective(&input.asked.x), ROUNDING);
    }
}

#[test]
fn derivatives_are_the_slopes() {
    for Point { name, input, .. } in &points() {
        let (mut nlp, asked) = (input.nlp(), &input.asked);
        let anchors: Vec<_> = asked.x.iter().map(|x| 0.5 * x).collect();
        nlp.anchor_ties(0.3, &anchors);
        let jacobian = jacobian_error(&nlp, &asked.x);
        let hessian = hessian_error(&nlp, &asked.x, asked.obj_factor, &asked.multipliers);
        // Third derivatives of angles near where they are singular, times δ² = 1e-10.
        assert!(jacobian < 1e-6 && hessian < 1e-6, "{name}: {jacobian:e}, {hessian:e}");
    }
}
