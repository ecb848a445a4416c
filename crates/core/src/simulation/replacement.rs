//! Replacement of contacts that are not where their pieces touch (18g).
//!
//! A plane stops an edge or a corner for the whole interval, also beside its face, and the plane across two
//! edges does not rotate with them. If such a contact carries a force although the pieces do not touch there, the
//! interval is solved again. The points in which the pieces are nearest to each other at the end of the first solution
//! take its place, and if that fails, nothing does. If neither ends with pieces that touch where forces act, the first
//! solution is taken and marked.

use super::interval::Interval;
use super::unphysical::UnphysicalCause;
use super::workspace::Workspace;
use crate::error::Error;
use crate::step::StepStatus;
use crate::world::{Partner, World};

/// Largest number of solutions with replaced contacts, each of which may show further ones.
const MOST_SOLUTIONS: u32 = 3;

/// Overlap after a replacement of contacts, as a fraction of the world's reach.
const LARGEST_OVERLAP: f64 = 1e-6;

/// Solves an interval by `solve`, and replaces contacts.
///
/// # Errors
/// Those of `solve`.
pub(super) fn solve(
    world: &World,
    workspace: &mut Workspace<'_>,
    taken: &mut Interval,
    solve: impl Fn(&mut Workspace<'_>, &mut Interval) -> Result<(), Error>,
) -> Result<(), Error> {
    solve(workspace, taken)?;
    let Some(cause) = replace_misplaced(world, workspace, taken) else { return Ok(()) };
    let most = taken.overlap.max(LARGEST_OVERLAP * world.reach());
    let first = (taken.clone(), workspace.candidates.contacts().to_vec());
    let replaced = workspace.candidates.replaced().clone();
    for has_substitutes in [true, false] {
        workspace.candidates.replaced().clone_from(&replaced);
        workspace.candidates.replaced().has_substitutes = has_substitutes;
        let mut is_placed = false;
        for _ in 0..MOST_SOLUTIONS {
            solve(workspace, taken)?;
            is_placed = replace_misplaced(world, workspace, taken).is_none();
            if is_placed {
                break;
            }
        }
        if is_placed && taken.report.status.is_solved() && taken.overlap <= most {
            return Ok(());
        }
    }
    let contacts;
    (*taken, contacts) = first;
    workspace.candidates.clear();
    workspace.candidates.extend(contacts);
    workspace.rest.end();
    (taken.unphysical, taken.report.status) = (Some(cause), StepStatus::Wild);
    Ok(())
}

/// Replaces the contacts of a solved interval that are not where their pieces touch, in the next solutions.
/// Returns the cause that the worst of them is.
fn replace_misplaced(
    world: &World,
    workspace: &mut Workspace<'_>,
    taken: &Interval,
) -> Option<UnphysicalCause> {
    if taken.placement == 0.0 || !taken.report.status.is_solved() {
        return None;
    }
    let Interval { states, solution, .. } = taken;
    let Workspace { candidates, .. } = workspace;
    let misplaced = candidates.misplaced(world, states, &solution.states, solution.forces());
    let (contact, error) = *misplaced.iter().max_by(|a, b| a.1.total_cmp(&b.1))?;
    candidates.replace(world, states, &misplaced);
    let between = [Partner::Body(contact.key.body), contact.key.partner];
    Some(UnphysicalCause::Misplaced { between, error })
}
