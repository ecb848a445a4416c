//! How fast what joints hold taut can vibrate, against the time step.
//!
//! A step pulls along the directions at its start, so that the restoring moment of what is under tension is that of an
//! explicit method: it is stable for h ω < 2, and no residual shows it. The force f (N) of a joint at
//! the lever a (m) of a body resists its turning by
//!
//! ```text
//! K = Σ (f·a) E − ½ (f aᵀ + a fᵀ),   ω² ≤ the largest eigenvalue of I⁻¹ K over all bodies,     (J12)
//! ```
//!
//! I being the inertia about the centre of mass, or about an anchor that a joint holds in the world. A rod of mass m and length L under
//! a tension T has ω² = 12 T/(m L).

use crate::joint::{Axis, Joint, JointForce};
use crate::mechanics::State;
use crate::mechanics::quaternion::rotation;
use crate::world::World;
use nalgebra::{Matrix3, Vector3};

/// Finds it; owns its scratch memory, so that a step allocates nothing for it.
#[derive(Debug, Clone, Default)]
pub struct Stiffness {
    /// K of each body, N m, its frame.
    of: Vec<Matrix3<f64>>,
    /// Where a joint holds it in the world, m, its frame.
    held: Vec<Option<Vector3<f64>>>,
}

impl Stiffness {
    /// h ω (J12) of a step from `states` in which the `joints` and the `gears` of `world` have these forces; 0 without joints.
    /// A frame in the world that moves is where the step ends.
    #[inline]
    pub fn of_step(
        &mut self,
        world: &World,
        states: &[State],
        forces: (&[JointForce], &[f64]),
    ) -> f64 {
        let is_whole = states.len() == world.bodies().len();
        if world.joints().is_empty() || !is_whole {
            return 0.0;
        }
        self.of_joints(world, states, forces)
    }

    /// The same for each joint: that of the stiffer one of its bodies.
    pub fn of_each_joint(
        &mut self,
        world: &World,
        states: &[State],
        forces: (&[JointForce], &[f64]),
    ) -> Vec<f64> {
        if states.len() != world.bodies().len() {
            return vec![0.0; world.joints().len()];
        }
        self.collect(world, states, forces);
        let of_body = |body: usize| {
            let largest =
                self.scaled(world, body).map(|scaled| scaled.symmetric_eigenvalues().max());
            world.time_step() * largest.unwrap_or(0.0).max(0.0).sqrt()
        };
        let each: Vec<_> = (0..states.len()).map(of_body).collect();
        let of_joint = |joint: &Joint| {
            let other = joint.other().map_or(0.0, |other| each[other]);
            each[joint.body()].max(other)
        };
        world.joints().iter().map(of_joint).collect()
    }

    #[inline(never)]
    fn of_joints(
        &mut self,
        world: &World,
        states: &[State],
        forces: (&[JointForce], &[f64]),
    ) -> f64 {
        self.collect(world, states, forces);
        let mut largest = 0.0_f64;
        for body in 0..world.bodies().len() {
            let Some(scaled) = self.scaled(world, body) else { continue };
            // No eigenvalue is larger than the norm; a number without an order has none.
            if scaled.norm() > largest {
                largest = largest.max(scaled.symmetric_eigenvalues().max());
            }
        }
        world.time_step() * largest.sqrt()
    }

    /// L⁻¹ K L⁻ᵀ of a body, with I = L Lᵀ; `None` of a matrix that is not finite.
    fn scaled(&self, world: &World, body: usize) -> Option<Matrix3<f64>> {
        let (of, lever) = (&world.bodies()[body], self.held[body].unwrap_or_default());
        let about = Matrix3::identity() * lever.norm_squared() - lever * lever.transpose();
        let inertia = of.inertia() + about * of.mass();
        let root = inertia.cholesky()?.l().try_inverse()?;
        let scaled = root * self.of[body] * root.transpose();
        scaled.norm().is_finite().then_some(scaled)
    }

    /// K of every body, and where joints hold it in the world.
    fn collect(
        &mut self,
        world: &World,
        states: &[State],
        (joints, gears): (&[JointForce], &[f64]),
    ) {
        let bodies = world.bodies();
        self.of.clear();
        self.of.resize(bodies.len(), Matrix3::zeros());
        self.held.clear();
        self.held.resize(bodies.len(), None);
        for (joint, force) in world.joints().iter().zip(joints) {
            self.add(joint, force, states);
        }
        for (gear, force) in world.gears().iter().zip(gears) {
            for (joint, load) in gear.loads(*force, joints) {
                self.add(&world.joints()[joint], &load, states);
            }
        }
    }

    /// Adds what the `force` of a joint does to its bodies.
    fn add(&mut self, joint: &Joint, force: &JointForce, states: &[State]) {
        let [of_a, of_b] = joint.frames();
        let turned = |body: usize| rotation(&states[body].attitude);
        let frame = of_b.rotation();
        let along = joint.other().map_or(frame, |other| turned(other) * frame) * force.force;
        let sides = [(Some(joint.body()), of_a, along), (joint.other(), of_b, -along)];
        for (body, frame, force) in sides {
            let Some(body) = body else { continue };
            let (force, lever) = (turned(body).tr_mul(&force), frame.anchor);
            let across = force * lever.transpose();
            self.of[body] +=
                Matrix3::identity() * force.dot(&lever) - 0.5 * (across + across.transpose());
        }
        let holds = joint.linear().iter().all(|axis| *axis == Axis::Locked);
        if holds && joint.other().is_none() {
            self.held[joint.body()] = Some(of_a.anchor);
        }
    }
}
