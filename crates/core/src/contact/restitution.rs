//! Restitution: how fast a contact leaves that arrives in a step.
//!
//! Newton's law: the speed ċ⁺ at which the touching points part after an impact is at least e times
//! the speed c_n⁻ = −ċ⁻ at which they came. Both are taken where the impulse acts, at the levers of the
//! step's start, and with the velocities just before and just after it,
//!
//! ```text
//! ċ = n·(v_A + A_A ω̃_A × y_A − v_B − A_B ω̃_B × y_B)
//! ```
//!
//! ω̃ being I⁻¹ P⁻(ω) before and I⁻¹ P⁺(ω⁺) after ([`Rotation`](crate::mechanics::Rotation)). A contact
//! that arrives, open or touching at k, faster than a threshold, and which free flight would close,
//! then has beside the gap's row that of its **rebound** e c_n⁻,
//!
//! ```text
//! 0 ≤ p_n ⊥ min(φ⁺/h, ċ⁺ − e c_n⁻) ≥ 0                                    (eq. 29)
//! ```
//!
//! So does one that another's impulse closes, pressing in a step in which its island bounces, whatever c_n⁻
//! it has: one that was parting may then come as fast as it was. Everywhere else the law is that without restitution. What the impulses of a step do to the energy
//! at the time k is their work on the mean of the velocities before and after,
//!
//! ```text
//! W = Σ p·(u⁻ + u⁺)/2,                                                    (eq. 31)
//! ```
//!
//! exactly in the momentum form of the rotation, so that bodies with e = 1 and without friction keep
//! theirs, however they turn (eq. 30, 35 of `docs/formulation.md`): ċ⁺ = −ċ⁻. A bounce begins at the
//! height that the contact has at k; times and heights are right to first order in h.
//!
//! With friction, Newton's law can make energy (Kane's paradox): each contact's speeds are
//! prescribed one by one, whatever the others do. [`Contact::impact_work`] adds W up; the
//! simulation takes a part of e, the largest at which W ≤ 0, where it would be
//! positive.

use super::{Contact, Partner, Response};
use crate::mechanics::{RigidBody, State};
use crate::world::World;
use nalgebra::Vector3;

impl Contact {
    /// How the touching points of A and B move apart just before the impulses of a step from `states`,
    /// m/s, world. NaN where the list has no state of one of the bodies.
    #[must_use]
    pub fn arriving_velocity(&self, world: &World, states: &[State]) -> Vector3<f64> {
        let h = world.time_step();
        self.parting_velocity(world, states, states, |body, spin| {
            world.rotation().arriving_spin(body.inertia(), body.inertia_inverse(), spin, h)
        })
    }

    /// The same just after the impulses of the step `states` → `next`; arms and frames are those at its
    /// start.
    #[must_use]
    pub fn departing_velocity(
        &self,
        world: &World,
        states: &[State],
        next: &[State],
    ) -> Vector3<f64> {
        let h = world.time_step();
        self.parting_velocity(world, states, next, |body, spin| {
            world.rotation().departing_spin(body.inertia(), body.inertia_inverse(), spin, h)
        })
    }

    /// v_A + A_A ω̃_A × y_A − v_B − A_B ω̃_B × y_B, with the velocities of `moving` and ω̃ by `spin`.
    fn parting_velocity(
        &self,
        world: &World,
        states: &[State],
        moving: &[State],
        spin: impl Fn(&RigidBody, &Vector3<f64>) -> Vector3<f64>,
    ) -> Vector3<f64> {
        let unknown = Vector3::repeat(f64::NAN);
        let bodies = world.bodies();
        let (Some(body), Some(a)) = (bodies.get(self.key.body), moving.get(self.key.body)) else {
            return unknown;
        };
        let velocity = a.velocity + self.torque_map.tr_mul(&spin(body, &a.spin));
        let Partner::Body(other) = self.key.partner else {
            return velocity;
        };
        let (Some(body), Some(b), Some(at_a), Some(at_b)) =
            (bodies.get(other), moving.get(other), states.get(self.key.body), states.get(other))
        else {
            return unknown;
        };
        let arm = at_a.position + self.arm - at_b.position;
        let turning = at_b.pose().rotation * spin(body, &b.spin);
        velocity - b.velocity - turning.cross(&arm)
    }

    /// The work of an impulse `force` × h of the contact on the mean of the velocities before
    /// and after the step `states` → `next` of `world` (eq. 31), J. NaN where a list has no state of one
    /// of the bodies.
    #[must_use]
    pub fn impact_work(
        &self,
        world: &World,
        force: &Vector3<f64>,
        states: &[State],
        next: &[State],
    ) -> f64 {
        let (before, after) =
            (self.arriving_velocity(world, states), self.departing_velocity(world, states, next));
        0.5 * world.time_step() * force.dot(&(before + after))
    }

    /// e c_n⁻ (eq. 29), m/s, where free flight would take the bodies from `states` to `free` and the
    /// part `share` of the restitution is taken; 0 where the contact does not bounce, and where a list
    /// has no state of one of the bodies.
    #[must_use]
    pub fn rebound_of(&self, world: &World, states: &[State], free: &[State], share: f64) -> f64 {
        let restitution = self.law.restitution;
        if restitution == 0.0 {
            return 0.0;
        }
        let coming = -self.normal().dot(&self.arriving_velocity(world, states));
        let arrives =
            || coming > world.rebound_speed() && self.free_gap(free).is_some_and(|gap| gap <= 0.0);
        // A NaN bounces nowhere.
        let bounces = coming.is_finite() && (self.struck || arrives());
        if bounces { share * restitution * coming } else { 0.0 }
    }

