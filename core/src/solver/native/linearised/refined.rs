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
//! Where the limit of vanishing compliance is taken at one point, at which compliance acts on changes alone, that residual counts what
//! gives way from the impulse of the first solution on, û = u + ε (δp̂ − δp̂₁) with δp̂₁ = D (m + J x):
//!
//! ```text
//! δV = x + K⁻¹ (b − A x + Σ H D C (m + J x)),   C = E − ε D                        (G14)
//! ```
//!
//! with what is left of the compliance of second order. Transposed the same, with what the rows' motions have a part in,
//! λ = Dᵀ Hᵀ y, kept beside y:
//!
//! ```text
//! y = z + w,   λ = Cᵀ λ_z + Dᵀ Hᵀ w,   w = K⁻ᵀ (c − Aᵀ z + Σ Jᵀ Cᵀ λ_z),   λ_z = Dᵀ Hᵀ z,   z = K⁻ᵀ c
//! ```
//!
//! Equation numbers are those of `docs/gradients.md`.

use super::super::equations::Equations;
use super::super::island::{HeldSide, Island, IslandSlope, IslandSystem};
use super::super::law::Factored;
use super::slopes::RowsChange;
use nalgebra::{Matrix3, SMatrix, Vector3, Vector6};

/// What the system at a point consists of.
#[derive(Debug, Clone, Default)]
pub(super) struct Held {
    couplings: Vec<HeldRows>,
    sides: Vec<HeldSide>,
    /// Of A of every body the part that turns; the other is one.
    turning: Vec<Matrix3<f64>>,
}

/// A coupling that has a gain.
#[derive(Debug, Clone)]
struct HeldRows {
    index: usize,
    /// Where its sides end.
    end: usize,
    /// ε |g| of each row: 1 of what is stiff.
    stiffness: Vector3<f64>,
    /// C, along the rows; where no limit is taken, E.
    again: Matrix3<f64>,
}

impl Held {
    /// No coupling, and these parts of A.
    pub(super) fn begin(&mut self, turning: impl Iterator<Item = Matrix3<f64>>) {
        self.couplings.clear();
        self.sides.clear();
        self.turning.clear();
        self.turning.extend(turning);
    }

    /// Adds a coupling of the island, with ε = `compliance`, of which the limit is taken or not.
    pub(super) fn add(
        &mut self,
        island: &Island,
        (index, slope, gain): (usize, &IslandSlope, &Factored),
        (compliance, is_limit): (f64, bool),
    ) {
        island.hold(index, (slope, gain), &mut self.sides);
        let mut again = Matrix3::identity();
        if is_limit {
            let along = gain.from.tr_mul(&gain.to) * Matrix3::from_diagonal(&gain.gains);
            again -= along * compliance;
        }
        let (end, stiffness) = (self.sides.len(), gain.gains.abs() * compliance);
        self.couplings.push(HeldRows { index, end, stiffness, again });
    }

    /// The couplings with their sides.
    fn couplings(&self) -> impl Iterator<Item = (&HeldRows, &[HeldSide])> {
        let mut begin = 0;
        self.couplings.iter().map(move |rows| {
            let sides = &self.sides[begin..rows.end];
            begin = rows.end;
            (rows, sides)
        })
    }

    /// Whether the system decides the impulses of all rows: what gives way from any impulses on leaves them, but for a small part
    ///
    /// ```text
    /// δp̂ ← D (J δV − ε δp̂),   K δV = −ε Σ H D δp̂
    /// ```
    ///
    /// The impulses are without a pattern, so that no direction is missed.
    pub(super) fn is_determined(
        &self,
        island: &Island,
        (columns, system): (&mut Columns<6>, &mut IslandSystem),
    ) -> bool {
        /// What is left is of second order in (G14): as much as extrapolation (G7) leaves.
        const LEFT: f64 = 1e-4;
        columns.begin(self.turning.len(), island.couplings().len());
        let mut number = 0_u32;
        for rows in &self.couplings {
            columns.motions[rows.index] = SMatrix::from_fn(|_, _| {
                // Parts of a turn by the golden ratio, which never meet.
                number = number.wrapping_add(0x9E37_79B9);
                f64::from(number) / f64::from(u32::MAX) - 0.5
            });
        }
        columns.press_motions(self);
        island.solve_all(system, (&mut columns.solved, &mut columns.values));
        self.couplings().all(|(rows, sides)| {
            let motions = columns.motions[rows.index].data.0.iter().enumerate();
            motions.into_iter().all(|(column, motion)| {
                let mut along = *motion;
                for side in sides {
                    side.see(&columns.solved[side.body].data.0[column], &mut along);
                }
                (0..3).all(|k| rows.stiffness[k] * along[k].abs() <= LEFT)
            })
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

    /// b + Σ H D m, where the solutions will be.
    fn press_motions(&mut self, held: &Held) {
        let Self { rhs, motions, solved, .. } = self;
        solved.clone_from(rhs);
        for (rows, sides) in held.couplings() {
            for (column, motion) in motions[rows.index].data.0.iter().enumerate() {
                if *motion != [0.0; 3] {
                    for side in sides {
                        side.press(motion, &mut solved[side.body].data.0[column]);
                    }
                }
            }
        }
    }

    /// Solves for δV.
    pub(super) fn solve(&mut self, island: &Island, held: &Held, system: &mut IslandSystem) {
        self.press_motions(held);
        let Self { rhs, motions, solved, values } = self;
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
        for (rows, sides) in held.couplings() {
            for (column, motion) in motions[rows.index].data.0.iter().enumerate() {
                let mut along = *motion;
                for side in sides {
                    side.see(&solved[side.body].data.0[column], &mut along);
                }
                let along: [f64; 3] = (rows.again * Vector3::from(along)).into();
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
        for (rows, sides) in held.couplings() {
            let by = rows.again.tr_mul(&pulled(sides, solved));
            sides.iter().for_each(|side| rhs[side.body] += side.rows.tr_mul(&by));
            motions[rows.index] = by;
        }
        island.solve_transposed(system, (rhs, values));
        for (rows, sides) in held.couplings() {
            motions[rows.index] += pulled(sides, rhs);
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
