//! Velocities of the instant in a run with [`Integrator::Leapfrog`](crate::world::Integrator).
//!
//! A step moves poses with the velocity of its end. A run keeps the velocities w of the middle of
//! its steps, so that this motion is of second order in h. Velocities V of the instant k follow from
//! the step just taken, and a start at V is converted with a trial step from it:
//!
//! ```text
//! V = w + ½ (w − w⁻),   w = V − ½ (w⁺(V) − V)                            (eq. 37)
//! ```
//!
//! Changes of velocity that do not scale with h say nothing about the acceleration: impacts, the end
//! of a slip, stops of joints. The bodies of islands [with such a change](super::abrupt) have V = w, with
//! an error of ½ h times the acceleration.
//!
//! The local error of a smooth step estimates the error of the time step, and so does the rotation that
//! the update of the attitude lacks, at the reach r of the body. An abrupt change happens at an
//! unknown time within its step:
//!
//! ```text
//! e = Σ h³/12 r |ω|³ + Σ h/24 |w⁺ − 2w + w⁻| over smooth steps + Σ h/2 |w⁺ − w| over abrupt ones  (eq. 40)
//! ```
//!
//! A window, which is much shorter than the usual interval, is an instant: w = V before and after it. Its
//! change of velocity has what removes the errors of a conversion, and divided by its length it would be no
//! acceleration. All bodies start after it.
//!
//! For a vibration the second sum is the error of its phase. Errors that grow afterwards, as in chaotic
//! motion, are not in it.

use super::abrupt::{STILL, TakenStep};
use super::inputs::Inputs;
use super::interval::Interval;
use super::moment::Moment;
use super::one_interval;
use super::workspace::Workspace;
use crate::error::Error;
use crate::mechanics::State;
use crate::mechanics::quaternion::advance;
use crate::step::{ContactForce, StepStatus};
use crate::world::{Impacts, World};
use nalgebra::Vector3;
use std::mem::take;

/// States of the instant, and what is left to convert.
#[derive(Debug, Clone, PartialEq, Default)]
#[cfg_attr(feature = "save", derive(serde::Serialize, serde::Deserialize))]
pub(super) struct Instants {
    /// States at k, with the velocities of the instant.
    pub states: Vec<State>,
    /// True for bodies whose velocity in the simulation is still the one of the instant.
    pub starts: Vec<bool>,
    /// Estimated errors e of the positions since the start (m).
    pub errors: Vec<f64>,
    /// True for bodies whose last step changed their velocity abruptly, or that have none. Others have
    /// extrapolated velocities of the instant.
    pub was_abrupt: Vec<bool>,
    /// `errors` and `was_abrupt` before the last step.
    past: (Vec<f64>, Vec<bool>),
    /// Smoothness of the motion, in a run with intervals; otherwise empty.
    smooth: Vec<Smooth>,
}

/// Motion of a body since its last start or abrupt change of velocity.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
#[cfg_attr(feature = "save", derive(serde::Serialize, serde::Deserialize))]
struct Smooth {
    /// Number of velocities of the middle with the same step length, at most 3. The one of a trial step
    /// does not count.
    known: u8,
    /// Time since the last impact (s).
    since: f64,
    /// Second derivatives of velocity (m/s³) and spin (rad/s³), from three of them.
    jerk: Option<[Vector3<f64>; 2]>,
}

impl Instants {
    /// Start of bodies at `states`.
    pub(super) fn at(states: &[State]) -> Self {
        let bodies = states.len();
        Self {
            states: states.to_vec(),
            starts: vec![true; bodies],
            errors: vec![0.0; bodies],
            was_abrupt: vec![true; bodies],
            past: (vec![0.0; bodies], vec![true; bodies]),
            smooth: Vec::new(),
        }
    }

    /// Takes the last step back, before which the velocities of the instant were those of `states`.
    pub(super) fn take_back(&mut self, states: &[State]) {
        self.states.clear();
        self.states.extend_from_slice(states);
        self.starts.fill(false);
        self.errors.clone_from(&self.past.0);
        self.was_abrupt.clone_from(&self.past.1);
    }

