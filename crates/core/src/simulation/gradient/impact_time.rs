//! Derivatives that know when an impact happens.
//!
//! A step ends an impact at its own end, whatever the gap at its start. So the derivative of the step
//! knows nothing of the time of the impact. A gap that is larger by δφ closes later, by δφ/c at the
//! approach speed c. With the flows f⁻ before and f⁺ after the impact and the derivative J of the
//! step, the change of the state becomes
//!
//! ```text
//! δx⁺ = J (δx + f⁻ δt) − f⁺ δt,   δt = (δφ − τ δV_n)/c,
//! c = √(V_n² + 2 a φ),   τ = 2 φ/(V_n + c)                                (G21)
//! ```
//!
//! with the approach V_n and its rate a at the start of the interval, where the gap is φ. This is
//! the derivative of the motion, and not of the steps. The flows are those of all bodies that
//! contacts and joints connect. Points that meet in one interval count as meeting at their mean
//! time. An impact ends in the step after the one that closes its gap, so that f⁺ and J are those
//! of both steps. Equation numbers are those of `docs/gradients.md`.

use crate::contact::Contact;
use crate::derivative::StateChange;
use crate::mechanics::State;
use crate::mechanics::quaternion::rotation;
use crate::simulation::Interval;
use crate::simulation::abrupt::{CLOSED, STILL};
use crate::world::World;
use nalgebra::Vector3;

/// Times of impacts in a backward pass.
#[derive(Default)]
pub(super) struct ImpactTimes {
    /// True if the derivative has the times of impacts, because it is asked for or impacts are
    /// [located](crate::world::Impacts::Located).
    are_asked: bool,
    /// Accelerations (m/s², rad/s²) of the bodies in the interval before in the pass.
    later: Vec<[Vector3<f64>; 2]>,
    /// Contacts that meet in the present interval.
    met: Vec<Meeting>,
    /// Impacts of the interval before in the pass that may belong to those of the present one.
    pending: Option<Impacts>,
}

/// Contact that closes its gap in an interval.
#[derive(Debug, Clone, Copy)]
struct Meeting {
    contact: Contact,
    /// Speed c of approach at the impact (m/s).
    speed: f64,
    /// Time τ of the impact after the start (s).
    time: f64,
}

/// Impacts of an interval.
struct Impacts {
    met: Vec<Meeting>,
    /// States at its start.
    states: Vec<State>,
    /// The first of the bodies connected with each body.
    labels: Vec<usize>,
    /// Products with the flows before and after, for each body.
    flows: Vec<[f64; 2]>,
}

/// Derivatives with respect to a moment of the run, with the velocities of the middle and of the instant.
pub(super) struct DualStates<'a> {
    pub states: &'a mut [StateChange],
    pub instants: &'a mut [StateChange],
}

impl ImpactTimes {
    pub(super) fn new(are_asked: bool) -> Self {
        Self { are_asked, ..Self::default() }
    }

    /// Begins with an interval. `dual` has the derivatives with respect to its end. Returns true if an impact of
    /// it has no time of its own in the derivative.
    pub(super) fn begin(&mut self, world: &World, taken: &Interval, dual: DualStates<'_>) -> bool {
        self.met = meeting(world, taken);
        let meets_again = |pending: &Impacts| {
            let is_same =
                |met: &Meeting| self.met.iter().any(|of| of.contact.key == met.contact.key);
            pending.met.iter().any(is_same)
        };
        if let Some(pending) = self.pending.take_if(|pending| !meets_again(pending)) {
            pending.add_times(dual);
        }
        let is_one = self.are_asked && self.met.len() < 2;
        !self.met.is_empty() && !is_one
    }

    /// Adds the part of (G21) through the times of the impacts of the interval. `after` are the derivatives with
    /// respect to its end, and `dual` those with respect to its start.
    pub(super) fn add(
        &mut self,
        world: &World,
        taken: &Interval,
        after: &[StateChange],
        dual: DualStates<'_>,
    ) {
        let Self { are_asked: true, later, met, pending, .. } = self else { return };
        let Interval { states, wrenches, solution, .. } = taken;
        let time = |body: usize| world.time_step() * world.kick(body);
        if !met.is_empty() {
            let instants = taken.instant_states();
            let goes_on = pending.take();
            let flows = states.iter().enumerate().map(|(body, state)| {
                if world.is_held(body) {
                    return [0.0; 2];
                }
                let next = &solution.states[body];
                let instant = &instants[body];
                let free = world.free_flight(body, state, &wrenches[body]);
                let flow = |of: &State, [velocity, spin]: [Vector3<f64>; 2]| StateChange {
                    position: of.velocity,
                    turn: of.spin,
                    velocity,
                    spin,
                };
                let changed = [free.velocity - state.velocity, free.spin - state.spin];
                let flow_before = flow(instant, changed.map(|change| change / time(body)));
                let flow_after = flow(next, later.get(body).copied().unwrap_or_default());
                let of_start = dual.states[body].plus(1.0, &dual.instants[body]);
                let after = match &goes_on {
                    Some(later) => later.flows[body][1],
                    None => after[body].dot(&flow_after),
                };
                [of_start.dot(&flow_before), after]
            });
            let impacts = Impacts {
                met: std::mem::take(met),
                states: states.clone(),
                flows: flows.collect(),
                labels: connected(world, taken),
            };
            // An impact ends in the step after the one that closes the gap.
            if impacts.met.iter().all(|met| met.time * met.speed <= CLOSED * world.reach()) {
                *pending = Some(impacts);
            } else {
                impacts.add_times(dual);
            }
        }
        let pairs = states.iter().zip(&solution.states).enumerate();
        later.clear();
        later.extend(pairs.map(|(body, (state, next))| {
            [next.velocity - state.velocity, next.spin - state.spin].map(|of| of / time(body))
        }));
    }

