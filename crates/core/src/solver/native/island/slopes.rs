//! Derivatives of an island's coupling rows with respect to the velocities, and their blocks in the
//! linear system.
//!
//! Equation numbers refer to `docs/native-solver.md`.

use super::{Both, CouplingKind, Island, IslandSlope, LinkTurnings, LinkedCoupling};
use crate::solver::native::equations::{Elimination, Velocity};
use crate::solver::native::fixed_motion::slope;
use crate::solver::native::law::Gain;
use crate::solver::native::pair_motion::{PairSlope, beside};
use crate::sparse::BlockSystem;
use nalgebra::{Matrix3, Matrix3x6, RowVector6, Vector3, Vector6};

impl Island {
    /// ∂u/∂V of a coupling.
    #[inline]
    pub(super) fn slope(
        &self,
        linked: LinkedCoupling<'_>,
        velocity: &[Velocity],
        turnings: &[Both],
    ) -> IslandSlope {
        if let CouplingKind::Gear(gear) = linked.link.kind {
            return IslandSlope::Gear(self.gear_slope(gear, velocity, turnings));
        }
        IslandSlope::Pair(self.pair_slope(linked, velocity, turnings))
    }

    /// ∂u/∂V of a coupling of one or two bodies.
    #[inline]
    pub(super) fn pair_slope(
        &self,
        linked: LinkedCoupling<'_>,
        velocity: &[Velocity],
        turnings: &[Both],
    ) -> PairSlope {
        let LinkedCoupling { link, coupling } = linked;
        let mut slope = self.gap_slope(linked, velocity, turnings);
        if !coupling.bounces() {
            return slope;
        }
        let u = self.gap_velocity(linked, velocity, LinkTurnings::new(link, turnings));
        if coupling.bounded(u, &self.departing(linked, velocity)).1 {
            let normal = &coupling.rows.normal();
            let exchange = |slope: &mut Matrix3x6<f64>, along: RowVector6<f64>| {
                *slope += normal * (along - slope.tr_mul(normal).transpose());
            };
            let torque_map = &coupling.lever.torque_map;
            exchange(&mut slope.a.1, self.departing_slope(normal, link.a, torque_map, velocity));
            if let (Some((_, by_b)), Some(other)) = (&mut slope.b, &link.b) {
                let (index, torque_map) = (other.index, &other.torque_map);
                exchange(by_b, -self.departing_slope(normal, index, torque_map, velocity));
            }
        }
        slope
    }

    /// nᵀ ∂/∂V of [`departing`](Self::departing) for one side of a coupling.
    fn departing_slope(
        &self,
        normal: &Vector3<f64>,
        index: usize,
        torque_map: &Matrix3<f64>,
        velocity: &[Velocity],
    ) -> RowVector6<f64> {
        let along = self.members[index].departing_slope(&velocity[index], torque_map, normal);
        let mut row = RowVector6::zeros();
        row.fixed_columns_mut::<3>(0).copy_from(&normal.transpose());
        row.fixed_columns_mut::<3>(3).copy_from(&along);
        row
    }

    #[inline]
    fn gap_slope(
        &self,
        linked: LinkedCoupling<'_>,
        velocity: &[Velocity],
        turnings: &[Both],
    ) -> PairSlope {
        let LinkedCoupling { link, coupling } = linked;
        let of_a = &turnings[link.a];
        // Angular rows of joints (J4) depend on spins only.
        if let CouplingKind::Turn(turn) = link.kind {
            let other = link.b.as_ref().map(|other| (other.index, &velocity[other.index].spin));
            let (by_a, by_b) =
                self.turns[turn].slopes(&velocity[link.a].spin, other.map(|(_, spin)| spin));
            let by_spin = |slope: &Matrix3<f64>| beside(&Matrix3::zeros(), slope);
            let b = other.map(|(index, _)| (index, by_spin(&by_b)));
            return PairSlope { a: (link.a, by_spin(&by_a)), b };
        }
        // u = ℓ (Ω_A − Ω_B)
        if link.kind == CouplingKind::Moment {
            let by_spin =
                |torque_map: &Matrix3<f64>| beside(&Matrix3::zeros(), &torque_map.transpose());
            let b = link.b.as_ref().map(|other| (other.index, -by_spin(&other.torque_map)));
            return PairSlope { a: (link.a, by_spin(&coupling.lever.torque_map)), b };
        }
        // Round features (N14) and ellipsoids (N14a)
        let both = || LinkTurnings::new(link, turnings);
        let curved = match link.kind {
            CouplingKind::Round(round) => {
                Some(self.round_motion(linked, round, velocity, both()).slopes())
            }
            CouplingKind::Ellipsoid(one) => {
                Some(self.ellipsoid_motion(linked, one, velocity, both()).slopes())
            }
            _ => None,
        };
        if let Some((by_a, by_b)) = curved {
            let b = link.b.as_ref().zip(by_b).map(|(other, by_b)| (other.index, by_b));
            return PairSlope { a: (link.a, by_a), b };
        }
        // A point against a plane: (N11), or (N3) without a second body.
        match &link.b {
            Some(other) => {
                let of_b = &turnings[other.index];
                let (by_a, by_b) = self.pair_motion(linked, other, velocity, of_a, of_b).slopes();
                PairSlope { a: (link.a, by_a), b: Some((other.index, by_b)) }
            }
            None => {
                let turning = &of_a.there;
                let rotation = &self.members[link.a].rotation;
                let swept = turning.swept(&coupling.lever.centre);
                let by_spin = slope(coupling, rotation, turning, &swept);
                PairSlope { a: (link.a, beside(&Matrix3::identity(), &by_spin)), b: None }
            }
        }
    }