    /// Stores the errors and flags before an interval.
    fn remember(&mut self) {
        self.past.0.clone_from(&self.errors);
        self.past.1.clone_from(&self.was_abrupt);
    }

    /// Sets the state of `body` as a start.
    pub(super) fn start(&mut self, body: usize, state: State) {
        self.states[body] = state;
        self.starts[body] = true;
        self.was_abrupt[body] = true;
        self.smooth.get_mut(body).map(take);
    }

    /// Takes second derivatives of velocities that are not known yet from the `next` step.
    pub(super) fn learn(&mut self, next: &Self) {
        let pairs = self.smooth.iter_mut().zip(&next.smooth);
        pairs.for_each(|(smooth, next)| smooth.jerk = smooth.jerk.or(next.jerk));
    }

    /// True if this holds finite states of `bodies` bodies.
    #[cfg(feature = "save")]
    pub(super) fn fits(&self, bodies: usize) -> bool {
        let numbers = self.states.iter().map(State::to_vector);
        let numbers_of = [self.states.len(), self.errors.len(), self.past.0.len()];
        let flags_of = [self.starts.len(), self.was_abrupt.len(), self.past.1.len()];
        [numbers_of, flags_of] == [[bodies; 3]; 2]
            && (self.smooth.is_empty() || self.smooth.len() == bodies)
            && numbers.into_iter().all(|numbers| numbers.iter().all(|x| x.is_finite()))
    }

    /// Adds a body at the end.
    pub(super) fn push(&mut self, state: State) {
        self.states.push(state);
        self.starts.push(true);
        self.errors.push(0.0);
        self.was_abrupt.push(true);
        self.smooth.clear();
        self.past.0.push(0.0);
        self.past.1.push(true);
    }

    /// Removes the body `index`. Bodies after it move up by one.
    pub(super) fn remove(&mut self, index: usize) {
        self.states.remove(index);
        self.starts.remove(index);
        self.errors.remove(index);
        self.was_abrupt.remove(index);
        self.smooth.clear();
        self.past.0.remove(index);
        self.past.1.remove(index);
    }
}

/// Trial step that converts the velocities of a start.
#[derive(Debug, Clone, Default)]
pub(super) struct TrialStep {
    /// Its interval, from states with the velocities of the instant.
    pub taken: Interval,
    /// Bodies whose velocity it converted.
    pub converted: Vec<bool>,
}

/// Origin of the velocity w of a body at the start of an interval.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub(super) enum Converted {
    #[default]
    Kept,
    /// w + κ (w − w⁻) with this κ, but for second derivatives of the velocity.
    Shifted(f64),
    /// The velocity V of the instant, which is `extrapolated` or that of the interval before. A trial
    /// step converts it; without one w is V.
    Started { extrapolated: bool, has_trial: bool },
}

/// Largest errors of bodies in a step.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub(crate) struct AddedError {
    /// Estimate (40) of bodies in smooth motion, and of those with an abrupt change of velocity (m).
    pub smooth: f64,
    pub abrupt: f64,
    /// Error of the velocity of the instant, from the change of the second differences (m/s).
    pub velocity: f64,
    /// True if a body moved by less than its error between two impacts: in the exact motion, they may
    /// come in the other order.
    pub is_ambiguous: bool,
}

/// State one step of `h` (s) before `state`, at its velocity.
fn moved_back(state: &State, h: f64) -> State {
    State {
        position: state.position - h * state.velocity,
        attitude: advance(&state.attitude, &state.spin, -h),
        ..*state
    }
}

