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
//! island starts there anew. A step of few bodies is divided once, at its first turn, and not in an
//! island with impacts or with fast rotations, whose kinetic energy differs by (h ω)²/4 along tangents and chords. It stays whole if
//! the motion does not turn back: one that only ends has an error of second order.

use super::inputs::Inputs;
use super::moment::Moment;
use super::one_interval;
use super::record::StepRecord;
use super::workspace::Workspace;
use crate::mechanics::State;
use crate::world::{Span, World};
use std::mem::take;

/// Largest rotation of a body of the island in the step (rad).
const MOST_ROTATION: f64 = 0.05;

/// Largest number of bodies of the world. All of them take a divided step, which costs as much as two more, and few
/// motions in a pile turn back.
const MOST_BODIES: usize = 16;

/// Slip or rate of an axis below which a motion does not turn back but ends (m/s or rad/s, times the speed
/// scale).
const LEAST: f64 = 1e-6;

/// Divides the step of `record`, which was taken in one interval, at its turn. Returns the moment at its start if
/// that was done.
pub(super) fn divide(
    world: &mut World,
    moment: &mut Moment,
    inputs: &Inputs,
    workspace: &mut Workspace<'_>,
    record: &mut StepRecord,
) -> Option<Box<Moment>> {
    let turn = workspace.abrupt.turn.take().filter(|_| world.bodies().len() <= MOST_BODIES)?;
    let label = workspace.abrupt.islands.label(turn.body);
    let mut states = record.states().iter().enumerate();
    let rotates = |state: &State| state.spin.norm() * world.time_step() > MOST_ROTATION;
    if states.any(|(of, state)| workspace.abrupt.islands.label(of) == label && rotates(state)) {
        return None;
    }
    let end = moment.clone();
    if !moment.move_back(record.first()) {
        return None;
    }
    let start = Box::new(moment.clone());
    // The search is that of the end of the step.
    *moment.search = Default::default();
    workspace.abrupt.begin_turn(turn.body);
    let check = take(&mut workspace.energy_check);
    let least = LEAST * world.speed_scale();
    let mut divided = None;
    let taken = in_two(turn.time, world, moment, &inputs.uninterrupted(), workspace, record);
    world.set_span(None);
    if taken.is_none() || turn.motion.speed(world, record.last()) <= least {
        record.truncate(1);
        *moment = end;
        workspace.energy_check = check;
        workspace.forget();
    } else {
        record.remove_first();
        workspace.rest.end();
        divided = Some(start);
    }
    workspace.abrupt.turning.clear();
    divided
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
        one_interval::interval(world, moment, inputs, workspace, Some(span), taken, false).ok()?;
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
