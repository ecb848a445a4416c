//! The candidates of a step: the contacts that its solver considers, and the search for more.

use super::neighbours::{Neighbours, has_pairs};
use super::restitution::Rebound;
use super::{Contact, Detection, KeyIndex, Partner, detection};
use crate::mechanics::State;
use crate::world::World;

/// The contacts of a step, and the memory of the search for them, which is for the steps of one
/// world.
///
/// What is found are *candidates*: contacts that a solver considers. Which of them *carry a
/// force* is the solution's to say
/// ([`ContactForce::carries_force`](crate::step::ContactForce::carries_force)).
#[derive(Debug, Clone, Default)]
pub struct Candidates {
    contacts: Vec<Contact>,
    neighbours: Neighbours,
    rebound: Rebound,
    /// Memory of [`detection::admit_missed`].
    index: KeyIndex,
}

impl Candidates {
    /// No contacts yet.
    #[must_use]
    pub fn new() -> Self {
        Self::default()
    }

    /// The contacts found so far, in the order in which they were found.
    #[must_use]
    pub fn contacts(&self) -> &[Contact] {
        &self.contacts
    }

    /// Gives the contacts away, for the memory of `contacts`.
    pub fn hand_over(&mut self, contacts: &mut Vec<Contact>) {
        std::mem::swap(&mut self.contacts, contacts);
        self.contacts.clear();
    }

    /// Forgets the contacts.
    pub fn clear(&mut self) {
        self.contacts.clear();
    }

    /// Makes these the candidates of a step from `states` whose free flight would end in `free`,
    /// by `rule`. Returns whether the step needs a solver at all: whether something may touch, or joints tie
    /// bodies. Lists have one state a
    /// body; of others what bodies they have meets the ground, and no body meets another.
    pub fn find(
        &mut self,
        rule: Detection,
        world: &World,
        states: &[State],
        free: &[State],
    ) -> bool {
        let reaches_ground = rule.find(world, states, free, &mut self.contacts);
        let has_pairs = has_pairs(world);
        if has_pairs {
            self.neighbours.touching(world, states, &mut self.contacts);
        }
        // Where nothing holds a body, free flight is what there is to look at.
        let needs_contact = reaches_ground
            || !self.contacts.is_empty()
            || !world.joints().is_empty()
            || has_pairs
                && self.neighbours.overlapping(world, states, free, 0.0, &mut self.contacts);
        self.rebound.begin(world, free);
        self.rebound.set(world, states, &mut self.contacts);
        needs_contact
    }

    /// Takes the parts `shares` of the restitution, one a body, in the step from `states` that the
    /// contacts were found for; all of it until this is called, and of bodies without a share.
    pub fn share_restitution(&mut self, world: &World, states: &[State], shares: &[f64]) {
        self.rebound.set_shares(shares);
        self.rebound.set(world, states, &mut self.contacts);
    }

    /// Has the contacts of these `places` bounce in the step from `states`, because the impulses of others
    /// close them ([`Contact::struck`]). Places without a contact are passed over.
    pub fn strike(&mut self, world: &World, states: &[State], places: &[usize]) {
        for &place in places {
            if let Some(contact) = self.contacts.get_mut(place) {
                contact.struck = true;
            }
        }
        self.rebound.set(world, states, &mut self.contacts);
    }

    /// Adds the contacts that the step `states` → `next` takes deeper than `depth` (m) into each
    /// other and that are no candidates yet: detection is a prediction, and an impulse on one point
    /// may drive down another. Returns whether there were any. Lists as in [`Candidates::find`].
    pub fn admit_missed(
        &mut self,
        world: &World,
        states: &[State],
        next: &[State],
        depth: f64,
    ) -> bool {
        let known = self.contacts.len();
        let Self { contacts, index, .. } = self;
        let ground = detection::admit_missed(world, states, next, depth, contacts, index);
        let pieces = has_pairs(world)
            && self.neighbours.overlapping(world, states, next, depth, &mut self.contacts);
        self.rebound.set(world, states, &mut self.contacts[known..]);
        ground || pieces
    }

    /// Whether the step `states` → `next` with these contacts passes something all the same or leaves it
    /// out: pieces that go through each other on the way, that overlap deep and have no feature left to
    /// meet with, or that turn by more than [a radian](crate::simulation::wild::LARGEST_TURN) in reach of each
    /// other. Lists as in [`Candidates::find`].
    pub fn passes(&mut self, world: &World, states: &[State], next: &[State]) -> bool {
        has_pairs(world) && self.neighbours.passes(world, states, next, &mut self.contacts)
    }

    /// The deepest overlap of any two pieces where the bodies are at `states`, m, from the shapes
    /// alone, and whose they are: the second is what is fixed, if one is. `None` without overlap,
    /// and where there is not one state a body.
    pub fn deepest_overlap(
        &mut self,
        world: &World,
        states: &[State],
    ) -> Option<(f64, Partner, Partner)> {
        if has_pairs(world) { self.neighbours.deepest(world, states) } else { None }
    }
}

/// Contacts that were found otherwise.
impl Extend<Contact> for Candidates {
    fn extend<T: IntoIterator<Item = Contact>>(&mut self, contacts: T) {
        self.contacts.extend(contacts);
    }
}

/// Contacts that are given, to repeat a step.
impl From<Vec<Contact>> for Candidates {
    fn from(contacts: Vec<Contact>) -> Self {
        Self { contacts, ..Self::default() }
    }
}
