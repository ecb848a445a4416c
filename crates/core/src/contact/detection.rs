//! Detection: which points may touch in a step, as [contacts](Contact).
//!
//! What detection finds are *candidates*: contacts that a solver considers. Which of them
//! *carry a force* is the solution's to say
//! ([`ContactForce::carries_force`](crate::step::ContactForce::carries_force)).

use super::{Contact, ContactKey, Features, KeyIndex, Partner, Plane};
use crate::mechanics::{Pose, State};
use crate::world::World;

/// A point at or below this height at step k is a candidate, in parts of the body's reach: 5 mm
/// for the tutorial's cube, whose value it is.
pub const CONTACT_BAND: f64 = 0.005;

/// The rule by which points become candidates.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum Detection {
    /// The tutorial's rule: a height of at most [`CONTACT_BAND`] at step k. A fast point can
    /// jump the band in one step; where a solver then clamps its force to zero, the step has
    /// no solution.
    Height,
    /// The same, or a height of at most 0 after a free flight step.
    #[default]
    Predictive,
}

impl Detection {
    /// Fills `contacts` with the candidates of a step from `states` whose free flight would
    /// end in `free`, in the order of bodies and points. Returns whether the step needs a
    /// contact problem at all: whether there is a candidate, or free flight would take some
    /// other point below the ground. Bodies without a state in both lists are passed over.
    pub fn find(
        self,
        world: &World,
        states: &[State],
        free: &[State],
        contacts: &mut Vec<Contact>,
    ) -> bool {
        contacts.clear();
        let Some(ground) = world.ground() else { return false };
        let mut needs_contact = false;
        let bodies = world.bodies().iter().zip(states).zip(free);
        for (index, ((body, state), free)) in bodies.enumerate() {
            let band = CONTACT_BAND * body.reach();
            let (pose, free) = (state.pose(), free.pose());
            let heights = world.heights(index, &pose).zip(world.heights(index, &free));
            for (point, (now, then)) in heights.enumerate() {
                let candidate = now <= band || (self == Self::Predictive && then <= 0.0);
                if candidate {
                    contacts.push(ground_contact(world, ground, index, point, &pose));
                }
                needs_contact |= candidate || then < 0.0;
            }
        }
        needs_contact
    }

    /// The word of the command line.
    #[must_use]
    pub fn name(self) -> &'static str {
        match self {
            Self::Height => "height",
            Self::Predictive => "predictive",
        }
    }
}

/// Every point of every body against the ground, whatever its height: what a step can be
/// judged by that comes from a file.
pub fn all_contacts(world: &World, states: &[State], contacts: &mut Vec<Contact>) {
    contacts.clear();
    let Some(ground) = world.ground() else { return };
    for (index, (body, state)) in world.bodies().iter().zip(states).enumerate() {
        let pose = state.pose();
        let points = 0..body.contact_points().len();
        let of_point = |point| ground_contact(world, ground, index, point, &pose);
        contacts.extend(points.map(of_point));
    }
}

/// Adds the points that the step `states` → `next` takes lower than `depth` (m) below the
/// ground and that are no candidates yet: detection is a prediction, and an impulse on one
/// point may drive down another. Returns whether there were any. Bodies without a state in both
/// lists are passed over. `index` is memory to find contacts with.
pub fn admit_missed(
    world: &World,
    states: &[State],
    next: &[State],
    depth: f64,
    contacts: &mut Vec<Contact>,
    index: &mut KeyIndex,
) -> bool {
    let Some(ground) = world.ground() else { return false };
    let before = contacts.len();
    index.clear();
    index.reserve(contacts.capacity());
    let of_bodies = states.iter().zip(next).take(world.bodies().len());
    for (body, (state, next)) in of_bodies.enumerate() {
        for (point, height) in world.heights(body, &next.pose()).enumerate() {
            let key = ContactKey { body, point, partner: Partner::Ground, pair: None };
            if height < -depth && index.find(contacts, &key, contacts.len()).is_none() {
                contacts.push(ground_contact(world, ground, body, point, &state.pose()));
            }
        }
    }
    contacts.len() > before
}

/// The contact of a body's point with the ground of the world.
fn ground_contact(
    world: &World,
    ground: &Plane,
    body: usize,
    point: usize,
    pose: &Pose,
) -> Contact {
    let a = &world.bodies()[body];
    let found = &a.contact_points()[point];
    let features =
        Features::of_plane(found.position, found.radius, *ground.frame(), ground.offset());
    let key = ContactKey { body, point, partner: Partner::Ground, pair: None };
    let law = world.law_between(body, Partner::Ground);
    Contact::new(key, features, law, (a, pose), None)
}
