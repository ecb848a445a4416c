//! Random articulated bodies: trees of links with a free root.

use super::super::draw::Draw;
use crate::common::prelude::*;
use nalgebra::{Isometry3, Quaternion, Translation3};
use std::f64::consts::FRAC_PI_2;

const GRAVITY: f64 = 9.81;

/// Natural units of a body of a given size.
#[derive(Clone, Copy)]
pub struct Units {
    /// m
    pub length: f64,
    /// kg
    pub mass: f64,
    /// s
    pub time: f64,
}

impl Units {
    /// Units of links of about `length` (m) with the density 1 kg/m³ of their cubes.
    fn new(length: f64) -> Self {
        Self { length, mass: length.powi(3), time: (length / GRAVITY).sqrt() }
    }

    pub fn speed(&self) -> f64 {
        self.length / self.time
    }

    /// Unit of the coordinate of an axis (m or rad).
    pub fn coordinate(&self, axis: JointAxis) -> f64 {
        match axis {
            JointAxis::Linear(_) => self.length,
            JointAxis::Angular(_) => 1.0,
        }
    }

    /// Unit of the force of an axis (N or N m): a link's weight, on a lever of the unit length.
    pub fn force(&self, axis: JointAxis) -> f64 {
        self.mass * GRAVITY * self.length / self.coordinate(axis)
    }
}

/// Movement of an articulated body at the start of a comparison.
#[derive(Clone, Copy, PartialEq, Debug)]
pub enum Situation {
    Flying,
    Lying,
    Sliding,
    /// In contact and driven by targets of motors that change with every step.
    Walking,
}

impl Situation {
    pub const ALL: [Self; 4] = [Self::Flying, Self::Lying, Self::Sliding, Self::Walking];
}

/// Articulated body in its world.
pub struct Tree {
    pub world: World,
    pub states: Vec<State>,
    pub units: Units,
}

fn quaternion(q: &Vector4<f64>) -> UnitQuaternion<f64> {
    UnitQuaternion::from_quaternion(Quaternion::new(q[0], q[1], q[2], q[3]))
}

fn vector(q: &UnitQuaternion<f64>) -> Vector4<f64> {
    Vector4::new(q.w, q.i, q.j, q.k)
}

pub fn placed(state: &State) -> Isometry3<f64> {
    Isometry3::from_parts(Translation3::from(state.position), quaternion(&state.attitude))
}

/// Places `state` anew, with its velocity and spin.
pub fn moved(state: &State, to: &Isometry3<f64>) -> State {
    State { position: to.translation.vector, attitude: vector(&to.rotation), ..*state }
}

impl Draw {
    fn chance(&mut self, share: f64) -> bool {
        self.within(0.0, 1.0) < share
    }

    fn below(&mut self, count: usize) -> usize {
        (self.within(0.0, count as f64) as usize).min(count - 1)
    }

    /// Tree of 2 to 8 links in `situation`, `length` (m) in size.
    pub fn tree(&mut self, situation: Situation, length: f64) -> Tree {
        let units = Units::new(length);
        let count = 2 + self.below(7);
        let mut bodies: Vec<RigidBody> = Vec::new();
        let mut halves = Vec::new();
        for _ in 0..count {
            let (body, half) = self.link(&units);
            bodies.push(body);
            halves.push(half);
        }
        let attitude = self.attitude();
        let mut states = vec![State {
            position: Vector3::zeros(),
            attitude,
            velocity: self.vector(0.3) * units.speed(),
            spin: self.vector(0.5) / units.time,
        }];
        let mut joints = Vec::new();
        for child in 1..count {
            let parent = if self.chance(0.6) { child - 1 } else { self.below(child) };
            let relative = UnitQuaternion::new(self.vector(0.8));
            let frame = self.attitude();
            let side = if self.chance(0.5) { 1.0 } else { -1.0 };
            let anchors = [
                Vector3::new(-halves[child][0], 0.0, 0.0),
                Vector3::new(side * halves[parent][0], 0.3 * self.unit() * halves[parent][1], 0.0),
            ];
            let own = vector(&(relative.inverse() * quaternion(&frame)));
            let frames = [
                JointFrame { anchor: anchors[0], attitude: own },
                JointFrame { anchor: anchors[1], attitude: frame },
            ];
            let base = placed(&states[parent]);
            let turned = base.rotation * relative;
            states.push(State {
                position: states[parent].position + base.rotation * anchors[1]
                    - turned * anchors[0],
                attitude: vector(&turned),
                ..states[0]
            });
            joints.push(self.joint(child, parent, frames, &units, situation));
        }
        let world = World::new(Parameters {
            ground: (situation != Situation::Flying).then(Plane::level),
            friction: if situation == Situation::Sliding {
                self.within(0.1, 0.4)
            } else {
                self.within(0.5, 0.9)
            },
            time_step: 0.006 * units.time,
            ..Parameters::new(bodies)
        });
        let mut world =
            world.unwrap().with_integrator(Integrator::Euler).with_joints(joints).unwrap();
        for one in 0..count {
            for other in 0..one {
                world = world.with_apart(one, Partner::Body(other)).unwrap();
            }
        }
        if situation != Situation::Flying {
            let lift = 0.01 * length - world.lowest_height(&states);
            states.iter_mut().for_each(|state| state.position.z += lift);
        }
        Tree { world, states, units }
    }

