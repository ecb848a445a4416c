//! Directions in which the arguments of a run change.

use super::runs::Inputs;
use super::tree::{Tree, moved, placed};
use crate::common::prelude::*;
use crate::gradients::draw::Draw;
use nalgebra::{Isometry3, Point3, Translation3};
use tumble_core::simulation::RunGradient;

/// Direction in the space of a run's arguments.
#[derive(Clone)]
pub struct Direction {
    pub name: &'static str,
    /// Rigid displacement of each link relative to its parent, in the world.
    places: Vec<Twist>,
    /// Changes of velocities and spins.
    speeds: Vec<StateChange>,
    pub inputs: Vec<Inputs>,
}

/// Rigid displacement per unit of a direction: translation, and rotation vector about `point`.
#[derive(Clone, Copy)]
struct Twist {
    point: Vector3<f64>,
    linear: Vector3<f64>,
    angular: Vector3<f64>,
}

impl Twist {
    fn displaced(&self, by: f64) -> Isometry3<f64> {
        let turn = UnitQuaternion::new(self.angular * by);
        let place = self.point + self.linear * by - turn * self.point;
        Isometry3::from_parts(Translation3::from(place), turn)
    }
}

/// Index of the joint of a link with its parent.
fn joint_of(world: &World, link: usize) -> Option<usize> {
    world.joints().iter().position(|joint| joint.body() == link)
}

/// Random directions: places along which joints hold, speeds, wrenches, motor targets and joint
/// forces. All are scaled so that they change the velocities by about the speed unit.
pub fn directions(tree: &Tree, steps: usize, draw: &mut Draw) -> Vec<Direction> {
    let Tree { world, states, units } = tree;
    let (h, count) = (world.time_step(), states.len());
    let still =
        Twist { point: Vector3::zeros(), linear: Vector3::zeros(), angular: Vector3::zeros() };
    let mut zero = Inputs::new(world);
    zero.forces.fill(0.0);
    zero.targets.fill(0.0);
    let none = |name| Direction {
        name,
        places: vec![still; count],
        speeds: vec![StateChange::zero(); count],
        inputs: vec![zero.clone(); steps],
    };
    let small = h / units.time;
    let mut place = none("place");
    for (link, twist) in place.places.iter_mut().enumerate() {
        let Some(joint) = joint_of(world, link) else {
            let (linear, angular) = (draw.vector(units.length * small), draw.vector(small));
            *twist = Twist { point: states[link].position, linear, angular };
            continue;
        };
        let joint = &world.joints()[joint];
        let parent = joint.other().unwrap();
        let frame = joint.frames()[1];
        let pose = placed(&states[parent]);
        let basis = pose.rotation.to_rotation_matrix().into_inner() * frame.rotation();
        twist.point =
            placed(&states[link]) * Point3::from(joint.frames()[0].anchor) - Point3::origin();
        for axis in joint.linear().iter().zip(0..).filter(|of| is_free(of.0)).map(|of| of.1) {
            let along: Vector3<f64> = basis.column(axis).into();
            twist.linear += along * (draw.unit() * units.length * small);
        }
        for axis in joint.angular().iter().zip(0..).filter(|of| is_free(of.0)).map(|of| of.1) {
            let about: Vector3<f64> = basis.column(axis).into();
            twist.angular += about * (draw.unit() * small);
        }
    }
    let mut speed = none("speed");
    for change in &mut speed.speeds {
        change.velocity = draw.vector(units.speed());
        change.spin = draw.vector(1.0 / units.time);
    }
    let mut wrench = none("wrench");
    let share = 1.0 / (steps as f64 * h);
    for wrenches in wrench.inputs.iter_mut().map(|inputs| &mut inputs.wrenches) {
        for (wrench, body) in wrenches.iter_mut().zip(world.bodies()) {
            wrench.force = draw.vector(body.mass() * units.speed() * share);
            wrench.torque = draw.vector(body.inertia().trace() / 3.0 / units.time * share);
        }
    }
    let mut target = none("target");
    let coordinates: Vec<f64> = world
        .motors()
        .iter()
        .map(|(joint, axis)| match world.joints()[*joint].drive(*axis).unwrap().motor.unwrap() {
            Motor::Position { .. } => units.coordinate(*axis),
            _ => units.coordinate(*axis) / units.time,
        })
        .collect();
    for targets in target.inputs.iter_mut().map(|inputs| &mut inputs.targets) {
        targets.iter_mut().zip(&coordinates).for_each(|(of, unit)| *of = draw.unit() * unit);
    }
    let mut force = none("force");
    for forces in force.inputs.iter_mut().map(|inputs| &mut inputs.forces) {
        for (force, (joint, axis)) in forces.iter_mut().zip(world.driven_axes()) {
            let body = &world.bodies()[world.joints()[joint].body()];
            let unit = match axis {
                JointAxis::Linear(_) => body.mass() * units.speed(),
                JointAxis::Angular(_) => body.inertia().trace() / 3.0 / units.time,
            };
            *force = draw.unit() * unit * share;
        }
    }
    let mut all = vec![place, speed, wrench, force];
    if !coordinates.is_empty() {
        all.push(target);
    }
    all
}

