//! Steps that obey every law and are no physics all the same: the time step is too long for them.
//!
//! A step turns a body about one axis by 2 atan(½ h|ω⁺|). The laws of contact speak of the mean
//! motion of a point over the step, its impulse does work on the motion at the end; the two differ
//! with the turn, and the energy of a solved step may grow by up to
//!
//! ```text
//! Σ |p| |ω⁺ × c| θ/√(1 + θ²),   θ = ½ h|ω⁺|                               (eq. 28)
//! ```
//!
//! over all contacts. That vanishes with h, but at turns of a radian it is what the body has, and no
//! residual can see it. So such steps are marked
//! ([`StepStatus::Wild`](crate::step::StepStatus::Wild)).
//!
//! Energy is counted by islands, the bodies that press on each other, directly or through others:
//! what flies by elsewhere excuses nothing. With the kinetic energy T, the forces f (with gravity)
//! and torques τ from outside, what an island makes is
//!
//! ```text
//! Σ T⁺ − T − f·(r⁺ − r) − h τ·ω⁺            without a contact that bounces,
//! Σ T⁺ − T − h f·(v + v⁺)/2 − h τ·(ω + ω⁺)/2     with one                (eq. 32)
//! ```
//!
//! The scheme moves with the new velocities. On what rests or slides their work is that of the
//! first line, of which (28) speaks. What bounces moves with two velocities in a step; the second line is the
//! change of the energy with the velocities of the middle, ½m|v + ½h f/m|² (eq. 30), less the
//! work on the way, and its part of the motion along is the work of the impulses (eq. 31), to rounding. An elastic
//! bounce makes none of it; of the first line it would make 2 g h/|v| of what it has. What joints tie is
//! counted so too: their reactions do no work on the mean of both velocities but of higher order, and what
//! their drives do on it is allowed, as is the work −h f·s of surfaces that carry with s
//! ([`Contact::carried`](crate::contact::Contact::carried)).
//!
//! Marked are also steps in which something was passed or left out: where pieces go through each other
//! all the same, overlap deep with no feature left to meet with, or turn by more than a radian in reach of
//! each other ([`Candidates::passes`](crate::contact::Candidates::passes)) or of the ground
//! ([`is_lost`]); of most of a turn there is no telling which way it went.

use super::energy;
use super::islands::Islands;
use crate::contact::certificate::Claim;
use crate::joint::JointMotion;
use crate::mechanics::{RigidBody, State, Wrench};
use crate::world::World;
use nalgebra::Vector3;

/// A step that turns a body by more than this is wild, rad.
pub use crate::mechanics::way::LARGEST_TURN;

/// An island that makes more energy than this part of its kinetic energy and the work on it is wild.
pub const LARGEST_GAIN: f64 = 1e-3;

/// A part of the same that rounding may make.
const ROUNDING: f64 = 1e-9;

/// A motion slower than this, m/s in the world's [scale](World::speed_scale), has no energy to speak
/// of.
const REST: f64 = 1e-4;

/// Tells whether steps are wild. Owns memory that steps use again.
#[derive(Debug, Clone, Default)]
pub struct EnergyJudge {
    islands: Islands,
    /// Of the island that begins with the body.
    budgets: Vec<Budget>,
}

/// What an island made of energy in a step, and of what; J.
#[derive(Debug, Clone, Copy, Default)]
struct Budget {
    /// Whether a contact presses in it. What nothing presses is in free flight.
    touches: bool,
    /// Whether one of those bounces, or joints tie it.
    bounces: bool,
    gained: f64,
    /// The work of the surfaces of contacts whose A is the body, until the islands are known.
    carried: f64,
    /// How deep contacts were at the step's start, m: the largest whose A is the body, until the islands are known;
    /// their sum.
    under: f64,
    /// Its kinetic energy and the work of all that acts on it from outside or drives its joints.
    size: f64,
    /// What the smallest motion that counts has.
    rest: f64,
}

