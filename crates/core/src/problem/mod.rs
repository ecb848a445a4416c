//! Stand-alone contact problems, given by matrices and solved by the contact solver of a step.
//!
//! Two forms are supported, those of the FCLIB collection. With impulses p and velocities u along
//! the rows,
//!
//! ```text
//! u = W p + q                                   local                      (C1)
//! M v = H p + f,   u = Hᵀ v + w                 global                     (C2)
//! ```
//!
//! Each group of rows has a [`Law`]: a contact, with its normal row followed by one or two
//! tangents, the moment of a contact, or rows of joints. The solver handles Coulomb's exact law, not
//! its convex relaxation.
//!
//! ```
//! use tumble_core::problem::{ContactProblem, Law, SolveOptions, SparseMatrix};
//!
//! // A mass of 2 kg slides at 3 m/s and would fall at 1 m/s; μ is 0.5.
//! let response = SparseMatrix::from_triplets(3, 3, (0..3).map(|k| (k, k, 0.5)))?;
//! let laws = vec![Law::contact(3, 0.5)?];
//! let problem = ContactProblem::local(response, vec![-1.0, 3.0, 0.0], laws)?;
//! let solution = problem.solve(&SolveOptions::default())?;
//! // 2 N s stop the fall, and friction takes 1 N s from the slide.
//! assert!(solution.is_solved());
//! assert!((solution.impulses[0] - 2.0).abs() < 1e-9);
//! assert!((solution.impulses[1] + 1.0).abs() < 1e-9);
//! assert!((solution.velocities[1] - 2.5).abs() < 1e-9);
//! # Ok::<(), tumble_core::problem::ProblemError>(())
//! ```
//!
//! Equation numbers C1, C2, … are those of `docs/contact-problem.md`.

mod error;
mod law;
mod mass;
mod matrix;
mod measure;
mod solution;

pub use error::ProblemError;
pub use law::{Law, RowLaw};
pub use matrix::SparseMatrix;
pub use measure::Evaluation;
pub use solution::{DEFAULT_RESIDUAL, Selection, Solution, SolveOptions};

pub(crate) use mass::MassMatrix;
pub(crate) use measure::three;

use error::{all_in_range, length};

/// Largest relative asymmetry of a matrix. Published problems are rounded, or come from slightly
/// asymmetric schemes. They are solved as given.
const SYMMETRIC: f64 = 1e-2;
/// Smallest value of the largest entry of W or M. W may also be zero.
const LEAST: f64 = 1e-100;
/// Relative tolerance of the semidefiniteness test for two rows.
const SEMIDEFINITE: f64 = 1e-3;

/// Contact problem: matrices, vectors, and the law of every group of rows.
#[derive(Debug, Clone)]
pub struct ContactProblem {
    form: Form,
    laws: Vec<Law>,
    /// First row of each group, and the number of rows at the end.
    starts: Vec<usize>,
}

/// Form of a problem.
#[derive(Debug, Clone)]
pub enum Form {
    /// Local form u = W p + q (C1).
    Local {
        /// Delassus matrix W (1/kg): velocities per impulse.
        response: SparseMatrix,
        /// Velocities q without impulses (m/s).
        free: Vec<f64>,
    },
    /// Global form M v = H p + f, u = Hᵀ v + w (C2).
    Global(Box<Global>),
}

/// Matrices of the global form.
#[derive(Debug, Clone)]
pub struct Global {
    /// Mass matrix M (kg for translations).
    pub mass: SparseMatrix,
    /// Directions H: one row per velocity component, one column per row of the laws.
    pub directions: SparseMatrix,
    /// Momentum f without impulses (kg m/s).
    pub momentum: Vec<f64>,
    /// Velocity offset w (m/s).
    pub offset: Vec<f64>,
    factors: MassMatrix,
}

impl Global {
    /// Factorised blocks of M.
    pub(crate) fn factors(&self) -> &MassMatrix {
        &self.factors
    }
}