    /// Box or capsule along x, with its half sides.
    fn link(&mut self, units: &Units) -> (RigidBody, Vector3<f64>) {
        let mass = units.mass * 2.0_f64.powf(self.unit());
        let half =
            Vector3::new(self.within(0.15, 0.35), self.within(0.04, 0.12), self.within(0.04, 0.12))
                * units.length;
        if self.chance(0.6) {
            return (RigidBody::solid_box(mass, half).unwrap(), half);
        }
        let radius = half[1];
        let along_x = Rotation3::from_axis_angle(&Vector3::y_axis(), FRAC_PI_2);
        let piece = Piece::capsule(half[0] - radius, radius).unwrap();
        let piece = piece.moved_by(along_x.matrix(), &Vector3::zeros()).unwrap();
        (RigidBody::solid(mass, &[piece]).unwrap().0, half)
    }

    fn joint(
        &mut self,
        child: usize,
        parent: usize,
        frames: [JointFrame; 2],
        units: &Units,
        situation: Situation,
    ) -> Joint {
        let about = JointAxis::Angular(2);
        match self.below(6) {
            0 => {
                let drive = self.drive(JointAxis::Linear(2), units, situation, true);
                Joint::prismatic(child, Some(parent), frames, drive)
            }
            1 => {
                let twist = self.drive(about, units, situation, true);
                Joint::ball(child, Some(parent), frames, self.within(0.4, 1.2), twist)
            }
            2 => {
                let axes = [0; 3].map(|_| Axis::Free(self.drive(about, units, situation, false)));
                let ball = Joint::spherical(child, Some(parent), frames);
                let linear = *ball.linear();
                ball.with_axes(linear, axes)
            }
            _ => {
                let drive = self.drive(about, units, situation, true);
                Joint::revolute(child, Some(parent), frames, drive)
            }
        }
    }

    /// Drive with any of a motor, limits, a spring, dry friction and an armature. Damping keeps
    /// free joints slow.
    fn drive(
        &mut self,
        axis: JointAxis,
        units: &Units,
        situation: Situation,
        may_have_limits: bool,
    ) -> Drive {
        let (coordinate, force) = (units.coordinate(axis), units.force(axis));
        let speed = coordinate / units.time;
        let most = if self.chance(0.8) { 10.0 } else { 0.1 } * force;
        let target = 0.2 * self.unit();
        let damping = self.within(0.1, 0.5) * force / speed;
        let position = Motor::Position {
            target: target * coordinate,
            stiffness: self.within(2.0, 8.0) * force / coordinate,
            damping,
            max_force: most,
        };
        let motor = match self.below(6) {
            _ if situation == Situation::Walking => Some(position),
            0 => Some(Motor::Speed { target: target * speed, max_force: most }),
            1 => Some(Motor::Damper { target: target * speed, damping, max_force: most }),
            2 | 3 => Some(position),
            _ => None,
        };
        let has_limits = may_have_limits && self.chance(0.5);
        let limits = [-self.within(0.1, 0.6), self.within(0.1, 0.6)].map(|end| end * coordinate);
        let stiffness = if self.chance(0.3) { self.within(0.5, 3.0) } else { 0.0 };
        let friction = if self.chance(0.2) { self.within(0.01, 0.1) } else { 0.0 };
        let armature = if self.chance(0.2) { self.within(0.01, 0.2) } else { 0.0 };
        Drive {
            limits: has_limits.then_some(limits),
            friction: friction * force,
            restitution: 0.0,
            static_friction: None,
            friction_curve: None,
            stiffness: stiffness * force / coordinate,
            rest: 0.2 * self.unit() * coordinate,
            damping: self.within(0.02, 0.1) * force / speed,
            force: 0.0,
            armature: armature * force * units.time / speed,
            motor,
        }
    }
}
