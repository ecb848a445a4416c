//! The contact problem by itself: given by matrices, whoever made them, and solved by what solves the
//! contacts of a step.
//!
//! Two forms are known, those of the FCLIB collection. With impulses p and velocities u along the rows,
//!
//! ```text
//! u = W p + q                                   local                      (C1)
//! M v = H p + f,   u = Hᵀ v + w                 global                     (C2)
//! ```
//!
//! and the rows, group by group, under a [`Law`]: a contact with its normal row first and one or two
//! tangents behind it, or rows of joints. What is solved is Coulomb's exact law, not its convex relaxation.
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
mod of_step;
mod solution;
mod wide;

pub use error::ProblemError;
pub use law::{Law, RowLaw};
pub use matrix::SparseMatrix;
pub use measure::Evaluation;
pub use solution::{DEFAULT_RESIDUAL, Selection, Solution, SolveOptions};

pub(crate) use mass::{MassMatrix, Sets};
pub(crate) use measure::three;

use error::{all_in_range, length};

/// A matrix counts as symmetric up to this part of its largest entry: published problems are rounded, or
/// of a scheme that is not quite symmetric. It is solved as it is given.
const SYMMETRIC: f64 = 1e-2;
/// The largest entry of W or M is no less, but for a W that is zero.
const LEAST: f64 = 1e-100;
/// Two rows of a matrix count as semidefinite up to this part of their diagonals.
const SEMIDEFINITE: f64 = 1e-3;

/// A contact problem: matrices, vectors, and the law of every group of rows.
#[derive(Debug, Clone)]
pub struct ContactProblem {
    form: Form,
    laws: Vec<Law>,
    /// Where the rows of each group begin; one more at the end.
    starts: Vec<usize>,
}

/// How a problem is given.
#[derive(Debug, Clone)]
pub enum Form {
    /// u = W p + q (C1).
    Local {
        /// W: what an impulse does to the velocities, in 1/kg.
        response: SparseMatrix,
        /// q: the velocities without impulses, m/s.
        free: Vec<f64>,
    },
    /// M v = H p + f, u = Hᵀ v + w (C2).
    Global(Box<Global>),
}

/// The global form.
#[derive(Debug, Clone)]
pub struct Global {
    /// M, kg for what moves along a line.
    pub mass: SparseMatrix,
    /// H: a row for each number of the velocities, a column for each row of the laws.
    pub directions: SparseMatrix,
    /// f: the momentum without impulses, kg m/s.
    pub momentum: Vec<f64>,
    /// w, m/s.
    pub offset: Vec<f64>,
    factors: MassMatrix,
}

impl Global {
    /// M, taken apart and factorised.
    pub(crate) fn factors(&self) -> &MassMatrix {
        &self.factors
    }
}

impl ContactProblem {
    /// The local form (C1): W in 1/kg, q in m/s, and the laws of the rows in their order.
    ///
    /// # Errors
    /// Sizes that do not fit together; a number that is not finite, or larger than 1e100; a W whose largest entry is less
    /// than 1e-100 and not zero, that is not symmetric (to 1 % of its largest entry), or that two of its rows show not to
    /// be positive semidefinite.
    pub fn local(
        response: SparseMatrix,
        free: Vec<f64>,
        laws: Vec<Law>,
    ) -> Result<Self, ProblemError> {
        let starts = starts_of(&laws);
        let rows = starts[laws.len()];
        square("W", &response, rows)?;
        length("q", free.len(), rows)?;
        all_in_range("a number of q", &free)?;
        is_semidefinite("W", &response)?;
        Ok(Self { form: Form::Local { response, free }, laws, starts })
    }

