//! What gears hold, linearised by the states at the start of the step, by their ratios and offsets, and by anchors.
//!
//! The row of a gear is a sum of rows of joints, and so are its slopes; at fixed V⁺ and impulse p̂ along it
//!
//! ```text
//! δu = −ℓ/h (q₂⁺ δr + δq₀),   along the row of the second coordinate δp̂₂ = −ℓ/ℓ₂ p̂ δr             (G15)
//! ```
//!
//! Equation numbers are those of `docs/gradients.md`.

use super::super::island::GearRow;
use super::constants::{add_anchors, anchors_of};
use super::slopes::RowsChange;
use crate::derivative::{RowsTangent, StateChange};
use crate::mechanics::State;
use crate::step::Step;
use crate::world::Constant;
use nalgebra::{Matrix3, RowSVector, Vector3};

/// The row of a gear, linearised: its motion, by the poses of the bodies of its two coordinates.
#[derive(Debug, Clone)]
pub(super) struct LinearGear {
    pub(super) coupling: usize,
    by_pose: [([Option<usize>; 2], RowSVector<f64, 12>); 2],
    by_time_step: f64,
    /// Its index in the world; of its motion by its ratio and its offset, and which coupling's impulse (m/s, world) by the ratio.
    gear: usize,
    by_ratio: f64,
    by_offset: f64,
    turned: (usize, Vector3<f64>),
    /// By the anchors of the joints that have them.
    by_anchors: [(usize, RowSVector<f64, 6>); 2],
}

/// Rows of a joint, of which gears may be made.
pub(super) struct TiedRows {
    pub(super) coupling: usize,
    pub(super) joint: usize,
    pub(super) bodies: [Option<usize>; 2],
    /// ℓ, m.
    pub(super) length: f64,
    /// Its angles at the step's start, rad.
    pub(super) angles: Vector3<f64>,
    /// The rows' axes.
    pub(super) frame: Matrix3<f64>,
    pub(super) of: RowsTangent,
}

impl LinearGear {
    /// The row u = ℓ (q₁⁺ − r q₂⁺ − q₀)/h of which the coordinates are rows of joints, under the `impulse` p̂ along it; `next` are
    /// the states at the end.
    pub(super) fn new(
        row: &GearRow,
        tangents: &[TiedRows],
        (step, next, impulse): (&Step<'_>, &[State], f64),
    ) -> Option<Self> {
        let h = step.world.time_step();
        let mut by_time_step = -row.offset / h;
        let mut of_part = |(coupling, k, factor): (usize, usize, f64)| {
            let tied = tangents.iter().find(|tied| tied.coupling == coupling)?;
            let (of, share) = (&tied.of, tied.length / h);
            by_time_step += factor * of.by_time_step[k];
            let slopes = (of.motion.row(k) + of.coordinates.row(k) * share) * factor;
            let by_anchors = of.anchors.as_ref().map_or_else(RowSVector::zeros, |of| {
                (of.motion.row(k) + of.coordinates.row(k) * share) * factor
            });
            Some(((tied.bodies, slopes), (tied.joint, by_anchors)))
        };
        let [a, b] = [of_part(row.parts[0])?, of_part(row.parts[1])?];
        let (by_pose, by_anchors) = ([a.0, b.0], [a.1, b.1]);
        let (coupling, k, _) = row.parts[1];
        let second = tangents.iter().find(|tied| tied.coupling == coupling)?;
        let axis = step.world.gears().get(row.gear)?.axes()[1];
        let end = axis.coordinate(step.world.joints(), next, &second.angles);
        let turned = second.frame.column(k) * (-row.length / second.length * impulse);
        Some(Self {
            coupling: row.coupling,
            by_pose,
            by_time_step,
            gear: row.gear,
            by_ratio: -row.length / h * end,
            by_offset: -row.length / h,
            turned: (coupling, turned),
            by_anchors,
        })
    }

    /// A change of its motion alone.
    fn along(motion: f64) -> RowsChange<1> {
        RowsChange { motion: Vector3::x() * motion, ..RowsChange::zero() }
    }

    /// By changes of states.
    pub(super) fn pushed(&self, states: &[StateChange]) -> RowsChange<1> {
        let mut along = 0.0;
        for (bodies, row) in &self.by_pose {
            for (side, body) in bodies.iter().enumerate() {
                let Some(state) = body.map(|body| &states[body]) else { continue };
                along += row.fixed_columns::<3>(6 * side).tr_dot(&state.position)
                    + row.fixed_columns::<3>(6 * side + 3).tr_dot(&state.turn);
            }
        }
        Self::along(along)
    }

    /// By the pose of a body of the world.
    pub(super) fn by_state(&self, body: usize) -> Option<RowsChange<6>> {
        let mut found = None;
        for (bodies, row) in &self.by_pose {
            for side in (0..2).filter(|side| bodies[*side] == Some(body)) {
                let columns = found.get_or_insert_with(RowsChange::<6>::zero);
                let mut part = columns.motion.row_mut(0);
                part += row.fixed_columns::<6>(6 * side);
            }
        }
        found
    }

    /// By changes of constants: of its own row, and of those of another coupling.
    pub(super) fn by_constants(
        &self,
        of: &impl Fn(Constant, usize) -> f64,
    ) -> [(usize, RowsChange<1>); 2] {
        let moved = self.by_anchors.iter().map(|(joint, row)| row.tr_dot(&anchors_of(*joint, of)));
        let ratio = of(Constant::GearRatio, self.gear);
        let own = self.by_time_step * of(Constant::TimeStep, 0)
            + self.by_ratio * ratio
            + self.by_offset * of(Constant::GearOffset, self.gear)
            + moved.sum::<f64>();
        let (coupling, turned) = self.turned;
        let other = RowsChange { impulse: turned * ratio, ..RowsChange::zero() };
        [(self.coupling, Self::along(own)), (coupling, other)]
    }

    /// The transpose.
    pub(super) fn pull(&self, by: &RowsChange<1>, states: &mut [StateChange]) {
        let along = by.motion[0];
        for (bodies, row) in &self.by_pose {
            for (side, body) in bodies.iter().enumerate() {
                let Some(state) = body.map(|body| &mut states[body]) else { continue };
                state.position += row.fixed_columns::<3>(6 * side).transpose() * along;
                state.turn += row.fixed_columns::<3>(6 * side + 3).transpose() * along;
            }
        }
    }

    /// The transpose; `pulled` has the derivatives by the rows of a coupling.
    pub(super) fn pull_constants(
        &self,
        pulled: impl Fn(usize) -> RowsChange<1>,
        constants: &[Constant],
        sums: &mut [Vec<f64>],
    ) {
        let along = pulled(self.coupling).motion[0];
        for (&constant, sums) in constants.iter().zip(sums) {
            match constant {
                Constant::TimeStep => sums[0] += along * self.by_time_step,
                Constant::GearOffset => sums[self.gear] += along * self.by_offset,
                Constant::GearRatio => {
                    let (coupling, turned) = &self.turned;
                    let turned = pulled(*coupling).impulse.dot(turned);
                    sums[self.gear] += along * self.by_ratio + turned;
                }
                Constant::Anchor => {
                    for (joint, row) in &self.by_anchors {
                        add_anchors(*joint, &(row.transpose() * along), sums);
                    }
                }
                _ => {}
            }
        }
    }
}
