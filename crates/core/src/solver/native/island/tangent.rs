//! Solves with the linearised equations of an island for any right-hand side, also transposed.
//!
//! These are the systems of a step's derivatives. Equation numbers refer to `docs/gradients.md`.

use super::{CouplingKind, Island, IslandSlope, IslandSystem, JointPlace};
use crate::joint::Segment;
use crate::solver::native::law::{CouplingLaw, Factored};
use crate::solver::native::pair_motion::PairSlope;
use nalgebra::{Matrix3, Matrix3x6, Matrix6x3, SMatrix, Vector3, Vector6};

/// Row of a gear.
#[derive(Debug, Clone, Copy)]
pub(crate) struct GearTangent {
    /// Index of its coupling; `gear` is the index in the world.
    pub(crate) coupling: usize,
    pub(crate) gear: usize,
    /// Coupling, row and factor of each coordinate.
    pub(crate) parts: [(usize, usize, f64); 2],
    /// Position error at the start of the step, over h (m/s).
    pub(crate) offset: f64,
    /// ℓ of the first coordinate (m if it is a rotation).
    pub(crate) length: f64,
}

/// One body of a coupling with the factored gain D = T diag(g) Fᵀ.
///
/// `rows` is Fᵀ J, the motion along the rows by the body's velocities. `effect` is H T diag(g), the
/// right-hand side of the body's equations by that motion.
#[derive(Debug, Clone, Copy)]
pub(crate) struct StiffSide {
    pub(crate) body: usize,
    pub(crate) rows: Matrix3x6<f64>,
    pub(crate) effect: Matrix6x3<f64>,
}

impl Island {
    /// Adds the sides of a coupling with this slope and gain.
    pub(crate) fn hold(
        &self,
        coupling: usize,
        slope: &IslandSlope,
        gain: &Factored,
        sides: &mut Vec<StiffSide>,
    ) {
        let linked = self.linked(coupling);
        let impulses = gain.to * Matrix3::from_diagonal(&gain.gains);
        match (slope, linked.link.kind) {
            (IslandSlope::Pair(PairSlope { a, b }), _) => {
                let slopes = std::iter::once(a).chain(b);
                for ((body, share, torque_map), (_, slope)) in self.sides(linked).zip(slopes) {
                    let mut effect = Matrix6x3::zeros();
                    if linked.link.pushes() {
                        effect.fixed_rows_mut::<3>(0).copy_from(&(impulses * share));
                    }
                    effect.fixed_rows_mut::<3>(3).copy_from(&(torque_map * impulses * share));
                    sides.push(StiffSide { body, rows: gain.from.tr_mul(slope), effect });
                }
            }
            (IslandSlope::Gear(slope), CouplingKind::Gear(gear)) => {
                for ((body, slope), (_, wrench)) in slope.bodies().zip(self.gears[gear].sides()) {
                    let (mut rows, mut effect) = (Matrix3x6::zeros(), Matrix6x3::zeros());
                    rows.row_mut(0).copy_from(&slope);
                    effect.column_mut(0).copy_from(&(wrench * gain.gains[0]));
                    sides.push(StiffSide { body, rows, effect });
                }
            }
            (IslandSlope::Gear(_), _) => {}
        }
    }

    /// Adds impulses of a coupling to right-hand sides of the equations of motion, per body mass.
    ///
    /// H is defined in (N12). The impulses are C columns:
    ///
    /// ```text
    /// rhs_A += H_A δp̂,   rhs_B += H_B δp̂                                         (G6)
    /// ```
    #[inline]
    pub(crate) fn add_impulses<const C: usize>(
        &self,
        coupling: usize,
        impulse: &SMatrix<f64, 3, C>,
        rhs: &mut [SMatrix<f64, 6, C>],
    ) {
        let linked = self.linked(coupling);
        if let CouplingKind::Gear(gear) = linked.link.kind {
            for (member, wrench) in self.gears[gear].sides() {
                rhs[member] += wrench * impulse.row(0);
            }
            return;
        }
        let pushes = linked.link.pushes();
        for (member, share, torque_map) in self.sides(linked) {
            for (rhs, impulse) in rhs[member].data.0.iter_mut().zip(&impulse.data.0) {
                let along = Vector3::from(*impulse) * share;
                let turning = torque_map * along;
                for k in 0..3 {
                    if pushes {
                        rhs[k] += along[k];
                    }
                    rhs[3 + k] += turning[k];
                }
            }
        }
    }

    /// Adds torques on the two bodies of a coupling, each in its own frame: M/m (0, δτ_A) and −M/m
    /// (0, δτ_B).
    pub(crate) fn add_torques<const C: usize>(
        &self,
        coupling: usize,
        torques: &SMatrix<f64, 6, C>,
        rhs: &mut [SMatrix<f64, 6, C>],
    ) {
        let linked = self.linked(coupling);
        if let CouplingKind::Gear(_) = linked.link.kind {
            return;
        }
        for (side, (member, share, _)) in self.sides(linked).enumerate() {
            for (rhs, torques) in rhs[member].data.0.iter_mut().zip(&torques.data.0) {
                (0..3).for_each(|k| rhs[3 + k] += torques[3 * side + k] * share);
            }
        }
    }

