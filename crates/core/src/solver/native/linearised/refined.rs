//! Linear systems of an island at one point, solved with iterative refinement.
//!
//! With motions m of the rows at fixed V⁺ and all other terms in b,
//!
//! ```text
//! A δV − Σ H D (m + J δV) = b,   K = A − Σ H D J                                   (G2)
//! ```
//!
//! D is as large as 1/ε, so forming K loses 1e-16/ε of A and b. The motions m are as large as 1/h.
//! The loss matters for motions that no coupling constrains. The residual keeps all digits if each
//! D multiplies the nearly vanishing sum m + J x. A second solve with the same factors restores
//! them:
//!
//! ```text
//! δV = x + K⁻¹ (b − A x + Σ H D (m + J x)),   x = K⁻¹ (b + Σ H D m)                (G11)
//! ```
//!
//! If the limit of vanishing compliance is taken at one point, compliance acts on changes only. The
//! residual then measures the deflection from the impulse of the first solve, û = u + ε (δp̂ −
//! δp̂₁) with δp̂₁ = D (m + J x):
//!
//! ```text
//! δV = x + K⁻¹ (b − A x + Σ H D C (m + J x)),   C = E − ε D                        (G14)
//! ```
//!
//! The remaining error is of second order in the compliance. For nearly dependent rows it is not
//! small, and further solves follow. With δp̂ = D s and s₁ = m + J x₁,
//!
//! ```text
//! xₖ₊₁ = xₖ + K⁻¹ (b − A xₖ + Σ H D (m + J xₖ − ε D sₖ)),   sₖ₊₁ = m + J xₖ₊₁ − ε D sₖ       (G19)
//! ```
//!
//! The first of these is (G14). The transposed solve runs in reverse order. Next to y it keeps λ,
//! the derivatives with respect to the row motions.
//!
//! Equation numbers refer to `docs/gradients.md`.

use super::slopes::RowsChange;
use crate::solver::native::equations::{Elimination, Equations};
use crate::solver::native::island::{Island, IslandSlope, IslandSystem, StiffSide};
use crate::solver::native::law::Factored;
use nalgebra::{Matrix3, SMatrix, Vector3, Vector6};

/// Compliance that a point is linearised with.
#[derive(Debug, Clone, Copy)]
pub(super) struct PointCompliance {
    /// ε of the matrix and of the law evaluated last.
    pub(super) compliance: f64,
    /// True if the limit ε → 0 is taken at this point (G14). Compliance then acts on changes only.
    pub(super) is_limit: bool,
}

/// Terms of the linear system at a point, kept separate for residuals.
#[derive(Debug, Clone, Default)]
pub(super) struct StiffTerms {
    couplings: Vec<StiffCoupling>,
    sides: Vec<StiffSide>,
    /// Angular block of A for every body. The linear block is the identity.
    turning: Vec<Matrix3<f64>>,
    /// Number of solves after the first.
    passes: usize,
}

/// Coupling with a nonzero gain.
#[derive(Debug, Clone)]
struct StiffCoupling {
    index: usize,
    /// End of its range in the list of sides.
    end: usize,
    /// ε |g| of each row: 1 for a stiff row.
    stiffness: Vector3<f64>,
    /// ε D along the rows. Zero without a limit.
    compliance_matrix: Matrix3<f64>,
}

impl StiffTerms {
    /// Starts a system without couplings, with these angular blocks of A.
    pub(super) fn begin(&mut self, turning: impl Iterator<Item = Matrix3<f64>>) {
        self.couplings.clear();
        self.sides.clear();
        self.turning.clear();
        self.turning.extend(turning);
        self.passes = 1;
    }

    /// Adds coupling `index` of the island, with the compliance of the point `on`.
    pub(super) fn add(
        &mut self,
        island: &Island,
        index: usize,
        eliminations: &[Elimination<IslandSlope>],
        gain: &Factored,
        on: PointCompliance,
    ) {
        let first = self.sides.len();
        island.hold(index, &eliminations[index].slope, gain, &mut self.sides);
        island.add_load_effects(index, gain, eliminations, &mut self.sides[first..]);
        let mut compliance_matrix = Matrix3::zeros();
        if on.is_limit {
            let along = gain.from.tr_mul(&gain.to) * Matrix3::from_diagonal(&gain.gains);
            compliance_matrix = along * on.compliance;
        }
        let end = self.sides.len();
        let stiffness = gain.gains.abs() * on.compliance;
        self.couplings.push(StiffCoupling { index, end, stiffness, compliance_matrix });
    }

