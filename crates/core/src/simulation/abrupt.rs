//! Changes of velocity in a step that do not scale with h: impacts, ends of slips, stops of joints.

use super::break_away::{Friction, PairFriction};
use super::instants::Instants;
use super::interval::Interval;
use super::islands::Islands;
use super::still_speeds::StillSpeeds;
use crate::contact::{Contact, ContactKey, KeyIndex};
use crate::joint::{Axis, Joint, JointForce};
use crate::mechanics::State;
use crate::partner::TurningFriction;
use crate::step::{ContactForce, StepSolution};
use crate::world::{Impacts, World};
use nalgebra::Vector3;

/// Share of the error of a second that an abrupt change may add.
pub(super) const CAUGHT: f64 = 0.1;
/// Slip or rate of an axis (m/s or rad/s, relative to the speed scale) below which it counts as
/// standing still. Solutions are exact to about 1e-12.
pub(super) const STILL: f64 = 1e-9;
/// Gap that counts as closed at the start of an interval, relative to the reach of the world.
pub(super) const CLOSED: f64 = 1e-9;
/// Smallest part of a step that is divided at a turn, as a share of the step.
const SOONEST: f64 = 1e-3;
/// Share of a step in which the velocities of its start act, and of speeds that the curvature of the motion
/// explains in it.
const SOON: f64 = 1e-3;
/// Distance from a limit (m or rad) below which an axis counts as stopped there.
const AT_LIMIT: f64 = 1e-9;

/// Scratch memory of the search for changes of velocity that do not scale with h.
#[derive(Default)]
pub(super) struct AbruptChanges {
    /// Bodies of islands with such a change.
    pub bodies: Vec<bool>,
    /// Bodies with an impact at one of their contacts.
    pub struck: Vec<bool>,
    /// Bodies of islands in which a change does not vanish with the length of the step: other changes than ends
    /// and turns of motions by friction.
    pub jumps: Vec<bool>,
    /// Largest velocity that the static friction of a contact or an axis takes too much in the step (m/s). Only with
    /// located impacts.
    pub lost: f64,
    /// Largest velocity that the static friction of an axis takes too much in the step in which it breaks away (m/s).
    /// The law holds the axis in that step, however short it is (docs/formulation.md, section 17). The same of the
    /// adhesion of points that open.
    pub late: f64,
    /// Shares of dry friction in its limit along the axes of each joint; empty unless impacts are located.
    pub axis_shares: Vec<[f64; 6]>,
    /// The first [turn](super::turning) of the step.
    pub turn: Option<Turn>,
    /// Flags of the bodies whose motions turn where the step is being divided; empty in other steps.
    pub turning: Vec<bool>,
    /// Turns, and bodies of islands with other changes.
    turns: Vec<Turn>,
    others: Vec<bool>,
    /// Islands with such a change, at the places of their labels.
    changed: Vec<bool>,
    pub islands: Islands,
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
    /// States at its end with the velocities of the instant, if it is smooth; empty unless impacts are located.
    pub ends: &'a [State],
    /// Forces and slips of the step before.
    pub past: &'a [ContactForce],
    pub contacts: &'a [Contact],
    pub solution: &'a StepSolution,
    /// Flags of bodies in resting islands; empty if none rests.
    pub resting: &'a [bool],
    /// States at its start with the velocities of the instant.
    pub instants: &'a Instants,
}

/// A turn: friction ends a motion.
#[derive(Debug, Clone, Copy)]
pub(super) struct Turn {
    pub body: usize,
    /// Time after the start of the step (s).
    pub time: f64,
    pub motion: TurningMotion,
}

/// The slip of a contact, or the rates of the joint with this index.
#[derive(Debug, Clone, Copy)]
pub(super) enum TurningMotion {
    Slip(ContactKey),
    Joint(usize),
}

/// Kind of a change of velocity.
#[derive(Debug, Clone, Copy)]
enum Change {
    /// Impact, stop at a limit, start of a joint: it does not vanish with the length of the step.
    Jump,
    /// Friction ends a motion, after this time from the start of the step (s) if it is a turn.
    Friction(Option<f64>),
}

