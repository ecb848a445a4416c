//! Restitution: how fast a contact leaves that arrives in a step.
//!
//! Newton's law, in Moreau's form: the speed at which the touching points part after the step is
//! at least e times the speed u_n⁻ at which they came, φ̇⁺ ≥ −e u_n⁻. A step moves with its new
//! velocities, φ⁺ = φ + h φ̇⁺, so that the law asks for a height above the plane, the contact's
//! **rise** ζ:
//!
//! ```text
//! 0 ≤ p_n ⊥ (φ⁺ − ζ)/h ≥ 0,   ζ = max(φ, 0) + h e |u_n⁻|                   (eq. 29)
//! ```
//!
//! where the contact arrives: it is open or touches at k, comes faster than a threshold, and free
//! flight would close it. Everywhere else ζ = 0, the law without restitution. A contact is left
//! from the height φ that it has at k, up to h |u_n⁻| above the plane, so that a frictionless ball
//! with e = 1 keeps its energy for ever (eq. 30 of `docs/formulation.md`), and bounces are right
//! to first order in h.
//!
//! With friction, Newton's law can make energy (Kane's paradox): each contact's speeds are
//! prescribed one by one, whatever the others do. What the impulses of a step do to the kinetic
//! energy is their work on the mean of the velocities before and after,
//!
//! ```text
//! W = Σ p·(u⁻ + u⁺)/2                                                     (eq. 31)
//! ```
//!
//! which [`Contact::impact_work`] adds up; the [simulation](crate::simulation) takes a part of e,
//! the largest at which W ≤ 0, where it would be positive.

use super::{Contact, Partner};
use crate::mechanics::{Pose, State};
use crate::world::World;
use nalgebra::Vector3;

impl Contact {
    /// How the touching points of A and B move apart where the bodies have the velocities of
    /// `moving`, m/s, world; arms and frames are those at the start of the step, `states`. NaN
    /// where a list has no state of one of the bodies.
    #[must_use]
    pub fn parting_velocity(&self, states: &[State], moving: &[State]) -> Vector3<f64> {
        let unknown = Vector3::repeat(f64::NAN);
        let Some(a) = moving.get(self.key.body) else { return unknown };
        let velocity = a.velocity + self.torque_map.tr_mul(&a.spin);
        let Partner::Body(other) = self.key.partner else {
            return velocity;
        };
        let (Some(b), Some(at_a), Some(at_b)) =
            (moving.get(other), states.get(self.key.body), states.get(other))
        else {
            return unknown;
        };
        let arm = at_a.position + self.arm - at_b.position;
        let turning = at_b.pose().rotation * b.spin;
        velocity - b.velocity - turning.cross(&arm)
    }

    /// The work of an impulse `force` × h of the contact on the mean of the velocities before
    /// and after the step `states` → `next` (eq. 31), J. NaN where a list has no state of one of
    /// the bodies.
    #[must_use]
    pub fn impact_work(
        &self,
        force: &Vector3<f64>,
        h: f64,
        states: &[State],
        next: &[State],
    ) -> f64 {
        let (before, after) =
            (self.parting_velocity(states, states), self.parting_velocity(states, next));
        0.5 * h * force.dot(&(before + after))
    }

    /// ζ (eq. 29), m, where free flight would take the bodies from `states` to `free` and the
    /// part `share` of the restitution is taken. 0 where a list has no state of one of the bodies.
    #[must_use]
    pub fn rise_of(&self, world: &World, states: &[State], free: &[State], share: f64) -> f64 {
        let restitution = self.law.restitution;
        if restitution == 0.0 {
            return 0.0;
        }
        let coming = -self.normal().dot(&self.parting_velocity(states, states));
        let stays_open = || self.free_gap(free).is_none_or(|gap| gap > 0.0);
        if coming.is_nan() || coming <= world.rebound_speed() || stays_open() {
            return 0.0;
        }
        self.gap.max(0.0) + world.time_step() * share * restitution * coming
    }

    /// φ after free flight to `free`, m, which is known if the bodies have states there.
    fn free_gap(&self, free: &[State]) -> Option<f64> {
        let pose = |index: usize| free.get(index).map(State::pose);
        let a = pose(self.key.body)?;
        Some(match self.key.partner {
            Partner::Body(other) => self.gap_at(&a, Some(&pose(other)?)),
            Partner::Ground | Partner::Fixed(_) => self.gap_at(&a, None::<&Pose>),
        })
    }
}

/// Sets the rise of the `contacts` of a step of `world` from `states` whose free flight ends in
/// `free`. `shares` are the parts of the restitution that each body takes, all of it where there
/// is none for a body; a contact takes the smaller one of its two. A contact does not bounce
/// whose bodies have no states in `states` and `free`.
pub fn raise(
    world: &World,
    states: &[State],
    free: &[State],
    shares: &[f64],
    contacts: &mut [Contact],
) {
    for contact in contacts {
        let shares = contact.key.bodies().filter_map(|body| shares.get(body).copied());
        let share = shares.fold(1.0, f64::min);
        contact.rise = contact.rise_of(world, states, free, share);
    }
}

/// What the search for contacts remembers of a step, to raise those that it finds later.
#[derive(Debug, Clone, Default)]
pub(super) struct Rebound {
    /// X at step k+1 in free flight; empty in a world without restitution.
    free: Vec<State>,
    /// Those that were set, of the first bodies; the others take all.
    shares: Vec<f64>,
}

impl Rebound {
    pub(super) fn begin(&mut self, world: &World, free: &[State]) {
        self.free.clear();
        self.shares.clear();
        if world.has_restitution() {
            self.free.extend_from_slice(free);
        }
    }

    pub(super) fn set_shares(&mut self, shares: &[f64]) {
        if !self.free.is_empty() {
            self.shares.clear();
            self.shares.extend_from_slice(shares);
        }
    }

    pub(super) fn raise(&self, world: &World, states: &[State], contacts: &mut [Contact]) {
        if !self.free.is_empty() {
            raise(world, states, &self.free, &self.shares, contacts);
        }
    }
}
