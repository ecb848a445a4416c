//! Islands: sets of bodies connected by contacts or joints, directly or through other bodies.
//!
//! Fixed objects connect nothing. Islands are independent problems.

use super::settings::{CHANGING, Settings};
use crate::contact::{Contact, KeyIndex, Partner};
use crate::joint::{Gear, Joint};
use crate::sets::DisjointSets;
use crate::step::{Step, StepSolution};
use crate::world::World;
use nalgebra::Vector3;

/// Islands of a step, ordered by their first bodies, with their contents.
#[derive(Debug, Clone, Default)]
pub(super) struct IslandPartition {
    /// Connected bodies. Each set begins with the first body of its island.
    sets: DisjointSets,
    /// Island of each body, [`NONE`] without contact.
    islands: Vec<usize>,
    /// Index of each body in its island.
    places: Vec<usize>,
    bodies: Groups,
    contacts: Groups,
    joints: Groups,
    gears: Groups,
    /// True if the island must be solved: it has a new contact or a marked body.
    changed: Vec<bool>,
    /// True per body whose island gets less effort. Empty without any.
    hopeless: Vec<bool>,
    unsettled: Vec<f64>,
    changes: Vec<(f64, f64)>,
    known: KnownForces,
    /// Finds contacts of the last step by key. `earlier` finds contacts of the step before it.
    previous: KeyIndex,
    earlier: KeyIndex,
}

const NONE: usize = usize::MAX;

/// Lists of indices, one per group, in one allocation.
#[derive(Debug, Clone, Default)]
struct Groups {
    starts: Vec<usize>,
    entries: Vec<usize>,
}

impl Groups {
    /// Sorts the numbers 0, 1, … into groups. `of` has the group of each number.
    fn sort(&mut self, groups: usize, of: impl Iterator<Item = usize> + Clone) {
        self.starts.clear();
        self.starts.resize(groups + 1, 0);
        let grouped = || of.clone().enumerate().filter(|(_, group)| *group != NONE);
        for (_, group) in grouped() {
            self.starts[group + 1] += 1;
        }
        for group in 0..groups {
            self.starts[group + 1] += self.starts[group];
        }
        self.entries.clear();
        self.entries.resize(self.starts[groups], 0);
        // Each start moves to the end of its group, and back by one group afterwards.
        for (entry, group) in grouped() {
            self.entries[self.starts[group]] = entry;
            self.starts[group] += 1;
        }
        self.starts.rotate_right(1);
        self.starts[0] = 0;
    }

    /// Sets one group with the numbers 0, 1, … below `count`.
    fn set_only_one(&mut self, count: usize) {
        self.starts.clear();
        self.starts.extend([0, count]);
        if self.entries.len() != count {
            self.entries.clear();
            self.entries.extend(0..count);
        }
    }

    /// True if there is one group of `count` numbers.
    fn has_only_one(&self, count: usize) -> bool {
        self.starts == [0, count]
    }

    fn len(&self) -> usize {
        self.starts.len() - 1
    }

    fn get(&self, group: usize) -> &[usize] {
        &self.entries[self.starts[group]..self.starts[group + 1]]
    }
}

/// Bodies whose islands must be solved again. Bodies without an entry are marked.
#[derive(Debug, Clone, Copy)]
pub(super) struct Marked<'a>(pub(super) Option<&'a [bool]>);

impl Marked<'_> {
    pub(super) const NONE: Self = Self(None);

    pub(super) fn holds(self, body: usize) -> bool {
        self.0.is_some_and(|marked| marked.get(body).is_none_or(|marked| *marked))
    }
}

/// Forces of all candidates in the last steps (N).
#[derive(Debug, Clone, Default)]
pub(super) struct KnownForces {
    /// Forces in the last step.
    pub(super) before: Vec<Vector3<f64>>,
    /// Moments in the last step (N m). Empty without any.
    pub(super) moments: Vec<Vector3<f64>>,
    /// Extrapolation of the last two steps, in worlds with joints. Empty otherwise.
    pub(super) ahead: Vec<Vector3<f64>>,
}

/// Contacts of a step. The first `known` were present in the last call for the same step.
#[derive(Debug, Clone, Copy)]
pub(super) struct StepContacts<'a> {
    pub(super) contacts: &'a [Contact],
    pub(super) known: usize,
}

