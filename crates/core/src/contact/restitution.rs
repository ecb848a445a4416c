//! Restitution: the parting speed of contacts that arrive in a step.
//!
//! Newton's law: the speed ċ⁺ at which the touching points part after an impact is at least e times
//! the approach speed c_n⁻ = −ċ⁻ before it. Both speeds are taken where the impulse acts, at the
//! levers of the step's start, with the velocities just before and just after the impulse:
//!
//! ```text
//! ċ = n·(v_A + A_A ω̃_A × y_A − v_B − A_B ω̃_B × y_B)
//! ```
//!
//! Here ω̃ is I⁻¹ P⁻(ω) before and I⁻¹ P⁺(ω⁺) after ([`Rotation`](crate::mechanics::Rotation)). After an
//! interval of another length, P⁻ has this length, and v has the fall (κ − 1) h g that it lacks (eq. 37). A
//! contact arrives if it is open or touching at k, approaches faster than a threshold, and would be
//! closed by free flight. It then has a row for its **rebound** e c_n⁻ in addition to the row of
//! the gap:
//!
//! ```text
//! 0 ≤ p_n ⊥ min(φ⁺/h, ċ⁺ − e c_n⁻) ≥ 0                                    (eq. 29)
//! ```
//!
//! A contact that is closed by the impulse of another one also has this row, at any c_n⁻. It must
//! press in a step in which its island bounces. If it was parting, it may approach afterwards as
//! fast as it parted. All other contacts follow the law without restitution.
//!
//! The impulses change the energy at time k by their work on the mean of the velocities before and
//! after:
//!
//! ```text
//! W = Σ p·(u⁻ + u⁺)/2,                                                    (eq. 31)
//! ```
//!
//! This is exact in the momentum form of the rotation. Bodies with e = 1 and without friction have
//! ċ⁺ = −ċ⁻ and conserve their energy for any rotation (eq. 30, 35 of `docs/formulation.md`). A
//! bounce begins at the height of the contact at k, so times and heights are accurate to first
//! order in h.
//!
//! With friction, Newton's law can create energy (Kane's paradox), because it prescribes the speed
//! of each contact independently of the others. [`Contact::impact_work`] computes the terms of W.
//! If W is positive, the simulation scales e by the largest share at which W ≤ 0.

use super::{Contact, Partner, Response};
use crate::mechanics::{RigidBody, State};
use crate::world::World;
use nalgebra::Vector3;

/// Approach speed of a struck contact that stands still (m/s): far below rounding, and not 0.
const JUST_ARRIVING: f64 = 1e-200;

impl Contact {
    /// Relative velocity of the touching points of A and B just before the impulses of a step from
    /// `states` (m/s, world). NaN if the list has no state of one of the bodies.
    pub fn arriving_velocity(&self, world: &World, states: &[State]) -> Vector3<f64> {
        let arriving = |body: usize| {
            let (of, state) = (world.bodies().get(body)?, states.get(body)?);
            let before = world.before().get(body).copied().unwrap_or(world.time_step());
            let spin = world.rotation().arriving_spin(
                of.inertia(),
                of.inertia_inverse(),
                &state.spin,
                before,
            );
            Some((state.velocity + world.missing_fall(body), spin))
        };
        self.parting_velocity(states, arriving)
    }

    /// Relative velocity of the touching points just after the impulses of the step `states` →
    /// `next` (m/s, world). Arms and frames are those at the start.
    pub fn departing_velocity(
        &self,
        world: &World,
        states: &[State],
        next: &[State],
    ) -> Vector3<f64> {
        let h = world.time_step();
        let departing = |body: usize| {
            let (of, state) = (world.bodies().get(body)?, next.get(body)?);
            let (inertia, inverse) = (of.inertia(), of.inertia_inverse());
            let spin = world.rotation().departing_spin(inertia, inverse, &state.spin, h);
            Some((state.velocity, spin))
        };
        self.parting_velocity(states, departing)
    }

