//! What joints and gears lock together: more than once, against each other, or in axes that were to be free.
//!
//! At the states X every locked axis of a joint and every gear is a row of
//!
//! ```text
//! G v = b                                                                   (J20)
//! ```
//!
//! where v has the velocities and spins of the bodies and b what frames in the world that move ask for. Rows are taken one
//! after another against an orthonormal basis of those before: a row that this leaves nothing of is redundant if b agrees,
//! and contradicts them if not. An axis whose own row the basis spans is locked.

use crate::joint::{Axis, GearAxis, Joint, JointAxis, JointFrame, Knots};
use crate::mechanics::way::Way;
use crate::mechanics::{State, Wrench};
use crate::world::World;
use nalgebra::{DVector, Vector3};
use std::collections::BTreeMap;

/// A part of a row of length 1 that is less than this is rounding: starts fit their joints to 1e-6.
const DEPENDENT: f64 = 1e-5;
/// A difference of velocities, m/s, that is less than this is rounding.
const SAME_VELOCITY: f64 = 1e-4;
/// More rows in one mechanism than this are not looked at: their cost grows with the third power.
const MOST_ROWS: usize = 600;

/// What has a row of (J20).
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub enum Lock {
    /// The joint of this index.
    Joint(usize),
    /// The gear of this index.
    Gear(usize),
}

/// What is odd about the rows of one mechanism.
#[derive(Debug, Clone, PartialEq)]
#[non_exhaustive]
pub enum Finding {
    /// No velocities obey all of these.
    Contradiction {
        /// Whose rows they are.
        locks: Vec<Lock>,
        /// By how much, m/s at the reach of the world's bodies.
        off: f64,
    },
    /// An axis that has a drive or is free cannot move.
    LockedAxis {
        /// Whose axis.
        axis: GearAxis,
        /// What locks it.
        locks: Vec<Lock>,
    },
    /// Some rows follow from the others: the reactions are not known one by one.
    Redundant {
        /// Whose rows they are.
        locks: Vec<Lock>,
        /// How many there are too many.
        rows: usize,
    },
}

/// A row of (J20), or what is left of it.
#[derive(Clone)]
struct LockedRow {
    /// G.
    along: DVector<f64>,
    /// b.
    velocity: f64,
    /// By how much each row that was given is in it.
    of: Vec<f64>,
}

impl LockedRow {
    fn minus(&mut self, part: f64, other: &Self) {
        self.along.axpy(-part, &other.along, 1.0);
        self.velocity -= part * other.velocity;
        for (own, other) in self.of.iter_mut().zip(&other.of) {
            *own -= part * other;
        }
    }

    fn scaled(&mut self, by: f64) {
        self.along *= by;
        self.velocity *= by;
        self.of.iter_mut().for_each(|part| *part *= by);
    }
}

impl World {
    /// What is odd about the locks of this world at `states`, one a body, where the frames in the world of some joints move on
    /// `courses` from `time` (s) on. Of a mechanism of more than 600 locked rows nothing is said.
    #[must_use]
    pub fn locked(&self, states: &[State], courses: &[(usize, Knots)], time: f64) -> Vec<Finding> {
        let rows = LockedRows { world: self, states, courses, time };
        rows.mechanisms().iter().flat_map(|mechanism| rows.of(mechanism)).collect()
    }
}

/// Makes the rows of a world.
struct LockedRows<'a> {
    world: &'a World,
    states: &'a [State],
    courses: &'a [(usize, Knots)],
    time: f64,
}

/// Joints and gears that may act on each other.
#[derive(Default)]
struct Mechanism {
    joints: Vec<usize>,
    gears: Vec<usize>,
    /// The bodies of both, in their order.
    bodies: Vec<usize>,
}

