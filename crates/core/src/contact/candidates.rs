//! Candidate contacts of a step, and the search for missing ones.

use super::adhesion::share_adhesion;
use super::aside::AsideContacts;
use super::collider::PieceExtent;
use super::collision::Reached;
use super::memory::Memory;
use super::neighbours::replaced::Replaced;
use super::neighbours::{Neighbours, Overlap, has_pairs};
use super::restitution::Rebound;
use super::slip_offset::InstantMotions;
use super::{Contact, Detection, KeyIndex, Partner, detection};
use crate::mechanics::State;
use crate::world::World;
use nalgebra::Vector3;

/// Contacts of a step, and the state of the search for them over the steps of one world.
///
/// The contacts are *candidates* for a solver. The solution decides which of them *carry a force*
/// ([`ContactForce::carries_force`](crate::step::ContactForce::carries_force)).
#[derive(Debug, Clone, Default)]
pub struct Candidates {
    contacts: Vec<Contact>,
    aside: AsideContacts,
    neighbours: Neighbours,
    rebound: Rebound,
    /// Workspace of [`detection::admit_missed`].
    index: KeyIndex,
    /// For the offsets of slips (eq. 38).
    motions: InstantMotions,
}

impl Candidates {
    /// An empty list of contacts.
    pub fn new() -> Self {
        Self::default()
    }

    /// Contacts found so far, in the order of the search.
    pub fn contacts(&self) -> &[Contact] {
        &self.contacts
    }

    /// Continues the search from `memory`, which must fit `world`, and gives the memory so far.
    pub(crate) fn exchange_memory(&mut self, world: &World, memory: &mut Box<Memory>) {
        self.neighbours.exchange_memory(world, memory);
    }

    /// Gives the state that the next search continues from.
    pub(crate) fn return_memory(&mut self, memory: &mut Box<Memory>) {
        self.neighbours.return_memory(memory);
    }

    /// Prepares for a memory other than the one that the last search left.
    pub(crate) fn forget(&mut self) {
        self.contacts.clear();
        self.aside.forget();
        self.neighbours.forget();
    }

    /// Begins a step in which `bodies` rest. Returns true if their contacts are the same as in the step before, and
    /// are [set aside](Self::aside).
    pub(crate) fn set_aside(&mut self, bodies: &[bool]) -> bool {
        self.aside.begin(bodies)
    }

    /// Flags of the bodies at rest whose contacts are left out, empty without any. They end the step where they begin
    /// it.
    pub fn aside(&self) -> &[bool] {
        self.aside.bodies()
    }

    /// True if a body at rest is touched whose contacts are set aside.
    pub(crate) fn touches_aside(&self) -> bool {
        self.aside.is_touched && !self.aside().is_empty()
    }

    /// Begins the search of the step again from `memory`, with all contacts.
    #[cold]
    pub(crate) fn take_all(&mut self, world: &World, memory: &Memory) {
        self.aside.end();
        self.neighbours.rewind(world, memory);
    }

    /// Number of all contacts, with those set aside.
    pub(crate) fn count_all(&self) -> usize {
        self.contacts.len() + self.aside.count()
    }

    /// Puts the contacts set aside back. `spare` is a workspace.
    pub(crate) fn put_back(&mut self, spare: &mut Vec<Contact>) {
        self.aside.put_back(&mut self.contacts, spare);
    }

    /// Puts the `entries` of contacts set aside back into a list with one entry for each of the others.
    pub(crate) fn merge<'a, T: Copy + 'a>(
        &self,
        entries: impl Iterator<Item = &'a T>,
        list: &mut Vec<T>,
        spare: &mut Vec<T>,
    ) {
        self.aside.merge(entries, list, spare);
    }

    /// Keeps the contacts of the `bodies` that rested in this step, which the next one may set aside.
    pub(crate) fn remember(&mut self, bodies: &[bool]) {
        self.aside.remember(bodies, &self.contacts);
    }

    /// Updates the search after body `body` with `pieces` pieces was removed; `world` is the world
    /// without it.
    pub(crate) fn remove(&mut self, world: &World, body: usize, pieces: usize) {
        let first = first_piece(world, body);
        self.neighbours.change(world, |memory| memory.remove(body, &(first..first + pieces)));
    }

    /// Updates the search after a last body was added to `world`.
    pub(crate) fn add(&mut self, world: &World) {
        let bodies = world.bodies().len();
        let pieces = first_piece(world, bodies - 1)..first_piece(world, bodies);
        self.neighbours.change(world, |memory| memory.add(bodies - 1, &pieces));
    }

