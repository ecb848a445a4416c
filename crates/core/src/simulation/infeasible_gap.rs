//! Certificates of steps without a solution: bodies that contacts and joints leave too little room.
//!
//! To first order, displacements x of the bodies satisfy
//!
//! ```text
//! G x ≥ −φ,   J x = −e                                                      (J22)
//! ```
//!
//! with the gaps φ of contacts and stops, and the errors e of locked axes and gears, at the start of the
//! step. Frames with prescribed motions are at its end. The displacement with the least sum of squared
//! violations has the violations p and λ, with
//!
//! ```text
//! p ≥ 0,   Gᵀp + Jᵀλ = 0,   b = −φ·p − e·λ = |p|² + |λ|²                    (J23)
//! ```
//!
//! With b > 0 no displacement satisfies (J22): the sum of its rows, weighted by p and λ, is 0 ≥ b. Every
//! motion has then a violation of at least b/(Σ p + Σ |λ|), and with the largest weight of a pair as
//! unit, b is the room that is missing.

use crate::contact::{Contact, Partner};
use crate::joint::{Axis, Drive, Joint, JointAxis, JointForce};
use crate::mechanics::{State, Wrench};
use crate::world::World;
use nalgebra::{DMatrix, DVector, Vector3, Vector6};

/// Objects that have too little room in a step.
#[derive(Debug, Clone, PartialEq)]
#[cfg_attr(feature = "save", derive(serde::Serialize, serde::Deserialize))]
pub struct InfeasibleGap {
    /// The objects, bodies first.
    pub between: Vec<Partner>,
    /// Missing room at the end of the step (m).
    pub lacking: f64,
}

/// Largest number of bodies that are examined together. Some of the rows (J22) prove as much as all.
const MOST_BODIES: usize = 32;
/// Weight of |x|² in the sum of squares, without which x would not be unique.
const REGULARISATION: f64 = 1e-12;
/// Largest number of Newton steps for the least squares.
const MOST_STEPS: u32 = 40;
/// Smallest significant violation, relative to the largest.
const SIGNIFICANT: f64 = 1e-3;

/// Row of (J22), in m.
struct Row {
    /// Bodies with the derivatives by their displacements. Rotations are multiplied by the world's reach.
    parts: Vec<(usize, Vector6<f64>)>,
    /// −φ or −e.
    least: f64,
    /// True for a row of J.
    is_locked: bool,
    /// Objects that the row connects.
    objects: [Partner; 2],
}

impl Row {
    /// Violation at the displacements `x`, whose bodies have the given `places`.
    fn violation(&self, places: &[Option<usize>], x: &DVector<f64>) -> f64 {
        let along = self.parts.iter().filter_map(|(body, part)| {
            places[*body].map(|place| part.dot(&x.fixed_rows::<6>(6 * place)))
        });
        let off = self.least - along.sum::<f64>();
        if self.is_locked { off } else { off.max(0.0) }
    }

    /// Violation of the motionless bodies.
    fn initial(&self) -> f64 {
        if self.is_locked { self.least.abs() } else { self.least }
    }

    /// Adds the `part` on the row of `other`.
    fn plus(mut self, part: f64, other: Self) -> Self {
        for (body, row) in other.parts {
            match self.parts.iter_mut().find(|(own, _)| *own == body) {
                Some((_, own)) => *own += row * part,
                None => self.parts.push((body, row * part)),
            }
        }
        self
    }
}