impl AbruptChanges {
    /// Finds the bodies of islands with an impact, with the end of a slip, or with a joint that comes to
    /// its limit or to rest, and the first turn. Impulses between the bodies of an island conserve momentum
    /// only if all have velocities of one time.
    pub fn find(&mut self, step: &TakenStep<'_>) {
        let TakenStep { world, contacts, solution, resting, .. } = step;
        let count = step.states.len();
        for flags in [&mut self.bodies, &mut self.struck, &mut self.jumps, &mut self.others] {
            flags.clear();
            flags.resize(count, false);
        }
        self.turns.clear();
        self.turn = None;
        (self.lost, self.late) = (0.0, 0.0);
        self.index.clear();
        let pairs = contacts.iter().zip(&solution.contacts).enumerate();
        let rests = |key: &ContactKey| resting.get(key.body) == Some(&true);
        let pairs = pairs.filter(|(_, (_, force))| force.carries_force() && !rests(&force.key));
        for (place, (contact, force)) in pairs {
            let past = self.index.find(step.past, &contact.key, place);
            let turns = self.turning.get(contact.key.body) == Some(&true);
            let motion = TurningMotion::Slip(contact.key);
            if step.is_impact(contact) || step.lands(contact) {
                contact.key.bodies().for_each(|body| self.struck[body] = true);
                self.add(contact.key.bodies(), Change::Jump, motion);
            } else if step.ends_impact(contact) {
                self.add(contact.key.bodies(), Change::Jump, motion);
            } else if !turns && step.ends_slip(contact, force, past) {
                let time = step.turn_of_slip(contact);
                self.add(contact.key.bodies(), Change::Friction(time), motion);
            } else if !turns && step.ends_turning(contact) {
                self.add(contact.key.bodies(), Change::Friction(None), motion);
            }
        }
        if let Some(accuracy) = world.impact_accuracy() {
            self.find_breaks(step, CAUGHT * accuracy);
            let opening =
                contacts.iter().zip(&solution.contacts).filter(|(_, of)| !of.carries_force());
            self.late = opening.map(|(contact, _)| contact.law.adhesion).sum();
        }
        self.axis_shares.clear();
        for (index, joint) in world.joints().iter().enumerate() {
            let Some(force) = solution.joints.get(index) else { continue };
            let bodies = [Some(joint.body()), joint.other()].into_iter().flatten();
            let turns = self.turning.get(joint.body()) == Some(&true);
            let motion = TurningMotion::Joint(index);
            let AxisChange { change, shares, lost, late } = step.axes(joint, index, force, turns);
            if let Some(accuracy) = world.impact_accuracy() {
                self.axis_shares.push(shares);
                self.late = self.late.max(late);
                if change.is_none() && lost > CAUGHT * accuracy {
                    self.lost = self.lost.max(lost);
                    self.add(bodies, Change::Friction(None), motion);
                    continue;
                }
            }
            match change {
                Some(Change::Friction(_)) if turns => {}
                Some(change) => self.add(bodies, change, motion),
                None if step.is_pulled(joint, &force.angles) => {
                    self.add(bodies, Change::Jump, motion);
                }
                None => {}
            }
        }
        if self.bodies.contains(&true) {
            let carrying = solution.contacts.iter().filter(|force| force.carries_force());
            self.islands.find(count, carrying.map(|force| &force.key), world);
            self.spread();
        }
    }