impl EnergyJudge {
    /// A judge without memory yet.
    #[must_use]
    pub fn new() -> Self {
        Self::default()
    }

    /// Whether the step of `world` that `claim` tells, with the contact forces `forces` (N, world, one
    /// a contact), turns a body too far or makes energy in an island. Its solver may
    /// leave a residual of `accepted` (m/s): a point that an earlier step has left h times that deep,
    /// or that a start has deeper, may be lifted out again, against the weight, and that is no energy made. What is no step of
    /// the world, with a state of every body at both ends and contacts of those alone, is wild.
    #[must_use]
    pub fn is_wild(
        &mut self,
        world: &World,
        claim: &Claim<'_>,
        forces: impl IntoIterator<Item = Vector3<f64>>,
        accepted: f64,
    ) -> bool {
        if !claim.is_of(world) {
            return true;
        }
        let joints = world.joints().iter().zip(claim.joints);
        let ends = (claim.states, claim.next);
        let seen =
            joints.map(|(joint, force)| joint.seen(ends.0, ends.1, force, world.time_step()));
        let seen: Vec<JointMotion> = seen.flatten().collect();
        self.is_wild_step(world, claim, &seen, forces, accepted)
    }

    /// Whether the island of each body makes energy, however little beside its own.
    pub(super) fn makers(
        &mut self,
        world: &World,
        claim: &Claim<'_>,
        seen: &[JointMotion],
        forces: impl IntoIterator<Item = Vector3<f64>>,
    ) -> Vec<bool> {
        self.count(world, claim, seen, forces, 0.0);
        let makes = |body: usize| {
            let of = &self.budgets[self.islands.of(body)];
            // A NaN is no small gain.
            let is_small = of.gained <= ROUNDING * of.size;
            !is_small
        };
        (0..claim.states.len()).map(makes).collect()
    }

    /// The same of a claim that is known to be of a step of the world, in which its joints are `seen`.
    pub(super) fn is_wild_step(
        &mut self,
        world: &World,
        claim: &Claim<'_>,
        seen: &[JointMotion],
        forces: impl IntoIterator<Item = Vector3<f64>>,
        accepted: f64,
    ) -> bool {
        let h = world.time_step();
        if claim.next.iter().any(|next| h * next.spin.norm() > LARGEST_TURN) {
            return true;
        }
        self.count(world, claim, seen, forces, accepted);
        let makes_energy = |of: &Budget| of.touches && of.gained > LARGEST_GAIN * of.size + of.rest;
        self.budgets.iter().any(makes_energy)
    }

    /// Counts what each island makes.
    fn count(
        &mut self,
        world: &World,
        claim: &Claim<'_>,
        seen: &[JointMotion],
        forces: impl IntoIterator<Item = Vector3<f64>>,
        accepted: f64,
    ) {
        let h = world.time_step();
        self.join(world, claim, forces);
        // What joins islands is known from here on; what surfaces did in them was counted by bodies.
        if world.has_surfaces() {
            for index in 0..self.budgets.len() {
                let carried = std::mem::take(&mut self.budgets[index].carried);
                self.budgets[self.islands.of(index)].gained -= carried;
            }
        }
        let (weight, slow) = (world.gravity().norm(), REST * world.speed_scale());
        for (index, body) in world.bodies().iter().enumerate() {
            let budget = &mut self.budgets[self.islands.of(index)];
            let (state, next) = (&claim.states[index], &claim.next[index]);
            let work = if budget.bounces { work_of_bounce } else { work };
            let [before, after] = [state, next].map(|state| kinetic_energy(world, body, state));
            let work = work(world, body, state, next, &claim.wrenches[index]);
            budget.gained += after - before - work;
            budget.size += before.max(after) + work.abs();
            let lift = weight * (h * accepted + budget.under);
            budget.rest += body.mass() * (0.5 * slow * slow + lift);
        }
        for ((joint, force), seen) in world.joints().iter().zip(claim.joints).zip(seen) {
            let work = seen.work(joint, claim.states, claim.next, force, h).unwrap_or(f64::NAN);
            let budget = &mut self.budgets[self.islands.of(joint.body())];
            budget.gained -= work;
            budget.size += work.abs();
        }
        for (gear, force) in world.gears().iter().zip(claim.gears) {
            let body = world.joints()[gear.axes()[0].joint].body();
            let work = gear.work(world, claim.states, claim.next, claim.joints, *force);
            let budget = &mut self.budgets[self.islands.of(body)];
            budget.gained -= work;
            budget.size += work.abs();
        }
    }