    /// v_A + A_A ω̃_A × y_A − v_B − A_B ω̃_B × y_B with v and ω̃ of a body by `motion`.
    fn parting_velocity(
        &self,
        states: &[State],
        motion: impl Fn(usize) -> Option<(Vector3<f64>, Vector3<f64>)>,
    ) -> Vector3<f64> {
        let unknown = Vector3::repeat(f64::NAN);
        let Some((linear, spin)) = motion(self.key.body) else { return unknown };
        let velocity = linear + self.torque_map.tr_mul(&spin);
        let Partner::Body(other) = self.key.partner else {
            return velocity;
        };
        let (Some((linear, spin)), Some(at_a), Some(at_b)) =
            (motion(other), states.get(self.key.body), states.get(other))
        else {
            return unknown;
        };
        let arm = at_a.position + self.arm - at_b.position;
        velocity - linear - (at_b.pose().rotation * spin).cross(&arm)
    }

    /// Work of the impulse `force` × h of the contact on the mean of the velocities before and
    /// after the step `states` → `next` of `world`, relative to moving surfaces (eq. 31) (J). NaN if a list has no
    /// state of one of the bodies.
    pub fn impact_work(
        &self,
        world: &World,
        force: &Vector3<f64>,
        states: &[State],
        next: &[State],
    ) -> f64 {
        let (before, after) =
            (self.arriving_velocity(world, states), self.departing_velocity(world, states, next));
        let mut velocity = 0.5 * (before + after);
        if world.has_surfaces() {
            velocity += self.carried(world, states);
        }
        world.time_step() * force.dot(&velocity)
    }

    /// Work of the `moment` (N m, world) × h of the contact on the mean of the angular velocities before and
    /// after the step `states` → `next` of `world` (eq. 31) (J).
    pub(crate) fn moment_work(
        &self,
        world: &World,
        moment: &Vector3<f64>,
        states: &[State],
        next: &[State],
    ) -> f64 {
        if *moment == Vector3::zeros() {
            return 0.0;
        }
        let h = world.time_step();
        let turning = |body: usize| {
            let of = &world.bodies()[body];
            let inverse = of.inertia_inverse();
            let scheme = world.rotation();
            let before = scheme.arriving_spin(of.inertia(), inverse, &states[body].spin, h);
            let after = scheme.departing_spin(of.inertia(), inverse, &next[body].spin, h);
            states[body].pose().rotation * (before + after)
        };
        let other = self.key.partner.body().map_or(Vector3::zeros(), turning);
        0.5 * h * moment.dot(&(turning(self.key.body) - other))
    }

    /// e c_n⁻ times `share` (eq. 29), for a free flight from `states` to `free` (m/s). It is 0 if
    /// the contact does not bounce, or if a list has no state of one of the bodies.
    pub fn rebound_of(&self, world: &World, states: &[State], free: &[State], share: f64) -> f64 {
        let restitution = self.law.restitution;
        if restitution == 0.0 {
            return 0.0;
        }
        let coming = self.coming_speed(world, states);
        let arrives =
            || coming > world.rebound_speed() && self.free_gap(free).is_some_and(|gap| gap <= 0.0);
        // A NaN does not bounce.
        let bounces = coming.is_finite() && (self.struck || arrives());
        if bounces { share * restitution * coming } else { 0.0 }
    }

    /// c_n⁻ (m/s). A [struck](Contact::struck) contact without it counts as just arriving, because a
    /// rebound of 0 has no row.
    pub(crate) fn coming_speed(&self, world: &World, states: &[State]) -> f64 {
        let coming = -self.normal().dot(&self.arriving_velocity(world, states));
        if self.struck && coming == 0.0 { JUST_ARRIVING } else { coming }
    }

    /// True if the contact bounces in the step, so that it has the row of a rebound.
    #[inline]
    pub fn bounces(&self) -> bool {
        self.rebound != 0.0
    }