    /// Couplings with their sides.
    fn couplings(&self) -> impl Iterator<Item = (&StiffCoupling, &[StiffSide])> {
        let mut begin = 0;
        self.couplings.iter().map(move |rows| {
            let sides = &self.sides[begin..rows.end];
            begin = rows.end;
            (rows, sides)
        })
    }

    /// Tests if the system determines the impulses of all rows, and sets the number of further
    /// solves (G19).
    ///
    /// Random impulses are relaxed by
    ///
    /// ```text
    /// δp̂ ← D (J δV − ε δp̂),   K δV = −ε Σ H D δp̂
    /// ```
    ///
    /// Determined impulses shrink in every pass. Random numbers miss no direction. One solve and
    /// one refinement leave the square of this reduction.
    pub(super) fn is_determined(
        &mut self,
        island: &Island,
        columns: &mut RefinedColumns<1>,
        system: &mut IslandSystem,
    ) -> bool {
        /// Largest remainder of the random impulses after the first solve and after the last.
        const FEW: f64 = 1e-5;
        const LEFT: f64 = 1e-10;
        /// Required reduction per pass.
        const LESS: f64 = 0.1;
        /// Largest number of solves after the first.
        const MOST: usize = 12;
        columns.begin(self.turning.len(), island.couplings().len());
        let mut rng = Rng::default();
        for rows in &self.couplings {
            columns.motions[rows.index] = SMatrix::from_fn(|_, _| rng.next());
        }
        let mut before = f64::INFINITY;
        for passes in 0..=MOST {
            let left = columns.relax_rows(self, island, system);

            if left <= if passes == 0 { FEW } else { LEFT } {
                self.passes = passes.max(1);
                return true;
            }
            // No equation determines a remainder that does not shrink.
            if left > LESS * before {
                return false;
            }
            before = left;
        }
        false
    }
}

/// Random numbers from −½ to ½ (SplitMix64: G. L. Steele, D. Lea, C. H. Flood, 2014).
///
/// No small subset sums to zero. Multiples of a fixed angle would: a − b − c + d vanishes for four
/// of them, as for the impulses that a face's corners can share.
#[derive(Default)]
pub(super) struct Rng(u64);

impl Rng {
    pub(super) fn next(&mut self) -> f64 {
        self.0 = self.0.wrapping_add(0x9E37_79B9_7F4A_7C15);
        let mixed = (self.0 ^ (self.0 >> 30)).wrapping_mul(0xBF58_476D_1CE4_E5B9);
        let mixed = (mixed ^ (mixed >> 27)).wrapping_mul(0x94D0_49BB_1331_11EB);
        let bits = (mixed ^ (mixed >> 31)) >> 32;
        bits as f64 / f64::from(u32::MAX) - 0.5
    }
}

impl StiffSide {
    /// Adds the motion along the rows for a change of the body's velocities.
    #[inline(always)]
    fn add_row_motion(&self, change: &[f64; 6], along: &mut [f64; 3]) {
        for (column, change) in self.rows.data.0.iter().zip(change) {
            (0..3).for_each(|k| along[k] += column[k] * change);
        }
    }

    /// Adds the right-hand side of motions along the rows.
    #[inline(always)]
    fn add_body_load(&self, along: &[f64; 3], rhs: &mut [f64; 6]) {
        for (column, along) in self.effect.data.0.iter().zip(along) {
            (0..6).for_each(|k| rhs[k] += column[k] * along);
        }
    }
}

/// Right-hand sides by body and coupling, their solutions and scratch, for C columns.
#[derive(Debug, Clone)]
pub(super) struct RefinedColumns<const C: usize> {
    /// b, or c of the transposed system; then its residual.
    pub(super) rhs: Vec<SMatrix<f64, 6, C>>,
    /// m of every coupling along its rows (m/s), or λ.
    pub(super) motions: Vec<SMatrix<f64, 3, C>>,
    /// δV, or y.
    pub(super) solved: Vec<SMatrix<f64, 6, C>>,
    values: Vec<SMatrix<f64, 6, C>>,
    /// Copy of b or c, for more than one further solve.
    begun: Vec<SMatrix<f64, 6, C>>,
    /// s of (G19), or its derivative.
    given: Vec<SMatrix<f64, 3, C>>,
}

