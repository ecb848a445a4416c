//! Velocities of the instant in a run with [`Integrator::Leapfrog`](crate::world::Integrator).
//!
//! A step moves poses with the velocity of its end. A run keeps the velocities w of the middle of
//! its intervals, so that this motion is of second order in h. Forces act over the time κ h from middle to
//! middle ([half kicks](crate::world::World::kick)). The velocity V of the instant at the end of an interval
//! follows from the change of velocity in it:
//!
//! ```text
//! V = w⁺ + (w⁺ − w⁻)/(2 κ)                                               (eq. 37a)
//! ```
//!
//! Changes of velocity that do not scale with h say nothing about the acceleration: impacts, the end
//! of a slip, stops of joints. The bodies of islands [with such a change](super::abrupt) have V = w⁺, with
//! an error of ½ h times the acceleration. V is output: no interval begins with it, but that of a body
//! that starts.
//!
//! The local error of a smooth step estimates the error of the time step, and so does the rotation that
//! the update of the attitude lacks, at the reach r of the body. An abrupt change happens at an
//! unknown time within its step:
//!
//! ```text
//! e = Σ h³/12 r |ω|³ + Σ h³/24 |ẅ| over smooth steps + Σ h/2 |w⁺ − w⁻| over abrupt ones       (eq. 40)
//! ```
//!
//! For a vibration the second sum is the error of its phase. Errors that grow afterwards, as in chaotic
//! motion, are not in it.

use super::abrupt::TakenStep;
use super::inputs::Inputs;
use super::instants::{AddedError, LastKick, Motion};
use super::interval::Interval;
use super::moment::Moment;
use super::workspace::Workspace;
use crate::joint::Joint;
use crate::mechanics::{State, Wrench};
use crate::step::StepStatus;
use crate::world::{Impacts, World};
use nalgebra::Vector3;

/// Spin at the end of an interval without forces in its second half (rad/s), I⁻¹ P⁻(ω; h) with the momentum P⁻
/// (34). It has the energy that free rotation conserves. `None` for a body under another torque.
fn turning_spin(
    world: &World,
    body: usize,
    wrenches: &[Wrench],
    state: &State,
    next: &State,
) -> Option<Vector3<f64>> {
    let torque = wrenches[body].torque - world.missing_kick(body, state).torque;
    let of = &world.bodies()[body];
    let rotation = world.rotation();
    let h = world.time_step();
    let arriving = || rotation.arriving_spin(of.inertia(), of.inertia_inverse(), &next.spin, h);
    (torque == Vector3::zeros()).then(arriving)
}

/// Motion of a body in an interval without an abrupt change.
struct SmoothMotion {
    /// Mean accelerations (m/s² and rad/s²), and their derivatives from two intervals.
    acceleration: [Vector3<f64>; 2],
    jerk: Option<[Vector3<f64>; 2]>,
    /// State at the end with the velocities of the instant, without late inputs.
    instant: State,
}

impl SmoothMotion {
    /// Motion of `body` in an interval from `state` to `next`. If the interval `is_brief`, its change of velocity has
    /// what removes the errors of V, and is no acceleration.
    fn new(
        world: &World,
        motion: &Motion,
        body: usize,
        [state, next]: [&State; 2],
        is_brief: bool,
    ) -> Self {
        let (h, kick) = (world.time_step(), world.kick(body));
        let changed = [next.velocity - state.velocity, next.spin - state.spin];
        let acceleration = changed.map(|changed| changed / (kick * h));
        // Both accelerations act in the middles of their kicks.
        let jerk = motion.acceleration.zip(motion.last).map(|(before, last)| {
            let apart = last.middle + 0.5 * h * (1.0 - kick);
            [0, 1].map(|k| (acceleration[k] - before[k]) / apart)
        });
        let mut instant = next.extrapolated(state, kick);
        let is_located = world.impacts() == Impacts::Located;
        if is_brief {
            let before = motion.acceleration.filter(|_| is_located).unwrap_or_default();
            instant.velocity = next.velocity + 0.5 * h * before[0];
            instant.spin = next.spin + 0.5 * h * before[1];
        } else if let Some([velocity, spin]) = jerk.filter(|_| is_located) {
            // ∫ (t − centre of the kick) over the second half of the interval.
            let moment = h * h * (0.125 + 0.25 * kick);
            instant.velocity += moment * velocity;
            instant.spin += moment * spin;
        }
        Self { acceleration, jerk, instant }
    }
}