    /// Updates the search after body `body` of `world` was held or released.
    pub(crate) fn hold(&mut self, world: &World, body: usize) {
        let pieces = first_piece(world, body)..first_piece(world, body + 1);
        self.neighbours.change(world, |memory| {
            if world.is_held(body) { memory.forget(body, &pieces) } else { memory.expect(body) }
        });
    }

    /// Moves the contacts to `contacts`, whose buffer is reused.
    pub fn hand_over(&mut self, contacts: &mut Vec<Contact>) {
        std::mem::swap(&mut self.contacts, contacts);
        self.contacts.clear();
    }

    /// Clears the contacts.
    pub fn clear(&mut self) {
        self.contacts.clear();
    }

    /// Finds the candidates of a step from `states` to the free flight states `free` by `rule`.
    ///
    /// Returns true if the step needs a solver: if bodies may touch, or if joints connect bodies.
    /// The lists need one state per body. With other lists only ground contacts of the listed
    /// bodies are found.
    pub fn find(
        &mut self,
        rule: Detection,
        world: &World,
        states: &[State],
        free: &[State],
    ) -> bool {
        let Self { contacts, aside, .. } = self;
        contacts.clear();
        aside.begin_search();
        let reaches_ground = rule.find_awake(world, states, free, aside, contacts);
        let has_pairs = has_pairs(world);
        if has_pairs {
            for list in self.neighbours.touching(world, states) {
                if aside.bodies().is_empty() {
                    contacts.extend_from_slice(list);
                    continue;
                }
                for contact in list {
                    if !aside.takes(contact, contacts.len()) {
                        contacts.push(*contact);
                    }
                }
            }
            if !self.neighbours.replaced.is_empty() {
                self.neighbours.put_replaced(world, &mut self.contacts);
            }
        }
        // Without candidates and joints, free flight is the step to check.
        aside.end_search();
        let needs_contact = reaches_ground
            || !aside.bodies().is_empty()
            || !self.contacts.is_empty()
            || !world.joints().is_empty()
            || has_pairs
                && self.neighbours.overlapping(
                    world,
                    states,
                    free,
                    0.0,
                    Reached::Free,
                    &mut self.contacts,
                );
        self.rebound.begin(world, free);
        self.complete(world, states, 0);
        needs_contact
    }

    /// Scales the restitution of each body by `shares`, in the step from `states` that the contacts
    /// were found for.
    ///
    /// The share is 1 until this is called, and for bodies without an entry.
    pub fn share_restitution(&mut self, world: &World, states: &[State], shares: &[f64]) {
        self.rebound.set_shares(shares);
        self.rebound.set(world, states, &mut self.contacts);
    }

    /// Marks the contacts at these indices as [struck](Contact::struck) in the step from `states`:
    /// the impulses of others close them, so they bounce. Indices without a contact are skipped.
    pub fn strike(&mut self, world: &World, states: &[State], places: &[usize]) {
        for &place in places {
            if let Some(contact) = self.contacts.get_mut(place) {
                contact.struck = true;
            }
        }
        self.rebound.set(world, states, &mut self.contacts);
    }

    /// [Holds](Contact::hold) the contacts at these indices, which stop or break away in the step `states` → `next`.
    pub(crate) fn catch(&mut self, world: &World, states: &[State], next: &[State], at: &[usize]) {
        at.iter().for_each(|&place| self.contacts[place].hold(world, states, next));
    }

    /// Adds the contacts that the step `states` → `next` makes deeper than `depth` (m) and that are
    /// not candidates yet.
    ///
    /// Detection is a prediction, and an impulse on one point may push down another. Returns true
    /// if there were any. The lists are like in [`Candidates::find`].
    pub fn admit_missed(
        &mut self,
        world: &World,
        states: &[State],
        next: &[State],
        depth: f64,
    ) -> bool {
        self.admit(world, states, next, depth, Reached::Solved)
    }

    /// Same as [`Self::admit_missed`] for a prediction or a preliminary solution `next`, which may violate
    /// its contacts.
    pub(crate) fn admit_foreseen(
        &mut self,
        world: &World,
        states: &[State],
        next: &[State],
        depth: f64,
    ) -> bool {
        self.admit(world, states, next, depth, Reached::Foreseen)
    }

