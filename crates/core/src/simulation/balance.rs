//! Energy balance of a step.
//!
//! A step changes the energy E = T + V (eq. 35) by the work of all forces and by a discretisation
//! term. Work is computed with the means of the velocities before and after the impulses:
//!
//! ```text
//! E⁺ − E = Σ h (f·v̄ + τ·ω̄) + D,   v̄ = ½ (v + v⁺),   ω̄ = ½ I⁻¹ (P⁻(ω) + P⁺(ω⁺))          (eq. 36)
//! ```
//!
//! The sum runs over loads, drives, joint reactions, and normal and tangential contact forces.
//! Gravity is part of E. D is the change of the rotational energy when the momentum is rotated,
//!
//! ```text
//! D = ½ P⁻(ω⁺)·I⁻¹ P⁻(ω⁺) − ½ P⁺(ω⁺)·I⁻¹ P⁺(ω⁺),
//! ```
//!
//! and for the tutorial's integrator −½ h m g·(v⁺ − v) − ½ h ω·(ω⁺ × I ω⁺). Every term is computed
//! independently. The balance closes to rounding if the residual is at rounding level.

use crate::contact::certificate::Claim;
use crate::contact::{Contact, ContactLoad, Partner};
use crate::joint::{Axis, JointForce};
use crate::kinematics::StepMap;
use crate::mechanics::{RigidBody, Rotation, State, Wrench};
use crate::world::World;
use nalgebra::Vector3;

/// Terms of the energy balance (eq. 36) (J).
#[derive(Debug, Clone, Copy, PartialEq, Default)]
#[non_exhaustive]
pub struct EnergyBalance {
    /// Work of external forces and torques, without gravity.
    pub loads: f64,
    /// Work of joint motors, springs, dampers, friction and limits, of gear drives, and of moving
    /// world frames.
    pub drives: f64,
    /// Work of joint and gear constraint forces.
    pub reactions: f64,
    /// Work of normal contact forces; negative in an inelastic impact.
    pub impacts: f64,
    /// Work of tangential contact forces and of moments; negative unless a moving surface drives a body.
    pub friction: f64,
    /// Discretisation term D.
    pub discretisation: f64,
}

impl EnergyBalance {
    /// Balance of an invalid step.
    const UNKNOWN: Self = Self {
        loads: f64::NAN,
        drives: f64::NAN,
        reactions: f64::NAN,
        impacts: f64::NAN,
        friction: f64::NAN,
        discretisation: f64::NAN,
    };

    /// Energy balance of the step of `world` described by `claim`. `loads` has the force (N, world), or
    /// force and moment, of each contact. Every term is NaN if `claim` does not fit `world`.
    pub fn new(
        world: &World,
        claim: &Claim<'_>,
        loads: impl IntoIterator<Item: Into<ContactLoad>>,
    ) -> Self {
        if claim.is_of(world) {
            Self::with(world, claim, loads, &Means::new(world, claim))
        } else {
            Self::UNKNOWN
        }
    }

    /// Works of the same forces from instant to instant. An impulse acts over κ lengths of the interval, and the
    /// body moves with w⁺ in all of it:
    ///
    /// ```text
    /// E(V⁺) − E(V) = Σ h/κ (f·v⁺ + τ·ω⁺) + O(h³)                                               (eq. 36a)
    /// ```
    ///
    /// A body with an `abrupt` change, and each one if they are not known, starts with V and ends with w⁺. Its works are
    /// those of (36).
    pub(super) fn between_instants(
        world: &World,
        claim: &Claim<'_>,
        loads: impl IntoIterator<Item: Into<ContactLoad>>,
        abrupt: &[bool],
    ) -> Self {
        Self::with(world, claim, loads, &Means::between_instants(world, claim, abrupt))
    }

    fn with(
        world: &World,
        claim: &Claim<'_>,
        loads: impl IntoIterator<Item: Into<ContactLoad>>,
        means: &Means<'_>,
    ) -> Self {
        let mut balance = Self::default();
        for (body, wrench) in claim.wrenches.iter().enumerate() {
            let missing = world.missing_kick(body, &claim.states[body]);
            let of_missing = means.work(body, &missing);
            balance.loads += means.work(body, wrench) - of_missing;
            balance.discretisation += of_missing;
        }
        for (contact, load) in claim.contacts.iter().zip(loads) {
            let ContactLoad { force, moment } = load.into();
            let along = contact.normal() * contact.normal().dot(&force);
            balance.impacts += means.work_of_contact(contact, &along);
            balance.friction += means.work_of_contact(contact, &(force - along));
            if moment != Vector3::zeros() {
                balance.friction += means.work_of_moment(contact, &moment);
            }
        }
        for (joint, force) in world.joints().iter().zip(claim.joints) {
            let held = |axes: &[Axis; 3], force: &Vector3<f64>| {
                Vector3::from_fn(
                    |k, _| if matches!(axes[k], Axis::Locked) { force[k] } else { 0.0 },
                )
            };
            let reaction = JointForce {
                force: held(joint.linear(), &force.force),
                torque: held(joint.angular(), &force.torque),
                ..*force
            };
            let drive = JointForce {
                force: force.force - reaction.force,
                torque: force.torque - reaction.torque,
                ..*force
            };
            let map = means.map;
            let work =
                |of| means.work_of_all(|loads| joint.add_loads(claim.states, of, &map, loads));
            balance.drives += work(&drive);
            let kind = if joint.moves() { &mut balance.drives } else { &mut balance.reactions };
            *kind += work(&reaction);
        }
        for (gear, force) in world.gears().iter().zip(claim.gears) {
            let mut work = 0.0;
            for (index, load) in gear.loads(*force, claim.joints) {
                let joint = &world.joints()[index];
                work += means
                    .work_of_all(|loads| joint.add_loads(claim.states, &load, &means.map, loads));
            }
            let kind = match gear.drive() {
                None => &mut balance.reactions,
                Some(_) => &mut balance.drives,
            };
            *kind += work;
        }
        let bodies = world.bodies().iter().zip(claim.states.iter().zip(claim.next));
        for (index, (body, ends)) in bodies.enumerate() {
            if !world.is_held(index) {
                balance.discretisation += discretisation(world, body, ends.0, ends.1);
            }
        }
        balance
    }

