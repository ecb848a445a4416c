//! Changes of velocity in a step that do not scale with h: impacts, ends of slips, stops of joints.

use super::islands::Islands;
use crate::contact::{Contact, ContactKey, KeyIndex};
use crate::joint::{Axis, Joint};
use crate::mechanics::State;
use crate::mechanics::quaternion::rotation;
use crate::partner::TurningFriction;
use crate::step::{ContactForce, StepSolution};
use crate::world::World;
use nalgebra::Vector3;

/// Slip or rate of an axis (m/s or rad/s, relative to the speed scale) below which it counts as
/// standing still. Solutions are exact to about 1e-12.
pub(super) const STILL: f64 = 1e-9;
/// Distance from a limit (m or rad) below which an axis counts as stopped there.
const AT_LIMIT: f64 = 1e-9;

/// Scratch memory of the search for changes of velocity that do not scale with h.
#[derive(Default)]
pub(super) struct AbruptChanges {
    /// Bodies of islands with such a change.
    pub bodies: Vec<bool>,
    /// Bodies with an impact at one of their contacts.
    pub struck: Vec<bool>,
    /// Islands with such a change, at the places of their labels.
    changed: Vec<bool>,
    islands: Islands,
    index: KeyIndex,
}

/// A step whose changes of velocity are examined.
pub(super) struct TakenStep<'a> {
    pub world: &'a World,
    /// States from which the step started, and one step before.
    pub states: &'a [State],
    pub earlier: &'a [State],
    /// States after free flight.
    pub free: &'a [State],
    /// Forces and slips of the step before.
    pub past: &'a [ContactForce],
    pub contacts: &'a [Contact],
    pub solution: &'a StepSolution,
    /// Flags of bodies in resting islands; empty if none rests.
    pub resting: &'a [bool],
}

impl AbruptChanges {
    /// Finds the bodies of islands with an impact, with the end of a slip, or with a joint that comes to
    /// its limit or to rest. Impulses between the bodies of an island conserve momentum only if all have
    /// velocities of one time.
    pub fn find(&mut self, step: &TakenStep<'_>) {
        let Self { bodies, struck, changed, islands, index } = self;
        let TakenStep { world, contacts, solution, resting, .. } = step;
        bodies.clear();
        bodies.resize(step.states.len(), false);
        struck.clear();
        struck.resize(step.states.len(), false);
        index.clear();
        let pairs = contacts.iter().zip(&solution.contacts).enumerate();
        let rests = |key: &ContactKey| resting.get(key.body) == Some(&true);
        let pairs = pairs.filter(|(_, (_, force))| force.carries_force() && !rests(&force.key));
        for (place, (contact, force)) in pairs {
            let past = index.find(step.past, &contact.key, place);
            let is_impact = step.is_impact(contact);
            if is_impact || step.ends_slip(contact, force, past) || step.ends_turning(contact) {
                contact.key.bodies().for_each(|body| bodies[body] = true);
                contact.key.bodies().for_each(|body| struck[body] |= is_impact);
            }
        }
        for (joint, force) in world.joints().iter().zip(&solution.joints) {
            if step.is_stopped(joint, &force.angles) || step.is_pulled(joint, &force.angles) {
                bodies[joint.body()] = true;
                joint.other().into_iter().for_each(|body| bodies[body] = true);
            }
        }
        if bodies.len() > 1 && bodies.contains(&true) {
            let carrying = solution.contacts.iter().filter(|force| force.carries_force());
            islands.find(bodies.len(), carrying.map(|force| &force.key), world);
            changed.clear();
            changed.resize(bodies.len(), false);
            for body in (0..bodies.len()).filter(|body| bodies[*body]) {
                changed[islands.label(body)] = true;
            }
            for (body, is_abrupt) in bodies.iter_mut().enumerate() {
                *is_abrupt = changed[islands.label(body)];
            }
        }
    }

    /// Adds the bodies with such a change to `flags`, and all bodies if they were not searched. Returns true
    /// if a flag is new.
    pub fn add_to(&self, flags: &mut [bool]) -> bool {
        let mut is_new = false;
        for (body, flag) in flags.iter_mut().enumerate() {
            let is_abrupt = self.bodies.get(body).is_none_or(|is_abrupt| *is_abrupt);
            is_new |= is_abrupt && !*flag;
            *flag |= is_abrupt;
        }
        is_new
    }
}

/// True if a motion ends or turns back from `before` to `now`, or would do so in half of another step.
/// `kick` is the time of the change, in lengths of the interval.
fn ends(before: &Vector3<f64>, now: &Vector3<f64>, least: f64, kick: f64) -> bool {
    let along = now.dot(before);
    let turns_soon = || (1.0 + 2.0 * kick) * now.norm_squared() < along;
    before.norm() > least && (now.norm() <= least || along < 0.0 || turns_soon())
}