    fn admit(
        &mut self,
        world: &World,
        states: &[State],
        next: &[State],
        depth: f64,
        reached: Reached,
    ) -> bool {
        let known = self.contacts.len();
        let Self { contacts, aside, index, .. } = self;
        let rests = aside.bodies();
        let ground = detection::admit_missed(world, states, next, depth, rests, contacts, index);
        let pieces = has_pairs(world)
            && self.neighbours.overlapping(world, states, next, depth, reached, &mut self.contacts);
        if !self.aside.bodies().is_empty() {
            self.aside.note(&self.contacts[known..]);
        }
        self.complete(world, states, known);
        ground || pieces
    }

    /// Completes the new contacts, from index `first` on.
    fn complete(&mut self, world: &World, states: &[State], first: usize) {
        let new = &mut self.contacts[first..];
        if world.span().is_some() {
            new.iter_mut().for_each(|contact| contact.hold_back(world));
        }
        new.iter_mut().for_each(|contact| contact.set_friction(world, states));
        self.rebound.set(world, states, new);
        share_adhesion(world, &mut self.contacts);
        if self.motions.are_known() {
            for contact in &mut self.contacts[first..] {
                self.motions.set_offsets(world, states, contact);
            }
        }
    }

    /// Sets the states with the velocities of the instant, and those after free flight, for the
    /// offsets of slips (eq. 38). Without states, slips have no offset.
    pub(crate) fn set_instants(&mut self, instants: &[State], free: &[State]) {
        self.motions.set(instants, free);
    }

    /// First pair whose collision the step `states` → `next` misses in spite of these contacts.
    ///
    /// Pieces may pass through each other. They may overlap deeply without a feature left to stop
    /// them. Or they may rotate by more than [a radian](crate::simulation::unphysical::LARGEST_TURN)
    /// within reach of each other. The lists are like in [`Candidates::find`].
    pub fn missed_pair(
        &mut self,
        world: &World,
        states: &[State],
        next: &[State],
    ) -> Option<[Partner; 2]> {
        has_pairs(world)
            .then(|| self.neighbours.missed_pair(world, states, next, &mut self.contacts))?
    }

    /// Two objects that sink into each other in the step `states` → `next`: some of their pieces end deeper than
    /// they began, by more than contacts fixed to their bodies explain (eq. 18h). A contact is missing then,
    /// whatever the other contacts are. The lists are like in [`Candidates::find`].
    pub fn sunk_pair(
        &mut self,
        world: &World,
        states: &[State],
        next: &[State],
    ) -> Option<[Partner; 2]> {
        let fits = states.len() == world.bodies().len() && states.len() == next.len();
        (has_pairs(world) && fits).then(|| self.neighbours.sunk_pair(world, states, next))?
    }

    /// Deepest overlap of any two pieces with the bodies at `states` (m), from the shapes alone,
    /// and the owners of the pieces.
    ///
    /// A fixed owner is the second. `None` without overlap, and if there is not one state per body.
    pub fn deepest_overlap(
        &mut self,
        world: &World,
        states: &[State],
    ) -> Option<(f64, Partner, Partner)> {
        let deepest = has_pairs(world)
            .then(|| self.neighbours.deepest(world, states, usize::MAX, |_| 0.0))??;
        Some((deepest.depth, deepest.between.0, deepest.between.1))
    }

    /// Largest error of the placement of a contact that carries a force, in the step `states` → `next`
    /// with these contacts and `forces` (N, world) (eq. 18g) (m). It is 0 if all of them are where two
    /// pieces touch. Contacts with the ground are exact.
    pub fn placement_error(
        &mut self,
        world: &World,
        states: &[State],
        next: &[State],
        forces: impl IntoIterator<Item = Vector3<f64>>,
    ) -> f64 {
        self.placement_of_loaded(world, states, next, forces, |_, _| ())
    }

    /// Loaded contacts that are not where two pieces touch, with their errors (18g) (m): those above 10⁻⁴ of the
    /// smaller piece. The arguments are like in [`Candidates::placement_error`].
    pub fn misplaced(
        &mut self,
        world: &World,
        states: &[State],
        next: &[State],
        forces: impl IntoIterator<Item = Vector3<f64>>,
    ) -> Vec<(Contact, f64)> {
        let mut misplaced = Vec::new();
        self.placement_of_loaded(world, states, next, forces, |contact, error| {
            misplaced.push((*contact, error));
        });
        misplaced
    }

    /// [Replaces](Neighbours::replace) contacts that are `misplaced` after a step from `states` in the next
    /// searches of this step.
    pub(crate) fn replace(
        &mut self,
        world: &World,
        states: &[State],
        misplaced: &[(Contact, f64)],
    ) {
        self.neighbours.replace(world, states, misplaced);
    }

