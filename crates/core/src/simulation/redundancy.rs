//! Redundancy analysis of joints and gears: redundant and contradictory constraints, and free axes
//! that cannot move.
//!
//! At the states X, every locked joint axis and every gear is a row of
//!
//! ```text
//! G v = b                                                                   (J20)
//! ```
//!
//! with the velocities and spins v of the bodies. b holds the velocities of moving world frames.
//! The rows are orthonormalised one after another (Gram–Schmidt). A row with no remainder is
//! redundant if b agrees, and contradictory otherwise. A free axis is locked if its own row is in
//! the span.

use crate::joint::{Axis, GearAxis, Joint, JointAxis, JointFrame, Knots};
use crate::mechanics::trajectory::Trajectory;
use crate::mechanics::{State, Wrench};
use crate::world::World;
use nalgebra::{DVector, Vector3};
use std::collections::BTreeMap;

/// Smallest independent remainder of a row of length 1. Initial states satisfy joints to 1e-6.
const DEPENDENT: f64 = 1e-5;
/// Smallest significant difference of velocities (m/s).
const SAME_VELOCITY: f64 = 1e-4;
/// Largest number of rows in an analysed mechanism. The cost grows with the third power.
const MOST_ROWS: usize = 600;

/// Constraint with rows in (J20).
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub enum Constraint {
    /// Joint with this index.
    Joint(usize),
    /// Gear with this index.
    Gear(usize),
}

/// Problem with the constraints of one mechanism.
#[derive(Debug, Clone, PartialEq)]
#[non_exhaustive]
pub enum RedundancyFinding {
    /// Constraints that no velocities satisfy.
    Contradiction {
        /// Constraints involved.
        locks: Vec<Constraint>,
        /// Size of the contradiction (m/s), with rotations scaled by the reach of the world's
        /// bodies.
        off: f64,
    },
    /// A free or driven axis that cannot move.
    LockedAxis {
        /// The axis.
        axis: GearAxis,
        /// Constraints that lock it.
        locks: Vec<Constraint>,
    },
    /// Linearly dependent constraints. Their individual reactions are not unique.
    Redundant {
        /// Constraints involved.
        locks: Vec<Constraint>,
        /// Number of redundant rows.
        rows: usize,
    },
}

/// A row of (J20), or its remainder.
#[derive(Clone)]
struct LockedRow {
    /// Row of G.
    along: DVector<f64>,
    /// Entry of b.
    velocity: f64,
    /// Coefficients of the original rows in this one.
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
    /// Finds problems with the constraints of this world at `states`, one per body. `courses` are
    /// the prescribed motions of world frames of joints from `time` (s) on. Mechanisms with more
    /// than 600 locked rows are skipped.
    pub fn locked(
        &self,
        states: &[State],
        courses: &[(usize, Knots)],
        time: f64,
    ) -> Vec<RedundancyFinding> {
        let rows = LockedRows { world: self, states, courses, time };
        rows.mechanisms().iter().flat_map(|mechanism| rows.findings(mechanism)).collect()
    }
}

/// Input of the analysis, which builds the rows.
struct LockedRows<'a> {
    world: &'a World,
    states: &'a [State],
    courses: &'a [(usize, Knots)],
    time: f64,
}

/// Connected joints and gears that can interact.
#[derive(Default)]
struct Mechanism {
    joints: Vec<usize>,
    gears: Vec<usize>,
    /// Their bodies, sorted.
    bodies: Vec<usize>,
}

impl LockedRows<'_> {
    /// Mechanisms without open branches. A body on a single joint can always satisfy it.
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
            // Keeps a joint that is locked by its own limits.
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

    /// Groups the joints flagged in `stays` into connected mechanisms.
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
            let label = find(&mut root, joint.body());
            mechanisms.entry(label).or_default().joints.push(index);
        }
        for (index, gear) in gears.iter().enumerate() {
            let label = find(&mut root, joints[gear.axes()[0].joint].body());
            mechanisms.entry(label).or_default().gears.push(index);
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

    /// Problems of one mechanism.
    fn findings(&self, mechanism: &Mechanism) -> Vec<RedundancyFinding> {
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
                findings.push(RedundancyFinding::Contradiction { locks: involved, off });
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
                    findings.push(RedundancyFinding::LockedAxis { axis: of, locks });
                }
            }
        }
        if too_many > 0 {
            redundant.sort();
            redundant.dedup();
            findings.push(RedundancyFinding::Redundant { locks: redundant, rows: too_many });
        }
        findings
    }

    /// Rows of (J20), scaled to length 1, and their constraints. `None` if there are too many or a
    /// body has no state.
    fn rows(&self, mechanism: &Mechanism) -> Option<(Vec<Constraint>, Vec<LockedRow>)> {
        let (mut locks, mut found) = (Vec::new(), Vec::new());
        for &index in &mechanism.joints {
            let joint = &self.world.joints()[index];
            for axis in axes() {
                if is_locked(joint, axis) || limits_lock(joint, axis) {
                    let of = GearAxis { joint: index, axis };
                    let along = self.along(of, &mechanism.bodies)?;
                    let velocity = self.prescribed_speed(index, axis)?;
                    locks.push(Constraint::Joint(index));
                    found.push((along, velocity));
                }
            }
        }
        for &index in &mechanism.gears {
            let gear = &self.world.gears()[index];
            if gear.drive().is_none() {
                let [first, second] = *gear.axes();
                locks.push(Constraint::Gear(index));
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

    /// Gradient of an axis coordinate with respect to the velocities of `bodies`. Rotations are
    /// scaled by the reach of the world's bodies.
    fn along(&self, place: GearAxis, bodies: &[usize]) -> Option<DVector<f64>> {
        let joint = &self.world.joints()[place.joint];
        let wrenches = joint.wrenches(self.states, place.axis, 1.0)?;
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

    /// Velocity along a locked axis that a moving world frame prescribes to a body (m/s or rad/s).
    fn prescribed_speed(&self, index: usize, axis: JointAxis) -> Option<f64> {
        let joint = &self.world.joints()[index];
        let Some((_, knots)) = self.courses.iter().find(|(of, _)| *of == index) else {
            return Some(0.0);
        };
        let h = self.world.time_step();
        let [from, to] = [self.time, self.time + h].map(|time| as_state(&knots.at(time)));
        let path = Trajectory::between(&from, &to);
        let (velocity, spin) = (path.shift() / h, path.turn() / h);
        let state = self.states.get(joint.body())?;
        let at_centre = velocity + spin.cross(&(state.position - from.position));
        let pose = state.pose();
        let [Wrench { force, torque }, _] = joint.wrenches(self.states, axis, 1.0)?;
        Some(force.dot(&at_centre) + torque.dot(&(pose.rotation.transpose() * spin)))
    }
}

/// Subtracts the projection of a row onto `basis` and returns the length of the remainder. It runs
/// twice to remove rounding errors.
fn rest_of(row: &mut LockedRow, basis: &[LockedRow]) -> f64 {
    for _ in 0..2 {
        for other in basis {
            let part = row.along.dot(&other.along);
            row.minus(part, other);
        }
    }
    row.along.norm()
}

/// Constraints with significant coefficients.
fn involved(parts: &[f64], locks: &[Constraint]) -> Vec<Constraint> {
    let parts = parts.iter().zip(locks).filter(|(part, _)| part.abs() > DEPENDENT);
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

/// True if both limits of a free axis are equal.
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
