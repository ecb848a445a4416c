//! Which of the candidates the program is posed with, and what happens to one that should have been
//! among them.
//!
//! A candidate without force that moves sideways leaves the program without a feasible optimum
//! (docs/formulation.md, section 8), and every one of them costs six variables and six rows. So
//! [`Formulation::Reduced`](super::Formulation::Reduced) poses the candidates that free flight closes
//! and, between bodies, those that carried a force in the step before. Where the end takes another one
//! into each other, that one joins and the step is solved again: a contact that ends open with no force
//! obeys the contact law, whether it was posed or not. Bodies without such a contact are in free flight.
//! The tutorial's program is posed with all candidates.

use super::posed::PosedProgram;
use super::program::{Attempted, Hold, IpoptEffort, IpoptProgram, StartMultipliers};
use super::start::{ProgramPoses, ProgramStart};
use tumble_core::contact::{Candidates, Contact, KeyIndex, Partner};
use tumble_core::error::Error;
use tumble_core::step::{ContactForce, Step};

/// What `program` is posed with in `step`: a contact that free flight leaves open by no more than
/// `near` (m) counts as closed.
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

/// Solves `step` with what is `posed`, from `start`, and again with the contacts that it missed, in
/// all within `effort`. `posed` is that of the last solve.
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
    // The tutorial's program has the heights of all points, of candidates or not.
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
        // What was missed has no force to hold on to.
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
