//! What controls put on bodies in the program.

use super::super::motion::Motion;
use super::PlanNlp;
use crate::mechanics::State;
use crate::mechanics::quaternion::rotated_point_forms;
use crate::plan::{Applied, Axes, ControlKind};
use crate::step_nlp::entries::EntrySink;
use crate::step_nlp::layout::{SPIN_ROWS, VELOCITY_ROWS};
use crate::step_nlp::several::component::{rows, weighted};
use nalgebra::{Matrix3x4, Vector3};

/// What a control puts on a body in a step.
pub(super) struct Pushed<'p> {
    pub(super) kind: &'p ControlKind,
    pub(super) body: usize,
    pub(super) applied: Applied,
    pub(super) numbers: Vec<f64>,
    pub(super) columns: Vec<Option<usize>>,
    pub(super) scales: Vec<f64>,
}

impl Pushed<'_> {
    /// Whether the wrench depends on the body's attitude: a torque of the world and a force of the body.
    fn turns(&self) -> bool {
        !matches!(self.kind, ControlKind::Force { .. })
    }

    /// The components that are looked for.
    fn free(&self) -> impl Iterator<Item = (usize, usize, f64)> {
        let columns = self.columns.iter().zip(&self.scales).enumerate();
        columns.filter_map(|(i, (column, scale))| column.map(|column| (i, column, *scale)))
    }

    /// The rows of the motion by the attitude and by the control (eq. P23).
    pub(super) fn emit_slopes(
        &self,
        (motion, state): (&Motion, &State),
        (row, attitude): (usize, usize),
        program: &PlanNlp<'_>,
        sink: &mut impl EntrySink,
    ) {
        let velocity = row + VELOCITY_ROWS.start;
        let spin = row + SPIN_ROWS.start;
        for ((i, column, scale), slope) in self.free().filter_map(|free| {
            self.kind.slopes(&self.numbers).get(free.0).map(|slope| (free, *slope))
        }) {
            let wrench = program.in_units(&slope).wrench(state);
            let push = wrench.force * (motion.velocity_per_force * scale);
            let twist = motion.spin_per_torque * wrench.torque * scale;
            for k in 0..3 {
                if self.pushes(i) {
                    sink.put(velocity + k, column, push[k]);
                }
                if self.turns() {
                    sink.put(spin + k, column, twist[k]);
                }
            }
        }
        let q = &state.attitude;
        match self.applied.axes {
            Axes::World if self.turns() => {
                let mut slope = Matrix3x4::zeros();
                for j in 0..3 {
                    let axis = rows(&rotated_point_forms(&Vector3::ith(j, 1.0)), q);
                    slope.set_row(j, &axis.tr_mul(&self.applied.torque).transpose());
                }
                sink.put_block((spin, attitude), &(motion.spin_per_torque * slope));
            }
            Axes::World => {}
            Axes::Body => {
                let slope = rows(&rotated_point_forms(&self.applied.force), q);
                sink.put_block((velocity, attitude), &(slope * motion.velocity_per_force));
            }
        }
    }

    /// Whether component `i` changes the force.
    fn pushes(&self, i: usize) -> bool {
        match self.kind {
            ControlKind::Torque { .. } => false,
            ControlKind::Push(_) => i < 3,
            _ => true,
        }
    }

    /// The curvatures of that (eq. P23).
    pub(super) fn emit_curvatures(
        &self,
        (motion, state): (&Motion, &State),
        (y, attitude): (&[f64], usize),
        program: &PlanNlp<'_>,
        sink: &mut impl EntrySink,
    ) {
        if !self.turns() {
            return;
        }
        let (of_force, of_torque) = motion.load_weights(y);
        let q = &state.attitude;
        // What is turned, by what, for the whole and for each component's slope.
        let turned = |applied: &Applied| match applied.axes {
            Axes::World => (rotated_point_forms(&of_torque), applied.torque),
            Axes::Body => (rotated_point_forms(&applied.force), of_force),
        };
        let (forms, weights) = turned(&self.applied);
        sink.put_lower(attitude, &weighted(&forms, &weights));
        let slopes = self.kind.slopes(&self.numbers);
        for (i, column, scale) in self.free() {
            let (forms, weights) = turned(&program.in_units(&slopes[i]));
            let by_attitude = rows(&forms, q).tr_mul(&weights) * scale;
            for k in 0..4 {
                sink.put_symmetric(column, attitude + k, by_attitude[k]);
            }
        }
        if !matches!(self.kind, ControlKind::Push(_)) {
            return;
        }
        let curvatures = self.kind.curvatures(&self.numbers);
        for (i, column, scale) in self.free() {
            for (j, other, other_scale) in self.free().filter(|(j, ..)| *j <= i) {
                let bend = curvatures.iter().find(|(a, b, _)| (*a, *b) == (i, j));
                let bend = bend.map_or(0.0, |(.., bend)| {
                    let bend = program.in_units(bend).wrench(state);
                    of_force.dot(&bend.force) + of_torque.dot(&bend.torque)
                });
                sink.put_symmetric(column, other, bend * scale * other_scale);
            }
        }
    }
}
