//! The linearised equations of an island, for any right-hand side, and transposed: what a derivative of the
//! step is solved by.
//!
//! Equation numbers are those of `docs/gradients.md`.

use super::super::equations::{Answer, Gain};
use super::super::law::Law;
use super::{Island, IslandSystem, JointPlace, Kind};
use crate::joint::Segment;
use nalgebra::{Matrix3, SMatrix, Vector3, Vector6};

/// The row of a gear.
#[derive(Debug, Clone, Copy)]
pub(in super::super) struct GearRow {
    /// Its coupling.
    pub(in super::super) coupling: usize,
    /// Of each coordinate its coupling, the row there, and the factor of that row's speed.
    pub(in super::super) parts: [(usize, usize, f64); 2],
    /// What it is off by at the step's start, over h, m/s.
    pub(in super::super) offset: f64,
}

/// What a change of a coupling's rows and arms makes of its impulse at fixed V⁺, and of the torques of the
/// impulse that it has: of A and of B, each in its own frame.
#[derive(Debug, Clone, Copy)]
pub(in super::super) struct CouplingChange {
    pub(in super::super) impulse: Vector3<f64>,
    pub(in super::super) torques: [Vector3<f64>; 2],
}

/// D of an answer.
pub(in super::super) fn gain_of(answer: &Answer) -> Matrix3<f64> {
    match &answer.gain {
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
    /// rhs_A += H_A δp̂ + M/m (0, δτ_A),   rhs_B += H_B δp̂ − M/m (0, δτ_B)             (G6)
    /// ```
    pub(in super::super) fn add_change(
        &self,
        coupling: usize,
        change: &CouplingChange,
        rhs: &mut [Vector6<f64>],
    ) {
        let of = (&self.links[coupling], &self.setting.couplings[coupling]);
        if let Kind::Gear(gear) = of.0.kind {
            for (member, wrench) in self.gears[gear].sides() {
                rhs[member] += wrench * change.impulse[0];
            }
            return;
        }
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
        if let Kind::Gear(gear) = of.0.kind {
            let sides = self.gears[gear].sides();
            impulse[0] = sides.map(|(member, wrench)| wrench.dot(&rhs[member])).sum();
            return CouplingChange { impulse, torques };
        }
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

    /// The same for several right-hand sides, whose `values` by places are scratch.
    pub(in super::super) fn solve_all<const C: usize>(
        &self,
        system: &mut IslandSystem,
        (rhs, values): (&mut [SMatrix<f64, 6, C>], &mut Vec<SMatrix<f64, 6, C>>),
    ) {
        values.clear();
        values.resize(rhs.len(), SMatrix::zeros());
        for (index, rhs) in rhs.iter().enumerate() {
            values[self.pattern.place(index)] = *rhs;
        }
        system.blocks.solve_all(&self.pattern, values);
        for (index, rhs) in rhs.iter_mut().enumerate() {
            *rhs = values[self.pattern.place(index)];
        }
    }

    /// Adds to the right-hand sides what changes of a coupling make, each a column of nine numbers: of its impulse and of
    /// its torques (G6).
    pub(in super::super) fn add_changes<const C: usize>(
        &self,
        coupling: usize,
        change: &SMatrix<f64, 9, C>,
        rhs: &mut [SMatrix<f64, 6, C>],
    ) {
        let of = (&self.links[coupling], &self.setting.couplings[coupling]);
        let impulse = change.fixed_rows::<3>(0);
        if let Kind::Gear(gear) = of.0.kind {
            for (member, wrench) in self.gears[gear].sides() {
                rhs[member] += wrench * impulse.row(0);
            }
            return;
        }
        for (side, (member, share, torque_map)) in self.sides(of).enumerate() {
            if of.0.pushes() {
                let mut part = rhs[member].fixed_rows_mut::<3>(0);
                part += impulse * share;
            }
            let turning = torque_map * impulse + change.fixed_rows::<3>(3 + 3 * side);
            let mut part = rhs[member].fixed_rows_mut::<3>(3);
            part += turning * share;
        }
    }

    /// Whether it has no row at all.
    pub(in super::super) fn is_plain(&self) -> bool {
        self.links.is_empty()
    }

    /// Its joints.
    pub(in super::super) fn joint_places(&self) -> &[JointPlace] {
        &self.joints
    }

    /// Its gears.
    pub(in super::super) fn gear_rows(&self) -> impl Iterator<Item = GearRow> {
        let first = self.links.len() - self.gears.len();
        self.gears.iter().enumerate().map(move |(place, train)| train.row(first + place))
    }

    /// The impulse p̂ that gears add along the rows of a joint's coupling, m/s.
    pub(in super::super) fn geared(
        &self,
        coupling: usize,
        impulses: &[Vector3<f64>],
    ) -> Vector3<f64> {
        let mut along = Vector3::zeros();
        for gear in self.gear_rows() {
            for (_, row, factor) in gear.parts.into_iter().filter(|(of, ..)| *of == coupling) {
                along[row] += factor * impulses[gear.coupling][0];
            }
        }
        along
    }

    /// A piece of the law of row k of a joint's coupling.
    pub(in super::super) fn segment(&self, coupling: usize, k: usize, piece: u8) -> Segment {
        match &self.setting.couplings[coupling].law {
            Law::Axes(axes) => axes.segment(&self.setting.graphs, k, piece),
            Law::Cone(_) => Segment::NONE,
        }
    }

    /// The rows of a coupling, as columns.
    pub(in super::super) fn rows(&self, coupling: usize) -> &Matrix3<f64> {
        &self.setting.couplings[coupling].rows.frame
    }
}
