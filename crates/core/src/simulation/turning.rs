//! Turns: steps in which friction ends a slip, or the motion of an axis.
//!
//! Forces act from the middle of an interval to that of the next one, so that friction has one direction in
//! this time. Where it turns after the share θ of it, with the accelerations a₁ before and a₂ after, the
//! velocity is wrong by up to
//!
//! ```text
//! θ (a₁ − a₂) h
//! ```
//!
//! Therefore such a step is taken in two intervals. The first one ends where the motion comes to rest, and the
//! island starts there anew. A step is divided once, at its first turn, and not in an island with impacts.

use super::inputs::Inputs;
use super::moment::Moment;
use super::one_interval;
use super::record::StepRecord;
use super::workspace::Workspace;
use crate::world::{Span, World};

/// Divides the step of `record`, which was taken in one interval, at its turn. Returns the moment at its start if
/// that was done.
pub(super) fn divide(
    world: &mut World,
    moment: &mut Moment,
    inputs: &Inputs,
    workspace: &mut Workspace<'_>,
    record: &mut StepRecord,
) -> Option<Box<Moment>> {
    let (body, time) = workspace.abrupt.turn.take()?;
    let end = moment.clone();
    if !moment.move_back(record.first()) {
        return None;
    }
    let start = Box::new(moment.clone());
    workspace.abrupt.begin_turn(body);
    let taken = in_two(time, world, moment, &inputs.uninterrupted(), workspace, record);
    workspace.abrupt.turning.clear();
    workspace.rest.end();
    world.set_span(None);
    if taken.is_none() {
        record.truncate(1);
        *moment = end;
        workspace.forget();
        return None;
    }
    record.remove_first();
    Some(start)
}

/// Takes the step in two intervals, the first of which ends after this `time` (s), behind the interval in
/// `record`. Returns `None` if one of them is not solved or gains energy.
fn in_two(
    time: f64,
    world: &mut World,
    moment: &mut Moment,
    inputs: &Inputs,
    workspace: &mut Workspace<'_>,
    record: &mut StepRecord,
) -> Option<()> {
    let usual = world.whole_step();
    for (since, length) in [(0.0, time), (time, usual - time)] {
        workspace.rest.end();
        if since > 0.0 {
            moment.start_where(&workspace.abrupt.turning);
        }
        let span = Span { since, length, usual, is_retry: false };
        let taken = record.next_interval();
        one_interval::interval(world, moment, inputs, workspace, Some(span), taken).ok()?;
        if !taken.report.status.is_solved() || taken.gain.is_some() {
            return None;
        }
        let part = taken.part.as_mut()?;
        part.changeable = world.changeable();
    }
    let [.., first, second] = record.intervals_mut() else { return None };
    // Rows count the energy of the island at its start.
    first.part.as_mut()?.energies[1] = Some(second.energy(&second.world(world)));
    Some(())
}