    /// Adds what is left at the start of the run.
    pub(super) fn end(&mut self, dual: DualStates<'_>) {
        if let Some(pending) = self.pending.take() {
            pending.add_times(dual);
        }
    }
}

impl Impacts {
    /// Adds the part through the times to the derivatives with respect to the start of the interval.
    fn add_times(&self, dual: DualStates<'_>) {
        for Meeting { contact, speed, time } in &self.met {
            let label = self.labels[contact.key.body];
            let is_own = |body: &usize| self.labels[*body] == label;
            let count = self.met.iter().filter(|met| is_own(&met.contact.key.body)).count();
            let flows = self.flows.iter().enumerate().filter(|(body, _)| is_own(body));
            let by_time: f64 = flows.map(|(_, [before, after])| before - after).sum();
            let share = by_time / (speed * count as f64);
            for (body, gap) in gap_slopes(contact, &self.states) {
                dual.states[body] = dual.states[body].plus(share, &gap);
                let rate =
                    StateChange { velocity: gap.position, spin: gap.turn, ..StateChange::zero() };
                dual.instants[body] = dual.instants[body].plus(share * time, &rate);
            }
        }
    }
}

/// Contacts with a force whose touching points approach faster than smooth accelerations explain.
fn meeting(world: &World, taken: &Interval) -> Vec<Meeting> {
    let Interval { states, wrenches, solution, .. } = taken;
    let instants = taken.instant_states();
    let least = STILL * world.speed_scale();
    let loaded = taken.contacts.iter().zip(&solution.contacts);
    let loaded = loaded.filter(|(_, force)| force.carries_force());
    let approaching = loaded.filter_map(|(contact, _)| {
        let speed = -contact.normal().dot(&contact.point_velocity(world, instants));
        (speed > least).then_some((contact, speed))
    });
    let approaching: Vec<_> = approaching.collect();
    if approaching.is_empty() {
        return Vec::new();
    }
    let flights = states.iter().zip(wrenches).enumerate();
    let free: Vec<_> =
        flights.map(|(body, (state, wrench))| world.free_flight(body, state, wrench)).collect();
    let met = |(contact, speed): (&Contact, f64)| {
        let is_abrupt = speed > contact.smooth_change(world, states, &free) + least;
        let time = world.time_step() * world.kick(contact.key.body);
        let faster = contact.rate_along(states, states) - contact.rate_along(states, &free);
        let gap = contact.gap.max(0.0);
        let square = speed * speed + 2.0 * gap * faster / time;
        let end = if square > 0.0 { square.sqrt() } else { speed };
        is_abrupt.then(|| Meeting {
            contact: *contact,
            speed: end,
            time: 2.0 * gap / (speed + end),
        })
    };
    approaching.into_iter().filter_map(met).collect()
}

/// The first body among those that contacts with a force and joints connect with each body.
fn connected(world: &World, taken: &Interval) -> Vec<usize> {
    let mut labels: Vec<usize> = (0..taken.states.len()).collect();
    let pairs = taken.contacts.iter().zip(&taken.solution.contacts);
    let loaded = pairs.filter(|(_, force)| force.carries_force());
    let touching = loaded.filter_map(|(of, _)| Some((of.key.body, of.key.partner.body()?)));
    let joined = world.joints().iter().filter_map(|joint| Some((joint.body(), joint.other()?)));
    for (a, b) in touching.chain(joined) {
        if world.is_held(a) || world.is_held(b) || labels[a] == labels[b] {
            continue;
        }
        let first = labels[a].min(labels[b]);
        let other = labels[a].max(labels[b]);
        labels.iter_mut().filter(|label| **label == other).for_each(|label| *label = first);
    }
    labels
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