    /// Distance of the step from a change between bouncing and not bouncing (m/s).
    ///
    /// It compares the approach speed with its threshold, and the gap after the free flight to
    /// `free`, divided by h, with 0. It is infinite for a contact that is struck or has no
    /// restitution.
    pub(crate) fn bounce_margin(&self, world: &World, states: &[State], free: &[State]) -> f64 {
        if self.struck || self.law.restitution == 0.0 {
            return f64::INFINITY;
        }
        let coming = -self.normal().dot(&self.arriving_velocity(world, states));
        let faster = coming - world.rebound_speed();
        let closer = self.free_gap(free).map_or(f64::INFINITY, |gap| -gap / world.time_step());
        // Bouncing needs both to be positive. The result is the distance to the nearest change of
        // this.
        match faster.min(closer) {
            least if least > 0.0 => least,
            _ => (-faster).max(-closer).max(0.0),
        }
    }

    /// True if the contact is [struck](Contact::struck) once it presses in a step in which its
    /// island bounces. Such a contact has restitution and no rebound yet.
    pub fn may_be_struck(&self) -> bool {
        !self.struck && !self.bounces() && self.law.restitution > 0.0
    }

    /// True if the gap is at most the distance that the points of the contact can move in the step
    /// `states` → `next` of `world`.
    ///
    /// The distance uses the speeds before and after and `pushed` (m/s), the speed from the
    /// impulses on its bodies. One of these impulses may have closed the contact before others held
    /// it back.
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

    /// Bound on the relative speed of the contact's points caused by the impulse of `force` (N)
    /// alone (m/s). It is h |f|/m times the sum of both [responses](Contact::response).
    pub fn pushed_by(&self, world: &World, force: &Vector3<f64>) -> f64 {
        let mass = world.bodies().get(self.key.body).map_or(f64::NAN, RigidBody::mass);
        let Response { normal, tangential } = self.response;
        world.time_step() * force.norm() / mass * (normal + tangential)
    }

    /// Motion in the law of the contact (m/s, world). `u` is its [motion](Contact::motion) over the
    /// step `states` → `next` of `world`.
    ///
    /// It adds the motion of [surfaces](Contact::carried) and the offset of the slip (eq. 38). Along the normal it is the smaller of
    /// the gap speed and the parting speed beyond the rebound (eq. 29).
    #[inline]
    pub fn law_motion(
        &self,
        u: Vector3<f64>,
        world: &World,
        states: &[State],
        next: &[State],
    ) -> Vector3<f64> {
        if self.bounces() || self.has_law_offset(world) {
            self.changed_motion(u, world, states, next)
        } else {
            u
        }
    }

    /// Motion in the law of a contact that bounces or touches a moving surface.
    fn changed_motion(
        &self,
        u: Vector3<f64>,
        world: &World,
        states: &[State],
        next: &[State],
    ) -> Vector3<f64> {
        let u = u + self.law_offset(world, states);
        if self.bounces() { self.bounded_motion(u, world, states, next) } else { u }
    }

    /// Motion in the law of a contact that bounces.
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

    /// φ after free flight to `free` (m); `None` if a body has no state there.
    fn free_gap(&self, free: &[State]) -> Option<f64> {
        let pose = |index: usize| free.get(index).map(State::pose);
        let a = pose(self.key.body)?;
        Some(match self.key.partner.body() {
            Some(other) => self.gap_at(&a, Some(&pose(other)?)),
            None => self.gap_at(&a, None),
        })
    }
}

/// Sets the rebounds of the `contacts` of a step of `world` from `states` to the free flight states
/// `free`.
///
/// `shares` scales the restitution of each body, with 1 for bodies without an entry. A contact uses
/// the smaller share of its two bodies. A contact does not bounce if its bodies have no states in
/// `states` and `free`.
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

/// Data of a step for the rebounds of contacts that are found later.
#[derive(Debug, Clone, Default)]
pub(super) struct Rebound {
    /// X at step k+1 in free flight; empty in a world without restitution.
    free: Vec<State>,
    /// Shares of the restitution of the first bodies; 1 for the others.
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
            shares.clone_into(&mut self.shares);
        }
    }

    pub(super) fn set(&self, world: &World, states: &[State], contacts: &mut [Contact]) {
        if !self.free.is_empty() {
            set_rebounds(world, states, &self.free, &self.shares, contacts);
        }
    }
}
