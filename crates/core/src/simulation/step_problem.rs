//! Contact problem of a recorded step.

use super::Interval;
use crate::contact::{Contact, Partner};
use crate::mechanics::State;
use crate::problem::{ContactProblem, Law, ProblemError, SparseMatrix};
use crate::world::World;
use nalgebra::{Matrix3, Vector3};

impl ContactProblem {
    /// Returns the contact problem of an interval in `world` in global form, and its impulses p⁺
    /// (N s).
    ///
    /// Velocities are those of every body: linear (m/s, world frame) and spin (rad/s, body frame).
    /// Rows are the normal and the tangents of every contact in the record, then those of the moments
    /// that contacts have, u = ℓ Ω along tangents and normal with ℓ of (44). With the impulses p⁺,
    /// the velocities v⁺ and the contact motion u⁺ of the step,
    ///
    /// ```text
    /// M = diag(m E, I),   H = (E; G) F,   f = M v⁺ − H p⁺,   w = u⁺ − Hᵀ v⁺               (C6)
    /// ```
    ///
    /// Impulses are those of the pressing forces (48), and f has the adhesion.
    ///
    /// M and H are those at the start of the step. The effect of the rotation during the step is
    /// included in f and w with its final value. The solution of the step therefore solves the
    /// problem, up to the residual of the step.
    ///
    /// # Errors
    /// If `world` has joints or gears, if the interval is not from it, or if a number is not
    /// finite.
    pub fn from_interval(
        world: &World,
        taken: &Interval,
    ) -> Result<(Self, Vec<f64>), ProblemError> {
        if !world.joints().is_empty() {
            let why = "contact problems do not support joints";
            return Err(ProblemError::Step { why });
        }
        let bodies = world.bodies().len();
        let Interval { states, contacts, solution, .. } = taken;
        let next = &solution.states;
        let sizes = [states.len(), next.len(), solution.contacts.len()];
        let is_of = |contact: &Contact| contact.key.bodies().all(|body| body < bodies);
        if sizes != [bodies, bodies, contacts.len()] || !contacts.iter().all(is_of) {
            return Err(ProblemError::Step { why: "its record belongs to another world" });
        }
        let mut entries = Vec::new();
        for (index, body) in world.bodies().iter().enumerate() {
            for k in 0..3 {
                entries.push((6 * index + k, 6 * index + k, body.mass()));
                let inertia = |j: usize| body.inertia()[(k, j)];
                entries.extend((0..3).map(|j| (6 * index + 3 + k, 6 * index + 3 + j, inertia(j))));
            }
        }
        let mass = SparseMatrix::from_triplets(6 * bodies, 6 * bodies, entries)?;
        let (mut entries, mut laws) = (Vec::new(), Vec::new());
        let (mut impulses, mut motion) = (Vec::new(), Vec::new());
        let map = world.step_map();
        let h = map.time_step;
        for (index, contact) in contacts.iter().enumerate() {
            let tensor = contact.friction_tensor(world, states);
            let force = contact.pressing_force(world, &solution.contacts[index].force);
            let mut frame = normal_first(&contact.frame);
            let mut impulse = frame.tr_mul(&force) * h;
            if let Some(tensor) = tensor {
                // Rows of the scaled motion, with the round cone (eq. 46).
                frame = normal_first(&tensor.frame(&contact.frame));
                impulse = frame.tr_mul(&force) * h;
                impulse[1] /= tensor.stretch();
                frame.column_mut(1).scale_mut(tensor.stretch());
            }
            impulses.extend(impulse.iter());
            let poses = |body: usize| (states[body].pose(), next[body].pose());
            let a = poses(contact.key.body);
            let b = contact.key.partner.body().map(poses);
            let u = contact.motion([&a.0, &a.1], b.as_ref().map(|b| [&b.0, &b.1]), &map);
            let u = contact.law_motion(u, world, states, next);
            motion.extend(frame.tr_mul(&u).iter());
            laws.push(Law::contact(3, contact.law.friction)?);
            for (body, linear, angular) in sides(contact, states, &frame) {
                for (k, column) in (3 * index..3 * index + 3).enumerate() {
                    for j in 0..3 {
                        entries.push((6 * body + j, column, linear[(j, k)]));
                        entries.push((6 * body + 3 + j, column, angular[(j, k)]));
                    }
                }
            }
        }
        for (index, contact) in contacts.iter().enumerate() {
            let friction = contact.turning_friction(world);
            if !friction.acts() {
                continue;
            }
            let rotation = |body: usize| states[body].pose().rotation;
            let length = contact.moment_scale(world, rotation).length;
            let first = impulses.len();
            let moment = solution.moment(index);
            impulses.extend((contact.frame.tr_mul(&moment) * (h / length)).iter());
            let poses = |body: usize| (states[body].pose(), next[body].pose());
            let a = poses(contact.key.body);
            let b = contact.key.partner.body().map(poses);
            let b = b.as_ref().map(|b| [&b.0, &b.1]);
            let turned = contact.relative_turning([&a.0, &a.1], b, &map);
            let turned = (turned + contact.turning_offset) * length;
            motion.extend(contact.frame.tr_mul(&turned).iter());
            laws.push(Law::moment(index, friction.rolling / length, friction.torsional / length)?);
            for (body, sign) in contact.key.bodies().zip([length, -length]) {
                let turn = rotation(body).tr_mul(&contact.frame) * sign;
                let places = (0..9).map(|k| (k % 3, k / 3));
                entries.extend(places.map(|(j, k)| (6 * body + 3 + j, first + k, turn[(j, k)])));
            }
        }
        let directions = SparseMatrix::from_triplets(6 * bodies, impulses.len(), entries)?;
        let velocities: Vec<f64> =
            next.iter().flat_map(|state| [state.velocity, state.spin]).flat_map(numbers).collect();
        let mut momentum = vec![0.0; velocities.len()];
        mass.add_product(&velocities, &mut momentum);
        let minus: Vec<f64> = impulses.iter().map(|impulse| -impulse).collect();
        directions.add_product(&minus, &mut momentum);
        let minus: Vec<f64> = velocities.iter().map(|velocity| -velocity).collect();
        directions.add_transposed_product(&minus, &mut motion);
        let problem = Self::global(mass, directions, momentum, motion, laws)?;
        Ok((problem, impulses))
    }
}

fn numbers(vector: Vector3<f64>) -> [f64; 3] {
    [vector[0], vector[1], vector[2]]
}

/// Wrenches of unit impulses along the contact axes on both bodies: body, force (world frame) and
/// torque (body frame).
fn sides(
    contact: &Contact,
    states: &[State],
    frame: &Matrix3<f64>,
) -> impl Iterator<Item = (usize, Matrix3<f64>, Matrix3<f64>)> {
    let body = contact.key.body;
    let other = match contact.key.partner {
        Partner::Ground | Partner::Fixed(_) => None,
        Partner::Body(other) => {
            let (a, b) = (states[body].pose(), states[other].pose());
            let arm = a.position + contact.arm - b.position;
            let torques = b.rotation.tr_mul(&(arm.cross_matrix() * frame));
            Some((other, -frame, -torques))
        }
    };
    std::iter::once((body, *frame, contact.torque_map * frame)).chain(other)
}

/// The frame (t₁, t₂, n) as (n, t₁, t₂), normal first.
fn normal_first(frame: &Matrix3<f64>) -> Matrix3<f64> {
    let axis = |k: usize| frame.column(k).into_owned();
    Matrix3::from_columns(&[axis(2), axis(0), axis(1)])
}
