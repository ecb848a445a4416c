//! The equations of motion (eq. 8) of one body over one step as functions of both its ends.
//!
//! ```text
//! (r + h v⁺ − r⁺)/h,   u(p) − q⁺,   v + h (g + F/m) − v⁺,   ω + h I⁻¹ (τ − G(ω, ω⁺)) − ω⁺
//! p = q + ½ h q ⊗ H ω⁺ = (E + ½ h R(H ω⁺)) q                                        (eq. P11)
//! ```
//!
//! What acts on the body, F and τ, others add.

use crate::mechanics::quaternion::{attitude_map, right};
use crate::mechanics::{RigidBody, Rotation, State};
use crate::step_nlp::entries::EntrySink;
use crate::step_nlp::gyroscopic::Gyroscopic;
use crate::step_nlp::kernels::Normalised;
use crate::step_nlp::layout::{
    ATTITUDE, ATTITUDE_ROWS, POSITION, POSITION_ROWS, SPIN, SPIN_ROWS, VELOCITY, VELOCITY_ROWS,
};
use crate::world::World;
use nalgebra::{Matrix3, Matrix4, Matrix4x3, Vector3, Vector4};

/// The constants of a body in the rows of its motion.
#[derive(Debug, Clone)]
pub(super) struct Motion {
    time_step: f64,
    /// h g.
    falling: Vector3<f64>,
    /// h/m: v⁺ by a force.
    pub(super) velocity_per_force: f64,
    /// h I⁻¹: ω⁺ by a torque.
    pub(super) spin_per_torque: Matrix3<f64>,
    gyroscopic: Gyroscopic,
    /// What ω adds to G: that of ω⁺ with the time step turned round (eq. 33b); nothing in the tutorial's form.
    earlier: Option<Gyroscopic>,
}

/// A body at both ends of a step.
pub(super) type Ends<'a> = (&'a State, &'a State);

/// The first columns of a body's states at both ends of a step.
pub(super) type Columns = (usize, usize);

impl Motion {
    pub(super) fn new(world: &World, body: &RigidBody) -> Self {
        let (h, rotation) = (world.time_step(), world.rotation());
        let earlier = || Gyroscopic::new(body, rotation, -h);
        Self {
            time_step: h,
            falling: world.gravity() * h,
            velocity_per_force: h / body.mass(),
            spin_per_torque: body.inertia_inverse() * h,
            gyroscopic: Gyroscopic::new(body, rotation, h),
            earlier: (rotation == Rotation::Momentum).then(earlier),
        }
    }

    /// p of the attitude's row, and its slopes by q and ω⁺.
    fn turned(&self, (old, new): Ends<'_>) -> (Normalised, Matrix4<f64>, Matrix4x3<f64>) {
        let half = 0.5 * self.time_step;
        let spin = Vector4::new(0.0, new.spin[0], new.spin[1], new.spin[2]);
        let by_attitude = Matrix4::identity() + right(&spin) * half;
        let by_spin = attitude_map(&old.attitude) * half;
        (Normalised::new(by_attitude * old.attitude), by_attitude, by_spin)
    }

    /// The thirteen rows without what acts on the body.
    pub(super) fn rows(&self, ends: Ends<'_>, rows: &mut [f64]) {
        let (old, new) = ends;
        let h = self.time_step;
        let position = (old.position - new.position) / h + new.velocity;
        let attitude = self.turned(ends).0.unit - new.attitude;
        let velocity = old.velocity + self.falling - new.velocity;
        let gyroscopic = self.gyroscopic.term(&old.spin, &new.spin);
        let spin = old.spin - self.spin_per_torque * gyroscopic - new.spin;
        rows[POSITION_ROWS].copy_from_slice(position.as_slice());
        rows[ATTITUDE_ROWS].copy_from_slice(attitude.as_slice());
        rows[VELOCITY_ROWS].copy_from_slice(velocity.as_slice());
        rows[SPIN_ROWS].copy_from_slice(spin.as_slice());
    }