impl<const C: usize> RefinedColumns<C> {
    pub(super) fn new() -> Self {
        let (rhs, solved, values, begun) = (Vec::new(), Vec::new(), Vec::new(), Vec::new());
        Self { rhs, motions: Vec::new(), solved, values, begun, given: Vec::new() }
    }

    /// Resets the right-hand sides to zero.
    pub(super) fn begin(&mut self, members: usize, couplings: usize) {
        self.rhs.clear();
        self.rhs.resize(members, SMatrix::zeros());
        self.motions.clear();
        self.motions.resize(couplings, SMatrix::zeros());
    }

    /// Adds the changes of a coupling's rows.
    pub(super) fn add(&mut self, island: &Island, coupling: usize, change: &RowsChange<C>) {
        self.motions[coupling] += change.motion;
        if change.impulse != SMatrix::<f64, 3, C>::zeros() {
            island.add_impulses(coupling, &change.impulse, &mut self.rhs);
        }
        island.add_torques(coupling, &change.torques, &mut self.rhs);
    }

    /// Solves for bodies without couplings.
    pub(super) fn solve_uncoupled(&mut self, inverse: &Matrix3<f64>) {
        self.solved.clone_from(&self.rhs);
        for solved in &mut self.solved {
            let turned = inverse * solved.fixed_rows::<3>(3);
            solved.fixed_rows_mut::<3>(3).copy_from(&turned);
        }
    }

    /// Writes b + Σ H D m to the solution's memory.
    fn add_motion_loads(&mut self, stiff: &StiffTerms) {
        let Self { rhs, motions, solved, .. } = self;
        solved.clone_from(rhs);
        for (rows, sides) in stiff.couplings() {
            for (column, motion) in motions[rows.index].data.0.iter().enumerate() {
                if *motion != [0.0; 3] {
                    for side in sides {
                        side.add_body_load(motion, &mut solved[side.body].data.0[column]);
                    }
                }
            }
        }
    }

    /// Relaxes the rows from impulses δp̂, given as motions −ε δp̂. Leaves the motions of the
    /// remainder and returns its largest entry.
    fn relax_rows(
        &mut self,
        stiff: &StiffTerms,
        island: &Island,
        system: &mut IslandSystem,
    ) -> f64 {
        self.rhs.iter_mut().for_each(|rhs| rhs.fill(0.0));
        self.add_motion_loads(stiff);
        let Self { motions, solved, values, .. } = self;
        island.solve_all(system, solved, values);
        let mut largest = 0.0_f64;
        for (rows, sides) in stiff.couplings() {
            for (column, motion) in motions[rows.index].data.0.iter_mut().enumerate() {
                for side in sides {
                    side.add_row_motion(&solved[side.body].data.0[column], motion);
                }
                *motion = (rows.compliance_matrix * -Vector3::from(*motion)).into();
                largest = motion.iter().fold(largest, |most, x| most.max(x.abs()));
            }
        }
        largest
    }