    /// Finds pairs of bodies whose static friction is overcome in the step, where it takes a velocity of more than
    /// `allowed` (m/s). Points of a pair may be at their limits while others hold it.
    fn find_breaks(&mut self, step: &TakenStep<'_>, allowed: f64) {
        let pair = |key: &ContactKey| (key.body, key.partner);
        let forces = &step.solution.contacts;
        let mut place = 0;
        while place < forces.len() {
            let first = &step.contacts[place];
            let same = |force: &&ContactForce| pair(&force.key) == pair(&first.key);
            let group = place..place + forces[place..].iter().take_while(same).count().max(1);
            place = group.end;
            let turns = self.turning.get(first.key.body) == Some(&true);
            let is_known = first.key.bodies().any(|body| self.bodies[body]);
            let rests = step.resting.get(first.key.body) == Some(&true);
            let growth = step.growth(first.key.bodies()).filter(|_| !is_known && !rests);
            let Some(growth) = growth else { continue };
            let mut friction = PairFriction::default();
            let mut past =
                |place: usize| self.index.find(step.past, &step.contacts[place].key, place);
            for place in group.clone() {
                friction.load(&step.contacts[place], &forces[place], past(place));
            }
            if !friction.presses() {
                continue;
            }
            for place in group {
                friction.add(&step.contacts[place], &forces[place], past(place), growth);
            }
            let friction = friction.at(first, step.world, step.still().now);
            let lost = friction.lost(step.still(), step.world.speed_scale(), turns);
            if let Some(lost) = lost.filter(|lost| *lost > allowed) {
                self.lost = self.lost.max(lost);
                let motion = TurningMotion::Slip(first.key);
                self.add(first.key.bodies(), Change::Friction(None), motion);
            }
        }
    }

    /// Adds a `change` of a `motion` of these `bodies`.
    fn add(&mut self, bodies: impl Iterator<Item = usize>, change: Change, motion: TurningMotion) {
        for body in bodies {
            self.bodies[body] = true;
            self.jumps[body] |= matches!(change, Change::Jump);
            match change {
                Change::Friction(Some(time)) => self.turns.push(Turn { body, time, motion }),
                Change::Friction(None) | Change::Jump => self.others[body] = true,
            }
        }
    }

    /// Extends the changes to the islands of their bodies. The turn is the first one in an island without other
    /// changes.
    fn spread(&mut self) {
        let Self { bodies, jumps, others, changed, islands, turns, .. } = self;
        for flags in [jumps, others, &mut *bodies] {
            changed.clear();
            changed.resize(flags.len(), false);
            for body in (0..flags.len()).filter(|body| flags[*body]) {
                changed[islands.label(body)] = true;
            }
            for (body, flag) in flags.iter_mut().enumerate() {
                *flag = changed[islands.label(body)];
            }
        }
        let turns = turns.iter().filter(|turn| !self.others[turn.body]);
        self.turn = turns.copied().min_by(|a, b| a.time.total_cmp(&b.time));
    }

