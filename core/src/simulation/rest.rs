//! What rests: a step whose givens are all those of the step before ends as that one did.
//!
//! A step depends on the states, the two solutions before it, what acts from outside, the world, and what the search for
//! contacts remembers, and on nothing else where its solver [repeats](StepSolver::repeats) itself. Where it leaves
//! all of them as they were, to the last bit, so does the next one, and every one after it until something is changed from outside.
//! Such a step is known before free flight: no contact is found again, nothing solved, certified or held against other
//! pieces, because all of it would come out as it did.

use super::{Scratch, Simulation, StepRecord};
use crate::contact::{Certificate, Contact, Memory};
use crate::joint::JointForce;
use crate::mechanics::{State, Wrench};
use crate::step::{ContactForce, StepReport, StepSolution, StepSolver};
use nalgebra::Vector3;

/// The last step, where it left all as it was.
#[derive(Debug, Clone, Default)]
pub(super) struct Rest {
    /// Whether the step at hand begins with the states and forces of the step before.
    begins: bool,
    /// What the search remembered at its start.
    memory: Memory,
    /// What acted on the bodies in it, and what else it came to.
    wrenches: Vec<Wrench>,
    contacts: Vec<Contact>,
    last: Option<Came>,
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

impl Rest {
    /// Something is changed from outside: the next step is another one.
    pub(super) fn end(&mut self) {
        (self.last, self.begins) = (None, false);
    }

    /// Notes what a step begins with, where its solution may be that of the step before.
    pub(super) fn begin(
        &mut self,
        (now, before): (&StepSolution, Option<&StepSolution>),
        memory: &Memory,
        solver: &dyn StepSolver,
    ) {
        self.last = None;
        let repeats = before.is_some_and(|before| is_same(now, before));
        self.begins = repeats && solver.repeats();
        if self.begins {
            self.memory.copy_from(memory);
        }
    }
}

impl Simulation<'_> {
    /// Takes the step to come where it is the last one again; its wrenches are set. Returns whether it did.
    #[inline(never)]
    pub(super) fn rest(&mut self, record: &mut StepRecord) -> bool {
        let Scratch { rest, wrenches, .. } = &self.scratch;
        let Some(came) = rest.last else { return false };
        let bits = |wrench: &Wrench| [wrench.force, wrench.torque].map(bits_of);
        if !wrenches.iter().map(bits).eq(rest.wrenches.iter().map(bits)) {
            return false;
        }
        record.index = self.index;
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
        self.taken_back = false;
        self.index += 1;
        true
    }

    /// Notes whether the step that was taken last, which `record` describes, left all as it was.
    pub(super) fn note_rest(&mut self, record: &StepRecord) {
        let Self { now, before, driving, scratch, .. } = self;
        let Scratch { rest, wrenches, candidates, .. } = scratch;
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

/// Whether two solutions are the same to the last bit, also in the sign of what is zero.
fn is_same(one: &StepSolution, other: &StepSolution) -> bool {
    let of_state = |state: &State| {
        let State { position, attitude, velocity, spin } = state;
        (bits_of(*position), bits_of(*velocity), bits_of(*spin), attitude.map(f64::to_bits))
    };
    let of_contact =
        |contact: &ContactForce| (contact.key, bits_of(contact.force), bits_of(contact.slip));
    let of_joint = |joint: &JointForce| [joint.force, joint.torque, joint.angles].map(bits_of);
    one.states.iter().map(of_state).eq(other.states.iter().map(of_state))
        && one.contacts.iter().map(of_contact).eq(other.contacts.iter().map(of_contact))
        && one.joints.iter().map(of_joint).eq(other.joints.iter().map(of_joint))
        && one.gears.iter().map(|f| f.to_bits()).eq(other.gears.iter().map(|f| f.to_bits()))
}

fn bits_of(vector: Vector3<f64>) -> [u64; 3] {
    [vector.x, vector.y, vector.z].map(f64::to_bits)
}
