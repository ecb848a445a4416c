//! Stability of taut joints: their vibration frequency in relation to the time step.
//!
//! A step applies forces along the directions at its start. The restoring moment of joints under
//! tension is therefore explicit, stable for h ω < 2, and no residual shows an instability. A joint
//! force f (N) at the lever arm a (m) of a body resists rotation by
//!
//! ```text
//! K = Σ (f·a) E − ½ (f aᵀ + a fᵀ),   ω² ≤ the largest eigenvalue of I⁻¹ K over all bodies,     (J12)
//! ```
//!
//! with the inertia I about the centre of mass, or about an anchor fixed in the world. A rod of
//! mass m and length L under a tension T has ω² = 12 T/(m L).

use crate::joint::{Axis, Joint, JointForce};
use crate::mechanics::quaternion::rotation;
use crate::mechanics::{RigidBody, State};
use crate::world::World;
use nalgebra::{Matrix3, Vector3};

/// Computes h ω; owns scratch memory, so that a step does not allocate.
#[derive(Debug, Clone, Default)]
pub struct Stiffness {
    /// K of each body (N m), body frame.
    of: Vec<Matrix3<f64>>,
    /// Anchor of a joint that fixes the body in the world (m), body frame.
    held: Vec<Option<Vector3<f64>>>,
    /// Upper bound of the eigenvalues of each body (1/s²).
    most: Vec<f64>,
}

/// Inertia of a body about its centre of mass, or about the point `lever`.
fn inertia(body: &RigidBody, lever: &Vector3<f64>) -> Matrix3<f64> {
    let about = Matrix3::identity() * lever.norm_squared() - lever * lever.transpose();
    body.inertia() + about * body.mass()
}

impl Stiffness {
    /// Returns h ω (J12) of a step of `world` from `states` with the forces of `joints` and
    /// `gears`; 0 without joints. Moving world frames are at the end of the step.
    #[inline]
    pub fn largest_in_step(
        &mut self,
        world: &World,
        states: &[State],
        joints: &[JointForce],
        gears: &[f64],
    ) -> f64 {
        let is_whole = states.len() == world.bodies().len();
        if world.joints().is_empty() || !is_whole {
            return 0.0;
        }
        self.largest_of_joints(world, states, joints, gears)
    }

    /// Returns h ω for each joint: the larger value of its two bodies.
    pub fn per_joint(
        &mut self,
        world: &World,
        states: &[State],
        joints: &[JointForce],
        gears: &[f64],
    ) -> Vec<f64> {
        if states.len() != world.bodies().len() {
            return vec![0.0; world.joints().len()];
        }
        self.collect(world, states, joints, gears);
        let of_body = |body: usize| {
            let lever = self.held[body].unwrap_or_default();
            let largest = self.largest_eigenvalue(body, &inertia(&world.bodies()[body], &lever));
            world.time_step() * largest.max(0.0).sqrt()
        };
        let each: Vec<_> = (0..states.len()).map(of_body).collect();
        let of_joint = |joint: &Joint| {
            let other = joint.other().map_or(0.0, |other| each[other]);
            each[joint.body()].max(other)
        };
        world.joints().iter().map(of_joint).collect()
    }

    #[inline(never)]
    fn largest_of_joints(
        &mut self,
        world: &World,
        states: &[State],
        joints: &[JointForce],
        gears: &[f64],
    ) -> f64 {
        self.collect(world, states, joints, gears);
        let bodies = world.bodies();
        // Skips bodies whose bound ‖L⁻¹ K L⁻ᵀ‖² = tr (I⁻¹ K)² is below the present maximum, or is
        // NaN.
        self.most.clear();
        self.most.extend(bodies.iter().zip(&self.of).zip(&self.held).map(|((body, k), held)| {
            let inverse = held
                .map_or(Some(*body.inertia_inverse()), |lever| inertia(body, &lever).try_inverse());
            inverse.map_or(0.0, |inverse| {
                let scaled = inverse * k;
                (scaled * scaled).trace().max(0.0).sqrt()
            })
        }));
        let mut largest = 0.0_f64;
        let first = (0..bodies.len()).max_by(|a, b| self.most[*a].total_cmp(&self.most[*b]));
        for index in first.into_iter().chain(0..bodies.len()) {
            let most = std::mem::take(&mut self.most[index]);
            if most.is_finite() && most > largest {
                let lever = self.held[index].unwrap_or_default();
                largest =
                    largest.max(self.largest_eigenvalue(index, &inertia(&bodies[index], &lever)));
            }
        }
        world.time_step() * largest.sqrt()
    }

    /// Computes K of every body, and the anchors fixed in the world.
    fn collect(&mut self, world: &World, states: &[State], joints: &[JointForce], gears: &[f64]) {
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

    /// Largest eigenvalue of I⁻¹ K of a body (1/s²), computed from L⁻¹ K L⁻ᵀ with I = L Lᵀ. 0 if it
    /// is not finite.
    fn largest_eigenvalue(&self, index: usize, inertia: &Matrix3<f64>) -> f64 {
        let root = inertia.cholesky().and_then(|of| of.l().try_inverse());
        let scaled = root.map(|root| root * self.of[index] * root.transpose());
        let scaled = scaled.filter(|scaled| scaled.norm().is_finite());
        scaled.map_or(0.0, |scaled| scaled.symmetric_eigenvalues().max())
    }

    /// Adds the contribution of a joint `force` to its bodies.
    fn add(&mut self, joint: &Joint, force: &JointForce, states: &[State]) {
        let [of_a, of_b] = joint.frames();
        let turned = |body: usize| rotation(&states[body].attitude);
        let mut add = |body: usize, force: Vector3<f64>, lever: &Vector3<f64>| {
            let across = force * lever.transpose();
            self.of[body] +=
                Matrix3::identity() * force.dot(lever) - 0.5 * (across + across.transpose());
        };
        // Converts the force from the frame of B to the world frame and to the frame of A.
        let of_other = of_b.rotation() * force.force;
        let along = joint.other().map_or(of_other, |other| turned(other) * of_other);
        add(joint.body(), turned(joint.body()).tr_mul(&along), &of_a.anchor);
        if let Some(other) = joint.other() {
            add(other, -of_other, &of_b.anchor);
        }
        let holds = joint.linear().iter().all(|axis| *axis == Axis::Locked);
        if holds && joint.other().is_none() {
            self.held[joint.body()] = Some(of_a.anchor);
        }
    }
}