/// Finds the certificate (J23) of a step of `world` from `states` with `contacts`, in which every motion has a
/// violation of more than `least` (m). The joint forces `near` have the angles at the start.
pub(super) fn find(
    world: &World,
    states: &[State],
    contacts: &[Contact],
    near: &[JointForce],
    least: f64,
) -> Option<InfeasibleGap> {
    let mut rows: Vec<_> =
        contacts.iter().map(|contact| contact_row(world, states, contact)).collect();
    for (joint, near) in world.joints().iter().zip(near) {
        add_joint(world, states, joint, near, &mut rows);
    }
    add_gears(world, states, near, &mut rows);
    let places = select(world, states.len(), &mut rows, least);
    if rows.is_empty() {
        return None;
    }
    let (x, violations) = least_squares(&rows, &places);
    let most = violations.iter().fold(0.0, |most: f64, p| most.max(p.abs()));
    let weights: f64 = violations.iter().map(|p| p.abs()).sum();
    let b: f64 = rows.iter().zip(&violations).map(|(row, p)| row.least * p).sum();
    // The regularisation leaves Gᵀp + Jᵀλ = δ x, which motions within the reach could use.
    let unbalanced = REGULARISATION * x.lp_norm(1) * world.reach();
    let is_proven = b - unbalanced > least * weights;
    if !is_proven {
        return None;
    }
    let mut between = Vec::new();
    // Weights of the contacts of each pair of objects.
    let mut pairs: Vec<([Partner; 2], f64)> = Vec::new();
    for (row, p) in rows.iter().zip(&violations).filter(|(_, p)| p.abs() > SIGNIFICANT * most) {
        for object in row.objects {
            if !between.contains(&object) {
                between.push(object);
            }
        }
        match pairs.iter_mut().find(|(pair, _)| *pair == row.objects) {
            _ if row.is_locked => {}
            Some((_, weight)) => *weight += p,
            None => pairs.push((row.objects, *p)),
        }
    }
    let unit = pairs.iter().map(|(_, weight)| *weight).reduce(f64::max).unwrap_or(most);
    between.sort_by_key(|object| (object.body().is_none(), object.body()));
    Some(InfeasibleGap { between, lacking: b / unit })
}

/// Derivative of a coordinate on which a unit force has this `wrench`.
fn derivative(world: &World, Wrench { force, torque }: &Wrench) -> Vector6<f64> {
    let spin = torque / world.reach();
    Vector6::new(force[0], force[1], force[2], spin[0], spin[1], spin[2])
}

fn contact_row(world: &World, states: &[State], contact: &Contact) -> Row {
    let (key, normal) = (contact.key, contact.normal());
    let on_a = Wrench { force: normal, torque: contact.torque_map * normal };
    let mut parts = vec![(key.body, derivative(world, &on_a))];
    if let Some(other) = key.partner.body() {
        let pose = states[other].pose();
        let arm = states[key.body].position + contact.arm - pose.position;
        let torque = pose.rotation.tr_mul(&normal.cross(&arm));
        parts.push((other, derivative(world, &Wrench { force: -normal, torque })));
    }
    let objects = [Partner::Body(key.body), key.partner];
    Row { parts, least: -contact.gap, is_locked: false, objects }
}

/// Row of a coordinate of `joint`, without its error.
fn axis_row(world: &World, states: &[State], joint: &Joint, axis: JointAxis) -> Option<Row> {
    let wrenches = joint.wrenches(states, axis, 1.0)?;
    let bodies = [Some(joint.body()), joint.other()];
    let parts = bodies.iter().zip(&wrenches);
    let parts = parts.filter_map(|(body, wrench)| Some(((*body)?, derivative(world, wrench))));
    let objects = bodies.map(|body| body.map_or(Partner::Body(joint.body()), Partner::Body));
    Some(Row { parts: parts.collect(), least: 0.0, is_locked: true, objects })
}

/// Adds the rows of a law whose coordinate is off by `off` if it is locked, and otherwise at `coordinate`, in
/// units of `length` (m).
fn add_law(row: Row, law: &Axis, coordinate: f64, length: f64, rows: &mut Vec<Row>) {
    let mut add = |size: f64, least: f64, is_locked: bool| {
        let parts = row.parts.iter().map(|(body, part)| (*body, part * size)).collect();
        rows.push(Row { parts, least, is_locked, objects: row.objects });
    };
    match law {
        Axis::Locked => add(length, -length * coordinate, true),
        Axis::Free(Drive { limits: Some([low, high]), .. }) => {
            for (size, stop) in [(length, low), (-length, high)] {
                if stop.is_finite() {
                    add(size, size * (stop - coordinate), false);
                }
            }
        }
        Axis::Free(_) => {}
    }
}

fn add_joint(
    world: &World,
    states: &[State],
    joint: &Joint,
    near: &JointForce,
    rows: &mut Vec<Row>,
) {
    let Some(at) = joint.coordinates(states) else { return };
    let angles = joint.counted(&at, &near.angles);
    let length = joint.length(world.bodies());
    for k in 0..3 {
        let axes = [
            (JointAxis::Linear(k), &joint.linear()[k], at.place[k], 1.0),
            (JointAxis::Angular(k), &joint.acting_axes()[k], angles[k], length),
        ];
        for (axis, law, coordinate, length) in axes {
            if let Some(row) = axis_row(world, states, joint, axis) {
                add_law(row, law, coordinate, length, rows);
            }
        }
    }
}

