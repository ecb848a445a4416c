//! The linear systems of an island at a point, solved to the digits of what they are made of.
//!
//! With motions m of the rows at fixed V⁺ and everything else in b,
//!
//! ```text
//! A δV − Σ H D (m + J δV) = b,   K = A − Σ H D J                                   (G2)
//! ```
//!
//! D is as large as 1/ε, so that A and b lose 1e-16/ε where K is formed, and m is as large as 1/h. What they lose shows
//! where the couplings hold nothing. A residual in which the rows are not summed up, of which each D is multiplied with a sum that
//! nearly vanishes, has all digits, and a second solution with the same factors gives them back:
//!
//! ```text
//! δV = x + K⁻¹ (b − A x + Σ H D (m + J x)),   x = K⁻¹ (b + Σ H D m)                (G11)
//! ```
//!
//! Transposed the same, with what the rows' motions have a part in, λ = Dᵀ Hᵀ y, kept beside y:
//!
//! ```text
//! y = z + w,   λ = λ_z + Dᵀ Hᵀ w,   w = K⁻ᵀ (c − Aᵀ z + Σ Jᵀ λ_z),   λ_z = Dᵀ Hᵀ z,   z = K⁻ᵀ c
//! ```
//!
//! Equation numbers are those of `docs/gradients.md`.

use super::super::island::{HeldSide, Island, IslandSlope, IslandSystem};
use super::super::law::Factored;
use super::slopes::RowsChange;
use nalgebra::{Matrix3, SMatrix, Vector3, Vector6};

/// What the system at a point consists of.
#[derive(Debug, Clone, Default)]
pub(super) struct Held {
    /// The couplings that have a gain, and where the sides of each end.
    couplings: Vec<(usize, usize)>,
    sides: Vec<HeldSide>,
    /// Of A of every body the part that turns; the other is one.
    turning: Vec<Matrix3<f64>>,
}

impl Held {
    /// No coupling, and these parts of A.
    pub(super) fn begin(&mut self, turning: impl Iterator<Item = Matrix3<f64>>) {
        self.couplings.clear();
        self.sides.clear();
        self.turning.clear();
        self.turning.extend(turning);
    }

    /// Adds a coupling of the island.
    pub(super) fn add(&mut self, island: &Island, index: usize, of: (&IslandSlope, &Factored)) {
        island.hold(index, of, &mut self.sides);
        self.couplings.push((index, self.sides.len()));
    }

    /// The couplings with their sides.
    fn couplings(&self) -> impl Iterator<Item = (usize, &[HeldSide])> {
        let mut begin = 0;
        self.couplings.iter().map(move |&(index, end)| {
            let sides = &self.sides[begin..end];
            begin = end;
            (index, sides)
        })
    }
}

impl HeldSide {
    /// Adds what a change of the body's velocities is along the rows.
    #[inline(always)]
    fn see(&self, change: &[f64; 6], along: &mut [f64; 3]) {
        for (column, change) in self.rows.data.0.iter().zip(change) {
            (0..3).for_each(|k| along[k] += column[k] * change);
        }
    }

    /// Adds what motions along the rows make of the right-hand sides.
    #[inline(always)]
    fn press(&self, along: &[f64; 3], rhs: &mut [f64; 6]) {
        for (column, along) in self.effect.data.0.iter().zip(along) {
            (0..6).for_each(|k| rhs[k] += column[k] * along);
        }
    }
}

/// Columns of right-hand sides by members and by couplings, of their solutions, and scratch.
#[derive(Debug, Clone)]
pub(super) struct Columns<const C: usize> {
    /// b, or c; then what is left of it.
    pub(super) rhs: Vec<SMatrix<f64, 6, C>>,
    /// m of every coupling along its rows, m/s; or λ.
    pub(super) motions: Vec<SMatrix<f64, 3, C>>,
    /// δV, or y.
    pub(super) solved: Vec<SMatrix<f64, 6, C>>,
    values: Vec<SMatrix<f64, 6, C>>,
}

impl<const C: usize> Columns<C> {
    pub(super) fn new() -> Self {
        Self { rhs: Vec::new(), motions: Vec::new(), solved: Vec::new(), values: Vec::new() }
    }

