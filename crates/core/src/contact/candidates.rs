//! The candidates of a step: the contacts that its solver considers, and the search for more.

use super::memory::Memory;
use super::neighbours::{Neighbours, Overlap, has_pairs};
use super::proxy::PieceExtent;
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

    /// What the search for the next step goes on from; nothing where no pieces can meet.
    pub(crate) fn memory(&self) -> &Memory {
        self.neighbours.memory()
    }

    /// Goes on from `memory`, which must fit `world`, whose contacts are not known any more.
    pub(crate) fn recall(&mut self, world: &World, memory: &Memory) {
        self.contacts.clear();
        self.neighbours.recall(world, memory);
    }

    /// Goes on in `world`, from which the body `body` with so many `pieces` was taken.
    pub(crate) fn remove(&mut self, world: &World, body: usize, pieces: usize) {
        let first = first_piece(world, body);
        self.neighbours.change(world, |memory| memory.remove(body, &(first..first + pieces)));
    }

    /// Goes on in `world`, to which its last body was added.
    pub(crate) fn add(&mut self, world: &World) {
        let bodies = world.bodies().len();
        let pieces = first_piece(world, bodies - 1)..first_piece(world, bodies);
        self.neighbours.change(world, |memory| memory.add(bodies - 1, &pieces));
    }

    /// Goes on in `world`, which holds the body `body` or does so no more.
    pub(crate) fn hold(&mut self, world: &World, body: usize) {
        let pieces = first_piece(world, body)..first_piece(world, body + 1);
        self.neighbours.change(world, |memory| match world.is_held(body) {
            true => memory.forget(body, &pieces),
            false => memory.expect(body),
        });
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
        let deepest =
            has_pairs(world).then(|| self.neighbours.deepest(world, states, |_| 0.0))??;
        Some((deepest.depth, deepest.between.0, deepest.between.1))
    }

    /// The deepest overlap of two pieces at `states` that is more than a start may have, of those of the bodies
    /// that are `asked` about. Lists as in [`Candidates::deepest_overlap`].
    ///
    /// A start may have the [contact band](detection::CONTACT_BAND) of the smaller body, as between a
    /// body and the ground, and of what is thin a tenth of what the largest balls inside both have of
    /// radii; whatever the sizes, 10⁻⁶ of the world's reach is taken for rounding. A step takes
    /// pieces out of each other, at the speed of the depth over h.
    pub fn overlap_at_start(
        &mut self,
        world: &World,
        states: &[State],
        asked: impl Fn(usize) -> bool,
    ) -> Option<Overlap> {
        let allowed = allowed_at_start(world, asked);
        has_pairs(world).then(|| self.neighbours.deepest(world, states, allowed))?
    }

    /// All overlaps at `states` that are deeper than rounding, the deepest first. One that is deeper
    /// than its [`allowed`](Overlap::allowed) is refused by
    /// [`overlap_at_start`](Self::overlap_at_start).
    pub fn overlaps_at_start(&mut self, world: &World, states: &[State]) -> Vec<Overlap> {
        /// What rounding leaves, in parts of the world's reach.
        const ROUNDING: f64 = 1e-12;
        if !has_pairs(world) {
            return Vec::new();
        }
        let allowed = allowed_at_start(world, |_| true);
        self.neighbours.overlaps(world, states, ROUNDING * world.reach(), allowed)
    }
}

/// Overlap that two pieces may start with, m; any where no body is `asked` about.
fn allowed_at_start(
    world: &World,
    asked: impl Fn(usize) -> bool,
) -> impl Fn([(Partner, PieceExtent); 2]) -> f64 {
    /// Of what is thin.
    const PART: f64 = 0.1;
    /// What rounding and the digits of an input may leave, in parts of the world's reach.
    const ROUNDING: f64 = 1e-6;
    let reach = move |partner: Partner| match partner.body() {
        Some(body) => world.bodies()[body].reach(),
        None => f64::INFINITY,
    };
    move |[a, b]: [(Partner, PieceExtent); 2]| {
        if ![a.0, b.0].into_iter().filter_map(Partner::body).any(&asked) {
            return f64::INFINITY;
        }
        let band = detection::CONTACT_BAND * reach(a.0).min(reach(b.0));
        band.min(PART * (a.1.inner + b.1.inner)).max(ROUNDING * world.reach())
    }
}

/// The number of the first piece of body `body`, all pieces of bodies being counted.
fn first_piece(world: &World, body: usize) -> usize {
    world.bodies()[..body].iter().map(|body| body.pieces().len()).sum()
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
