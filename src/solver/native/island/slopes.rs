//! How the points of an island's contacts answer to the velocities of its bodies, and what that makes of
//! the linear system.
//!
//! Equation numbers are those of `docs/native-solver.md`.

use super::super::blocks::BlockSystem;
use super::super::equations::{Candidate, Elimination, Gain, Velocity};
use super::super::fixed_motion::slope;
use super::super::pair_motion::{PairSlope, beside};
use super::{Both, Island, Link};
use nalgebra::{Matrix3, Matrix3x6, Matrix6, RowVector6, Vector3, Vector6};

impl Island {
    /// ∂u/∂V of a candidate.
    pub(super) fn pair_slope(
        &self,
        link: &Link,
        candidate: &Candidate,
        velocity: &[Velocity],
        turnings: &[Both],
    ) -> PairSlope {
        let mut slope = self.gap_slope(link, candidate, velocity, turnings);
        if !candidate.bounces() {
            return slope;
        }
        let both = (&turnings[link.a], link.b.as_ref().map(|other| &turnings[other.index]));
        let u = self.gap_velocity((link, candidate), velocity, both);
        if candidate.bounded(u, &self.departing((link, candidate), velocity)).1 {
            let normal = &candidate.normal;
            let exchange = |slope: &mut Matrix3x6<f64>, along: RowVector6<f64>| {
                *slope += normal * (along - slope.tr_mul(normal).transpose());
            };
            let of_a = (link.a, &candidate.torque_map);
            exchange(&mut slope.a.1, self.departing_slope(normal, of_a, velocity));
            if let (Some((_, by_b)), Some(other)) = (&mut slope.b, &link.b) {
                let of_b = (other.index, &other.torque_map);
                exchange(by_b, -self.departing_slope(normal, of_b, velocity));
            }
        }
        slope
    }

    /// nᵀ ∂/∂V of what [`departing`](Self::departing) is, for one side of a candidate.
    fn departing_slope(
        &self,
        normal: &Vector3<f64>,
        (index, torque_map): (usize, &Matrix3<f64>),
        velocity: &[Velocity],
    ) -> RowVector6<f64> {
        let member = &self.members[index];
        let inertia = (&member.inertia, &member.inertia_inverse);
        let slope = self.form.departing_slope(inertia, &velocity[index].spin, self.time_step);
        let mut row = RowVector6::zeros();
        row.fixed_columns_mut::<3>(0).copy_from(&normal.transpose());
        row.fixed_columns_mut::<3>(3).copy_from(&(torque_map * normal).tr_mul(&slope));
        row
    }

    fn gap_slope(
        &self,
        link: &Link,
        candidate: &Candidate,
        velocity: &[Velocity],
        turnings: &[Both],
    ) -> PairSlope {
        let of_a = &turnings[link.a];
        if let Some(round) = link.round {
            let both = (of_a, link.b.as_ref().map(|other| &turnings[other.index]));
            let (by_a, by_b) = self.round_motion((candidate, round), link, velocity, both).slopes();
            let b = link.b.as_ref().zip(by_b).map(|(other, by_b)| (other.index, by_b));
            return PairSlope { a: (link.a, by_a), b };
        }
        match &link.b {
            Some(other) => {
                let both = (of_a, &turnings[other.index]);
                let pair = self.pair_motion(candidate, (link, other), velocity, both);
                let (by_a, by_b) = pair.slopes();
                PairSlope { a: (link.a, by_a), b: Some((other.index, by_b)) }
            }
            None => {
                let (turning, rotation) = (&of_a.there, &self.members[link.a].rotation);
                let swept = turning.swept(&candidate.centre);
                let by_spin = slope(candidate, rotation, turning, &swept);
                PairSlope { a: (link.a, beside(&Matrix3::identity(), &by_spin)), b: None }
            }
        }
    }

    /// Adds to the system what a contact's answer δp̂ = d + D δu makes of the equations of
    /// motion: with H = M/m (E; G) of A and −M/m (E; G) of B,
    ///
    /// ```text
    /// rhs_i += H_i d,   block (i, j) −= H_i D ∂u/∂V_j                            (N12)
    /// ```
    pub(super) fn add_contact(
        &self,
        link: &Link,
        candidate: &Candidate,
        contact: &Elimination<PairSlope>,
        blocks: &mut BlockSystem,
    ) {
        let a = (link.a, self.members[link.a].share, &candidate.torque_map);
        let b = link
            .b
            .as_ref()
            .map(|other| (other.index, -self.members[other.index].share, &other.torque_map));
        let Elimination { answer, slope } = contact;
        for (row, share, torque_map) in std::iter::once(a).chain(b) {
            let mut rhs = Vector6::zeros();
            rhs.fixed_rows_mut::<3>(0).copy_from(&(share * answer.offset));
            rhs.fixed_rows_mut::<3>(3).copy_from(&(share * (torque_map * answer.offset)));
            blocks.add_rhs(row, &rhs);
            for (column, slope) in std::iter::once(&slope.a).chain(slope.b.as_ref()) {
                let gained = match &answer.gain {
                    Gain::Zero => continue,
                    Gain::Spring(stiffness) => slope * -stiffness,
                    Gain::Full(gain) => gain * slope,
                };
                let linear = gained * -share;
                let mut block = Matrix6::zeros();
                block.fixed_view_mut::<3, 6>(0, 0).copy_from(&linear);
                block.fixed_view_mut::<3, 6>(3, 0).copy_from(&(torque_map * linear));
                blocks.add(row, *column, &block);
            }
        }
    }
}
