//! Derivatives that know when a bounce happens.
//!
//! A step ends a bounce at its own end, whatever the gap at its start. So the derivative of the step
//! knows nothing of the time of the impact. A gap that is larger by δφ closes later, by δφ/c at the
//! approach speed c. With the flows f⁻ before and f⁺ after the impact and the derivative J of the
//! step, the change of the state becomes
//!
//! ```text
//! δx⁺ = J (δx + f⁻ δt) − f⁺ δt,   δt = δφ/c                               (G21)
//! ```
//!
//! the derivative of the motion, and not of the steps. Equation numbers are those of `docs/gradients.md`.

use crate::contact::Contact;
use crate::derivative::StateChange;
use crate::mechanics::State;
use crate::mechanics::quaternion::rotation;
use crate::simulation::Interval;
use crate::simulation::abrupt::STILL;
use crate::world::World;
use nalgebra::Vector3;

/// Times of impacts in a backward pass.
pub(super) struct ImpactTimes {
    is_asked: bool,
    /// True if impacts are [located](crate::world::Impacts::Located).
    is_located: bool,
    /// Accelerations (m/s², rad/s²) of the bodies in the step before in the pass, with located impacts.
    later: Vec<[Vector3<f64>; 2]>,
}

impl ImpactTimes {
    pub(super) fn new(is_asked: bool, is_located: bool) -> Self {
        Self { is_asked, is_located, later: Vec::new() }
    }

    pub(super) fn are_asked(&self) -> bool {
        self.is_asked || self.is_located
    }

    /// Adds the part of (G21) through the times of the impacts of a step to `dual`, the product Jᵀ of
    /// `dual_after` with its derivative. Returns false if impacts have no times of their own.
    pub(super) fn add(
        &mut self,
        world: &World,
        taken: &Interval,
        dual_after: &[StateChange],
        dual: &mut [StateChange],
    ) -> bool {
        if !self.is_located {
            return add_bounce_times(world, taken, dual_after, dual);
        }
        let has_one_time = self.add_located_time(world, taken, dual_after, dual);
        let pairs = taken.states.iter().zip(&taken.solution.states).enumerate();
        let changes = pairs.map(|(body, (state, next))| {
            let time = world.time_step() * world.kick(body);
            [(next.velocity - state.velocity) / time, (next.spin - state.spin) / time]
        });
        self.later.clear();
        self.later.extend(changes);
        has_one_time
    }

    /// Part of (G21) through the time of an impact in an interval, with a loss or without. Points that
    /// meet in it count as meeting at their mean time. Returns false if there are several.
    fn add_located_time(
        &self,
        world: &World,
        taken: &Interval,
        dual_after: &[StateChange],
        dual: &mut [StateChange],
    ) -> bool {
        let Interval { states, wrenches, solution, .. } = taken;
        let instants = taken.instant_states();
        let flights = states.iter().zip(wrenches).enumerate();
        let free: Vec<_> =
            flights.map(|(body, (state, wrench))| world.free_flight(body, state, wrench)).collect();
        let pairs = taken.contacts.iter().zip(&solution.contacts);
        let meets = |contact: &Contact| {
            let speed = -contact.normal().dot(&contact.point_velocity(world, instants));
            let least = contact.smooth_change(world, states, &free) + STILL * world.speed_scale();
            (speed > least).then_some(speed)
        };
        let loaded = pairs.filter(|(_, force)| force.carries_force());
        let met: Vec<_> =
            loaded.filter_map(|(contact, _)| Some((contact, meets(contact)?))).collect();
        if met.is_empty() {
            return true;
        }
        let mut moved: Vec<_> = met.iter().flat_map(|(contact, _)| contact.key.bodies()).collect();
        moved.sort_unstable();
        moved.dedup();
        let mut by_time = 0.0;
        for &body in &moved {
            let (state, next, instant) = (&states[body], &solution.states[body], &instants[body]);
            let before = [free[body].velocity - state.velocity, free[body].spin - state.spin];
            let flow = |of: &State, [velocity, spin]: [Vector3<f64>; 2]| StateChange {
                position: of.velocity,
                turn: of.spin,
                velocity,
                spin,
            };
            let later = self.later.get(body).copied().unwrap_or_default();
            let time = world.time_step() * world.kick(body);
            by_time += dual[body].dot(&flow(instant, before.map(|change| change / time)));
            by_time -= dual_after[body].dot(&flow(next, later));
        }
        for (contact, speed) in &met {
            let share = by_time / (speed * met.len() as f64);
            for (body, gap) in gap_slopes(contact, states) {
                dual[body] = dual[body].plus(share, &gap);
            }
        }
        met.len() == 1
    }
}

/// Part of (G21) through the times of bounces in a step. Returns false if bodies bounce at several points
/// in the step: their impacts have no times of their own and are left out.
fn add_bounce_times(
    world: &World,
    taken: &Interval,
    dual_after: &[StateChange],
    dual: &mut [StateChange],
) -> bool {
    let pairs = taken.contacts.iter().zip(&taken.solution.contacts);
    let bounces: Vec<_> = pairs
        .filter(|(contact, force)| contact.bounces() && force.carries_force())
        .map(|(contact, _)| contact)
        .collect();
    let mut all_have_times = true;
    for contact in &bounces {
        let shares = |other: &&&Contact| {
            other.key.bodies().any(|body| contact.key.bodies().any(|own| own == body))
        };
        let speed = contact.coming_speed(world, &taken.states);
        // The contact itself is one of those that share its bodies.
        if bounces.iter().filter(shares).count() > 1 || speed <= 0.0 {
            all_have_times = false;
            continue;
        }
        let mut later = 0.0;
        for body in contact.key.bodies() {
            let state = &taken.states[body];
            let end = &taken.solution.states[body];
            let free = world.free_flight(body, state, &taken.wrenches[body]);
            let h = world.time_step();
            let flow = |of: &State| StateChange {
                position: of.velocity,
                turn: of.spin,
                velocity: (free.velocity - state.velocity) / h,
                spin: (free.spin - state.spin) / h,
            };
            later += dual[body].dot(&flow(state)) - dual_after[body].dot(&flow(end));
        }
        for (body, gap) in gap_slopes(contact, &taken.states) {
            dual[body] = dual[body].plus(later / speed, &gap);
        }
    }
    all_have_times
}

/// Derivatives of the gap of `contact` with respect to the poses of its bodies.
fn gap_slopes(
    contact: &Contact,
    states: &[State],
) -> impl Iterator<Item = (usize, StateChange)> + use<> {
    let normal = contact.normal();
    let own = &states[contact.key.body];
    let point = own.position + contact.arm;
    let of_body = |body: usize, sign: f64| {
        let state = &states[body];
        let turn = (point - state.position).cross(&normal);
        let turn = rotation(&state.attitude).tr_mul(&turn);
        let slopes = StateChange { position: normal, turn, ..StateChange::zero() };
        (body, slopes.scaled(sign))
    };
    let other = contact.key.partner.body().map(|body| of_body(body, -1.0));
    [Some(of_body(contact.key.body, 1.0)), other].into_iter().flatten()
}
