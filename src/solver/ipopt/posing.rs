//! Which of the candidates the program is posed with, and what happens to a point that should
//! have been one of them.
//!
//! A candidate without force that moves sideways leaves the program without a feasible optimum
//! (docs/formulation.md, section 8), and every one of them costs six variables and six rows. So
//! [`Formulation::Reduced`] poses the candidates that free flight takes to the ground. Where the end takes another point into the ground, that
//! one is admitted and the step solved again: a point that ends above the ground with no force
//! obeys the contact law, whether it was posed or not.

use super::program::{Attempt, Attempted, Program, StartMultipliers};
use super::{BODY, Formulation};
use crate::contact::{Candidates, Contact};
use crate::error::Error;
use crate::mechanics::State;
use crate::step::Step;
use crate::step_nlp::ProgramPoint;

/// Flags the points that `step` is posed with, of the candidates `contacts`.
pub(super) fn pose(
    step: &Step<'_>,
    contacts: &[Contact],
    formulation: Formulation,
    flags: &mut [bool],
) {
    flags.fill(false);
    let free = step.free[BODY].pose();
    for contact in contacts {
        let touches = contact.gap_at(&free, None) <= 0.0;
        flags[contact.key.point] = formulation == Formulation::Clamped || touches;
    }
}

/// What a solve may take, and how exact it is.
#[derive(Clone, Copy)]
pub(super) struct Effort {
    /// Iterations.
    pub(super) limit: u32,
    /// A point that ends no lower than this below the ground need not have been posed, m.
    pub(super) depth: f64,
    /// See [`Attempt::yielding`].
    pub(super) yielding: f64,
}

/// Solves `step` for the flags, from `start`, and again with the points that it missed, in all within
/// `effort`. Leaves the end in `point` (the program's units); `flags` are those of
/// the last solve.
pub(super) fn solve_posed(
    program: &mut Program,
    step: &Step<'_>,
    (start, multipliers): (&ProgramPoint, StartMultipliers<'_>),
    effort: Effort,
    (candidates, flags): (&mut Candidates, &mut [bool]),
    point: &mut ProgramPoint,
) -> Result<Attempted, Error> {
    let Effort { limit, depth, yielding } = effort;
    let reduced = program.formulation == Formulation::Reduced;
    let mut attempted = if reduced && !flags.contains(&true) {
        point.set_free(&program.units.state(&step.free[BODY]));
        Attempted::free()
    } else {
        let attempt = Attempt { start, multipliers, limit, tightness: 1.0, yielding };
        program.attempt(step, flags, attempt, point)?
    };
    while reduced && attempted.converged && attempted.iterations < limit {
        let next = program.units.si_state(&point.state());
        if !admit(step, &next, depth, candidates, flags) {
            break;
        }
        let attempt = Attempt {
            start,
            multipliers: StartMultipliers::Estimated,
            limit: limit - attempted.iterations,
            tightness: 1.0,
            yielding,
        };
        let before = attempted.iterations;
        attempted = program.attempt(step, flags, attempt, point)?;
        attempted.iterations += before;
    }
    Ok(attempted)
}

/// Flags the points that end lower than `depth` (m) below the ground, and makes them contacts.
/// Returns whether there were any that were not posed.
fn admit(
    step: &Step<'_>,
    next: &State,
    depth: f64,
    candidates: &mut Candidates,
    flags: &mut [bool],
) -> bool {
    candidates.admit_missed(step.world, step.states, &[*next], depth);
    let mut admitted = false;
    for (height, flag) in step.world.heights(BODY, &next.pose()).zip(flags) {
        if height < -depth && !*flag {
            (*flag, admitted) = (true, true);
        }
    }
    admitted
}