    /// Nothing on the right.
    pub(super) fn begin(&mut self, members: usize, couplings: usize) {
        self.rhs.clear();
        self.rhs.resize(members, SMatrix::zeros());
        self.motions.clear();
        self.motions.resize(couplings, SMatrix::zeros());
    }

    /// Adds what changes of the rows of a coupling make.
    pub(super) fn add(&mut self, island: &Island, coupling: usize, change: &RowsChange<C>) {
        self.motions[coupling] += change.motion;
        if change.impulse != SMatrix::<f64, 3, C>::zeros() {
            island.add_impulses(coupling, &change.impulse, &mut self.rhs);
        }
        island.add_torques(coupling, &change.torques, &mut self.rhs);
    }

    /// Solves the equations of bodies by themselves, for the spins.
    pub(super) fn turn(&mut self, inverse: &Matrix3<f64>) {
        self.solved.clone_from(&self.rhs);
        for solved in &mut self.solved {
            let turned = inverse * solved.fixed_rows::<3>(3);
            solved.fixed_rows_mut::<3>(3).copy_from(&turned);
        }
    }

    /// Solves for δV.
    pub(super) fn solve(&mut self, island: &Island, held: &Held, system: &mut IslandSystem) {
        let Self { rhs, motions, solved, values } = self;
        solved.clone_from(rhs);
        for (index, sides) in held.couplings() {
            for (column, motion) in motions[index].data.0.iter().enumerate() {
                if *motion != [0.0; 3] {
                    for side in sides {
                        side.press(motion, &mut solved[side.body].data.0[column]);
                    }
                }
            }
        }
        island.solve_all(system, (solved, values));
        for ((rhs, x), turning) in rhs.iter_mut().zip(&*solved).zip(&held.turning) {
            for (rhs, x) in rhs.data.0.iter_mut().zip(&x.data.0) {
                let turned = turning * Vector3::new(x[3], x[4], x[5]);
                for k in 0..3 {
                    rhs[k] -= x[k];
                    rhs[3 + k] -= turned[k];
                }
            }
        }
        for (index, sides) in held.couplings() {
            for (column, motion) in motions[index].data.0.iter().enumerate() {
                let mut along = *motion;
                for side in sides {
                    side.see(&solved[side.body].data.0[column], &mut along);
                }
                for side in sides {
                    side.press(&along, &mut rhs[side.body].data.0[column]);
                }
            }
        }
        island.solve_all(system, (rhs, values));
        solved.iter_mut().zip(&*rhs).for_each(|(x, more)| *x += more);
    }
}

impl Columns<1> {
    /// Solves the transposed system: for y, and λ in the place of the motions.
    pub(super) fn solve_transposed(
        &mut self,
        island: &Island,
        held: &Held,
        system: &mut IslandSystem,
    ) {
        let Self { rhs, motions, solved, values } = self;
        let pulled = |sides: &[HeldSide], values: &[Vector6<f64>]| -> Vector3<f64> {
            sides.iter().map(|side| side.effect.tr_mul(&values[side.body])).sum()
        };
        solved.clone_from(rhs);
        island.solve_transposed(system, (solved, values));
        for ((rhs, z), turning) in rhs.iter_mut().zip(&*solved).zip(&held.turning) {
            let turned = turning.tr_mul(&z.fixed_rows::<3>(3));
            *rhs -= Vector6::new(z[0], z[1], z[2], turned[0], turned[1], turned[2]);
        }
        for (index, sides) in held.couplings() {
            let by = pulled(sides, solved);
            sides.iter().for_each(|side| rhs[side.body] += side.rows.tr_mul(&by));
            motions[index] = by;
        }
        island.solve_transposed(system, (rhs, values));
        for (index, sides) in held.couplings() {
            motions[index] += pulled(sides, rhs);
        }
        solved.iter_mut().zip(&*rhs).for_each(|(z, more)| *z += more);
    }

    /// What the solution of the transposed system makes derivatives by changes of the rows of a coupling.
    pub(super) fn pulled(&self, island: &Island, coupling: usize) -> RowsChange<1> {
        RowsChange {
            motion: self.motions[coupling],
            impulse: island.impulse_pulled(coupling, &self.solved),
            torques: island.torques_pulled(coupling, &self.solved),
        }
    }
}