impl LockedRows<'_> {
    /// The mechanisms, without what hangs on one joint alone: it obeys its rows whatever the rest does.
    fn mechanisms(&self) -> Vec<Mechanism> {
        let (joints, gears) = (self.world.joints(), self.world.gears());
        let bodies = self.states.len();
        let mut stays = vec![true; joints.len()];
        let mut is_geared = vec![false; bodies];
        for axis in gears.iter().flat_map(|gear| gear.axes()) {
            ends(&joints[axis.joint]).for_each(|body| is_geared[body] = true);
        }
        let mut ties = vec![0_usize; bodies];
        joints.iter().flat_map(ends).for_each(|body| ties[body] += 1);
        let mut by_body = vec![Vec::new(); bodies];
        for (index, joint) in joints.iter().enumerate() {
            ends(joint).for_each(|body| by_body[body].push(index));
        }
        let mut leaves: Vec<_> = (0..bodies).filter(|body| ties[*body] == 1).collect();
        while let Some(body) = leaves.pop() {
            let last = by_body[body].iter().find(|joint| stays[**joint]);
            let Some(&joint) = last.filter(|_| !is_geared[body]) else { continue };
            // A joint whose own limits lock it is of interest by itself.
            if locks_itself(&joints[joint]) {
                continue;
            }
            stays[joint] = false;
            for other in ends(&joints[joint]) {
                ties[other] -= 1;
                if ties[other] == 1 {
                    leaves.push(other);
                }
            }
        }
        self.joined(&stays)
    }

    /// The joints that stay, those of each connected mechanism together.
    fn joined(&self, stays: &[bool]) -> Vec<Mechanism> {
        let (joints, gears) = (self.world.joints(), self.world.gears());
        let mut root: Vec<usize> = (0..self.states.len()).collect();
        let kept = || joints.iter().enumerate().filter(|(index, _)| stays[*index]);
        for (_, joint) in kept() {
            if let Some(other) = joint.other() {
                join(&mut root, joint.body(), other);
            }
        }
        for gear in gears {
            let [a, b] = gear.axes().map(|axis| joints[axis.joint].body());
            join(&mut root, a, b);
        }
        let mut mechanisms: BTreeMap<usize, Mechanism> = BTreeMap::new();
        for (index, joint) in kept() {
            let of = find(&mut root, joint.body());
            mechanisms.entry(of).or_default().joints.push(index);
        }
        for (index, gear) in gears.iter().enumerate() {
            let of = find(&mut root, joints[gear.axes()[0].joint].body());
            mechanisms.entry(of).or_default().gears.push(index);
        }
        for mechanism in mechanisms.values_mut() {
            let geared = mechanism.gears.iter().flat_map(|gear| gears[*gear].axes());
            let tied = mechanism.joints.iter().copied().chain(geared.map(|axis| axis.joint));
            mechanism.bodies = tied.flat_map(|joint| ends(&joints[joint])).collect();
            mechanism.bodies.sort_unstable();
            mechanism.bodies.dedup();
        }
        mechanisms.into_values().collect()
    }

    /// What is odd about one mechanism.
    fn of(&self, mechanism: &Mechanism) -> Vec<Finding> {
        let Some((locks, rows)) = self.rows(mechanism) else { return Vec::new() };
        let mut basis: Vec<LockedRow> = Vec::new();
        let (mut findings, mut redundant) = (Vec::new(), Vec::new());
        let mut too_many = 0;
        for row in &rows {
            let mut left = row.clone();
            let length = rest_of(&mut left, &basis);
            if length > DEPENDENT {
                left.scaled(1.0 / length);
                basis.push(left);
                continue;
            }
            let involved = involved(&left.of, &locks);
            if left.velocity.abs() > SAME_VELOCITY {
                let off = left.velocity.abs();
                findings.push(Finding::Contradiction { locks: involved, off });
                return findings;
            }
            too_many += 1;
            redundant.extend(involved);
        }
        for &joint in &mechanism.joints {
            for axis in axes() {
                if is_locked(&self.world.joints()[joint], axis) {
                    continue;
                }
                let of = GearAxis { joint, axis };
                let along = self.along(of, &mechanism.bodies).filter(|row| row.norm() > 0.0);
                let Some(along) = along else { continue };
                let length = along.norm();
                let of_none = vec![0.0; locks.len()];
                let mut row = LockedRow { along: along / length, velocity: 0.0, of: of_none };
                if rest_of(&mut row, &basis) <= DEPENDENT {
                    let locks = involved(&row.of, &locks);
                    findings.push(Finding::LockedAxis { axis: of, locks });
                }
            }
        }
        if too_many > 0 {
            redundant.sort();
            redundant.dedup();
            findings.push(Finding::Redundant { locks: redundant, rows: too_many });
        }
        findings
    }

    /// The rows of (J20), each of length 1, and whose they are; `None` where there are too many, or a body has no state.
    fn rows(&self, mechanism: &Mechanism) -> Option<(Vec<Lock>, Vec<LockedRow>)> {
        let (mut locks, mut found) = (Vec::new(), Vec::new());
        for &index in &mechanism.joints {
            let joint = &self.world.joints()[index];
            for axis in axes() {
                if is_locked(joint, axis) || limits_lock(joint, axis) {
                    let of = GearAxis { joint: index, axis };
                    let along = self.along(of, &mechanism.bodies)?;
                    let velocity = self.asked(index, axis)?;
                    locks.push(Lock::Joint(index));
                    found.push((along, velocity));
                }
            }
        }
        for &index in &mechanism.gears {
            let gear = &self.world.gears()[index];
            if gear.drive().is_none() {
                let [first, second] = *gear.axes();
                locks.push(Lock::Gear(index));
                let [first, second] = [first, second].map(|of| self.along(of, &mechanism.bodies));
                found.push((first? - gear.ratio() * second?, 0.0));
            }
        }
        if locks.len() > MOST_ROWS {
            return None;
        }
        let row = |(index, (along, velocity)): (usize, (DVector<f64>, f64))| {
            let mut of = vec![0.0; locks.len()];
            of[index] = 1.0;
            let mut row = LockedRow { along, velocity, of };
            let length = row.along.norm();
            row.scaled(if length > 0.0 { 1.0 / length } else { 0.0 });
            row
        };
        let rows = found.into_iter().enumerate().map(row).collect();
        Some((locks, rows))
    }

    /// How the coordinate of an axis changes with the velocities of these bodies, turns at the reach of the world's bodies.
    fn along(&self, of: GearAxis, bodies: &[usize]) -> Option<DVector<f64>> {
        let joint = &self.world.joints()[of.joint];
        let wrenches = joint.wrenches(self.states, of.axis, 1.0)?;
        let mut row = DVector::zeros(6 * bodies.len());
        let acting = [Some(joint.body()), joint.other()];
        for (body, Wrench { force, torque }) in acting.into_iter().zip(wrenches) {
            let Some(body) = body else { continue };
            let place = 6 * bodies.binary_search(&body).ok()?;
            let mut part = row.fixed_rows_mut::<3>(place);
            part += force;
            let mut part = row.fixed_rows_mut::<3>(place + 3);
            part += torque / self.world.reach();
        }
        Some(row)
    }

    /// The velocity along a locked axis that a frame in the world asks of a body, because it moves.
    fn asked(&self, index: usize, axis: JointAxis) -> Option<f64> {
        let joint = &self.world.joints()[index];
        let Some((_, knots)) = self.courses.iter().find(|(of, _)| *of == index) else {
            return Some(0.0);
        };
        let h = self.world.time_step();
        let [from, to] = [self.time, self.time + h].map(|time| as_state(&knots.at(time)));
        let way = Way::between(&from, &to);
        let (velocity, spin) = (way.shift() / h, way.turn() / h);
        let state = self.states.get(joint.body())?;
        let at_centre = velocity + spin.cross(&(state.position - from.position));
        let pose = state.pose();
        let [Wrench { force, torque }, _] = joint.wrenches(self.states, axis, 1.0)?;
        Some(force.dot(&at_centre) + torque.dot(&(pose.rotation.transpose() * spin)))
    }
}

