//! Resting bodies: a step with exactly the input of the previous step has the same result.
//!
//! The input of a step is the states, the two previous solutions, the loads, the world and the
//! memory of the contact search. With an [`IslandSolver`](crate::step::IslandSolver), a step is a
//! deterministic function of them. If a step leaves all of them unchanged to the last bit, so does
//! every later one until an input changes. Such a step is copied: free flight, detection, solve and
//! certificate are skipped.
//!
//! If other bodies move, the same holds for single islands. An island rests if its bodies have not
//! moved and its contact forces were the same in the last two steps. If no new contact appears, the
//! island is neither solved nor certified again. From the second step with the same islands at rest
//! on, their contacts are [set aside](crate::contact::Candidates::aside).

use super::inputs::Inputs;
use super::instants::AddedError;
use super::interval::Interval;
use super::islands::Islands;
use super::moment::Moment;
use super::{EnergyGain, UnphysicalCause};
use crate::contact::certificate::{Certifier, Claim};
use crate::contact::{Certificate, Contact, ContactKey, ContactLoad, KeyIndex, Memory};
use crate::joint::JointForce;
use crate::mechanics::{State, Wrench};
use crate::step::{ContactForce, StepReport, StepSolution, StepSolver, StepStatus};
use crate::world::World;
use nalgebra::Vector3;
use std::sync::Arc;

/// Identity of a rest of a simulation: of the steps that repeat one and the same step.
#[derive(Debug, Clone)]
pub(super) struct RestKey {
    owner: Arc<()>,
    /// Number of the rest.
    count: u64,
}

impl PartialEq for RestKey {
    fn eq(&self, other: &Self) -> bool {
        Arc::ptr_eq(&self.owner, &other.owner) && self.count == other.count
    }
}

/// Detection of steps and islands at rest.
#[derive(Debug)]
pub(super) struct RestingBodies {
    /// The present or next rest.
    key: RestKey,
    /// True if the current step starts with the states and forces of the previous one.
    begins: bool,
    /// Memory of the contact search at its start.
    memory: Memory,
    /// Wrenches and contacts of the resting step; `last` holds its other results.
    wrenches: Vec<Wrench>,
    contacts: Vec<Contact>,
    last: Option<StepDiagnostics>,
    /// True if the last step repeated the previous one.
    stays: bool,
    /// True if the solver is deterministic.
    repeats: bool,
    /// Resting bodies of the current step; after the step, those that the solver left unchanged.
    bodies: Vec<bool>,
    /// True if the solver was informed that no body rests.
    reported_no_rest: bool,
    /// Wrenches of the last step.
    loads: Vec<Wrench>,
    /// Number of contacts at the start of the current step.
    found: usize,
    /// Bodies that were expected to rest and did, or that have not moved.
    still: Vec<bool>,
    /// True for the first body of an island with a contact or joint.
    ties: Vec<bool>,
    islands: Islands,
    indices: [KeyIndex; 2],
    /// Certificate of resting bodies, and their flags in the interval that it was computed in.
    certified: (Vec<bool>, Certificate),
}

/// Results of a step besides its solution.
#[derive(Debug, Clone, Copy)]
struct StepDiagnostics {
    report: StepReport,
    certificate: Certificate,
    restitution_share: f64,
    stiffness: f64,
    overlap: f64,
    placement: f64,
    unphysical: Option<UnphysicalCause>,
    gain: Option<EnergyGain>,
}

impl RestingBodies {
    pub(super) fn new() -> Self {
        Self {
            key: RestKey { owner: Arc::new(()), count: 0 },
            begins: false,
            memory: Memory::default(),
            wrenches: Vec::new(),
            contacts: Vec::new(),
            last: None,
            stays: false,
            repeats: false,
            bodies: Vec::new(),
            reported_no_rest: false,
            loads: Vec::new(),
            found: 0,
            still: Vec::new(),
            ties: Vec::new(),
            islands: Islands::default(),
            indices: Default::default(),
            certified: Default::default(),
        }
    }

