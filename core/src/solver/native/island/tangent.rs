//! The linearised equations of an island, for any right-hand side, and transposed: what a derivative of the
//! step is solved by.
//!
//! Equation numbers are those of `docs/gradients.md`.

use super::super::equations::{Elimination, Gain};
use super::super::pair_motion::PairSlope;
use super::{Island, IslandSystem};
use nalgebra::{Matrix3, Vector3, Vector6};

/// What a change of a coupling's rows and arms makes of its impulse at fixed V⁺, and of the torques of the
/// impulse that it has: of A and of B, each in its own frame.
#[derive(Debug, Clone, Copy)]
pub(in super::super) struct CouplingChange {
    pub(in super::super) impulse: Vector3<f64>,
    pub(in super::super) torques: [Vector3<f64>; 2],
}

/// D of an answer.
pub(in super::super) fn gain_of(elimination: &Elimination<PairSlope>) -> Matrix3<f64> {
    match &elimination.answer.gain {
        Gain::Zero => Matrix3::zeros(),
        Gain::Spring(stiffness) => Matrix3::from_diagonal_element(-stiffness),
        Gain::Full(gain) => *gain,
    }
}

impl Island {
    /// What a change of a coupling makes of the right-hand sides of the equations of motion, each over its
    /// body's mass: with H of (N12) and M/m,
    ///
    /// ```text
    /// rhs_A += H_A δp̂ + M/m (0, δτ_A),   rhs_B += H_B δp̂ − M/m (0, δτ_B)             (G5)
    /// ```
    pub(in super::super) fn add_change(
        &self,
        coupling: usize,
        change: &CouplingChange,
        rhs: &mut [Vector6<f64>],
    ) {
        let of = (&self.links[coupling], &self.setting.couplings[coupling]);
        for ((member, share, torque_map), torque) in self.sides(of).zip(&change.torques) {
            let mut part = Vector6::zeros();
            if of.0.pushes() {
                part.fixed_rows_mut::<3>(0).copy_from(&(change.impulse * share));
            }
            let turning = torque_map * change.impulse + torque;
            part.fixed_rows_mut::<3>(3).copy_from(&(turning * share));
            rhs[member] += part;
        }
    }

    /// The transpose: derivatives by the change of a coupling, of those by the right-hand sides.
    pub(in super::super) fn change_pulled(
        &self,
        coupling: usize,
        rhs: &[Vector6<f64>],
    ) -> CouplingChange {
        let of = (&self.links[coupling], &self.setting.couplings[coupling]);
        let (mut impulse, mut torques) = (Vector3::zeros(), [Vector3::zeros(); 2]);
        for ((member, share, torque_map), torque) in self.sides(of).zip(&mut torques) {
            let part = rhs[member] * share;
            *torque = part.fixed_rows::<3>(3).into();
            impulse += torque_map.tr_mul(torque);
            if of.0.pushes() {
                impulse += part.fixed_rows::<3>(0);
            }
        }
        CouplingChange { impulse, torques }
    }

    /// Solves the system that was factorised last, or the transposed one, for right-hand sides by members,
    /// in their memory.
    pub(in super::super) fn solve<const TRANSPOSED: bool>(
        &self,
        system: &mut IslandSystem,
        rhs: &mut [Vector6<f64>],
    ) {
        let IslandSystem { blocks, values } = system;
        values.clear();
        values.resize(rhs.len(), Vector6::zeros());
        for (index, rhs) in rhs.iter().enumerate() {
            values[self.pattern.place(index)] = *rhs;
        }
        blocks.solve::<TRANSPOSED>(&self.pattern, values);
        for (index, rhs) in rhs.iter_mut().enumerate() {
            *rhs = values[self.pattern.place(index)];
        }
    }
}