    /// Finds the islands, and whether they bounce.
    fn join(
        &mut self,
        world: &World,
        claim: &Claim<'_>,
        forces: impl IntoIterator<Item = Vector3<f64>>,
    ) {
        let pressing = |force: &Vector3<f64>| *force != Vector3::zeros();
        let bodies = claim.states.len();
        self.budgets.clear();
        self.budgets.resize(bodies, Budget::default());
        // Marks the contacts' bodies, until the islands are known.
        let h = world.time_step();
        let contacts = claim.contacts.iter().zip(forces).filter(|(_, force)| pressing(force));
        let budgets = &mut self.budgets;
        let keys = contacts.map(|(contact, force)| {
            let budget = &mut budgets[contact.key.body];
            budget.touches = true;
            budget.bounces |= contact.bounces();
            budget.under = budget.under.max(-contact.gap);
            if world.has_surfaces() {
                budget.carried -= h * force.dot(&contact.carried(world, claim.states));
            }
            &contact.key
        });
        self.islands.find(bodies, keys, world);
        for joint in world.joints() {
            let budget = &mut self.budgets[joint.body()];
            (budget.touches, budget.bounces) = (true, true);
        }
        for body in 0..bodies {
            let Budget { touches, bounces, .. } = self.budgets[body];
            let under = std::mem::take(&mut self.budgets[body].under);
            let budget = &mut self.budgets[self.islands.of(body)];
            budget.touches |= touches;
            budget.bounces |= bounces;
            budget.under += under;
        }
    }
}

/// Whether a body of `world` turns by more than [`LARGEST_TURN`] so near the ground that a point of it may have
/// been in it on the way: the lowest that a turning point can come is the reach of the body below the lower
/// end of its way.
#[must_use]
#[inline]
pub fn is_lost(world: &World, states: &[State], next: &[State]) -> bool {
    let Some(ground) = world.ground() else { return false };
    let h = world.time_step();
    let height = |state: &State| ground.normal().dot(&state.position) - ground.offset();
    let bodies = world.bodies().iter().zip(states).zip(next);
    bodies.into_iter().any(|((body, state), next)| {
        let turns_far = h * next.spin.norm() > LARGEST_TURN;
        let reach = || {
            let points = body.contact_points().iter();
            points.map(|point| point.position.norm() + point.radius).fold(0.0, f64::max)
        };
        turns_far && height(state).min(height(next)) < reach()
    })
}

/// The work of gravity and `wrench` on a body in a step that does not bounce (eq. 32), J.
fn work(world: &World, body: &RigidBody, state: &State, next: &State, wrench: &Wrench) -> f64 {
    let force = wrench.force + world.gravity() * body.mass();
    let moved = next.position - state.position;
    force.dot(&moved) + world.time_step() * wrench.torque.dot(&next.spin)
}

/// The same in a step that bounces.
fn work_of_bounce(
    world: &World,
    body: &RigidBody,
    state: &State,
    next: &State,
    wrench: &Wrench,
) -> f64 {
    let force = wrench.force + world.gravity() * body.mass();
    let power =
        force.dot(&(state.velocity + next.velocity)) + wrench.torque.dot(&(state.spin + next.spin));
    0.5 * world.time_step() * power
}

/// ½ m v² and the energy of the [turning](energy::turning), J.
fn kinetic_energy(world: &World, body: &RigidBody, state: &State) -> f64 {
    let along = 0.5 * body.mass() * state.velocity.norm_squared();
    along + energy::turning(world, body, &state.spin)
}