/// What `basis` leaves of a row, and how long it is. Twice, so that rounding of the first time is gone.
fn rest_of(row: &mut LockedRow, basis: &[LockedRow]) -> f64 {
    for _ in 0..2 {
        for other in basis {
            let part = row.along.dot(&other.along);
            row.minus(part, other);
        }
    }
    row.along.norm()
}

/// Whose rows a combination has.
fn involved(of: &[f64], locks: &[Lock]) -> Vec<Lock> {
    let parts = of.iter().zip(locks).filter(|(part, _)| part.abs() > DEPENDENT);
    let mut found: Vec<_> = parts.map(|(_, lock)| *lock).collect();
    found.dedup();
    found
}

fn as_state(frame: &JointFrame) -> State {
    let (velocity, spin) = (Vector3::zeros(), Vector3::zeros());
    State { position: frame.anchor, attitude: frame.attitude, velocity, spin }
}

fn axes() -> impl Iterator<Item = JointAxis> {
    (0..3).map(JointAxis::Linear).chain((0..3).map(JointAxis::Angular))
}

fn axis_of(joint: &Joint, axis: JointAxis) -> &Axis {
    match axis {
        JointAxis::Linear(k) => &joint.linear()[k],
        JointAxis::Angular(k) => &joint.angular()[k],
    }
}

fn is_locked(joint: &Joint, axis: JointAxis) -> bool {
    matches!(axis_of(joint, axis), Axis::Locked)
}

/// Whether the two limits of a free axis are one.
fn limits_lock(joint: &Joint, axis: JointAxis) -> bool {
    match axis_of(joint, axis) {
        Axis::Free(drive) => drive.limits.is_some_and(|[least, most]| least == most),
        Axis::Locked => false,
    }
}

fn locks_itself(joint: &Joint) -> bool {
    axes().any(|axis| limits_lock(joint, axis))
}

fn ends(joint: &Joint) -> impl Iterator<Item = usize> {
    [Some(joint.body()), joint.other()].into_iter().flatten()
}

fn find(root: &mut [usize], mut at: usize) -> usize {
    while root[at] != at {
        root[at] = root[root[at]];
        at = root[at];
    }
    at
}

fn join(root: &mut [usize], a: usize, b: usize) {
    let (a, b) = (find(root, a), find(root, b));
    root[a.max(b)] = a.min(b);
}
