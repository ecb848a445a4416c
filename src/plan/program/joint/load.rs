//! What the forces and torques of a joint put on its bodies, and the derivatives of it.

use super::super::contact::{Turned, put_symmetric_block};
use super::{Tie, Tied};
use crate::step_nlp::entries::EntrySink;
use crate::step_nlp::layout::{ATTITUDE, SPIN_ROWS};
use crate::step_nlp::several::component::weighted;
use nalgebra::{Matrix3x4, Vector3};

impl Tie {
    /// The torque on A, in its frame, of torques about its axes.
    fn torque(&self, sizes: &[f64; 3]) -> Vector3<f64> {
        let pairs = self.axes[0].iter().zip(sizes);
        pairs.map(|(axis, size)| axis.vector * (self.length * *size)).sum()
    }

    /// Adds forces and torques to the rows of both motions: τ = ℓ Σ T α on A, −A_Bᵀ A_A τ on B.
    pub(super) fn add_loads(&self, tied: &Tied<'_>, rows: &mut [f64]) {
        if tied.acts(0) {
            self.arm.add_rows(&tied.pull(), rows);
        }
        if !tied.acts(1) {
            return;
        }
        let (none, torque) = (Vector3::zeros(), self.torque(&tied.sizes[1]));
        tied.a.motion.add_load(&none, &torque, &mut rows[tied.a.row..]);
        if let Some(b) = tied.b {
            let turned = Turned::new(torque).at(&tied.a.start.attitude).0;
            let torque = -b.start.pose().rotation.tr_mul(&turned);
            b.motion.add_load(&none, &torque, &mut rows[b.row..]);
        }
    }

    /// The slopes of these rows.
    pub(super) fn emit_load_slopes(&self, tied: &Tied<'_>, sink: &mut impl EntrySink) {
        if tied.acts(0) {
            self.arm.emit_slopes(&tied.pull(), sink);
        }
        if !tied.acts(1) {
            return;
        }
        let (a, b) = (&tied.a, tied.b);
        // The axes of B's motion in the world, each with its slope by q_B.
        let seen = b.map(|b| {
            let axis = |j: usize| Turned::new(Vector3::ith(j, 1.0)).at(&b.start.attitude);
            (b, [0, 1, 2].map(axis))
        });
        for &(axis, column, share) in &tied.acts[1] {
            let torque = self.axes[0][axis].vector * (self.length * share);
            let twist = a.motion.spin_per_torque * torque;
            for k in 0..3 {
                sink.put(a.row + SPIN_ROWS.start + k, column, twist[k]);
            }
            let Some((b, axes)) = &seen else { continue };
            let turned = Turned::new(torque).at(&a.start.attitude).0;
            let torque = Vector3::from_fn(|j, _| -axes[j].0.dot(&turned));
            let twist = b.motion.spin_per_torque * torque;
            for k in 0..3 {
                sink.put(b.row + SPIN_ROWS.start + k, column, twist[k]);
            }
        }
        let Some((b, axes)) = &seen else { return };
        let whole = Turned::new(self.torque(&tied.sizes[1])).at(&a.start.attitude);
        let (mut by_a, mut by_b) = (Matrix3x4::zeros(), Matrix3x4::zeros());
        for (j, (axis, slope)) in axes.iter().enumerate() {
            by_a.set_row(j, &-whole.1.tr_mul(axis).transpose());
            by_b.set_row(j, &-slope.tr_mul(&whole.0).transpose());
        }
        let (at, twist) = (b.row + SPIN_ROWS.start, &b.motion.spin_per_torque);
        sink.put_block((at, a.columns.0 + ATTITUDE.start), &(twist * by_a));
        sink.put_block((at, b.columns.0 + ATTITUDE.start), &(twist * by_b));
    }

    /// The curvatures of these rows: that of the torques is one of −(A_B Y_τB)·(A_A τ).
    pub(super) fn emit_load_curvatures(
        &self,
        tied: &Tied<'_>,
        y: &[f64],
        sink: &mut impl EntrySink,
    ) {
        if tied.acts(0) {
            self.arm.emit_curvatures(&tied.pull(), y, sink);
        }
        let Some(b) = tied.b.filter(|_| tied.acts(1)) else { return };
        let a = &tied.a;
        let (of_a, of_b) = (a.columns.0 + ATTITUDE.start, b.columns.0 + ATTITUDE.start);
        let weights = Turned::new(-b.motion.load_weights(&y[b.row..]).1);
        let (seen, seen_slope) = weights.at(&b.start.attitude);
        let whole = Turned::new(self.torque(&tied.sizes[1]));
        let (turned, turned_slope) = whole.at(&a.start.attitude);
        sink.put_lower(of_a, &weighted(&whole.forms, &seen));
        sink.put_lower(of_b, &weighted(&weights.forms, &turned));
        put_symmetric_block((of_a, of_b), &turned_slope.tr_mul(&seen_slope), sink);
        for &(axis, column, share) in &tied.acts[1] {
            let alone = self.axes[0][axis].at(&a.start.attitude);
            let size = self.length * share;
            let by_a = alone.1.tr_mul(&seen) * size;
            let by_b = seen_slope.tr_mul(&alone.0) * size;
            for k in 0..4 {
                sink.put_symmetric(column, of_a + k, by_a[k]);
                sink.put_symmetric(column, of_b + k, by_b[k]);
            }
        }
    }
}