fn is_free(axis: &Axis) -> bool {
    *axis != Axis::Locked
}

impl Direction {
    /// States moved by `by`.
    pub fn states(&self, tree: &Tree, by: f64) -> Vec<State> {
        let mut moves: Vec<Isometry3<f64>> = Vec::new();
        let each = tree.states.iter().enumerate().map(|(link, state)| {
            let own = self.places[link].displaced(by);
            let joint = joint_of(&tree.world, link).map(|joint| &tree.world.joints()[joint]);
            let all = joint.map_or(own, |joint| moves[joint.other().unwrap()] * own);
            moves.push(all);
            let changed = self.speeds[link];
            let place = moved(state, &(all * placed(state)));
            StateChange::zero().plus(by, &changed).applied(&place)
        });
        each.collect()
    }

    /// Change of the states at the start, per unit of the direction.
    fn slope(&self, tree: &Tree) -> Vec<StateChange> {
        let mut twists: Vec<[Vector3<f64>; 2]> = Vec::new();
        for (link, twist) in self.places.iter().enumerate() {
            // Velocity at the origin, and rotation.
            let mut own = [twist.linear - twist.angular.cross(&twist.point), twist.angular];
            if let Some(joint) = joint_of(&tree.world, link) {
                let parent = twists[tree.world.joints()[joint].other().unwrap()];
                own = [own[0] + parent[0], own[1] + parent[1]];
            }
            twists.push(own);
        }
        let each = tree.states.iter().zip(&twists).zip(&self.speeds);
        each.map(|((state, [linear, angular]), speed)| StateChange {
            position: linear + angular.cross(&state.position),
            turn: placed(state).rotation.inverse() * angular,
            ..*speed
        })
        .collect()
    }

    /// Products of the gradient's components with the direction's.
    pub fn products(&self, tree: &Tree, found: &RunGradient) -> Vec<f64> {
        let slope = self.slope(tree);
        let states = found.states.iter().zip(&slope).flat_map(|(by, change)| {
            let (by, change) = (by.to_array(), change.to_array());
            (0..12).map(move |k| by[k] * change[k])
        });
        let mut all: Vec<f64> = states.collect();
        for ((inputs, wrenches), by) in self.inputs.iter().zip(&found.wrenches).zip(&found.inputs) {
            for (by, own) in wrenches.iter().zip(&inputs.wrenches) {
                all.extend(by.force.component_mul(&own.force).iter());
                all.extend(by.torque.component_mul(&own.torque).iter());
            }
            all.extend(by[0].iter().zip(&inputs.targets).map(|(by, own)| by * own));
            all.extend(by[1].iter().zip(&inputs.forces).map(|(by, own)| by * own));
        }
        all
    }
}
