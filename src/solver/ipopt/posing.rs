//! Choice of the contacts in the program, and repeated solves with contacts that were missing.
//!
//! A candidate that moves sideways without force leaves the program without a feasible optimum
//! (docs/formulation.md, section 8). Every candidate also costs six variables and six rows.
//! [`Formulation::Reduced`](super::Formulation::Reduced) therefore includes only the candidates
//! that free flight closes. Between bodies it also includes those with a force in the previous
//! step.
//!
//! If the result penetrates at another candidate, that one is added and the step is solved again.
//! An open contact without force obeys the contact law, in the program or not. Bodies without
//! contacts in the program are in free flight. The tutorial's program includes all candidates.

use super::posed::PosedProgram;
use super::program::{Attempted, Hold, IpoptEffort, IpoptProgram, StartMultipliers};
use super::start::{ProgramPoses, ProgramStart};
use tumble_core::contact::{Candidates, Contact, KeyIndex, Partner};
use tumble_core::error::Error;
use tumble_core::step::{ContactForce, Step};

/// Selects the contacts of `program` in `step`. A contact counts as closed if free flight leaves a
/// gap of at most `near` (m).
pub(super) fn posed_in(
    program: &IpoptProgram,
    step: &Step<'_>,
    candidates: &[Contact],
    near: f64,
) -> PosedProgram {
    let (free, mut index) = (ProgramPoses::of(step.states, step.free), KeyIndex::new());
    PosedProgram::of(candidates, |place, contact| {
        let mut before = || index.find(&step.previous.contacts, &contact.key, place);
        let rests = matches!(contact.key.partner, Partner::Body(_))
            && before().is_some_and(ContactForce::carries_force);
        program.is_tutorials() || rests || free.gap(contact) <= near
    })
}

/// Solves `step` with the contacts `posed` from `start`, and repeats with contacts that were
/// missing. All solves share the limit in `effort`. On return `posed` holds the contacts of the
/// last solve.
pub(super) fn solve_posed(
    program: &mut IpoptProgram,
    step: &Step<'_>,
    start: &mut ProgramStart,
    effort: IpoptEffort<'_>,
    candidates: &mut Candidates,
    posed: &mut PosedProgram,
    end: &mut ProgramStart,
) -> Result<Attempted, Error> {
    let IpoptEffort { limit, depth, hold, .. } = effort;
    let contacts = candidates.contacts();
    // The tutorial's program has height rows of all points, so it is never skipped.
    let mut attempted = if posed.bodies.is_empty() && !program.is_tutorials() {
        end.reset(step.free, contacts.len());
        Attempted::free()
    } else {
        program.attempt(step, contacts, posed, start, effort, end)?
    };
    while !program.is_tutorials() && attempted.converged && attempted.iterations < limit {
        candidates.admit_missed(step.world, step.states, &end.states, depth);
        let contacts = candidates.contacts();
        let poses = ProgramPoses::of(step.states, &end.states);
        let wider = PosedProgram::of(contacts, |index, contact| {
            posed.has(index) || poses.gap(contact) < -depth
        });
        if wider == *posed {
            break;
        }
        *posed = wider;
        start.values.resize_with(contacts.len(), Default::default);
        // A missing contact has no force at the start, so normal forces must be free.
        let (limit, hold) = (limit - attempted.iterations, Hold { normal: 0.0, ..hold });
        let multipliers = StartMultipliers::Estimated;
        let effort = IpoptEffort { multipliers, limit, hold, ..effort };
        let before = attempted.iterations;
        attempted = program.attempt(step, contacts, posed, start, effort, end)?;
        attempted.iterations += before;
    }
    end.values.resize_with(candidates.contacts().len(), Default::default);
    Ok(attempted)
}
