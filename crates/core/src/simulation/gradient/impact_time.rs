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
use crate::simulation::StepRecord;
use crate::world::World;

/// Adds the part of (G21) through the times of the impacts of a step to `dual`, the product Jᵀ of
/// `dual_after` with its derivative. Returns false if bodies bounce at several points in the step: their
/// impacts have no times of their own and are left out.
pub(super) fn add_impact_times(
    world: &World,
    record: &StepRecord,
    dual_after: &[StateChange],
    dual: &mut [StateChange],
) -> bool {
    let pairs = record.contacts.iter().zip(&record.solution.contacts);
    let bounces: Vec<_> = pairs
        .filter(|(contact, force)| contact.bounces() && force.carries_force())
        .map(|(contact, _)| contact)
        .collect();
    let mut all_have_times = true;
    for contact in &bounces {
        let shares = |other: &&&Contact| {
            other.key.bodies().any(|body| contact.key.bodies().any(|own| own == body))
        };
        let speed = contact.coming_speed(world, &record.states);
        // The contact itself is one of those that share its bodies.
        if bounces.iter().filter(shares).count() > 1 || speed <= 0.0 {
            all_have_times = false;
            continue;
        }
        let mut later = 0.0;
        for body in contact.key.bodies() {
            let state = &record.states[body];
            let end = &record.solution.states[body];
            let free = world.free_flight(body, state, &record.wrenches[body]);
            let h = world.time_step();
            let flow = |of: &State| StateChange {
                position: of.velocity,
                turn: of.spin,
                velocity: (free.velocity - state.velocity) / h,
                spin: (free.spin - state.spin) / h,
            };
            later += dual[body].dot(&flow(state)) - dual_after[body].dot(&flow(end));
        }
        for (body, gap) in gap_slopes(contact, &record.states) {
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