impl ContactProblem {
    /// Creates a problem in local form (C1) from W (1/kg), q (m/s) and the laws of the rows in
    /// their order.
    ///
    /// # Errors
    /// If sizes do not match, or if a number is not finite or larger than 1e100. W must have a
    /// largest entry of at least 1e-100 or be zero, and be symmetric to 1 % of its largest entry.
    /// It must be positive semidefinite in every pair of rows.
    pub fn local(
        response: SparseMatrix,
        free: Vec<f64>,
        laws: Vec<Law>,
    ) -> Result<Self, ProblemError> {
        let starts = starts_of(&laws)?;
        let rows = starts[laws.len()];
        square("W", &response, rows)?;
        length("q", free.len(), rows)?;
        all_in_range("a number of q", &free)?;
        is_semidefinite("W", &response)?;
        Ok(Self { form: Form::Local { response, free }, laws, starts })
    }

    /// Creates a problem in global form (C2) from M (kg), H, f (kg m/s), w (m/s) and the laws of
    /// the columns of H in their order.
    ///
    /// # Errors
    /// If sizes do not match, or if a number is not finite or larger than 1e100. M must have a
    /// largest entry of at least 1e-100, be symmetric to 1 % of its largest entry, and be positive
    /// definite.
    pub fn global(
        mass: SparseMatrix,
        directions: SparseMatrix,
        momentum: Vec<f64>,
        offset: Vec<f64>,
        laws: Vec<Law>,
    ) -> Result<Self, ProblemError> {
        let starts = starts_of(&laws)?;
        let rows = starts[laws.len()];
        square("M", &mass, directions.rows())?;
        length("columns of H", directions.columns(), rows)?;
        length("f", momentum.len(), directions.rows())?;
        length("w", offset.len(), rows)?;
        all_in_range("a number of f", &momentum)?;
        all_in_range("a number of w", &offset)?;
        is_semidefinite("M", &mass)?;
        let factors = MassMatrix::new(&mass)?;
        let global = Global { mass, directions, momentum, offset, factors };
        Ok(Self { form: Form::Global(Box::new(global)), laws, starts })
    }

    /// Form of the problem.
    pub fn form(&self) -> &Form {
        &self.form
    }

    /// Law of every group of rows.
    pub fn laws(&self) -> &[Law] {
        &self.laws
    }

    /// Rows of a group; empty for a group that does not exist.
    pub fn rows(&self, group: usize) -> std::ops::Range<usize> {
        match self.starts.get(group..group + 2) {
            Some(ends) => ends[0]..ends[1],
            None => 0..0,
        }
    }

    pub(crate) fn group_of(&self, row: usize) -> usize {
        self.starts.partition_point(|start| *start <= row) - 1
    }

    /// Copy with coefficients of friction of at most `most`.
    pub(crate) fn with_friction_up_to(&self, most: f64) -> Self {
        let laws = self.laws.iter().map(|law| law.with_friction_up_to(most)).collect();
        Self { laws, ..self.clone() }
    }

    /// Number of rows, the length of p and u.
    pub fn row_count(&self) -> usize {
        self.starts[self.laws.len()]
    }

    /// Length of the velocities v of the global form; 0 for the local form.
    pub fn velocity_count(&self) -> usize {
        match &self.form {
            Form::Local { .. } => 0,
            Form::Global(global) => global.mass.rows(),
        }
    }

    /// Dimension 2 or 3 if all groups are contacts with that many rows, as FCLIB files require.
    pub fn dimension(&self) -> Option<usize> {
        let first = self.laws.first()?.rows();
        let alike = |law: &Law| matches!(law, Law::Contact { .. }) && law.rows() == first;
        self.laws.iter().all(alike).then_some(first)
    }

    /// Converts to the local form: W = Hᵀ M⁻¹ H, q = Hᵀ M⁻¹ f + w. A local problem is copied.
    ///
    /// # Errors
    /// Those of [`local`](Self::local), which do not occur for a checked global form.
    pub fn to_local(&self) -> Result<Self, ProblemError> {
        let Form::Global(global) = &self.form else { return Ok(self.clone()) };
        let (response, free) = global.condensed()?;
        Self::local(response, free, self.laws.clone())
    }
}

