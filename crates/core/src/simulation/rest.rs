//! What rests: a step whose givens are all those of the step before ends as that one did.
//!
//! A step depends on the states, the two solutions before it, what acts from outside, the world, and what the search for
//! contacts remembers, and on nothing else where its solver [repeats](StepSolver::repeats) itself. Where it leaves
//! all of them as they were, to the last bit, so does the next one, and every one after it until something is changed from outside.
//! Such a step is known before free flight: no contact is found again, nothing solved, certified or held against other
//! pieces, because all of it would come out as it did.
//!
//! Where something moves elsewhere, the same is said of islands: of bodies that have not moved, whose contacts are those of the
//! last step with the forces that they had in the two before. Contacts are found as ever, from what is known of pieces that
//! have not moved; if no other joins, the island is not solved, and not certified again.

use super::islands::Islands;
use super::{Simulation, StepRecord, StepScratch};
use crate::contact::{Certificate, Contact, ContactKey, KeyIndex, Memory};
use crate::joint::JointForce;
use crate::mechanics::{State, Wrench};
use crate::step::{ContactForce, StepReport, StepSolution, StepSolver, StepStatus};
use nalgebra::Vector3;

/// The last step, where it left all as it was.
#[derive(Debug, Clone, Default)]
pub(super) struct RestingBodies {
    /// Whether the step at hand begins with the states and forces of the step before.
    begins: bool,
    /// What the search remembered at its start.
    memory: Memory,
    /// What acted on the bodies in it, and what else it came to.
    wrenches: Vec<Wrench>,
    contacts: Vec<Contact>,
    last: Option<Came>,
    /// Whether the last step was the one before it again.
    stays: bool,
    /// Whether the solver repeats itself.
    repeats: bool,
    /// The bodies for whose islands the step at hand is the last one again, and after it those that were left so.
    bodies: Vec<bool>,
    /// Whether the solver knows that none rests.
    none_told: bool,
    /// What acted on the bodies in the last step.
    loads: Vec<Wrench>,
    /// How many contacts the step at hand began with.
    found: usize,
    /// The bodies that were to rest and did, and those that have not moved.
    still: Vec<bool>,
    /// Of the first body of an island whether it touches something or is tied.
    ties: Vec<bool>,
    islands: Islands,
    indices: [KeyIndex; 2],
}

/// What a step came to beside its solution.
#[derive(Debug, Clone, Copy)]
struct Came {
    report: StepReport,
    certificate: Certificate,
    restitution_share: f64,
    stiffness: f64,
    overlap: f64,
}

impl RestingBodies {
    /// Something is changed from outside: the next step is another one.
    pub(super) fn end(&mut self) {
        (self.last, self.begins, self.none_told, self.stays) = (None, false, false, false);
        self.bodies.clear();
        self.loads.clear();
    }

    /// Whether the last step was the one before it again, to the last bit.
    #[cfg(feature = "save")]
    pub(super) fn stays(&self) -> bool {
        self.stays
    }

    /// Whether the step to come may be the last one again.
    #[inline]
    pub(super) fn is_known(&self) -> bool {
        self.last.is_some()
    }

    /// The bodies of islands that rest; none at all where none does.
    pub(super) fn bodies(&self) -> &[bool] {
        &self.bodies
    }

    /// Tells a solver which bodies rest, if some do or did.
    #[inline]
    pub(super) fn tell(&mut self, solver: &mut dyn StepSolver) {
        let none = self.bodies.is_empty();
        if !(none && self.none_told) {
            if let Some(solver) = solver.islands() {
                solver.expect_rest(&self.bodies);
            }
            self.none_told = none;
        }
    }

    /// Makes room for what a step at rest comes to, so that none is to be made when it comes.
    #[inline]
    fn make_room(&mut self, contacts: usize, bodies: usize) {
        if self.contacts.capacity() < contacts || self.wrenches.capacity() < bodies {
            self.contacts.clear();
            self.contacts.reserve(contacts);
            self.wrenches.clear();
            self.wrenches.reserve(bodies);
        }
    }

    /// Notes how many contacts a step begins with.
    pub(super) fn found(&mut self, contacts: usize) {
        self.found = contacts;
    }