/// Converts the velocities of `moment` from intervals of length `from` to those of length `to` (s). Near
/// the end of the last interval, the motion has the velocity V + a t + ½ j t². Its derivatives follow
/// from the last velocities of the middle. Bodies without them start, and all of them before and after a
/// window. Returns the origin of each velocity.
pub(super) fn change_length(
    moment: &mut Moment,
    from: f64,
    to: f64,
    at_window: bool,
) -> Vec<Converted> {
    let Moment { now, before, instants, .. } = moment;
    let mut converted = vec![Converted::Kept; now.states.len()];
    let Some(instants) = instants else { return converted };
    instants.smooth.resize(now.states.len(), Smooth::default());
    for (body, smooth) in instants.smooth.iter_mut().enumerate() {
        let instant = &instants.states[body];
        let state = &mut now.states[body];
        let is_known = smooth.known >= 2 && !instants.starts[body] && !at_window;
        let past = before.as_ref().filter(|_| is_known);
        let Some(past) = past else {
            *state = *instant;
            let extrapolated = !instants.was_abrupt[body];
            converted[body] = Converted::Started { extrapolated, has_trial: false };
            (instants.starts[body], instants.was_abrupt[body]) = (true, true);
            *smooth = Smooth { since: smooth.since, ..Smooth::default() };
            continue;
        };
        let past = &past.states[body];
        let [jerk, turning] = smooth.jerk.unwrap_or_default();
        let middle = |instant: &Vector3<f64>, last: Vector3<f64>, jerk: &Vector3<f64>| {
            let acceleration = last / from + from * jerk;
            instant - 0.5 * to * acceleration + 0.125 * to * to * jerk
        };
        let velocity = middle(&instant.velocity, state.velocity - past.velocity, &jerk);
        let spin = middle(&instant.spin, state.spin - past.spin, &turning);
        (state.velocity, state.spin) = (velocity, spin);
        converted[body] = Converted::Shifted(0.5 * (1.0 - to / from));
        smooth.known = 1;
    }
    converted
}

/// True if bodies start.
#[inline]
pub(super) fn has_starts(moment: &Moment) -> bool {
    moment.instants.as_ref().is_some_and(|instants| instants.starts.contains(&true))
}

/// Converts the velocities of bodies that start, with a trial of the interval (eq. 37). The trial and
/// its bodies are left in `kept`. Returns true if there were any.
///
/// # Errors
/// If the trial cannot be posed or was interrupted; the moment is then unchanged.
pub(super) fn start(
    world: &World,
    moment: &mut Moment,
    inputs: &Inputs,
    workspace: &mut Workspace<'_>,
    converted: &mut [Converted],
    kept: Option<&mut TrialStep>,
) -> Result<bool, Error> {
    if !has_starts(moment) {
        return Ok(false);
    }
    if world.is_window() {
        moment.instants.iter_mut().for_each(|instants| instants.starts.fill(false));
        return Ok(false);
    }
    workspace.rest.end();
    let search = moment.search.clone();
    let mut trial = Interval::default();
    let solved = one_interval::solve(world, moment, inputs, workspace, &mut trial, |_, _, _| ());
    // The interval itself searches again.
    moment.search = search;
    workspace.forget();
    solved?;
    let Workspace { free, abrupt, wrenches, .. } = workspace;
    let Moment { now, instants, .. } = moment;
    let Some(instants) = instants else { return Ok(false) };
    if let StepStatus::Free | StepStatus::Converged | StepStatus::Retried = trial.report.status {
        let earlier: Vec<_> =
            now.states.iter().map(|state| moved_back(state, world.time_step())).collect();
        abrupt.find(&TakenStep {
            world,
            states: &now.states,
            earlier: &earlier,
            free,
            past: &[],
            contacts: &trial.contacts,
            solution: &trial.solution,
            resting: &[],
        });
    } else {
        abrupt.bodies.clear();
        abrupt.bodies.resize(now.states.len(), true);
    }
    // Initial point of the first interval.
    now.contacts.clone_from(&trial.solution.contacts);
    for (body, (state, next)) in now.states.iter_mut().zip(&trial.solution.states).enumerate() {
        if !instants.starts[body] {
            continue;
        }
        let has_trial = !abrupt.bodies[body];
        if has_trial {
            state.velocity -= 0.5 * (next.velocity - state.velocity);
            state.spin -= 0.5 * (next.spin - state.spin);
        }
        if let Some(converted) = converted.get_mut(body) {
            let extrapolated = matches!(converted, Converted::Started { extrapolated: true, .. });
            *converted = Converted::Started { extrapolated, has_trial };
        }
    }
    if let Some(kept) = kept {
        let starts = instants.starts.iter().zip(&abrupt.bodies);
        kept.converted = starts.map(|(starts, is_abrupt)| *starts && !is_abrupt).collect();
        trial.wrenches.clone_from(wrenches);
        kept.taken = trial;
    }
    instants.starts.fill(false);
    Ok(true)
}