#[derive(Debug, Clone, Copy)]
pub(super) struct IslandView<'a> {
    /// Bodies, as world indices.
    pub(super) bodies: &'a [usize],
    /// Contacts, as candidate indices.
    pub(super) contacts: &'a [usize],
    /// Joints, as world indices.
    pub(super) joints: &'a [usize],
    /// Gears, as world indices.
    pub(super) gears: &'a [usize],
    /// Index of every body of the world in `bodies`.
    pub(super) places: &'a [usize],
    /// Forces of the candidates in the last steps.
    pub(super) known: &'a KnownForces,
    /// Relative change of the impulses between the last two steps. Infinite if no impulse acted.
    pub(super) unsettled: f64,
    /// True if it has no solution, or failed in several steps.
    pub(super) is_hopeless: bool,
}

impl IslandView<'_> {
    /// True if the island is large and its forces changed in the last step.
    pub(super) fn changes(&self) -> bool {
        let has_joints = !self.joints.is_empty();
        Settings::for_island(self.bodies.len(), self.contacts.len(), has_joints).is_large
            && self.unsettled > CHANGING
            && self.unsettled < f64::INFINITY
    }

    /// True if the island [changes](Self::changes) and has several bodies. Its solutions are
    /// preliminary until all its contacts are known, and each continues from the one before.
    pub(super) fn is_solved_twice(&self) -> bool {
        self.bodies.len() > 1 && self.changes()
    }
}

impl IslandPartition {
    /// Finds the islands of a step and those to be solved.
    ///
    /// An island must be solved if it has a new contact or a `marked` body. With `joints_are_new`
    /// every island with joints must be solved.
    #[inline]
    pub(super) fn find(
        &mut self,
        step: &Step<'_>,
        contacts: StepContacts<'_>,
        joints_are_new: bool,
        marked: Marked<'_>,
    ) {
        let StepContacts { contacts, known } = contacts;
        let (count, joints) = (step.states.len(), step.world.joints());
        if count == 1 && joints.is_empty() {
            self.set_only_one(contacts.len());
        } else {
            self.set_many(count, contacts, step.world);
            self.find_ahead(step, contacts);
        }
        let islands = self.bodies.len();
        self.changed.clear();
        let new = |island| {
            self.contacts.get(island).last().is_some_and(|place| *place >= known)
                || joints_are_new && !self.joints.get(island).is_empty()
        };
        let marked = |island| {
            marked.0.is_some() && self.bodies.get(island).iter().any(|body| marked.holds(*body))
        };
        self.changed.extend((0..islands).map(|island| new(island) || marked(island)));
        self.find_before(step, contacts, known);
        self.set_unsettled(step, islands);
    }

    /// Replaces the last forces by those solved so far in this step, for bodies that continue from
    /// them.
    pub(super) fn continue_from(
        &mut self,
        solved: &StepSolution,
        continues: impl Fn(usize) -> bool,
    ) {
        for (before, contact) in self.known.before.iter_mut().zip(&solved.contacts) {
            if continues(contact.key.body) {
                *before = contact.force;
            }
        }
        let moments = solved.contacts.iter().zip(&solved.moments);
        for (before, (contact, moment)) in self.known.moments.iter_mut().zip(moments) {
            if continues(contact.key.body) {
                *before = *moment;
            }
        }
    }

    /// Copies the last solution for islands whose bodies all rest.
    ///
    /// Their contacts must be unchanged and not from an earlier call. The flag in `rests` is
    /// cleared for all other bodies to be solved. Contacts of bodies in `aside` are left out.
    pub(super) fn keep(
        &mut self,
        step: &Step<'_>,
        contacts: StepContacts<'_>,
        aside: &[bool],
        rests: &mut [bool],
        solution: &mut StepSolution,
    ) {
        let StepContacts { contacts, known } = contacts;
        if !rests.contains(&true) {
            return;
        }
        // Bodies without an island have nothing to solve, unless their contacts are set aside.
        for (body, (rests, island)) in rests.iter_mut().zip(&self.islands).enumerate() {
            *rests &= *island != NONE || aside.get(body) == Some(&true);
        }
        let Self { bodies, contacts: held, joints, gears, changed, previous, .. } = self;
        let last = step.previous;
        for (island, changed) in changed.iter_mut().enumerate().filter(|(_, changed)| **changed) {
            let (bodies, held) = (bodies.get(island), held.get(island));
            // An island stays if all its bodies rest and all its contacts were there.
            let stays = known == 0
                && bodies.iter().all(|&body| rests.get(body) == Some(&true))
                && held.iter().all(|&place| {
                    previous.place(&last.contacts, &contacts[place].key, place).is_some()
                });
            if !stays {
                for &body in bodies {
                    rests.get_mut(body).into_iter().for_each(|rests| *rests = false);
                }
                continue;
            }
            // States, forces and moments of the last step
            *changed = false;
            bodies.iter().for_each(|&body| solution.states[body] = step.states[body]);
            for &place in held {
                let found = previous.place(&last.contacts, &contacts[place].key, place);
                let Some(found) = found else { continue };
                solution.contacts[place] = last.contacts[found];
                if let Some(moment) = solution.moments.get_mut(place) {
                    *moment = last.moment(found);
                }
            }
            for &joint in joints.get(island) {
                solution.joints[joint] = last.joints[joint];
            }
            for &gear in gears.get(island) {
                solution.gears[gear] = last.gears[gear];
            }
        }
    }