    /// The terms in the order of the columns of steps.csv.
    pub fn terms(&self) -> [f64; 6] {
        let Self { loads, drives, reactions, impacts, friction, discretisation } = *self;
        [loads, drives, reactions, impacts, friction, discretisation]
    }
}

/// Mean velocities of a step.
struct Means<'a> {
    claim: &'a Claim<'a>,
    map: StepMap,
    /// Means v̄ (world frame) and ω̄ (body frame); zero for held bodies.
    velocities: Vec<(Vector3<f64>, Vector3<f64>)>,
}

impl<'a> Means<'a> {
    fn new(world: &World, claim: &'a Claim<'a>) -> Self {
        let map = world.step_map();
        let h = map.time_step;
        let mean = |(index, body): (usize, &RigidBody)| {
            if world.is_held(index) {
                return (Vector3::zeros(), Vector3::zeros());
            }
            let (state, next) = (&claim.states[index], &claim.next[index]);
            let form = world.rotation();
            let (inertia, inverse) = (body.inertia(), body.inertia_inverse());
            let before = form.arriving_spin(inertia, inverse, &state.spin, h);
            let after = form.departing_spin(inertia, inverse, &next.spin, h);
            (0.5 * (state.velocity + next.velocity), 0.5 * (before + after))
        };
        Self { claim, map, velocities: world.bodies().iter().enumerate().map(mean).collect() }
    }

    /// Means for bodies with an `abrupt` change, and w⁺ and ω⁺ over κ for the others.
    fn between_instants(world: &World, claim: &'a Claim<'a>, abrupt: &[bool]) -> Self {
        let mut means = Self::new(world, claim);
        let bodies = claim.next.iter().zip(abrupt).zip(&mut means.velocities).enumerate();
        for (index, ((next, _), mean)) in bodies.filter(|(_, ((_, is_abrupt), _))| !**is_abrupt) {
            let share = if world.is_held(index) { 0.0 } else { 1.0 / world.kick(index) };
            *mean = (share * next.velocity, share * next.spin);
        }
        means
    }

    fn work(&self, body: usize, wrench: &Wrench) -> f64 {
        let (velocity, spin) = &self.velocities[body];
        self.map.time_step * (wrench.force.dot(velocity) + wrench.torque.dot(spin))
    }

    /// Work of a contact force on A and of its reaction on B.
    fn work_of_contact(&self, contact: &Contact, force: &Vector3<f64>) -> f64 {
        let a = contact.key.body;
        let on_a = self.work(a, &Wrench { force: *force, torque: contact.torque_map * force });
        let Partner::Body(b) = contact.key.partner else { return on_a };
        let [of_a, of_b] = [a, b].map(|body| &self.claim.states[body]);
        let arm = of_a.position + contact.arm - of_b.position;
        let torque = of_b.pose().rotation.tr_mul(&arm.cross(force));
        on_a - self.work(b, &Wrench { force: *force, torque })
    }

    /// Work of the moment of a contact on A and of its opposite on B.
    fn work_of_moment(&self, contact: &Contact, moment: &Vector3<f64>) -> f64 {
        let work = |body: usize| {
            let torque = self.claim.states[body].pose().rotation.tr_mul(moment);
            self.work(body, &Wrench { force: Vector3::zeros(), torque })
        };
        work(contact.key.body) - contact.key.partner.body().map_or(0.0, work)
    }

    /// Work of the wrenches that `add` adds to the bodies.
    fn work_of_all(&self, add: impl FnOnce(&mut [Wrench])) -> f64 {
        let mut loads = vec![Wrench::zero(); self.velocities.len()];
        add(&mut loads);
        loads.iter().enumerate().map(|(body, load)| self.work(body, load)).sum()
    }
}

/// Discretisation term D of a body.
fn discretisation(world: &World, body: &RigidBody, state: &State, next: &State) -> f64 {
    let (h, inertia) = (world.time_step(), body.inertia());
    let form = world.rotation();
    match form {
        Rotation::Tutorial => {
            let falling = world.gravity().dot(&(next.velocity - state.velocity));
            let turning = state.spin.dot(&next.spin.cross(&(inertia * next.spin)));
            -0.5 * h * (body.mass() * falling + turning)
        }
        Rotation::Momentum => {
            let inverse = body.inertia_inverse();
            let arriving = form.arriving_spin(inertia, inverse, &next.spin, h);
            let departing = form.departing_spin(inertia, inverse, &next.spin, h);
            // Difference of squares as a product, which avoids cancellation.
            0.5 * (arriving - departing).dot(&(inertia * (arriving + departing)))
        }
    }
}