/// Velocities of the instant at the end of the interval `taken` from `moment` (eq. 37), and the
/// growth of errors (40). `started` is true if velocities were converted by a trial.
pub(super) fn end(
    world: &World,
    moment: &mut Moment,
    workspace: &mut Workspace<'_>,
    started: bool,
    taken: &mut Interval,
) {
    taken.errors = AddedError::default();
    let has_contacts = workspace.has_contacts();
    let Moment { now, before, instants, .. } = moment;
    let Some(instants) = instants else { return };
    let Workspace { free, abrupt, rest, .. } = workspace;
    let Interval { contacts, solution, part, .. } = &*taken;
    let converted = part.as_ref().map_or(&[][..], |part| &part.converted);
    let is_shifted = converted.iter().any(|of| matches!(of, Converted::Shifted(_)));
    let is_smooth = has_contacts
        && matches!(
            taken.report.status,
            StepStatus::Free | StepStatus::Converged | StepStatus::Retried | StepStatus::Fallback
        );
    let h = world.time_step();
    // An interval of another length than the last one has none before it.
    let is_window = world.is_window();
    let begins = (started || is_window) && world.impacts() == Impacts::Located;
    let moved_back = |state| moved_back(state, h);
    let moved_back: Vec<_> = now.states.iter().filter(|_| begins).map(moved_back).collect();
    let earlier = match before {
        _ if begins => &moved_back,
        Some(before) => &before.states,
        None => &now.states,
    };
    abrupt.bodies.clear();
    // In an interval of another length, only the contacts that stick have the slip of the one before.
    let sticks = |past: &&ContactForce| past.slip.norm() <= STILL * world.speed_scale();
    let has_past = !started && !is_window;
    let known = if is_shifted && has_past { &*now.contacts } else { &[] };
    let sticking: Vec<_> = known.iter().filter(sticks).copied().collect();
    if is_smooth {
        abrupt.find(&TakenStep {
            world,
            states: &now.states,
            earlier,
            free,
            past: if has_past && !is_shifted { &now.contacts } else { &sticking },
            contacts,
            solution,
            resting: rest.bodies(),
        });
    }
    instants.remember();
    let mut added_error = AddedError::default();
    let change = |from: &State, to: &State| (to.velocity - from.velocity, to.spin - from.spin);
    for body in 0..now.states.len() {
        let state = &now.states[body];
        let next = &solution.states[body];
        let is_abrupt = abrupt.bodies.get(body).is_none_or(|is_abrupt| *is_abrupt);
        let last = change(state, next);
        let reach = world.bodies()[body].reach();
        let size = |of: (Vector3<f64>, Vector3<f64>)| of.0.norm() + (reach * of.1).norm();
        // Second difference of the velocities of the middle, w⁺ − 2w + w⁻.
        let has_past = match instants.smooth.get_mut(body) {
            Some(smooth) if is_abrupt => {
                let is_struck = is_smooth && abrupt.struck[body];
                let moved = (smooth.since + h) * size(last);
                added_error.is_ambiguous |= is_struck && moved < instants.errors[body];
                let since = if is_struck { 0.0 } else { smooth.since + h };
                *smooth = Smooth { since, ..Smooth::default() };
                false
            }
            Some(smooth) => {
                smooth.since += h;
                smooth.known = (smooth.known + 1).min(3);
                smooth.known == 3
            }
            None => !is_abrupt && !instants.was_abrupt[body],
        };
        let second = before.as_ref().filter(|_| has_past).map(|before| {
            let earlier = change(&before.states[body], state);
            (last.0 - earlier.0, last.1 - earlier.1)
        });
        let turning = h.powi(3) / 12.0 * reach * state.spin.norm().powi(3);
        let error = match second {
            _ if is_abrupt => 0.5 * h * size(last),
            second => second.map_or(0.0, |second| h / 24.0 * size(second)) + turning,
        };
        instants.errors[body] += error;
        let of_kind = if is_abrupt { &mut added_error.abrupt } else { &mut added_error.smooth };
        *of_kind = of_kind.max(error);
        instants.was_abrupt[body] = is_abrupt || is_window;
        let is_first = instants.smooth.get(body).is_some_and(|smooth| smooth.known == 1);
        instants.states[body] = match instants.states[body] {
            _ if is_abrupt || is_window => *next,
            // Middle between the velocities of the instant before and after the first step.
            State { velocity, spin, .. } if is_first && begins => State {
                velocity: 2.0 * next.velocity - velocity,
                spin: 2.0 * next.spin - spin,
                ..*next
            },
            _ => next.extrapolated(state),
        };
        if let Some(smooth) = instants.smooth.get_mut(body) {
            if is_window {
                continue;
            }
            if let Some((velocity, spin)) = second {
                let jerk = [velocity / (h * h), spin / (h * h)];
                let [linear, angular] = smooth.jerk.map_or([Vector3::zeros(); 2], |last| {
                    [0, 1].map(|k| h * h * (jerk[k] - last[k]))
                });
                let missed = 0.3125 * size((linear, angular));
                added_error.velocity = added_error.velocity.max(missed);
                smooth.jerk = Some(jerk);
            }
            let [velocity, spin] = smooth.jerk.unwrap_or_default();
            instants.states[body].velocity += 0.375 * h * h * velocity;
            instants.states[body].spin += 0.375 * h * h * spin;
        }
    }
    taken.errors = added_error;
    taken.extrapolated.extend(instants.was_abrupt.iter().map(|was_abrupt| !was_abrupt));
}