    /// Identity of the present or next rest.
    pub(super) fn key(&self) -> &RestKey {
        &self.key
    }

    /// Clears all flags after a change of an input.
    pub(super) fn end(&mut self) {
        (self.last, self.begins, self.reported_no_rest, self.stays) = (None, false, false, false);
        self.bodies.clear();
        self.loads.clear();
        self.certified.0.clear();
    }

    /// True if the last step repeated the previous one to the last bit.
    pub(super) fn stays(&self) -> bool {
        self.stays
    }

    /// True if the next step may repeat the last one.
    #[inline]
    pub(super) fn is_known(&self) -> bool {
        self.last.is_some()
    }

    /// Flags of bodies in resting islands; empty if none rests.
    pub(super) fn bodies(&self) -> &[bool] {
        &self.bodies
    }

    /// Informs the solver of the resting bodies, if there are or were any.
    #[inline]
    pub(super) fn tell(&mut self, solver: &mut dyn StepSolver) {
        let none = self.bodies.is_empty();
        if !(none && self.reported_no_rest) {
            if let Some(solver) = solver.islands() {
                solver.expect_rest(&self.bodies);
            }
            self.reported_no_rest = none;
        }
    }

    /// Reserves memory for the results of a resting step in advance.
    #[inline]
    fn make_room(&mut self, contacts: usize, bodies: usize) {
        if self.contacts.capacity() < contacts || self.wrenches.capacity() < bodies {
            self.contacts.clear();
            self.contacts.reserve(contacts);
            self.wrenches.clear();
            self.wrenches.reserve(bodies);
        }
    }

    /// Stores the number of contacts at the start of a step.
    pub(super) fn found(&mut self, contacts: usize) {
        self.found = contacts;
    }

    /// Clears the flags of bodies that the solver did not leave unchanged.
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

    /// Wakes islands with a wrench that differs from the last step's.
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
            still[islands.label(body)] = false;
        }
        for (body, rests) in bodies.iter_mut().enumerate().filter(|(_, rests)| **rests) {
            *rests = still[islands.label(body)];
        }
    }

    /// Stores the start of a step whose solution may equal the previous one.
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
        // Islands can rest only if there is more than one body.
        self.repeats = (repeats || wrenches.len() > 1) && solver.islands().is_some();
        self.begins = repeats && self.repeats;
        self.wake(wrenches);
        if self.begins {
            self.memory.copy_from(memory);
        }
    }
}

impl RestingBodies {
    /// Certifies the step of `world` in `claim` with the `loads` of its contacts. Bodies that rested in
    /// the last interval too keep their part: their states, contacts and forces are the same. Resting
    /// bodies touch no others.
    pub(super) fn certify<L: IntoIterator<Item: Into<ContactLoad>> + Clone>(
        &mut self,
        world: &World,
        claim: &Claim<'_>,
        certifier: &mut Certifier,
        loads: L,
    ) -> Certificate {
        let Self { bodies, certified: (known, certificate), .. } = self;
        if bodies.is_empty() {
            known.clear();
            return certifier.contact_step(world, claim, loads);
        }
        if known != bodies {
            known.clone_from(bodies);
            let rests = |body: usize| bodies[body];
            let resting = certifier.bodies_of_step(world, claim, loads.clone(), rests);
            // Joints are certified with the moving bodies.
            *certificate = Certificate { joint: 0.0, joint_law: 0.0, ..resting };
        }
        certifier.bodies_of_step(world, claim, loads, |body| !bodies[body]).joined(certificate)
    }

