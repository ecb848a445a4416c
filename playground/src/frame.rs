//! A moment of a session as numbers, for the page and for the npm package.

use crate::pull::Hand;
use crate::session::Session;
use nalgebra::Vector3;
use tumble_core::contact::Partner;
use tumble_core::simulation::{Interval, StepRecord, energy};
use tumble_core::step::StepStatus;

/// Numbers before those of the bodies.
pub const HEAD: usize = 20;
/// Numbers of a body: position (m) and attitude (w, x, y, z).
pub const NUMBERS_OF_BODY: usize = 7;
/// Numbers of a contact: body, partner, point (m), normal, force (N), slip (m/s), friction.
pub const NUMBERS_OF_CONTACT: usize = 15;

/// Appends the present moment to `numbers`: head with the body in a `hand`, bodies, and contacts on
/// request.
pub fn write(session: &Session, hand: Hand, contacts: bool, numbers: &mut Vec<f64>) {
    let simulation = session.simulation();
    let (world, states) = (simulation.world(), simulation.states());
    let summary = session.summary();
    let record = session.record();
    let status = record.map_or(StepStatus::End, StepRecord::status);
    let total = simulation.energy();
    let bodies = world.bodies().iter().zip(states);
    let kinetic =
        total - bodies.map(|(body, state)| energy::potential(world, body, state)).sum::<f64>();
    let unsolved = session.unsolved();
    let grab = session.pulls().grabbed(hand);
    let start = numbers.len();
    numbers.extend([
        simulation.index() as f64,
        simulation.index() as f64 * world.time_step(),
        place_of(status),
        record.map_or(f64::NAN, StepRecord::residual),
        kinetic,
        total,
        record.map_or(0.0, |record| f64::from(record.report().iterations)),
        unsolved.failed as f64,
        unsolved.wild as f64,
        unsolved.first.map_or(-1.0, |index| index as f64),
        summary.worst.as_ref().map_or(0.0, |(_, residual, _)| *residual),
        states.len() as f64,
        0.0,
        grab.map_or(-1.0, |grab| grab.body() as f64),
    ]);
    let points = grab.map(|grab| (grab.place(&states[grab.body()]), grab.target()));
    let (place, target) = points.unwrap_or((Vector3::zeros(), Vector3::zeros()));
    numbers.extend(place.iter().chain(target.iter()));
    debug_assert_eq!(numbers.len(), start + HEAD);
    for state in states {
        numbers.extend(state.position.iter().chain(state.attitude.iter()));
    }
    if let Some(record) = record.filter(|_| contacts) {
        let before = numbers.len();
        let contacts = record.shares().flat_map(|(share, interval)| {
            let Interval { states, contacts, solution, .. } = interval;
            let pairs = contacts.iter().zip(&solution.contacts);
            pairs.map(move |(contact, found)| {
                let share = share.forces(contact.key.body, contact.key.partner.body());
                (contact, found, states, share * found.force)
            })
        });
        for (contact, found, states, force) in contacts {
            let Some(state) = states.get(contact.key.body) else { continue };
            if force == Vector3::zeros() {
                continue;
            }
            numbers.extend([contact.key.body as f64, partner(contact.key.partner)]);
            let vectors = [state.position + contact.arm, contact.normal(), force, found.slip];
            numbers.extend(vectors.iter().flat_map(|vector| vector.iter().copied()));
            numbers.push(contact.law.friction);
        }
        numbers[start + 12] = ((numbers.len() - before) / NUMBERS_OF_CONTACT) as f64;
    }
}

/// Appends each body's state as 13 numbers (r, q, v, ω), with the velocities of the instant, and the
/// parts of the last step's certificate (m/s). Parts are NaN if there is no last step.
pub fn write_states(session: &Session, numbers: &mut Vec<f64>) {
    for state in session.simulation().states() {
        numbers.extend(state.to_vector().iter());
    }
    let certificate = session.record().map(|record| record.certificate().parts());
    numbers.extend(certificate.map_or([f64::NAN; 7], |parts| parts.map(|(_, part)| part)));
}

/// Place of a status in [`StepStatus::ALL`].
fn place_of(status: StepStatus) -> f64 {
    StepStatus::ALL.iter().position(|other| *other == status).map_or(-1.0, |place| place as f64)
}

/// Index of a body; −1 for the ground and −2 − i for the fixed piece i.
fn partner(partner: Partner) -> f64 {
    match partner {
        Partner::Ground => -1.0,
        Partner::Fixed(index) => -2.0 - index as f64,
        Partner::Body(index) => index as f64,
    }
}