    /// Leaves those out that the solver did not leave as they were.
    #[inline]
    pub(super) fn keep(&mut self, rested: impl Fn(usize) -> bool) {
        if self.bodies.is_empty() {
            return;
        }
        self.bodies.iter_mut().enumerate().for_each(|(body, rests)| *rests &= rested(body));
        if !self.bodies.contains(&true) {
            self.bodies.clear();
        }
    }

    /// Wakes the islands of bodies on which something else acts than in the last step.
    fn wake(&mut self, wrenches: &[Wrench]) {
        let Self { bodies, loads, islands, still, .. } = self;
        if bodies.is_empty() {
            return;
        }
        let is_other = |body: usize| match loads.get(body) {
            Some(load) => bits_of_wrench(load) != bits_of_wrench(&wrenches[body]),
            None => true,
        };
        still.clear();
        still.resize(bodies.len(), true);
        for body in (0..bodies.len()).filter(|body| bodies[*body] && is_other(*body)) {
            still[islands.of(body)] = false;
        }
        for (body, rests) in bodies.iter_mut().enumerate().filter(|(_, rests)| **rests) {
            *rests = still[islands.of(body)];
        }
    }

    /// Notes what a step begins with, where its solution may be that of the step before.
    pub(super) fn begin(
        &mut self,
        now: &StepSolution,
        before: Option<&StepSolution>,
        memory: &Memory,
        solver: &mut dyn StepSolver,
        wrenches: &[Wrench],
    ) {
        (self.last, self.stays) = (None, false);
        let repeats = before.is_some_and(|before| !moves(now, before) && is_same(now, before));
        // One body by itself is all that can rest.
        self.repeats = (repeats || wrenches.len() > 1) && solver.islands().is_some();
        self.begins = repeats && self.repeats;
        self.wake(wrenches);
        if self.begins {
            self.memory.copy_from(memory);
        }
    }
}

impl Simulation<'_> {
    /// Takes the step to come where it is the last one again; its wrenches are set. Returns whether it did.
    #[inline(never)]
    pub(super) fn rest(&mut self, record: &mut StepRecord) -> bool {
        let StepScratch { rest, wrenches, .. } = &self.scratch;
        let Some(came) = rest.last else { return false };
        let of_wrench = bits_of_wrench;
        if !wrenches.iter().map(of_wrench).eq(rest.wrenches.iter().map(of_wrench)) {
            return false;
        }
        record.index = self.index;
        record.squeeze = None;
        record.report = came.report;
        record.certificate = came.certificate;
        record.restitution_share = came.restitution_share;
        record.stiffness = came.stiffness;
        record.overlap = came.overlap;
        record.states.clear();
        record.states.extend_from_slice(&self.now.states);
        record.solution.copy_from(&self.now);
        record.contacts.clear();
        record.contacts.extend_from_slice(&rest.contacts);
        // This solution and those before are one.
        self.scratch.rest.stays = true;
        self.taken_back = false;
        self.index += 1;
        true
    }

    /// Notes whether the step that was taken last, which `record` describes, left all as it was.
    pub(super) fn note_rest(&mut self, record: &StepRecord) {
        let Self { now, before, driving, scratch, .. } = self;
        let StepScratch { rest, wrenches, candidates, .. } = scratch;
        rest.make_room(record.contacts.len(), wrenches.len());
        let is_left = rest.begins
            && driving.is_idle()
            && before.as_ref().is_some_and(|before| is_same(now, before))
            && rest.memory == *candidates.memory();
        if is_left {
            rest.wrenches.clone_from(wrenches);
            rest.contacts.clone_from(&record.contacts);
            rest.last = Some(Came {
                report: record.report,
                certificate: record.certificate,
                restitution_share: record.restitution_share,
                stiffness: record.stiffness,
                overlap: record.overlap,
            });
        }
    }
}