    /// Sets the island of a world of one body, without a search.
    fn set_only_one(&mut self, contacts: usize) {
        let listed = self.contacts.has_only_one(contacts) && self.joints.has_only_one(0);
        if !(listed && self.islands == [0]) {
            self.islands.clear();
            self.islands.push(0);
            self.places.clear();
            self.places.push(0);
            self.bodies.set_only_one(1);
            self.contacts.set_only_one(contacts);
            self.joints.set_only_one(0);
            self.gears.set_only_one(0);
        }
    }

    fn set_many(&mut self, count: usize, contacts: &[Contact], world: &World) {
        let (joints, gears) = (world.joints(), world.gears());
        let tied = |gear: &Gear| gear.axes().map(|axis| joints[axis.joint].body());
        self.sets.reset(count);
        self.islands.clear();
        self.islands.resize(count, NONE);
        for contact in contacts {
            if let Partner::Body(other) = contact.key.partner {
                self.sets.join(contact.key.body, other);
            }
        }
        for joint in joints {
            if let Some(other) = joint.other() {
                self.sets.join(joint.body(), other);
            }
        }
        for [a, b] in gears.iter().map(tied) {
            self.sets.join(a, b);
        }
        // Marks the first bodies of all islands with a contact or joint.
        let held = contacts.iter().map(|contact| contact.key.body);
        for body in held.chain(joints.iter().map(Joint::body)) {
            let first = self.sets.first(body);
            self.islands[first] = 0;
        }
        let mut islands = 0;
        for body in 0..count {
            let first = self.sets.first(body);
            if self.islands[first] == NONE {
                continue;
            }
            if first == body {
                self.islands[body] = islands;
                islands += 1;
            } else {
                // The island is known from its first body.
                self.islands[body] = self.islands[first];
            }
        }
        // Lists of each island
        self.bodies.sort(islands, self.islands.iter().copied());
        let of = contacts.iter().map(|contact| self.islands[contact.key.body]);
        self.contacts.sort(islands, of);
        let of = joints.iter().map(|joint| self.islands[joint.body()]);
        self.joints.sort(islands, of);
        let of = gears.iter().map(|gear| self.islands[tied(gear)[0]]);
        self.gears.sort(islands, of);
        self.places.clear();
        self.places.resize(count, 0);
        for island in 0..islands {
            for (place, &body) in self.bodies.get(island).iter().enumerate() {
                self.places[body] = place;
            }
        }
    }

    /// Looks up the last forces of the new contacts.
    fn find_before(&mut self, step: &Step<'_>, contacts: &[Contact], known: usize) {
        let Self { known: KnownForces { before, moments, .. }, previous, .. } = self;
        if known == 0 {
            previous.clear();
            moments.clear();
        }
        moments.truncate(known);
        previous.reserve(contacts.len());
        before.truncate(known);
        let first = before.len();
        before.extend(contacts[first..].iter().zip(first..).map(|(contact, place)| {
            let last = step.previous;
            let found = previous.place(&last.contacts, &contact.key, place);
            if !last.moments.is_empty() {
                moments.push(found.map_or(Vector3::zeros(), |found| last.moment(found)));
            }
            found.map_or(Vector3::zeros(), |found| last.contacts[found].force)
        }));
    }

