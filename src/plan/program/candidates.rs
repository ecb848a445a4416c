//! Which contacts each step of the program has: those that a run found, for the whole of a solve.

use crate::contact::detection::all_contacts;
use crate::contact::{Contact, ContactKey, Partner};
use crate::mechanics::State;
use crate::plan::Replay;
use crate::world::World;
use std::collections::{BTreeMap, BTreeSet};

/// A point that a run keeps higher than this above the ground, in parts of its body's reach, is left out.
const NEAR: f64 = 1.0;
/// How deep a plane may lie above a point of the run for a contact that the run does not have in that step, m
/// over the reach: beyond its face a plane is none.
const BEHIND: f64 = 1e-6;

/// The contacts of the steps of `replay`: every point that comes near the ground, in all steps; of other contacts those
/// that a step has, and, where it has not, those of other steps whose features are the same throughout and which
/// are not behind.
pub(super) fn candidates(
    world: &World,
    replay: &Replay,
    admitted: &[ContactKey],
) -> Vec<Vec<Contact>> {
    let near = near_the_ground(world, replay, admitted);
    let found = between_bodies(replay);
    let mut scratch = Vec::new();
    let steps = replay.records.iter();
    steps
        .map(|record| {
            all_contacts(world, &record.states, &mut scratch);
            let mut contacts: Vec<_> =
                scratch.iter().filter(|contact| near.contains(&contact.key)).copied().collect();
            let own = |key: &ContactKey| record.contacts.iter().find(|own| own.key == *key);
            for (key, known) in &found {
                if let Some(own) = own(key) {
                    contacts.push(*own);
                } else if let Some(known) = known {
                    let there = placed(world, known, &record.states);
                    let poses = record.solution.states[key.body].pose();
                    let partner = key.partner.body().map(|b| record.solution.states[b].pose());
                    let depth = -BEHIND * world.reach();
                    if there.gap >= depth && there.gap_at(&poses, partner.as_ref()) >= depth {
                        contacts.push(there);
                    }
                }
            }
            contacts
        })
        .collect()
}

/// The points that come near the ground in the run.
fn near_the_ground(
    world: &World,
    replay: &Replay,
    admitted: &[ContactKey],
) -> BTreeSet<ContactKey> {
    let mut near: BTreeSet<_> = admitted.iter().copied().collect();
    for states in &replay.states {
        for (body, state) in states.iter().enumerate() {
            let most = NEAR * world.bodies()[body].reach();
            for (point, height) in world.heights(body, &state.pose()).enumerate() {
                if height <= most {
                    near.insert(ContactKey { body, point, partner: Partner::Ground, pair: None });
                }
            }
        }
    }
    near
}

/// Every other contact of the run; with its features, where they are the same in all steps that have it.
fn between_bodies(replay: &Replay) -> BTreeMap<ContactKey, Option<Contact>> {
    let mut found: BTreeMap<ContactKey, Option<Contact>> = BTreeMap::new();
    for contact in replay.records.iter().flat_map(|record| &record.contacts) {
        if contact.key.partner == Partner::Ground {
            continue;
        }
        let known = found.entry(contact.key).or_insert(Some(*contact));
        if known.is_some_and(|known| known.features != contact.features) {
            *known = None;
        }
    }
    found
}

/// A contact of the same features where the bodies are at `states`.
fn placed(world: &World, contact: &Contact, states: &[State]) -> Contact {
    let key = contact.key;
    let (a, b) = (states[key.body].pose(), key.partner.body().map(|b| states[b].pose()));
    let bodies = world.bodies();
    let other = key.partner.body().map(|b| &bodies[b]).zip(b.as_ref());
    Contact::new(key, contact.features, contact.law, (&bodies[key.body], &a), other)
}

/// The contacts that press in `replay` and are none of `candidates`, step by step.
pub(super) fn missing(replay: &Replay, candidates: &[Vec<Contact>]) -> Vec<ContactKey> {
    let mut missing = BTreeSet::new();
    for (record, posed) in replay.records.iter().zip(candidates) {
        for force in record.solution.contacts.iter().filter(|force| force.carries_force()) {
            if !posed.iter().any(|contact| contact.key == force.key) {
                missing.insert(force.key);
            }
        }
    }
    missing.into_iter().collect()
}
