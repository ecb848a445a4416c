//! Contact problems by themselves, and the text in which Siconos keeps them.
//!
//! What is said of [`ContactProblem`] holds here; [`dat`] reads and writes text, and opens no file.

pub mod dat;

pub use tumble_core::problem::{
    ContactProblem, DEFAULT_RESIDUAL, Evaluation, Form, Global, Law, ProblemError, RowLaw,
    Selection, Solution, SolveOptions, SparseMatrix,
};