impl Simulation<'_> {
    /// Notes for which islands the step that was taken last, which `record` describes, left all as it was.
    pub(super) fn note_islands(&mut self, record: &StepRecord) {
        let Self { now, before, long_before, driving, scratch, world, .. } = self;
        let StepScratch { rest, wrenches, .. } = scratch;
        let RestingBodies { bodies, loads, found, still, ties, islands, indices, repeats, .. } =
            rest;
        let (Some(before), Some(long_before)) = (before, long_before) else { return };
        let count = now.states.len();
        let can_rest = *repeats && driving.is_idle();
        let pasts = [before, long_before].map(|past| &*past);
        if !can_rest || pasts.iter().any(|past| past.states.len() != count) {
            bodies.clear();
            loads.clone_from(wrenches);
            return;
        }
        let rested = |body: usize| bodies.get(body).is_some_and(|rests| *rests);
        let has_moved = |body: usize| {
            let state = of_state(&now.states[body]);
            pasts.iter().any(|past| of_state(&past.states[body]) != state)
        };
        still.clear();
        still.extend((0..count).map(|body| rested(body) || !has_moved(body)));
        let falls_asleep = record.report.status == StepStatus::Converged
            && (0..count).any(|body| still[body] && !rested(body));
        if falls_asleep {
            islands.find(count, now.contacts.iter().map(|contact| &contact.key), world);
            // By islands from here on: whether all of one is as it was, and whether it has a contact or a joint.
            ties.clear();
            ties.resize(count, false);
            for body in 0..count {
                still[islands.of(body)] &= still[body];
            }
            indices.iter_mut().for_each(KeyIndex::clear);
            for (place, contact) in now.contacts.iter().enumerate() {
                let island = islands.of(contact.key.body);
                ties[island] = true;
                if !still[island] || rested(contact.key.body) {
                    continue;
                }
                let is_as_it_was = pasts.iter().zip(&mut *indices).all(|(past, index)| {
                    let found = index.find(&past.contacts, &contact.key, place);
                    found.is_some_and(|found| of_contact(found) == of_contact(contact))
                });
                still[island] = place < *found && is_as_it_was;
            }
            for (index, joint) in world.joints().iter().enumerate() {
                let island = islands.of(joint.body());
                ties[island] = true;
                let of = |solution: &StepSolution| solution.joints.get(index).map(of_joint);
                still[island] &= pasts.iter().all(|past| of(past) == of(now));
            }
            for (index, gear) in world.gears().iter().enumerate() {
                let island = islands.of(world.joints()[gear.axes()[0].joint].body());
                let of = |solution: &StepSolution| solution.gears.get(index).map(|f| f.to_bits());
                still[island] &= pasts.iter().all(|past| of(past) == of(now));
            }
            bodies.clear();
            bodies.extend((0..count).map(|body| {
                let island = islands.of(body);
                still[island] && ties[island]
            }));
            if !bodies.contains(&true) {
                bodies.clear();
            }
        }
        loads.clone_from(wrenches);
    }
}

type Bits = [u64; 3];

fn of_state(state: &State) -> (Bits, Bits, Bits, [u64; 4]) {
    let State { position, attitude, velocity, spin } = state;
    let attitude = attitude.map(f64::to_bits).into();
    (bits_of(*position), bits_of(*velocity), bits_of(*spin), attitude)
}

fn of_contact(contact: &ContactForce) -> (ContactKey, Bits, Bits) {
    (contact.key, bits_of(contact.force), bits_of(contact.slip))
}

fn of_joint(joint: &JointForce) -> [Bits; 3] {
    [joint.force, joint.torque, joint.angles].map(bits_of)
}

fn bits_of_wrench(wrench: &Wrench) -> [Bits; 2] {
    [wrench.force, wrench.torque].map(bits_of)
}

/// Whether the first body has other velocities in two solutions, which says at once that they are not the same.
#[inline]
fn moves(one: &StepSolution, other: &StepSolution) -> bool {
    let of_first = |solution: &StepSolution| solution.states.first().map(|s| bits_of(s.velocity));
    of_first(one) != of_first(other)
}

/// Whether two solutions are the same to the last bit, also in the sign of what is zero.
#[inline(never)]
fn is_same(one: &StepSolution, other: &StepSolution) -> bool {
    one.states.iter().map(of_state).eq(other.states.iter().map(of_state))
        && one.contacts.iter().map(of_contact).eq(other.contacts.iter().map(of_contact))
        && one.joints.iter().map(of_joint).eq(other.joints.iter().map(of_joint))
        && one.gears.iter().map(|f| f.to_bits()).eq(other.gears.iter().map(|f| f.to_bits()))
}

fn bits_of(vector: Vector3<f64>) -> [u64; 3] {
    [vector.x, vector.y, vector.z].map(f64::to_bits)
}