    /// Transpose of [`add_impulses`](Self::add_impulses): maps derivatives with respect to the
    /// right-hand sides to those with respect to the coupling's impulse.
    pub(crate) fn impulse_vjp(&self, coupling: usize, rhs: &[Vector6<f64>]) -> Vector3<f64> {
        let linked = self.linked(coupling);
        let mut impulse = Vector3::zeros();
        if let CouplingKind::Gear(gear) = linked.link.kind {
            let sides = self.gears[gear].sides();
            impulse[0] = sides.map(|(member, wrench)| wrench.dot(&rhs[member])).sum();
            return impulse;
        }
        for (member, share, torque_map) in self.sides(linked) {
            let part = rhs[member] * share;
            impulse += torque_map.tr_mul(&part.fixed_rows::<3>(3));
            if linked.link.pushes() {
                impulse += part.fixed_rows::<3>(0);
            }
        }
        impulse
    }

    /// Transpose of [`add_torques`](Self::add_torques).
    pub(crate) fn torques_vjp(&self, coupling: usize, rhs: &[Vector6<f64>]) -> Vector6<f64> {
        let linked = self.linked(coupling);
        let mut torques = Vector6::zeros();
        if let CouplingKind::Gear(_) = linked.link.kind {
            return torques;
        }
        for (side, (member, share, _)) in self.sides(linked).enumerate() {
            let part = rhs[member].fixed_rows::<3>(3) * share;
            torques.fixed_rows_mut::<3>(3 * side).copy_from(&part);
        }
        torques
    }

    /// Solves the system factorised last for right-hand sides by body, in place. `values` is
    /// scratch.
    pub(crate) fn solve_all<const C: usize>(
        &self,
        system: &mut IslandSystem,
        rhs: &mut [SMatrix<f64, 6, C>],
        values: &mut Vec<SMatrix<f64, 6, C>>,
    ) {
        self.by_places(rhs, values, |values| system.blocks.solve_all(&self.pattern, values));
    }

    /// Solves the transposed system likewise.
    pub(crate) fn solve_transposed(
        &self,
        system: &mut IslandSystem,
        rhs: &mut [Vector6<f64>],
        values: &mut Vec<Vector6<f64>>,
    ) {
        self.by_places(rhs, values, |values| system.blocks.solve::<true>(&self.pattern, values));
    }

    /// Permutes values by body into elimination order, applies `solve` and permutes back.
    fn by_places<T: Copy>(
        &self,
        members: &mut [T],
        values: &mut Vec<T>,
        solve: impl FnOnce(&mut [T]),
    ) {
        members.clone_into(values);
        for (index, member) in members.iter().enumerate() {
            values[self.pattern.place(index)] = *member;
        }
        solve(values);
        for (index, member) in members.iter_mut().enumerate() {
            *member = values[self.pattern.place(index)];
        }
    }

    /// True if the island has no couplings.
    pub(crate) fn is_plain(&self) -> bool {
        self.links.is_empty()
    }

    /// Joints of the island.
    pub(crate) fn joint_places(&self) -> &[JointPlace] {
        &self.joints
    }

    /// Gears of the island.
    pub(crate) fn gear_rows(&self) -> impl Iterator<Item = GearTangent> {
        let first = self.links.len() - self.gears.len();
        self.gears.iter().enumerate().map(move |(place, train)| train.row(first + place))
    }

    /// Impulse p̂ that gears add along the rows of a joint's coupling (m/s).
    pub(crate) fn geared(&self, coupling: usize, impulses: &[Vector3<f64>]) -> Vector3<f64> {
        let mut along = Vector3::zeros();
        for gear in self.gear_rows() {
            for (_, row, factor) in gear.parts.into_iter().filter(|(of, ..)| *of == coupling) {
                along[row] += factor * impulses[gear.coupling][0];
            }
        }
        along
    }

    /// Piece of the law of row k of a joint's coupling.
    pub(crate) fn segment(&self, coupling: usize, k: usize, piece: u8) -> Segment {
        match &self.setting.couplings[coupling].law {
            CouplingLaw::Axes(axes) => axes.segment(&self.setting.graphs, k, piece),
            CouplingLaw::Cone(_) | CouplingLaw::Ellipse(_) | CouplingLaw::Moment(_) => {
                Segment::NONE
            }
        }
    }

    /// Rows of a coupling, as columns.
    pub(crate) fn rows(&self, coupling: usize) -> &Matrix3<f64> {
        &self.setting.couplings[coupling].rows.frame
    }
}