    /// Bodies that a coupling's impulse acts on: index, M/m with its sign, and torque map.
    pub(super) fn sides<'a>(
        &self,
        linked: LinkedCoupling<'a>,
    ) -> impl Iterator<Item = (usize, f64, &'a Matrix3<f64>)> {
        let LinkedCoupling { link, coupling } = linked;
        let share = |index: usize| self.members[index].share;
        let a = (link.a, share(link.a), &coupling.lever.torque_map);
        let b = link.b.as_ref().map(|other| (other.index, -share(other.index), &other.torque_map));
        std::iter::once(a).chain(b)
    }

    /// Adds the offset d of a local solution δp̂ = d + D δu to the right-hand side of the equations
    /// of motion.
    ///
    /// H is M/m (E; G) for A and −M/m (E; G) for B:
    ///
    /// ```text
    /// rhs_i += H_i d,   block (i, j) −= H_i D ∂u/∂V_j                            (N12)
    /// ```
    pub(super) fn add_offset(
        &self,
        linked: LinkedCoupling<'_>,
        offset: &Vector3<f64>,
        values: &mut [Vector6<f64>],
    ) {
        if let CouplingKind::Gear(gear) = linked.link.kind {
            for (body, wrench) in self.gears[gear].sides() {
                values[self.pattern.place(body)] += wrench * offset[0];
            }
            return;
        }
        for (row, share, torque_map) in self.sides(linked) {
            let mut rhs = Vector6::zeros();
            if linked.link.pushes() {
                rhs.fixed_rows_mut::<3>(0).copy_from(&(share * offset));
            }
            rhs.fixed_rows_mut::<3>(3).copy_from(&(share * (torque_map * offset)));
            values[self.pattern.place(row)] += rhs;
        }
    }

    /// Adds the gain D of a joint's rotation or of a moment to the matrix (N12): torques by spins only.
    fn add_turning_gain(
        &self,
        linked: LinkedCoupling<'_>,
        gain: &Gain,
        slope: &PairSlope,
        blocks: &mut BlockSystem,
    ) {
        for (column, slope) in std::iter::once(&slope.a).chain(slope.b.as_ref()) {
            let by_spin = slope.fixed_columns::<3>(3);
            let gained = match gain {
                Gain::Zero => continue,
                Gain::Spring(stiffness) => by_spin * -stiffness,
                Gain::Full(gain) => gain * by_spin,
                Gain::Moment(gain) => gain.matrix() * by_spin,
            };
            for (row, share, torque_map) in self.sides(linked) {
                let turning = torque_map * (gained * -share);
                blocks.add_turning(&self.pattern, row, *column, &turning);
            }
        }
    }

    /// Adds the gain D of a coupling to the matrix (N12).
    pub(super) fn add_gain(
        &self,
        linked: LinkedCoupling<'_>,
        coupling: &Elimination<IslandSlope>,
        blocks: &mut BlockSystem,
    ) {
        let Elimination { local_solution, slope } = coupling;
        let slope = match (slope, linked.link.kind) {
            (IslandSlope::Pair(slope), _) => slope,
            (IslandSlope::Gear(slope), CouplingKind::Gear(gear)) => {
                let gain = local_solution.gain.first();
                for (row, wrench) in self.gears[gear].sides() {
                    for (column, slope) in slope.bodies() {
                        blocks.add(&self.pattern, row, column, &(wrench * (slope * -gain)));
                    }
                }
                return;
            }
            (IslandSlope::Gear(_), _) => return,
        };
        if !linked.link.pushes() {
            return self.add_turning_gain(linked, &local_solution.gain, slope, blocks);
        }
        // D ∂u/∂V of both bodies
        let gained = |slope: &Matrix3x6<f64>| match &local_solution.gain {
            Gain::Zero => None,
            Gain::Spring(stiffness) => Some(slope * -stiffness),
            Gain::Full(gain) => Some(gain * slope),
            Gain::Moment(gain) => Some(gain.matrix() * slope),
        };
        let ((a, by_a), b) = (&slope.a, slope.b.as_ref());
        let Some(by_a) = gained(by_a) else { return };
        let b = b.and_then(|(b, by_b)| Some((*b, gained(by_b)?)));
        // ∂u/∂v_B = −∂u/∂v_A of points (N11).
        let opposite = if linked.link.kind == CouplingKind::Point && !linked.coupling.bounces() {
            3
        } else {
            0
        };
        // block_ij −= H_i D ∂u/∂V_j with H_i = ±(M/m_i) (E; G_i), column by column
        for (row, share, torque_map) in self.sides(linked) {
            let [x, y, z] = &torque_map.data.0;
            let column = |gained: &[f64; 3]| {
                let [l, m, n] = gained.map(|entry| entry * -share);
                let turned = |k: usize| x[k] * l + y[k] * m + z[k] * n;
                [l, m, n, turned(0), turned(1), turned(2)]
            };
            let mut left = [[0.0; 6]; 3];
            let block = blocks.block_of(&self.pattern, row, *a);
            for (k, (to, gained)) in block.data.0.iter_mut().zip(&by_a.data.0).enumerate() {
                let more = column(gained);
                (0..6).for_each(|i| to[i] += more[i]);
                if k < 3 {
                    left[k] = more;
                }
            }
            let Some((b, by_b)) = &b else { continue };
            let block = blocks.block_of(&self.pattern, row, *b);
            for (to, less) in block.data.0.iter_mut().zip(&left[..opposite]) {
                (0..6).for_each(|i| to[i] -= less[i]);
            }
            let columns = block.data.0.iter_mut().zip(&by_b.data.0);
            for (to, gained) in columns.skip(opposite) {
                let more = column(gained);
                (0..6).for_each(|i| to[i] += more[i]);
            }
        }
    }
}
