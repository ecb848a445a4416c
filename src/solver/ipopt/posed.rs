//! Choice of the contacts in the program, and repeated solves with contacts that were missing.
//!
//! A candidate that moves sideways without force leaves the program without a feasible optimum
//! (docs/formulation.md, section 8). The program therefore poses only the candidates that free
//! flight closes, and clamps the others. If the result penetrates at another candidate, that one is
//! added and the step is solved again. An open contact without force obeys the contact law, posed
//! or not. A step without posed contacts is free flight. The tutorial poses all candidates and
//! solves once.

use super::BODY;
use super::program::{Attempted, IpoptEffort, IpoptProgram, StartMultipliers};
use crate::step_nlp::ProgramPoint;
use tumble_core::contact::{Candidates, Contact, ContactKey};
use tumble_core::error::Error;
use tumble_core::mechanics::State;
use tumble_core::step::Step;

/// Indices of the candidates in the program, ascending.
#[derive(Debug, Clone, Default, PartialEq)]
pub(super) struct PosedContacts(Vec<usize>);

impl PosedContacts {
    /// Selects the candidates for which `takes_part` is true.
    pub(super) fn new(
        candidates: &[Contact],
        mut takes_part: impl FnMut(usize, &Contact) -> bool,
    ) -> Self {
        let taken = candidates.iter().enumerate().filter(|(at, contact)| takes_part(*at, contact));
        Self(taken.map(|(at, _)| at).collect())
    }

    /// Selects the contacts of `program` in `step`. A contact counts as closed if free flight leaves
    /// a gap of at most `near` (m).
    pub(super) fn closed(
        program: &IpoptProgram,
        step: &Step<'_>,
        candidates: &[Contact],
        near: f64,
    ) -> Self {
        let free = &step.free[BODY];
        Self::new(candidates, |_, contact| program.is_tutorials() || gap(contact, free) <= near)
    }

    /// Indices of the candidates.
    pub(super) fn indices(&self) -> &[usize] {
        &self.0
    }

    /// Contact keys of the selected candidates.
    pub(super) fn keys(&self, candidates: &[Contact]) -> Vec<ContactKey> {
        self.0.iter().map(|&index| candidates[index].key).collect()
    }

    fn has(&self, index: usize) -> bool {
        self.0.binary_search(&index).is_ok()
    }
}

/// Gap φ⁺ of a contact at the state `next`, m.
pub(super) fn gap(contact: &Contact, next: &State) -> f64 {
    contact.gap_at(&next.pose(), None)
}

/// Solves `step` with the contacts `posed` from `start`, and repeats with contacts that were
/// missing. All solves share the limit in `effort`. On return `posed` holds the contacts of the
/// last solve.
pub(super) fn solve_posed(
    program: &mut IpoptProgram,
    step: &Step<'_>,
    start: &ProgramPoint,
    effort: IpoptEffort<'_>,
    candidates: &mut Candidates,
    posed: &mut PosedContacts,
    end: &mut ProgramPoint,
) -> Result<Attempted, Error> {
    let IpoptEffort { limit, depth, .. } = effort;
    // The tutorial's program has height rows of all points, so it is never skipped.
    let mut attempted = if posed.indices().is_empty() && !program.is_tutorials() {
        end.set_free(&program.units.state(&step.free[BODY]));
        Attempted::free()
    } else {
        program.attempt(step, candidates.contacts(), posed, start, effort, end)?
    };
    while !program.is_tutorials() && attempted.converged && attempted.iterations < limit {
        let next = program.next_state(step, end);
        candidates.admit_missed(step.world, step.states, &[next], depth);
        let contacts = candidates.contacts();
        let wider = PosedContacts::new(contacts, |index, contact| {
            posed.has(index) || gap(contact, &next) < -depth
        });
        if wider == *posed {
            break;
        }
        *posed = wider;
        let multipliers = StartMultipliers::Estimated;
        let effort = IpoptEffort { multipliers, limit: limit - attempted.iterations, ..effort };
        let before = attempted.iterations;
        attempted = program.attempt(step, contacts, posed, start, effort, end)?;
        attempted.iterations += before;
    }
    Ok(attempted)
}
