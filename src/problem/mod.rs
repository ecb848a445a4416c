//! Standalone contact problems, and their text format in Siconos.
//!
//! See [`ContactProblem`]. [`dat`] parses and formats text; it does not open files.

pub mod dat;

pub use tumble_core::problem::{
    ContactProblem, DEFAULT_RESIDUAL, Evaluation, Form, Global, Law, ProblemError, RowLaw,
    Selection, Solution, SolveOptions, SparseMatrix,
};