    /// Contacts that the searches of the same step replace.
    pub(crate) fn replaced(&mut self) -> &mut Replaced {
        &mut self.neighbours.replaced
    }

    fn placement_of_loaded(
        &mut self,
        world: &World,
        states: &[State],
        next: &[State],
        forces: impl IntoIterator<Item = Vector3<f64>>,
        visit: impl FnMut(&Contact, f64),
    ) -> f64 {
        let Self { contacts, neighbours, .. } = self;
        let loaded = contacts
            .iter()
            .zip(forces)
            .filter(|(contact, force)| contact.key.pair.is_some() && *force != Vector3::zeros());
        let mut loaded = loaded.map(|(contact, _)| contact).peekable();
        match loaded.peek() {
            Some(_) => neighbours.placement_error(world, states, next, loaded, visit),
            None => 0.0,
        }
    }

    /// Deepest overlap of two pieces at `states` above the limit for initial states. Only pairs
    /// with a body for which `asked` holds are tested. The lists are like in
    /// [`Candidates::deepest_overlap`].
    ///
    /// The limit is the [contact band](detection::CONTACT_BAND) of the smaller body, as between a
    /// body and the ground. For thin pieces it is a tenth of the summed radii of the largest balls
    /// inside both. For rounding it is at least 10⁻⁶ of the world's reach, or half of the smaller body's
    /// reach if that is less. The result is the deepest of the first thousand overlaps above their limits.
    /// A step separates overlapping pieces at the speed depth/h.
    pub fn overlap_at_start(
        &mut self,
        world: &World,
        states: &[State],
        asked: impl Fn(usize) -> bool,
    ) -> Option<Overlap> {
        let allowed = allowed_at_start(world, asked);
        has_pairs(world).then(|| self.neighbours.deepest(world, states, 1000, allowed))?
    }

    /// A pair of the last search if it was crowded: the boxes of some 4 million pairs met, and the
    /// search left other pairs out.
    pub fn crowded(&self) -> Option<[Partner; 2]> {
        self.neighbours.crowded()
    }

    /// All overlaps at `states` deeper than rounding, the deepest first.
    /// [`overlap_at_start`](Self::overlap_at_start) rejects one above its limit.
    pub fn overlaps_at_start(&mut self, world: &World, states: &[State]) -> Vec<Overlap> {
        /// Depth caused by rounding, as a fraction of the world's reach.
        const ROUNDING: f64 = 1e-12;
        if !has_pairs(world) {
            return Vec::new();
        }
        let allowed = allowed_at_start(world, |_| true);
        self.neighbours.overlaps(world, states, ROUNDING * world.reach(), allowed)
    }
}

/// Limit of the overlap of two pieces in an initial state (m); infinite if `asked` holds for
/// neither body.
fn allowed_at_start(
    world: &World,
    asked: impl Fn(usize) -> bool,
) -> impl Fn([(Partner, PieceExtent); 2]) -> f64 {
    /// Limit for thin pieces, as a fraction of their thickness.
    const PART: f64 = 0.1;
    /// Limit for rounding and the digits of an input, as a fraction of the world's reach.
    const ROUNDING: f64 = 1e-6;
    /// Limit for rounding as a fraction of the smaller reach: small bodies in one place of a large world
    /// overlap.
    const MOST_ROUNDED: f64 = 0.5;
    let reach = move |partner: Partner| match partner.body() {
        Some(body) => world.bodies()[body].reach(),
        None => f64::INFINITY,
    };
    move |[a, b]: [(Partner, PieceExtent); 2]| {
        if ![a.0, b.0].into_iter().filter_map(Partner::body).any(&asked) {
            return f64::INFINITY;
        }
        let smaller = reach(a.0).min(reach(b.0));
        let rounding = (ROUNDING * world.reach()).min(MOST_ROUNDED * smaller);
        let band = detection::CONTACT_BAND * smaller;
        band.min(PART * (a.1.inner + b.1.inner)).max(rounding)
    }
}

/// Index of the first piece of body `body` among the pieces of all bodies.
fn first_piece(world: &World, body: usize) -> usize {
    world.bodies()[..body].iter().map(|body| body.pieces().len()).sum()
}

/// Adds contacts from another source.
impl Extend<Contact> for Candidates {
    fn extend<T: IntoIterator<Item = Contact>>(&mut self, contacts: T) {
        self.contacts.extend(contacts);
    }
}

/// Given contacts, to repeat a step.
impl From<Vec<Contact>> for Candidates {
    fn from(contacts: Vec<Contact>) -> Self {
        Self { contacts, ..Self::default() }
    }
}