    /// Their slopes, from row `row` on.
    pub(super) fn emit_slopes(
        &self,
        ends: Ends<'_>,
        row: usize,
        (start, end): Columns,
        sink: &mut impl EntrySink,
    ) {
        let h = self.time_step;
        for k in 0..3 {
            let at = row + POSITION_ROWS.start + k;
            sink.put(at, start + POSITION.start + k, 1.0 / h);
            sink.put(at, end + POSITION.start + k, -1.0 / h);
            sink.put(at, end + VELOCITY.start + k, 1.0);
            let at = row + VELOCITY_ROWS.start + k;
            sink.put(at, start + VELOCITY.start + k, 1.0);
            sink.put(at, end + VELOCITY.start + k, -1.0);
        }
        let (unit, by_attitude, by_spin) = self.turned(ends);
        let slope = unit.jacobian();
        let at = row + ATTITUDE_ROWS.start;
        sink.put_block((at, start + ATTITUDE.start), &(slope * by_attitude));
        sink.put_block((at, end + SPIN.start), &(slope * by_spin));
        for k in 0..4 {
            sink.put(at + k, end + ATTITUDE.start + k, -1.0);
        }
        let at = row + SPIN_ROWS.start;
        let by_new = self.gyroscopic.slope(&ends.1.spin) * -h - Matrix3::identity();
        let mut by_old = Matrix3::identity();
        if let Some(earlier) = &self.earlier {
            by_old -= earlier.slope(&ends.0.spin) * h;
        }
        for k in 0..3 {
            for j in 0..3 {
                if j == k || self.gyroscopic.depends(k, j) {
                    sink.put(at + k, end + SPIN.start + j, by_new[(k, j)]);
                }
                if j == k || self.earlier.is_some() {
                    sink.put(at + k, start + SPIN.start + j, by_old[(k, j)]);
                }
            }
        }
    }

    /// Their curvatures with the multipliers `y` of the rows.
    pub(super) fn emit_curvatures(
        &self,
        ends: Ends<'_>,
        y: &[f64],
        (start, end): Columns,
        sink: &mut impl EntrySink,
    ) {
        let h = self.time_step;
        let of_attitude = Vector4::from_column_slice(&y[ATTITUDE_ROWS]);
        let of_spin = Vector3::from_column_slice(&y[SPIN_ROWS]);
        let (unit, by_attitude, by_spin) = self.turned(ends);
        let bend = unit.hessian(of_attitude);
        let pull: Vector4<f64> = unit.jacobian() * of_attitude;
        sink.put_lower(start + ATTITUDE.start, &(by_attitude.transpose() * bend * by_attitude));
        // q × ω⁺, with ∂²p/∂q∂ω⁺_j = ½ h R(H e_j).
        let mut mixed = by_spin.transpose() * bend * by_attitude;
        for j in 0..3 {
            let axis = Vector4::ith(1 + j, 0.5 * h);
            let row = mixed.row(j) + right(&axis).tr_mul(&pull).transpose();
            mixed.set_row(j, &row);
        }
        sink.put_block((end + SPIN.start, start + ATTITUDE.start), &mixed);
        let curvature = self.gyroscopic.curvature(&of_spin, &ends.1.spin) * h;
        sink.put_lower(end + SPIN.start, &(by_spin.transpose() * bend * by_spin - curvature));
        if let Some(earlier) = &self.earlier {
            let curvature = earlier.curvature(&of_spin, &ends.0.spin) * -h;
            sink.put_lower(start + SPIN.start, &curvature);
        }
    }

    /// Adds a force and a torque to the rows.
    pub(super) fn add_load(&self, force: &Vector3<f64>, torque: &Vector3<f64>, rows: &mut [f64]) {
        let (push, twist) = (force * self.velocity_per_force, self.spin_per_torque * torque);
        for k in 0..3 {
            rows[VELOCITY_ROWS.start + k] += push[k];
            rows[SPIN_ROWS.start + k] += twist[k];
        }
    }

    /// What a force (world) and a torque (body) are multiplied by in Σ y·rows.
    pub(super) fn load_weights(&self, y: &[f64]) -> (Vector3<f64>, Vector3<f64>) {
        let of_velocity = Vector3::from_column_slice(&y[VELOCITY_ROWS]);
        let of_spin = Vector3::from_column_slice(&y[SPIN_ROWS]);
        (of_velocity * self.velocity_per_force, self.spin_per_torque.tr_mul(&of_spin))
    }
}
