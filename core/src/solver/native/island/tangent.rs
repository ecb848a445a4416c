//! The linearised equations of an island, for any right-hand side, and transposed: what a derivative of the
//! step is solved by.
//!
//! Equation numbers are those of `docs/gradients.md`.

use super::super::equations::{Answer, Equations, Gain, Velocity};
use super::super::law::{NaturalMap, Piece};
use super::{Island, IslandScratch, IslandSystem};
use crate::step::Step;
use nalgebra::{Matrix3, Vector3, Vector6};

/// What joints and gears tie: bodies of the world, the joints between them, and a gear of these joints, where it is
/// that gear and not the joints that is meant.
#[derive(Debug, Clone, PartialEq)]
pub(in super::super) struct Tie {
    pub(in super::super) bodies: Vec<usize>,
    pub(in super::super) joints: Vec<usize>,
    pub(in super::super) gear: Option<usize>,
    /// The couplings in the island.
    pub(in super::super) couplings: Vec<usize>,
}

/// What is held while the bodies at the start of the step move.
#[derive(Debug, Clone)]
pub(in super::super) struct Held {
    /// V⁺ of the bodies.
    pub(in super::super) velocity: Vec<Velocity>,
    /// Of each coupling its piece, and its impulse M p̂ along its rows, N s.
    pub(in super::super) rows: Vec<(Piece, Vector3<f64>)>,
    /// M, kg, and ε of the law and of its pieces, where impulses are over M.
    pub(in super::super) mass: f64,
    pub(in super::super) compliances: (f64, f64),
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

    /// Whether it has no row at all.
    pub(in super::super) fn is_plain(&self) -> bool {
        self.links.is_empty()
    }

    /// What its joints and gears tie, one by one.
    pub(in super::super) fn ties(&self, step: &Step<'_>) -> Vec<Tie> {
        let of_joint = |joint: usize| {
            let joint = &step.world.joints()[joint];
            std::iter::once(joint.body()).chain(joint.other())
        };
        let joints = self.joints.iter().map(|at| Tie {
            bodies: of_joint(at.joint).collect(),
            joints: vec![at.joint],
            gear: None,
            couplings: at.place.into_iter().chain(at.turn).collect(),
        });
        let first = self.links.len() - self.gears.len();
        let gears = self.gears.iter().enumerate().map(|(place, train)| {
            let gear = train.of_world();
            let mut joints: Vec<usize> =
                step.world.gears()[gear].axes().iter().map(|axis| axis.joint).collect();
            joints.sort_unstable();
            joints.dedup();
            let mut bodies: Vec<usize> = joints.iter().flat_map(|joint| of_joint(*joint)).collect();
            bodies.sort_unstable();
            bodies.dedup();
            Tie { bodies, joints, gear: Some(gear), couplings: vec![first + place] }
        });
        joints.chain(gears).collect()
    }

    /// The rows of a coupling, as columns.
    pub(in super::super) fn rows(&self, coupling: usize) -> &Matrix3<f64> {
        &self.setting.couplings[coupling].rows.frame
    }

    /// Makes this the island of a `tie` alone in `step`, and gives the momentum over its mass that each of the bodies gets of
    /// its impulses, where V⁺, the pieces of the laws and the impulses along the rows are `held`: of these impulses, and of
    /// what the pieces ask for beside them (N5).
    pub(in super::super) fn momentum(
        &mut self,
        step: &Step<'_>,
        tie: &Tie,
        held: &Held,
    ) -> Vec<Vector6<f64>> {
        self.begin(step, &tie.bodies, 0.0);
        let place = |body: usize| tie.bodies.iter().position(|b| *b == body).unwrap_or(0);
        tie.joints.iter().for_each(|joint| self.admit_joint(step, *joint, place));
        tie.gear.iter().for_each(|gear| self.admit_gear(step, *gear));
        self.tie();
        let (mut scratch, mut points) = (IslandScratch::default(), Vec::new());
        self.set_points(&held.velocity, &mut scratch, &mut points);
        let unit = held.mass / self.mass;
        let (of_law, of_pieces) = (held.compliances.0 / unit, held.compliances.1 / unit);
        let mut values = vec![Vector6::zeros(); tie.bodies.len()];
        let couplings = self.links.iter().zip(&self.setting.couplings).zip(&points);
        // A gear is the last one.
        let others = self.links.len() - held.rows.len();
        for (((link, coupling), u), (piece, rows)) in couplings.skip(others).zip(&held.rows) {
            let impulse = coupling.rows.frame * rows / self.mass;
            let pull = coupling.pull(&NaturalMap::with_compliance(of_law), u, &impulse);
            let graphs = (coupling, &self.setting.graphs[..]);
            let answer = pull.answer(*piece, graphs, &impulse, of_pieces);
            self.add_offset((link, coupling), &(impulse + answer.offset), &mut values);
        }
        (0..tie.bodies.len()).map(|member| values[self.pattern.place(member)]).collect()
    }
}
