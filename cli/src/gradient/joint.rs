//! Coordinate or rate of a joint as the result of a run.

use crate::outcome::Failure;
use nalgebra::Vector3;
use tumble_core::derivative::StateChange;
use tumble_core::joint::{GearAxis, JointAxis};
use tumble_core::mechanics::State;
use tumble_core::world::World;
use tumble_model::nearest;
use tumble_scene::scene::Scene;

/// Axis of a joint.
#[derive(Debug, Clone, Copy)]
pub struct JointQuantity(GearAxis);

/// Fourth-order difference: f' = (f(−2h) − 8 f(−h) + 8 f(h) − f(2h))/12h.
const DIFFERENCES: [(f64, f64); 4] =
    [(-2.0, 1.0 / 12.0), (-1.0, -8.0 / 12.0), (1.0, 8.0 / 12.0), (2.0, -1.0 / 12.0)];

/// Step h of that difference, m and rad: its error is about 1e-13, and 1e-10 for second derivatives.
const MOVED: f64 = 1e-3;

impl JointQuantity {
    /// Axis `axis` of the joint `name`, or its only one.
    pub fn of(scene: &Scene, name: &str, axis: Option<&str>) -> Result<Self, Failure> {
        let joint = scene.joints.iter().position(|known| known == name).ok_or_else(|| {
            let hint = nearest::hint(name, scene.joints.iter().map(String::as_str));
            Failure::Input(format!("--joint {name}: the scene has no such joint{hint}"))
        })?;
        let kind = scene.model.joints[joint].kind;
        let turns = |index: usize| index >= 3 && kind.turns_in_any_way();
        let axes: Vec<_> = kind.driven().iter().filter(|(_, index)| !turns(*index)).collect();
        let found = match axis {
            None if axes.len() == 1 => axes.first(),
            None => None,
            Some(axis) => axes.iter().find(|(known, _)| *known == axis),
        };
        let Some((_, index)) = found else {
            let names: Vec<_> = axes.iter().map(|(name, _)| *name).collect();
            let names = if names.is_empty() { "none".to_owned() } else { names.join(", ") };
            return Err(Failure::Input(format!(
                "--joint {name}: an axis with a coordinate is needed; allowed for --axis: {names}"
            )));
        };
        let axis = match *index {
            index @ 0..3 => JointAxis::Linear(index),
            index => JointAxis::Angular(index - 3),
        };
        Ok(Self(GearAxis { joint, axis }))
    }

    /// Coordinate at `states`, with the joint angles nearest to `near` (m or rad).
    pub fn coordinate(&self, world: &World, states: &[State], near: &Vector3<f64>) -> f64 {
        self.0.coordinate(world.joints(), states, near)
    }

    /// Angles of the joint, from which the moved ones are counted.
    fn angles(&self, world: &World, states: &[State]) -> Vector3<f64> {
        let joint = &world.joints()[self.0.joint];
        let at = joint.coordinates(states);
        at.map_or(Vector3::zeros(), |at| joint.counted(&at, &Vector3::zeros()))
    }

    /// Rate of the coordinate: its derivative along the velocities of the bodies (m/s or rad/s).
    pub fn rate(&self, world: &World, states: &[State]) -> f64 {
        let near = self.angles(world, states);
        let fastest = self
            .bodies(world)
            .map(|body| states[body].velocity.amax().max(states[body].spin.amax()));
        let time = MOVED / fastest.fold(1.0, f64::max);
        let moved = |times: f64| {
            let mut states = states.to_vec();
            for body in self.bodies(world) {
                let State { velocity, spin, .. } = states[body];
                let (position, turn) = (velocity * (times * time), spin * (times * time));
                let change = StateChange { position, turn, ..StateChange::zero() };
                states[body] = change.applied(&states[body]);
            }
            self.coordinate(world, &states, &near)
        };
        DIFFERENCES.iter().map(|(times, weight)| moved(*times) * weight).sum::<f64>() / time
    }

    /// Derivatives of the coordinate by the states.
    pub fn coordinate_slope(&self, world: &World, states: &[State]) -> Vec<StateChange> {
        let near = self.angles(world, states);
        self.slope(world, states, &|states| self.coordinate(world, states, &near))
    }

    /// Derivatives of the rate by the states.
    pub fn rate_slope(&self, world: &World, states: &[State]) -> Vec<StateChange> {
        self.slope(world, states, &|states| self.rate(world, states))
    }

    /// Derivatives of `value` by the states of the joint's bodies.
    fn slope(
        &self,
        world: &World,
        states: &[State],
        value: &dyn Fn(&[State]) -> f64,
    ) -> Vec<StateChange> {
        let mut all = vec![StateChange::zero(); states.len()];
        for body in self.bodies(world) {
            let mut slopes = [0.0; StateChange::LEN];
            for (k, slope) in slopes.iter_mut().enumerate() {
                for (times, weight) in DIFFERENCES {
                    let mut change = [0.0; StateChange::LEN];
                    change[k] = times * MOVED;
                    let mut moved = states.to_vec();
                    moved[body] = StateChange::from_array(&change).applied(&states[body]);
                    *slope += value(&moved) * weight / MOVED;
                }
            }
            all[body] = StateChange::from_array(&slopes);
        }
        all
    }

    /// Index of the joint.
    pub fn joint(&self) -> usize {
        self.0.joint
    }

    /// Bodies that the joint connects.
    fn bodies(&self, world: &World) -> impl Iterator<Item = usize> {
        let joint = &world.joints()[self.0.joint];
        [Some(joint.body()), joint.other()].into_iter().flatten()
    }
}