    /// Describes the interval from `moment` as a copy of the one before in `taken`, if its wrenches
    /// are the same. Returns true if they are. The moment stays as it is. Nothing is copied if `taken` is such a
    /// copy already.
    #[inline(never)]
    pub(super) fn repeat(
        &mut self,
        moment: &Moment,
        wrenches: &[Wrench],
        taken: &mut Interval,
        is_copy: bool,
    ) -> bool {
        let Some(diagnostics) = self.last else { return false };
        let of_wrench = bits_of_wrench;
        if !wrenches.iter().map(of_wrench).eq(self.wrenches.iter().map(of_wrench)) {
            return false;
        }
        // The stored solutions are all equal.
        self.stays = true;
        if is_copy {
            return true;
        }
        taken.infeasible_gap = None;
        taken.report = diagnostics.report;
        taken.certificate = diagnostics.certificate;
        taken.restitution_share = diagnostics.restitution_share;
        taken.stiffness = diagnostics.stiffness;
        taken.overlap = diagnostics.overlap;
        taken.placement = diagnostics.placement;
        taken.unphysical = diagnostics.unphysical;
        taken.gain = diagnostics.gain;
        taken.errors = AddedError::default();
        taken.states.clear();
        taken.states.extend_from_slice(&moment.now.states);
        taken.instants.clear();
        taken.ends.clear();
        taken.extrapolated.clear();
        if let Some(instants) = &moment.instants {
            taken.instants.extend_from_slice(&instants.states);
            taken.ends.extend_from_slice(&instants.states);
            let bodies = 0..instants.states.len();
            taken.extrapolated.extend(bodies.map(|body| instants.is_extrapolated(body)));
        }
        taken.solution.copy_from(&moment.now);
        taken.contacts.clear();
        taken.contacts.extend_from_slice(&self.contacts);
        true
    }

    /// Notes what the interval `taken`, which ended at `moment`, left as it was.
    pub(super) fn note(
        &mut self,
        world: &World,
        moment: &Moment,
        inputs: &Inputs,
        wrenches: &[Wrench],
        taken: &Interval,
    ) {
        self.note_all(moment, inputs, wrenches, taken);
        // A single body is covered by `note_all`.
        if moment.now.states.len() > 1 {
            self.note_islands(world, moment, inputs, wrenches, taken);
        }
    }

    /// Checks whether the interval left everything unchanged.
    fn note_all(
        &mut self,
        moment: &Moment,
        inputs: &Inputs,
        wrenches: &[Wrench],
        taken: &Interval,
    ) {
        self.make_room(taken.contacts.len(), wrenches.len());
        let is_left = self.begins
            && inputs.driving.is_idle()
            && moment.before.as_ref().is_some_and(|before| is_same(&moment.now, before))
            && self.memory == *moment.search;
        if is_left {
            self.wrenches.clear();
            self.wrenches.extend_from_slice(wrenches);
            self.contacts.clone_from(&taken.contacts);
            self.key.count += 1;
            self.last = Some(StepDiagnostics {
                report: taken.report,
                certificate: taken.certificate,
                restitution_share: taken.restitution_share,
                stiffness: taken.stiffness,
                overlap: taken.overlap,
                placement: taken.placement,
                unphysical: taken.unphysical,
                gain: taken.gain,
            });
        }
    }