    /// Solves for δV.
    pub(super) fn solve(&mut self, island: &Island, stiff: &StiffTerms, system: &mut IslandSystem) {
        // x = K⁻¹(b + Σ H D m) (G11)
        self.add_motion_loads(stiff);
        let Self { rhs, motions, solved, values, begun, given } = self;
        island.solve_all(system, solved, values);
        let goes_on = stiff.passes > 1;
        if goes_on {
            given.clear();
            given.resize(motions.len(), SMatrix::zeros());
            begun.clone_from(rhs);
        }
        for pass in 0..stiff.passes {
            if pass > 0 {
                rhs.clone_from(begun);
            }
            // b − A x
            for ((rhs, x), turning) in rhs.iter_mut().zip(&*solved).zip(&stiff.turning) {
                for (rhs, x) in rhs.data.0.iter_mut().zip(&x.data.0) {
                    let turned = turning * Vector3::new(x[3], x[4], x[5]);
                    for k in 0..3 {
                        rhs[k] -= x[k];
                        rhs[3 + k] -= turned[k];
                    }
                }
            }
            // Σ H D (m + J x), with compliance on changes only (G14), or for more passes (G19)
            for (rows, sides) in stiff.couplings() {
                for (column, motion) in motions[rows.index].data.0.iter().enumerate() {
                    let mut along = *motion;
                    for side in sides {
                        side.add_row_motion(&solved[side.body].data.0[column], &mut along);
                    }
                    let along = Vector3::from(along);
                    let mut by = along;
                    if goes_on {
                        let given = &mut given[rows.index].data.0[column];
                        by -= rows.compliance_matrix * Vector3::from(*given);
                        *given = by.into();
                    }
                    let along: [f64; 3] = (along - rows.compliance_matrix * by).into();
                    for side in sides {
                        side.add_body_load(&along, &mut rhs[side.body].data.0[column]);
                    }
                }
            }
            island.solve_all(system, rhs, values);
            solved.iter_mut().zip(&*rhs).for_each(|(x, more)| *x += more);
        }
    }
}

impl RefinedColumns<1> {
    /// Largest motion of a stiff row that the solution does not cancel (m/s).
    pub(super) fn residual_of_stiff_rows(&self, stiff: &StiffTerms) -> f64 {
        let left = |(rows, sides): (&StiffCoupling, &[StiffSide])| {
            let mut along: [f64; 3] = self.motions[rows.index].into();
            sides.iter().for_each(|side| {
                side.add_row_motion(&self.solved[side.body].data.0[0], &mut along)
            });
            Vector3::from(along).component_mul(&rows.stiffness).amax()
        };
        stiff.couplings().map(left).fold(0.0, f64::max)
    }

    /// Solves the transposed system for y. λ replaces the motions.
    pub(super) fn solve_transposed(
        &mut self,
        island: &Island,
        stiff: &StiffTerms,
        system: &mut IslandSystem,
    ) {
        let Self { rhs, motions, solved, values, begun: z, given } = self;
        let pulled = |sides: &[StiffSide], values: &[Vector6<f64>]| -> Vector3<f64> {
            sides.iter().map(|side| side.effect.tr_mul(&values[side.body])).sum()
        };
        solved.clear();
        solved.resize(rhs.len(), Vector6::zeros());
        motions.iter_mut().for_each(|by| *by = Vector3::zeros());
        given.clear();
        given.resize(motions.len(), Vector3::zeros());
        // From the last solve to the second. The right-hand side is the dependence on the solve
        // before.
        for _ in 0..stiff.passes {
            z.clone_from(rhs);
            island.solve_transposed(system, z, values);
            solved.iter_mut().zip(&*z).for_each(|(sum, z)| *sum += z);
            for ((rhs, z), turning) in rhs.iter_mut().zip(&*z).zip(&stiff.turning) {
                let turned = turning.tr_mul(&z.fixed_rows::<3>(3));
                *rhs -= Vector6::new(z[0], z[1], z[2], turned[0], turned[1], turned[2]);
            }
            for (rows, sides) in stiff.couplings() {
                let by = pulled(sides, z);
                let by_given = given[rows.index] - rows.compliance_matrix.tr_mul(&by);
                given[rows.index] = rows.compliance_matrix.tr_mul(&-by_given);
                let by = by + by_given;
                sides.iter().for_each(|side| rhs[side.body] += side.rows.tr_mul(&by));
                motions[rows.index] += by;
            }
        }
        island.solve_transposed(system, rhs, values);
        for (rows, sides) in stiff.couplings() {
            motions[rows.index] += pulled(sides, rhs);
        }
        solved.iter_mut().zip(&*rhs).for_each(|(sum, z)| *sum += z);
    }

    /// Derivatives with respect to changes of a coupling's rows, from the transposed solution.
    pub(super) fn rows_vjp(&self, island: &Island, coupling: usize) -> RowsChange<1> {
        RowsChange {
            motion: self.motions[coupling],
            impulse: island.impulse_vjp(coupling, &self.solved),
            torques: island.torques_vjp(coupling, &self.solved),
        }
    }
}

#[cfg(test)]
#[path = "tests/refined.rs"]
mod tests;