fn add_gears(world: &World, states: &[State], near: &[JointForce], rows: &mut Vec<Row>) {
    let joints = world.joints();
    if world.gears().is_empty() {
        return;
    }
    let angles: Vec<Vector3<f64>> = near.iter().map(|force| force.angles).collect();
    for gear in world.gears() {
        let [first, second] =
            gear.axes().map(|of| axis_row(world, states, &joints[of.joint], of.axis));
        let (Some(first), Some(second)) = (first, second) else { continue };
        let row = first.plus(-gear.ratio(), second);
        let coordinate = gear.coordinate(joints, states, &angles);
        add_law(row, gear.law(), coordinate, gear.length(joints, world.bodies()), rows);
    }
}

/// Keeps the rows of the bodies near rows with an initial violation of more than `least` (m). Returns the
/// place of each of these bodies in x; held bodies have none.
fn select(world: &World, bodies: usize, rows: &mut Vec<Row>, least: f64) -> Vec<Option<usize>> {
    let mut is_near = vec![false; bodies];
    let mut count = 0;
    let mut violated: Vec<_> = rows.iter().filter(|row| row.initial() > least).collect();
    violated.sort_by(|a, b| b.initial().total_cmp(&a.initial()));
    let mut mark = |row: &Row, is_near: &mut Vec<bool>| {
        for (body, _) in &row.parts {
            if !is_near[*body] && count < MOST_BODIES {
                is_near[*body] = true;
                count += 1;
            }
        }
        count
    };
    violated.into_iter().for_each(|row| _ = mark(row, &mut is_near));
    loop {
        let before = is_near.clone();
        let connects =
            |row: &&Row| row.parts.iter().any(|(body, _)| before[*body] && !world.is_held(*body));
        rows.iter().filter(connects).for_each(|row| _ = mark(row, &mut is_near));
        if is_near == before {
            break;
        }
    }
    rows.retain(|row| row.parts.iter().all(|(body, _)| is_near[*body]));
    let mut places = vec![None; bodies];
    let moving = (0..bodies).filter(|body| is_near[*body] && !world.is_held(*body));
    moving.enumerate().for_each(|(place, body)| places[body] = Some(place));
    places
}

/// Displacement x with the least sum of squared violations, and the violations.
///
/// The sum is convex and piecewise quadratic. Newton's method with a line search finds its minimum.
fn least_squares(rows: &[Row], places: &[Option<usize>]) -> (DVector<f64>, Vec<f64>) {
    let size = 6 * places.iter().flatten().count();
    let at = |x: &DVector<f64>| -> (Vec<f64>, f64) {
        let violations: Vec<_> = rows.iter().map(|row| row.violation(places, x)).collect();
        let sum = violations.iter().map(|p| p * p).sum::<f64>() + REGULARISATION * x.norm_squared();
        (violations, sum)
    };
    let mut x = DVector::zeros(size);
    let (mut violations, mut sum) = at(&x);
    for _ in 0..MOST_STEPS {
        let mut matrix = DMatrix::from_diagonal_element(size, size, REGULARISATION);
        let mut slope = -REGULARISATION * &x;
        for (row, &p) in rows.iter().zip(&violations).filter(|(row, p)| row.is_locked || **p > 0.0)
        {
            let placed =
                || row.parts.iter().filter_map(|(body, part)| Some((6 * places[*body]?, part)));
            for (place, part) in placed() {
                let mut own = slope.fixed_rows_mut::<6>(place);
                own += part * p;
                for (other, beside) in placed() {
                    let mut block = matrix.fixed_view_mut::<6, 6>(place, other);
                    block += part * beside.transpose();
                }
            }
        }
        let Some(factors) = matrix.cholesky() else { break };
        let step = factors.solve(&slope);
        let mut length = 1.0;
        let better = loop {
            let trial = &x + &step * length;
            let (found, next) = at(&trial);
            if next < sum {
                break Some((trial, found, next));
            }
            length *= 0.5;
            if length < REGULARISATION {
                break None;
            }
        };
        let Some((trial, found, next)) = better else { break };
        let is_done = sum - next <= f64::EPSILON * sum;
        (x, violations, sum) = (trial, found, next);
        if is_done {
            break;
        }
    }
    (x, violations)
}