impl TakenStep<'_> {
    /// Time of the changes of velocity at a contact, in lengths of the interval.
    fn kick(&self, contact: &Contact) -> f64 {
        contact.key.bodies().map(|body| self.world.kick(body)).fold(f64::INFINITY, f64::min)
    }

    /// True if the touching points approach faster than smooth accelerations explain in a step.
    fn is_impact(&self, contact: &Contact) -> bool {
        let approach = -contact.normal().dot(&contact.point_velocity(self.world, self.states));
        approach > 0.0 && approach > contact.smooth_change(self.world, self.states, self.free)
    }

    /// True if a slip ends or turns back in the step, or would do so in half of another one.
    fn ends_slip(
        &self,
        contact: &Contact,
        now: &ContactForce,
        past: Option<&ContactForce>,
    ) -> bool {
        let least = STILL * self.world.speed_scale();
        let initial = || contact.initial_slip(self.world, self.states);
        ends(&past.map_or_else(initial, |past| past.slip), &now.slip, least, self.kick(contact))
    }

    /// True if rolling or spinning that a moment resists ends or turns back in the step, or would do so in
    /// half of another one.
    fn ends_turning(&self, contact: &Contact) -> bool {
        let friction = contact.turning_friction(self.world);
        if !friction.acts() {
            return false;
        }
        let TurningFriction { rolling, torsional } = friction;
        let turning = |states: &[State]| {
            let of = |body: usize| rotation(&self.states[body].attitude) * states[body].spin;
            of(contact.key.body) - contact.key.partner.body().map_or(Vector3::zeros(), of)
        };
        let normal = contact.normal();
        let [before, now] = [self.states, &self.solution.states].map(|states| {
            let turning = turning(states);
            let about = normal * normal.dot(&turning);
            (turning - about, about)
        });
        let reach = self.world.bodies()[contact.key.body].reach();
        let least = STILL * self.world.speed_scale() / reach;
        let kick = self.kick(contact);
        rolling > 0.0 && ends(&before.0, &now.0, least, kick)
            || torsional > 0.0 && ends(&before.1, &now.1, least, kick)
    }

    /// True if a body of `joint` starts with a velocity that its locked axes do not allow, or that its
    /// prescribed motion may change.
    fn is_pulled(&self, joint: &Joint, angles: &Vector3<f64>) -> bool {
        /// Share of the step in which the velocities of the start act, and of speeds that the curvature of
        /// the motion explains in it.
        const SOON: f64 = 1e-3;
        let bodies = || [Some(joint.body()), joint.other()].into_iter().flatten();
        let starts = |body| self.world.before().get(body) == Some(&0.0);
        if !bodies().any(starts) {
            return false;
        }
        let time = SOON * self.world.time_step();
        let ends = (joint.coordinates(self.states), joint.coasted(self.states, time));
        let (Some(now), Some(soon), false) = (ends.0, ends.1, joint.moves()) else { return true };
        let turns = joint.turns(&now, angles);
        let (along, about) = joint.rates(&now, &soon, &turns, time);
        let reach = self.world.bodies()[joint.body()].reach();
        let locked = |axes: &[Axis; 3], rates: &Vector3<f64>| {
            let locked = axes.iter().zip(rates).filter(|(axis, _)| **axis == Axis::Locked);
            locked.map(|(_, rate)| rate.abs()).fold(0.0, f64::max)
        };
        let speed = |body: usize| {
            let state = &self.states[body];
            state.velocity.norm() + self.world.bodies()[body].reach() * state.spin.norm()
        };
        let least = SOON * bodies().map(speed).sum::<f64>() + STILL * self.world.speed_scale();
        locked(joint.linear(), &along).max(reach * locked(joint.angular(), &about)) > least
    }

    /// True if an axis of `joint` comes to a limit, or if its dry friction stops it or turns.
    /// `angles` are its angles at the end of the step (rad).
    fn is_stopped(&self, joint: &Joint, angles: &Vector3<f64>) -> bool {
        let has_jump = |axis: &Axis| match axis {
            Axis::Free(drive) => drive.limits.is_some() || drive.rubs(),
            Axis::Locked => false,
        };
        let axes = || joint.linear().iter().chain(joint.angular());
        if !axes().any(has_jump) {
            return false;
        }
        let h = self.world.time_step();
        let next = &self.solution.states;
        let at = [self.earlier, self.states, next].map(|states| joint.coordinates(states));
        let [Some(earlier), Some(now), Some(end)] = at else { return false };
        let turns = joint.turns(&end, angles);
        let (before, after) =
            (joint.rates(&earlier, &now, &turns, h), joint.rates(&now, &end, &turns, h));
        let numbers = |of: &(Vector3<f64>, Vector3<f64>)| {
            [of.0[0], of.0[1], of.0[2], of.1[0], of.1[1], of.1[2]]
        };
        let (before, after, place) =
            (numbers(&before), numbers(&after), numbers(&(end.place, turns)));
        let least = STILL * self.world.speed_scale();
        axes().enumerate().any(|(k, axis)| {
            let Axis::Free(drive) = axis else { return false };
            let stops = drive.rubs()
                && before[k].abs() > least
                && (after[k].abs() <= least || after[k] * before[k] < 0.0);
            let is_at = |limit: f64| (place[k] - limit).abs() <= AT_LIMIT;
            let lands = drive.limits.is_some_and(|limits| limits.into_iter().any(is_at))
                && before[k].abs() > least;
            stops || lands
        })
    }
}