    /// The global form (C2): M in kg, H, f in kg m/s, w in m/s, and the laws of the columns of H in
    /// their order.
    ///
    /// # Errors
    /// Sizes that do not fit together; a number that is not finite, or larger than 1e100; an M whose largest entry is less
    /// than 1e-100, that is not symmetric (to 1 % of its largest entry), or not positive definite.
    pub fn global(
        mass: SparseMatrix,
        directions: SparseMatrix,
        momentum: Vec<f64>,
        offset: Vec<f64>,
        laws: Vec<Law>,
    ) -> Result<Self, ProblemError> {
        let starts = starts_of(&laws);
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

    /// How it is given.
    #[must_use]
    pub fn form(&self) -> &Form {
        &self.form
    }

    /// The law of every group of rows.
    #[must_use]
    pub fn laws(&self) -> &[Law] {
        &self.laws
    }

    /// The rows of a group; none of a group that is not there.
    #[must_use]
    pub fn rows(&self, group: usize) -> std::ops::Range<usize> {
        match self.starts.get(group..group + 2) {
            Some(ends) => ends[0]..ends[1],
            None => 0..0,
        }
    }

    /// The group that a row is of.
    pub(crate) fn group_of(&self, row: usize) -> usize {
        self.starts.partition_point(|start| *start <= row) - 1
    }

    /// How many rows there are: numbers in p and u.
    #[must_use]
    pub fn row_count(&self) -> usize {
        self.starts[self.laws.len()]
    }

    /// How many numbers the velocities v of the global form have; 0 of the local one.
    #[must_use]
    pub fn velocity_count(&self) -> usize {
        match &self.form {
            Form::Local { .. } => 0,
            Form::Global(global) => global.mass.rows(),
        }
    }

    /// 2 or 3 where all groups are contacts with so many rows, as the files of others have it.
    #[must_use]
    pub fn dimension(&self) -> Option<usize> {
        let first = self.laws.first()?.rows();
        let alike = |law: &Law| matches!(law, Law::Contact { .. }) && law.rows() == first;
        self.laws.iter().all(alike).then_some(first)
    }

    /// The same motion in the local form: W = Hᵀ M⁻¹ H, q = Hᵀ M⁻¹ f + w. The local form is itself.
    ///
    /// # Errors
    /// None that the checks of the global form leave; those of [`local`](Self::local).
    pub fn to_local(&self) -> Result<Self, ProblemError> {
        let Form::Global(global) = &self.form else { return Ok(self.clone()) };
        let (response, free) = global.condensed()?;
        Self::local(response, free, self.laws.clone())
    }

    /// Solves it.
    ///
    /// Where nothing solves it, the [solution](Solution) says so, and has the best point that was found, no impulses among them. Coefficients of
    /// friction beyond 1000 are lowered first. Not all problems with coefficients beyond 10⁵ are solved.
    ///
    /// # Errors
    /// Options that cannot be; a start that has not as many numbers as there are rows; an interrupt.
    pub fn solve(&self, options: &SolveOptions<'_>) -> Result<Solution, ProblemError> {
        options.check(self)?;
        self.solve_in_turn(options)
    }
}

impl Global {
    /// W and q of the local form.
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

/// Where the rows of each group begin; one more at the end.
fn starts_of(laws: &[Law]) -> Vec<usize> {
    let mut starts = Vec::with_capacity(laws.len() + 1);
    starts.push(0);
    for law in laws {
        starts.push(starts[starts.len() - 1] + law.rows());
    }
    starts
}

/// Refuses a matrix that is not `wanted` × `wanted`, too small to be divided by, or not symmetric.
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

/// Refuses a matrix that is not positive semidefinite as far as two rows show it: A_ii ≥ 0 and
/// A_ij² ≤ A_ii A_jj.
fn is_semidefinite(what: &'static str, matrix: &SparseMatrix) -> Result<(), ProblemError> {
    let diagonal: Vec<f64> = (0..matrix.rows()).map(|k| matrix.at(k, k)).collect();
    let largest = diagonal.iter().fold(0.0_f64, |most, value| most.max(value.abs()));
    for (row, column, value) in matrix.triplets() {
        let mean = 0.5 * (value + matrix.at(column, row));
        let (i, j) = (diagonal[row], diagonal[column]);
        // What is negative by rounding counts as zero.
        let bound = i.max(0.0).sqrt() * j.max(0.0).sqrt() * (1.0 + SEMIDEFINITE) + 1e-9 * largest;
        let is_negative = row == column && value < -1e-9 * largest;
        if is_negative || mean.abs() > bound {
            return Err(ProblemError::Indefinite { what, row, column });
        }
    }
    Ok(())
}