impl Global {
    /// Matrices W and q of the local form.
    fn condensed(&self) -> Result<(SparseMatrix, Vec<f64>), ProblemError> {
        let (count, size) = (self.directions.columns(), self.mass.rows());
        let by_row = {
            let turned =
                self.directions.triplets().map(|(row, column, value)| (column, row, value));
            SparseMatrix::from_triplets(count, size, turned)?
        };
        let mut entries = Vec::new();
        let (mut moved, mut sums) = (vec![0.0; size], vec![0.0; count]);
        for column in 0..count {
            let touched = self.factors.solve_sparse(self.directions.column(column), &mut moved);
            let mut rows = Vec::new();
            for &place in &touched {
                for (row, value) in by_row.column(place) {
                    if sums[row] == 0.0 {
                        rows.push(row);
                    }
                    sums[row] += value * moved[place];
                }
                moved[place] = 0.0;
            }
            for row in rows {
                if sums[row] != 0.0 {
                    entries.push((row, column, sums[row]));
                    sums[row] = 0.0;
                }
            }
        }
        let mut velocity = self.momentum.clone();
        self.factors.solve(&mut velocity);
        let mut free = self.offset.clone();
        self.directions.add_transposed_product(&velocity, &mut free);
        Ok((SparseMatrix::from_triplets(count, count, entries)?, free))
    }
}

/// First row of each group, and the number of rows at the end. Rejects moments without a contact.
fn starts_of(laws: &[Law]) -> Result<Vec<usize>, ProblemError> {
    let mut starts = Vec::with_capacity(laws.len() + 1);
    starts.push(0);
    for (group, law) in laws.iter().enumerate() {
        if let Law::Moment { contact, .. } = law
            && !matches!(laws[..group].get(*contact), Some(Law::Contact { .. }))
        {
            let what = "the group of a moment's contact";
            let allowed = "contacts before the moment";
            return Err(ProblemError::OutOfRange { what, value: *contact as f64, allowed });
        }
        starts.push(starts[starts.len() - 1] + law.rows());
    }
    Ok(starts)
}

/// Rejects a matrix that is not `wanted` × `wanted`, has too small entries, or is not symmetric.
fn square(what: &'static str, matrix: &SparseMatrix, wanted: usize) -> Result<(), ProblemError> {
    if (matrix.rows(), matrix.columns()) != (wanted, wanted) {
        let (rows, columns) = (matrix.rows(), matrix.columns());
        return Err(ProblemError::Shape { what, rows, columns, wanted });
    }
    let largest = matrix.largest();
    if largest > 0.0 && largest < LEAST {
        let (what, allowed) = match what {
            "M" => ("the largest entry of M", "1e-100 to 1e100"),
            _ => ("the largest entry of W", "1e-100 to 1e100, or 0"),
        };
        return Err(ProblemError::OutOfRange { what, value: largest, allowed });
    }
    let (apart, row, column) = matrix.asymmetry();
    if apart > SYMMETRIC {
        return Err(ProblemError::Asymmetric { what, row, column });
    }
    Ok(())
}

/// Rejects a matrix that is not positive semidefinite in a pair of rows: A_ii ≥ 0 and A_ij² ≤ A_ii
/// A_jj.
fn is_semidefinite(what: &'static str, matrix: &SparseMatrix) -> Result<(), ProblemError> {
    let diagonal: Vec<f64> = (0..matrix.rows()).map(|k| matrix.at(k, k)).collect();
    let largest = diagonal.iter().fold(0.0_f64, |most, value| most.max(value.abs()));
    for (row, column, value) in matrix.triplets() {
        let mean = 0.5 * (value + matrix.at(column, row));
        let (i, j) = (diagonal[row], diagonal[column]);
        // A value that is negative by rounding counts as zero.
        let bound = i.max(0.0).sqrt() * j.max(0.0).sqrt() * (1.0 + SEMIDEFINITE) + 1e-9 * largest;
        let is_negative = row == column && value < -1e-9 * largest;
        if is_negative || mean.abs() > bound {
            return Err(ProblemError::Indefinite { what, row, column });
        }
    }
    Ok(())
}