    /// Notes that the motions of the island of `body` turn at the next division of the step.
    pub fn begin_turn(&mut self, body: usize) {
        let label = self.islands.label(body);
        let bodies = 0..self.others.len();
        self.turning.extend(bodies.map(|body| self.islands.label(body) == label));
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

impl TakenStep<'_> {
    /// Time of the changes of velocity at a contact, in lengths of the interval.
    fn kick(&self, contact: &Contact) -> f64 {
        contact.key.bodies().map(|body| self.world.kick(body)).fold(f64::INFINITY, f64::min)
    }

    /// Speeds below which a motion stands still in this step. At its start each of two bodies has an error of up to a
    /// tenth of the accuracy.
    fn still(&self) -> StillSpeeds {
        let now = STILL * self.world.speed_scale();
        let known = self.world.impact_accuracy().map_or(0.0, |accuracy| 2.0 * CAUGHT * accuracy);
        StillSpeeds { before: now.max(known), now }
    }

    /// True if a body of `contact` starts. Slips before belong to another motion.
    fn starts(&self, contact: &Contact) -> bool {
        contact.key.bodies().any(|body| self.world.before().get(body) == Some(&0.0))
    }

    /// True if the touching points approach faster than smooth accelerations explain in a step.
    fn is_impact(&self, contact: &Contact) -> bool {
        let mut approach = -contact.normal().dot(&contact.point_velocity(self.world, self.states));
        if contact.rolls() {
            // A touching point that moves over its body leaves the plane faster than its surface does. The gap before
            // may be that of another feature.
            let closed = contact.gap_in(self.earlier) - contact.gap;
            approach = approach.min(closed / self.world.time_step());
        }
        approach > 0.0 && approach > contact.smooth_change(self.world, self.states, self.free)
    }

    /// True if a gap closes between bodies without forces between them before.
    fn lands(&self, contact: &Contact) -> bool {
        let is_same = |force: &ContactForce| {
            (force.key.body, force.key.partner) == (contact.key.body, contact.key.partner)
        };
        let mut past = self.past.iter().filter(|force| is_same(force));
        contact.gap > self.world.touching_gap().max(CLOSED * self.world.reach())
            && (self.starts(contact) || !past.any(ContactForce::carries_force))
    }

    /// True if the touching points still approach after an impact in the interval before. The velocity of its
    /// middle closed the gap.
    fn ends_impact(&self, contact: &Contact) -> bool {
        let is_struck = |body: usize| {
            self.world.before().get(body) != Some(&0.0) && self.instants.is_struck(body)
        };
        let approach = -contact.normal().dot(&contact.point_velocity(self.world, self.states));
        approach > STILL * self.world.speed_scale() && contact.key.bodies().any(is_struck)
    }

    /// True if a slip ends or turns back in the step, or would do so in half of another one.
    fn ends_slip(
        &self,
        contact: &Contact,
        now: &ContactForce,
        past: Option<&ContactForce>,
    ) -> bool {
        let initial = |states: &[State]| contact.initial_slip(self.world, states);
        let before = past.filter(|_| !self.starts(contact));
        let before = before.map_or_else(|| initial(self.states), |past| past.slip);
        let end = (!self.ends.is_empty()).then(|| initial(self.ends));
        self.still().ends(&before, &now.slip, end, self.kick(contact))
    }

    /// t⁺/t (41b) of forces on these bodies, for loads in the middle of a kick or for springs at the start of
    /// an interval, whichever is larger. `None` after an abrupt change.
    fn growth(&self, mut bodies: impl Iterator<Item = usize> + Clone) -> Option<f64> {
        let kicks = bodies.clone().map(|body| self.world.kick(body));
        let last = bodies.find_map(|body| self.instants.last_kick(body))?;
        let h = self.world.time_step();
        let ahead = 0.5 * h * (1.0 + kicks.fold(f64::INFINITY, f64::min));
        Some((ahead / (last.middle + h - ahead)).max(h / last.start))
    }

    /// Time after the start at which the slip of a contact ends, see [`Self::turn`] (s).
    fn turn_of_slip(&self, contact: &Contact) -> Option<f64> {
        let [before, start] = [self.states, &self.instants.states]
            .map(|states| contact.initial_slip(self.world, states));
        self.turn(contact.key.bodies(), &before, &start)
    }

    /// Time after the start at which a motion of `bodies` ends (s), if it goes on as it came. With the motion u
    /// in the middle of the interval before, of length h₁, and U at the start,
    ///
    /// ```text
    /// t = ½ h₁ u·U/(u·(u − U))
    /// ```
    ///
    /// It lies within the step, which can find a turn of a step beside it. `None` in a part of a step, and if the motion
    /// has no second difference yet.
    fn turn(
        &self,
        mut bodies: impl Iterator<Item = usize>,
        before: &Vector3<f64>,
        start: &Vector3<f64>,
    ) -> Option<f64> {
        let world = self.world;
        let h = world.time_step();
        let is_whole = world.span().is_none() && world.impacts() == Impacts::Stepped;
        let length = |body: usize| world.before().get(body).copied().unwrap_or(h);
        let own = bodies.next().filter(|body| self.instants.is_steady(*body))?;
        if !is_whole || !bodies.all(|body| self.instants.is_steady(body)) {
            return None;
        }
        let time = 0.5 * length(own) * before.dot(start) / before.dot(&(before - start));
        let is_near = (-0.5 * h..1.5 * h).contains(&time);
        is_near.then(|| time.clamp(SOONEST * h, (1.0 - SOONEST) * h))
    }

    /// True if rolling or spinning that a moment resists ends or turns back in the step, or would do so in
    /// half of another one.
    fn ends_turning(&self, contact: &Contact) -> bool {
        let friction = contact.turning_friction(self.world);
        if !friction.acts() {
            return false;
        }
        let TurningFriction { rolling, torsional } = friction;
        let parts = |states: &[State]| self.turning(contact, states);
        let [before, now] = [self.states, &self.solution.states].map(parts);
        let end = (!self.ends.is_empty()).then(|| parts(self.ends)).unzip();
        let reach = self.world.bodies()[contact.key.body].reach();
        let still = self.still().about(reach);
        let kick = self.kick(contact);
        rolling > 0.0 && still.ends(&before.0, &now.0, end.0, kick)
            || torsional > 0.0 && still.ends(&before.1, &now.1, end.1, kick)
    }

    /// Angular velocity of A relative to B with the spins of `states`: along the tangents, and about the normal
    /// (rad/s).
    fn turning(&self, contact: &Contact, states: &[State]) -> (Vector3<f64>, Vector3<f64>) {
        let turning = contact.turning_at(states);
        let about = contact.normal() * contact.normal().dot(&turning);
        (turning - about, about)
    }

    /// True if a body of `joint` starts with a velocity that its locked axes do not allow, or that its
    /// prescribed motion may change. In divided steps, that jumps only between intervals.
    fn is_pulled(&self, joint: &Joint, angles: &Vector3<f64>) -> bool {
        if joint.moves() && self.world.impacts() == Impacts::Located {
            return false;
        }
        let bodies = || [Some(joint.body()), joint.other()].into_iter().flatten();
        let starts = |body| self.world.before().get(body) == Some(&0.0);
        if !bodies().any(starts) {
            return false;
        }
        let time = SOON * self.world.time_step();
        let ends = (
            joint.coordinates(self.states),
            joint.coasted(self.states, &self.world.step_map().over(time)),
        );
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

    /// Way in which the axes of `joint` with this `index` and `force` come to a limit, or their dry friction stops or
    /// turns or no longer holds them; `breaks` as in [`Friction::lost`].
    fn axes(&self, joint: &Joint, index: usize, force: &JointForce, breaks: bool) -> AxisChange {
        let mut found = AxisChange::default();
        let has_jump = |axis: &Axis| match axis {
            Axis::Free(drive) => drive.limits.is_some() || drive.rubs(),
            Axis::Locked => false,
        };
        let axes = || joint.linear().iter().chain(joint.angular());
        if !axes().any(has_jump) {
            return found;
        }
        let Self { world, instants, .. } = self;
        let h = world.time_step();
        let bodies = || [Some(joint.body()), joint.other()].into_iter().flatten();
        let next = &self.solution.states;
        // The velocities of the bodies move them back to where the interval before began. With another length, an
        // axis at rest in its limit would seem to have moved there.
        let lengths = bodies().filter_map(|body| world.before().get(body)).copied();
        let length = lengths.filter(|length| *length > 0.0).reduce(f64::min);
        let earlier = match length {
            Some(length) => joint.coasted(self.states, &world.step_map().over(-length)),
            None => joint.coordinates(self.earlier),
        };
        let at = [self.states, next].map(|states| joint.coordinates(states));
        let (Some(earlier), [Some(now), Some(end)]) = (earlier, at) else { return found };
        let turns = joint.turns(&end, &force.angles);
        let before = joint.rates(&earlier, &now, &turns, length.unwrap_or(h));
        let after = joint.rates(&now, &end, &turns, h);
        let before = numbers(&before);
        let after = numbers(&after);
        let place = numbers(&(end.place, turns));
        let forces = numbers(&(force.force, force.torque));
        let still = self.still();
        let kick = bodies().map(|body| world.kick(body)).fold(f64::INFINITY, f64::min);
        let growth = world.impact_accuracy().and_then(|_| self.growth(bodies()));
        let angles = joint.counted(&now, &force.angles);
        let starts = joint.starts(self.states, &now, &angles, &world.step_map());
        for (k, axis) in axes().enumerate() {
            let Axis::Free(drive) = axis else { continue };
            // It comes to a stop, where it rests or bounces.
            let is_at = |limit: f64| (place[k] - limit).abs() <= AT_LIMIT;
            let is_stopped = drive.limits.is_some_and(|limits| limits.into_iter().any(is_at));
            let start = &starts[k / 3][k % 3];
            if (is_stopped || drive.bounces(start, h)) && before[k].abs() > still.now {
                return AxisChange { change: Some(Change::Jump), ..found };
            }
            if !drive.rubs() {
                continue;
            }
            let along = |rate: f64| Vector3::x() * rate;
            if still.ends(&along(before[k]), &along(after[k]), None, kick) {
                let soon = SOON * h;
                let turn = joint
                    .coasted(&self.instants.states, &world.step_map().over(soon))
                    .and_then(|coasted| {
                        let start = numbers(&joint.rates(&now, &coasted, &turns, soon));
                        self.turn(bodies(), &along(before[k]), &along(start[k]))
                    });
                found.change = Some(Change::Friction(turn));
            }
            let Some((share, most)) = axis.at_rest(start, h, forces[k]) else {
                continue;
            };
            found.shares[k] = share;
            let (Some(growth), Some(past)) = (growth, instants.axis_shares.get(index)) else {
                continue;
            };
            let reach = if k < 3 { 1.0 } else { world.bodies()[joint.body()].reach() };
            let response = |body: usize| {
                let body = &world.bodies()[body];
                if k < 3 {
                    1.0 / body.mass()
                } else {
                    reach * body.inertia_inverse().diagonal().max()
                }
            };
            let response = bodies().map(response).fold(0.0, f64::max);
            let friction = Friction {
                share: share.abs(),
                end: (share + (share - past[k]) * growth).abs(),
                limit: 1.0,
                kinetic: drive.static_friction.map_or(1.0, |limit| drive.friction / limit),
                change: most * h * response / kick,
                slip: after[k].abs() * reach,
                past_slip: before[k].abs() * reach,
            };
            if drive.static_friction.is_none() {
                let lost = friction.lost(still, world.speed_scale(), breaks);
                found.lost = found.lost.max(lost.unwrap_or_default());
            } else if friction.slip > still.now && friction.past_slip <= still.before {
                found.late = found.late.max((friction.limit - friction.kinetic) * friction.change);
            }
        }
        found
    }
}

/// Changes of the motion of a joint in a step.
#[derive(Debug, Clone, Copy, Default)]
struct AxisChange {
    change: Option<Change>,
    /// Shares of dry friction in its limit, along each axis at rest.
    shares: [f64; 6],
    /// Velocity that friction takes too much (m/s), see [`Friction::lost`], and [`AbruptChanges::late`].
    lost: f64,
    late: f64,
}

/// Numbers of two vectors.
fn numbers((along, about): &(Vector3<f64>, Vector3<f64>)) -> [f64; 6] {
    std::array::from_fn(|k| if k < 3 { along[k] } else { about[k - 3] })
}

impl TurningMotion {
    /// Speed of this motion in the interval `taken` of `world` (m/s or rad/s).
    pub fn speed(&self, world: &World, taken: &Interval) -> f64 {
        let Interval { states, solution, length, .. } = taken;
        let speed = match *self {
            Self::Slip(key) => {
                let same = solution.contacts.iter().find(|force| force.key == key);
                same.map(|force| force.slip.norm())
            }
            Self::Joint(index) => {
                let joint = &world.joints()[index];
                let [now, end] = [states, &solution.states].map(|states| joint.coordinates(states));
                now.zip(end).zip(solution.joints.get(index)).map(|((now, end), force)| {
                    let turns = joint.turns(&end, &force.angles);
                    let rates = numbers(&joint.rates(&now, &end, &turns, *length));
                    let axes = joint.linear().iter().chain(joint.angular()).zip(rates);
                    let rubs = |axis: &Axis| matches!(axis, Axis::Free(drive) if drive.rubs());
                    let rubbing = axes.filter(|(axis, _)| rubs(axis));
                    rubbing.map(|(_, rate)| rate.abs()).fold(0.0, f64::max)
                })
            }
        };
        speed.unwrap_or_default()
    }
}