    /// Checks which islands the interval left unchanged.
    fn note_islands(
        &mut self,
        world: &World,
        moment: &Moment,
        inputs: &Inputs,
        wrenches: &[Wrench],
        taken: &Interval,
    ) {
        let Self { bodies, loads, found, still, ties, islands, indices, repeats, .. } = self;
        let Moment { now, before: Some(before), long_before: Some(long_before), .. } = moment
        else {
            return;
        };
        let count = now.states.len();
        let can_rest = *repeats && inputs.driving.is_idle();
        let pasts = [before, long_before];
        if !can_rest || pasts.iter().any(|past| past.states.len() != count) {
            bodies.clear();
            loads.clear();
            loads.extend_from_slice(wrenches);
            return;
        }
        let rested = |body: usize| bodies.get(body).is_some_and(|rests| *rests);
        let has_moved = |body: usize| {
            let state = state_bits(&now.states[body]);
            pasts.iter().any(|past| state_bits(&past.states[body]) != state)
        };
        still.clear();
        still.extend((0..count).map(|body| rested(body) || !has_moved(body)));
        let falls_asleep = taken.report.status == StepStatus::Converged
            && (0..count).any(|body| still[body] && !rested(body));
        if falls_asleep {
            islands.find(count, now.contacts.iter().map(|contact| &contact.key), world);
            // From here on `still` and `ties` are per island: all its bodies are unchanged, and it
            // has a contact or joint.
            ties.clear();
            ties.resize(count, false);
            for body in 0..count {
                still[islands.label(body)] &= still[body];
            }
            indices.iter_mut().for_each(KeyIndex::clear);
            for (place, contact) in now.contacts.iter().enumerate() {
                let island = islands.label(contact.key.body);
                ties[island] = true;
                if !still[island] || rested(contact.key.body) {
                    continue;
                }
                let is_as_it_was = pasts.iter().zip(&mut *indices).all(|(past, index)| {
                    let found = index.find(&past.contacts, &contact.key, place);
                    found.is_some_and(|found| contact_bits(found) == contact_bits(contact))
                });
                still[island] = place < *found && is_as_it_was;
            }
            for (index, joint) in world.joints().iter().enumerate() {
                let island = islands.label(joint.body());
                ties[island] = true;
                let of = |solution: &StepSolution| solution.joints.get(index).map(joint_bits);
                still[island] &= pasts.iter().all(|past| of(past) == of(now));
            }
            for (index, gear) in world.gears().iter().enumerate() {
                let island = islands.label(world.joints()[gear.axes()[0].joint].body());
                let of = |solution: &StepSolution| solution.gears.get(index).map(|f| f.to_bits());
                still[island] &= pasts.iter().all(|past| of(past) == of(now));
            }
            bodies.clear();
            bodies.extend((0..count).map(|body| {
                let island = islands.label(body);
                still[island] && ties[island]
            }));
            if !bodies.contains(&true) {
                bodies.clear();
            }
        }
        loads.clear();
        loads.extend_from_slice(wrenches);
    }
}

type Bits = [u64; 3];

fn state_bits(state: &State) -> (Bits, Bits, Bits, [u64; 4]) {
    let State { position, attitude, velocity, spin } = state;
    let attitude = attitude.map(f64::to_bits).into();
    (bits_of(*position), bits_of(*velocity), bits_of(*spin), attitude)
}

fn contact_bits(contact: &ContactForce) -> (ContactKey, Bits, Bits) {
    (contact.key, bits_of(contact.force), bits_of(contact.slip))
}

fn joint_bits(joint: &JointForce) -> [Bits; 3] {
    [joint.force, joint.torque, joint.angles].map(bits_of)
}

fn bits_of_wrench(wrench: &Wrench) -> [Bits; 2] {
    [wrench.force, wrench.torque].map(bits_of)
}

/// True if the velocity of the first body differs between two solutions. This is a quick test
/// before [`is_same`].
#[inline]
fn moves(one: &StepSolution, other: &StepSolution) -> bool {
    let of_first = |solution: &StepSolution| solution.states.first().map(|s| bits_of(s.velocity));
    of_first(one) != of_first(other)
}

/// True if two solutions are equal to the last bit, including signs of zeros.
#[inline(never)]
fn is_same(one: &StepSolution, other: &StepSolution) -> bool {
    one.states.iter().map(state_bits).eq(other.states.iter().map(state_bits))
        && one.contacts.iter().map(contact_bits).eq(other.contacts.iter().map(contact_bits))
        && one.joints.iter().map(joint_bits).eq(other.joints.iter().map(joint_bits))
        && one.gears.iter().map(|f| f.to_bits()).eq(other.gears.iter().map(|f| f.to_bits()))
}

fn bits_of(vector: Vector3<f64>) -> [u64; 3] {
    [vector.x, vector.y, vector.z].map(f64::to_bits)
}