    /// Extrapolates the forces of the last two steps. A contact absent in one of them keeps its
    /// last force.
    fn find_ahead(&mut self, step: &Step<'_>, contacts: &[Contact]) {
        self.known.ahead.clear();
        let Some(before) = step.earlier.filter(|_| !step.world.joints().is_empty()) else { return };
        let Self { known: KnownForces { ahead, .. }, previous, earlier, .. } = self;
        for index in [&mut *previous, &mut *earlier] {
            index.clear();
            index.reserve(contacts.len());
        }
        ahead.extend(contacts.iter().enumerate().map(|(place, contact)| {
            let now = previous.find(&step.previous.contacts, &contact.key, place);
            let before = earlier.find(&before.contacts, &contact.key, place);
            let now = now.map_or(Vector3::zeros(), |now| now.force);
            before.map_or(now, |before| 2.0 * now - before.force)
        }));
    }

    /// Computes the relative impulse change of each island.
    fn set_unsettled(&mut self, step: &Step<'_>, islands: usize) {
        self.unsettled.clear();
        self.unsettled.resize(islands, f64::INFINITY);
        let Some(earlier) = step.earlier else { return };
        // Largest change and largest impulse of each island.
        self.changes.clear();
        self.changes.resize(islands, (0.0, 0.0));
        self.earlier.clear();
        self.earlier.reserve(step.previous.contacts.len());
        for (place, contact) in step.previous.contacts.iter().enumerate() {
            // The last solutions may belong to another world.
            let island = self.islands.get(contact.key.body);
            let Some((apart, largest)) = island.and_then(|island| self.changes.get_mut(*island))
            else {
                continue;
            };
            let before = self.earlier.find(&earlier.contacts, &contact.key, place);
            let before = before.map_or(Vector3::zeros(), |before| before.force);
            *apart = apart.max((contact.force - before).amax());
            *largest = largest.max(contact.force.amax());
        }
        // Joints and gears count like contacts.
        let joints = step.world.joints().iter().zip(&step.previous.joints);
        for (index, (joint, now)) in joints.enumerate() {
            let island = self.islands.get(joint.body());
            let Some((apart, largest)) = island.and_then(|island| self.changes.get_mut(*island))
            else {
                continue;
            };
            let Some(before) = earlier.joints.get(index) else { continue };
            let (force, torque) = (now.force - before.force, now.torque - before.torque);
            *apart = apart.max(force.amax()).max(torque.amax());
            *largest = largest.max(now.force.amax()).max(now.torque.amax());
        }
        let gears = step.world.gears().iter().zip(&step.previous.gears);
        for ((gear, now), before) in gears.zip(&earlier.gears) {
            let island = self.islands.get(step.world.joints()[gear.axes()[0].joint].body());
            let Some((apart, largest)) = island.and_then(|island| self.changes.get_mut(*island))
            else {
                continue;
            };
            *apart = apart.max((now - before).abs());
            *largest = largest.max(now.abs());
        }
        for (unsettled, (apart, largest)) in self.unsettled.iter_mut().zip(&self.changes) {
            if *largest > 0.0 {
                *unsettled = apart / largest;
            }
        }
    }

    /// Sets the flags of bodies whose islands get less effort, one per body or none.
    pub(super) fn expect_failure(&mut self, bodies: &[bool]) {
        bodies.clone_into(&mut self.hopeless);
    }

    pub(super) fn len(&self) -> usize {
        self.changed.len()
    }

    /// First body of every island.
    pub(super) fn first_bodies(&self) -> impl Iterator<Item = usize> {
        (0..self.len()).map(|number| self.bodies.get(number)[0])
    }

    /// Island `number`, if it must be solved.
    pub(super) fn changed_one(&self, number: usize) -> Option<IslandView<'_>> {
        self.changed[number].then(|| self.get(number))
    }

    fn get(&self, number: usize) -> IslandView<'_> {
        IslandView {
            bodies: self.bodies.get(number),
            contacts: self.contacts.get(number),
            joints: self.joints.get(number),
            gears: self.gears.get(number),
            places: &self.places,
            known: &self.known,
            unsettled: self.unsettled[number],
            is_hopeless: !self.hopeless.is_empty()
                && self.bodies.get(number).iter().any(|&body| self.hopeless[body]),
        }
    }

    /// All islands with their numbers.
    pub(super) fn all(&self) -> impl Iterator<Item = (usize, IslandView<'_>)> {
        (0..self.len()).map(|number| (number, self.get(number)))
    }

    /// All islands to be solved, with their numbers.
    pub(super) fn changed(&self) -> impl Iterator<Item = (usize, IslandView<'_>)> {
        (0..self.len()).filter_map(|number| Some((number, self.changed_one(number)?)))
    }
}