    /// Whether the contact bounces in the step: whether it has the row of a rebound.
    #[must_use]
    #[inline]
    pub fn bounces(&self) -> bool {
        self.rebound != 0.0
    }

    /// How far the step is from where the contact begins or ceases to bounce, m/s: how fast it arrives above the speed from which on it bounces, and
    /// how far open or closed free flight to `free` leaves it, over h. Infinite of what has no restitution, or is struck.
    pub(crate) fn bounce_margin(&self, world: &World, states: &[State], free: &[State]) -> f64 {
        if self.struck || self.law.restitution == 0.0 {
            return f64::INFINITY;
        }
        let coming = -self.normal().dot(&self.arriving_velocity(world, states));
        let faster = coming - world.rebound_speed();
        let closer = self.free_gap(free).map_or(f64::INFINITY, |gap| -gap / world.time_step());
        // Both have to be positive: what is not has to become so, or else the first that would not be any more counts.
        match faster.min(closer) {
            least if least > 0.0 => least,
            _ => (-faster).max(-closer).max(0.0),
        }
    }

    /// Whether the contact, if it presses in a step in which its island bounces, is
    /// [struck](Contact::struck): it has restitution, and no rebound so far.
    #[must_use]
    pub fn may_be_struck(&self) -> bool {
        !self.struck && !self.bounces() && self.law.restitution > 0.0
    }

    /// Whether the contact is no farther open than its points could move in the step `states` → `next` of
    /// `world`, at the speeds before and after and at `pushed` (m/s), what the impulses on its bodies make of them: what one of
    /// them may have closed within it, before others held that back.
    #[must_use]
    pub fn could_close(
        &self,
        world: &World,
        states: &[State],
        next: &[State],
        pushed: f64,
    ) -> bool {
        let before = self.arriving_velocity(world, states).norm();
        let after = self.departing_velocity(world, states, next).norm();
        self.gap <= world.time_step() * (before + after + pushed)
    }

    /// How fast the impulse of `force` (N) alone moves the points of the contact apart or along each other, m/s, at most: h |f|/m
    /// times both of its [responses](Contact::response).
    #[must_use]
    pub fn pushed_by(&self, world: &World, force: &Vector3<f64>) -> f64 {
        let mass = world.bodies().get(self.key.body).map_or(f64::NAN, RigidBody::mass);
        let Response { normal, tangential } = self.response;
        world.time_step() * force.norm() / mass * (normal + tangential)
    }

    /// The motion that the law of the contact speaks of, m/s, world, where `u` is its
    /// [motion](Contact::motion) over the step `states` → `next` of `world`: with what surfaces
    /// [carry](Contact::carried), and along the normal the smaller
    /// one of the gap speed and what is left of the rebound (eq. 29).
    #[must_use]
    #[inline]
    pub fn law_motion(
        &self,
        u: Vector3<f64>,
        world: &World,
        states: &[State],
        next: &[State],
    ) -> Vector3<f64> {
        match self.bounces() || world.has_surfaces() {
            true => self.changed_motion(u, world, states, next),
            false => u,
        }
    }

    /// The same of a contact that bounces or where surfaces move.
    fn changed_motion(
        &self,
        u: Vector3<f64>,
        world: &World,
        states: &[State],
        next: &[State],
    ) -> Vector3<f64> {
        let u = if world.has_surfaces() { u + self.carried(world, states) } else { u };
        if self.bounces() { self.bounded_motion(u, world, states, next) } else { u }
    }

    /// The same of a contact that bounces.
    fn bounded_motion(
        &self,
        u: Vector3<f64>,
        world: &World,
        states: &[State],
        next: &[State],
    ) -> Vector3<f64> {
        let normal = self.normal();
        let left = normal.dot(&self.departing_velocity(world, states, next)) - self.rebound;
        let along = normal.dot(&u);
        // A NaN stays one.
        if left >= along { u } else { u + normal * (left - along) }
    }

    /// φ after free flight to `free`, m, which is known if the bodies have states there.
    fn free_gap(&self, free: &[State]) -> Option<f64> {
        let pose = |index: usize| free.get(index).map(State::pose);
        let a = pose(self.key.body)?;
        Some(match self.key.partner.body() {
            Some(other) => self.gap_at(&a, Some(&pose(other)?)),
            None => self.gap_at(&a, None),
        })
    }
}

/// Sets the rebound of the `contacts` of a step of `world` from `states` whose free flight ends in
/// `free`. `shares` are the parts of the restitution that each body takes, all of it where there
/// is none for a body; a contact takes the smaller one of its two. A contact does not bounce
/// whose bodies have no states in `states` and `free`.
pub fn set_rebounds(
    world: &World,
    states: &[State],
    free: &[State],
    shares: &[f64],
    contacts: &mut [Contact],
) {
    for contact in contacts {
        let shares = contact.key.bodies().filter_map(|body| shares.get(body).copied());
        let share = shares.fold(1.0, f64::min);
        contact.rebound = contact.rebound_of(world, states, free, share);
    }
}

/// What the search for contacts remembers of a step, for the rebounds of those that it finds later.
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

    pub(super) fn set(&self, world: &World, states: &[State], contacts: &mut [Contact]) {
        if !self.free.is_empty() {
            set_rebounds(world, states, &self.free, &self.shares, contacts);
        }
    }
}