/// Velocities of the instant after the shorter intervals of a step from `start`, which was not solved
/// at once. All bodies have those of the middle, which the `moment` at the end has, and the error (40)
/// of an abrupt change.
pub(super) fn end_of_retry(
    world: &World,
    start: &Moment,
    moment: &mut Moment,
    intervals: &mut [Interval],
) {
    let Some(mut instants) = start.instants.clone() else { return };
    // The start has the velocities of the instant.
    intervals[0].instants.clone_from(&instants.states);
    for taken in &mut intervals[1..] {
        taken.instants.clone_from(&taken.states);
    }
    instants.remember();
    let mut largest = 0.0_f64;
    for (body, (state, end)) in start.now.states.iter().zip(&moment.now.states).enumerate() {
        let reach = world.bodies()[body].reach();
        let change =
            (end.velocity - state.velocity).norm() + (reach * (end.spin - state.spin)).norm();
        let error = 0.5 * world.time_step() * change;
        instants.errors[body] += error;
        largest = largest.max(error);
    }
    instants.starts.fill(false);
    instants.was_abrupt.fill(true);
    instants.states.clone_from(&moment.now.states);
    let bodies = instants.states.len();
    for taken in &mut *intervals {
        taken.extrapolated.clear();
        taken.extrapolated.resize(bodies, false);
    }
    if let [.., last] = intervals {
        last.errors.abrupt = largest;
        if let Some(part) = &mut last.part {
            part.ends.clone_from(&instants.states);
        }
    }
    moment.instants = Some(instants);
}