/// Velocities of the instant at the end of the interval `taken` from `moment` (eq. 37a), and the
/// growth of errors (40).
pub(super) fn end(
    world: &World,
    moment: &mut Moment,
    inputs: &Inputs,
    workspace: &mut Workspace<'_>,
    taken: &mut Interval,
) {
    taken.errors = AddedError::default();
    let has_contacts = workspace.has_contacts();
    let Moment { now, before, arrivals, instants, .. } = moment;
    let Some(instants) = instants else { return };
    let Workspace { free, abrupt, rest, wrenches, .. } = workspace;
    let Interval { contacts, solution, .. } = &*taken;
    let is_smooth = has_contacts
        && matches!(
            taken.report.status,
            StepStatus::Free | StepStatus::Converged | StepStatus::Retried | StepStatus::Fallback
        );
    let h = world.time_step();
    // After an interval of another length, the poses before are those of one of the same length.
    let is_regular = world.before().is_empty();
    let map = world.step_map();
    let moved_back = |state| map.over(-h).coasted(state);
    let moved_back: Vec<_> = now.states.iter().filter(|_| !is_regular).map(moved_back).collect();
    let earlier = match before {
        _ if !is_regular => &moved_back,
        Some(before) => &before.states,
        None => &now.states,
    };
    let divides = world.impacts() == Impacts::Located;
    // Bodies whose change of velocity in a window is no acceleration. A part of a divided step may be one.
    let brief: Vec<_> = if !world.is_window() {
        Vec::new()
    } else if divides {
        taken.held_bodies(world)
    } else {
        (0..arrivals.len()).map(|body| abrupt.turning.get(body) != Some(&true)).collect()
    };
    let is_brief = |body: usize| brief.get(body) == Some(&true);
    let smooth = |motion: &Motion, body: usize| {
        let [state, next] = [&now.states[body], &solution.states[body]];
        let mut smooth = SmoothMotion::new(world, motion, body, [state, next], is_brief(body));
        let [velocity, spin] = inputs.late_kick(world, body, &arrivals[body]);
        smooth.instant.velocity += velocity;
        smooth.instant.spin += spin;
        if divides && let Some(turning) = turning_spin(world, body, wrenches, state, next) {
            smooth.instant.spin =
                turning + (next.spin - free[body].spin) * (0.5 / world.kick(body));
        }
        smooth
    };
    instants.remember();
    // Accelerations before a turn say nothing about those after it.
    for (motion, turns) in instants.motions.iter_mut().zip(&abrupt.turning) {
        if divides && *turns {
            (motion.acceleration, motion.jerk) = (None, None);
        }
    }
    let located = arrivals.len() * usize::from(divides && is_smooth);
    let ends: Vec<_> =
        (0..located).map(|body| smooth(&instants.motions[body], body).instant).collect();
    abrupt.bodies.clear();
    let is_wild = has_contacts && taken.report.status == StepStatus::Wild;
    if is_smooth || is_wild {
        abrupt.find(&TakenStep {
            world,
            states: &now.states,
            earlier,
            free,
            ends: &ends,
            past: &now.contacts,
            contacts,
            solution,
            resting: rest.bodies(),
            instants,
        });
    }
    instants.axis_shares.clone_from(&abrupt.axis_shares);
    if is_wild {
        // Only its turn may be used.
        abrupt.bodies.clear();
    }
    let mut added_error = AddedError::default();
    // A jump of the velocity of a prescribed motion at a start is no acceleration. Its poses are exact, and its velocity
    // matters to what it touches.
    let driven = world.joints().iter().filter(|joint| divides && joint.moves());
    let driven: Vec<_> = driven.map(Joint::body).collect();
    for body in 0..arrivals.len() {
        let is_driven = driven.contains(&body);
        if is_driven && world.before().get(body) == Some(&0.0) {
            instants.states[body] = solution.states[body];
            instants.motions[body].since += h;
            continue;
        }
        let state = &now.states[body];
        let next = &solution.states[body];
        let is_abrupt = abrupt.bodies.get(body).is_none_or(|is_abrupt| *is_abrupt);
        let kick = world.kick(body);
        let changed = [next.velocity - state.velocity, next.spin - state.spin];
        let reach = world.bodies()[body].reach();
        let size = |of: &[Vector3<f64>; 2]| of[0].norm() + (reach * of[1]).norm();
        let motion = &mut instants.motions[body];
        if is_abrupt {
            let is_struck = is_smooth && abrupt.struck[body];
            let moved = (motion.since + h) * size(&changed);
            added_error.is_ambiguous |= divides && is_struck && moved < instants.errors[body];
            let since = if is_struck { 0.0 } else { motion.since + h };
            let missing = match free.get(body) {
                Some(free) if is_smooth => [free.velocity - state.velocity, free.spin - state.spin]
                    .map(|change| change * (0.5 / kick)),
                _ => [Vector3::zeros(); 2],
            };
            *motion = Motion { since, missing, ..Motion::default() };
            let error = 0.5 * h * size(&changed);
            instants.errors[body] += error;
            added_error.abrupt = added_error.abrupt.max(error);
            if is_smooth && !abrupt.jumps[body] {
                added_error.turned = added_error.turned.max(size(&changed)).max(abrupt.lost);
            } else {
                added_error.jumped = added_error.jumped.max(error);
            }
            instants.states[body] = *next;
            continue;
        }
        let SmoothMotion { acceleration, jerk, instant } = smooth(motion, body);
        instants.states[body] = instant;
        let since = motion.since + h;
        let last = Some(LastKick { middle: 0.5 * h * (1.0 + kick), start: h });
        if is_brief(body) {
            *motion = Motion { since, last, ..Motion::default() };
            continue;
        }
        let acceleration = Some(acceleration);
        let goes_on = Motion { since, last, acceleration, jerk, ..Motion::default() };
        let earlier = std::mem::replace(motion, goes_on);
        let mut loaded = solution.contacts.iter().filter(|force| force.carries_force());
        if is_driven && !loaded.any(|force| force.key.bodies().any(|touching| touching == body)) {
            continue;
        }
        let turning = reach * map.angle_error(&state.spin);
        let error = jerk.map_or(0.0, |jerk| h.powi(3) / 24.0 * size(&jerk)) + turning;
        instants.errors[body] += error;
        added_error.smooth = added_error.smooth.max(error);
        if let (Some(jerk), Some(last)) = (jerk, earlier.jerk) {
            let missed = 0.3125 * h * h * size(&[0, 1].map(|k| jerk[k] - last[k]));
            added_error.velocity = added_error.velocity.max(missed);
        }
    }
    added_error.late = abrupt.late;
    taken.errors = added_error;
    taken.ends.clone_from(&instants.states);
    taken.extrapolated.clear();
    let bodies = instants.states.len();
    taken.extrapolated.extend((0..bodies).map(|body| instants.is_extrapolated(body)));
}
