//! Standalone contact problems.

use crate::arrays::{Array, Numbers, list, numbers};
use crate::errors::refused;
use crate::watch::Watched;
use pyo3::exceptions::PyKeyboardInterrupt;
use pyo3::prelude::*;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, AtomicU64};
use tumble::problem::{
    ContactProblem, Form, Law, ProblemError, RowLaw, Selection, Solution, SolveOptions,
    SparseMatrix, dat,
};

/// Sparse matrix: numbers of rows and columns, then row, column and value of its entries.
type ProblemEntries<'py> = (usize, usize, Vec<usize>, Vec<usize>, Numbers<'py>);
/// Law of a group: μ, or names of row laws with two numbers each. The rows of a moment have the group of its
/// contact and their limit.
type GivenLaw = (Option<f64>, Vec<(String, f64, f64)>);

/// Number of rows from which a problem is solved on its own thread, so that Ctrl-C can end it.
const LONG: usize = 300;

/// A contact problem in the library's memory.
#[pyclass(frozen, name = "CoreProblem", module = "tumble._tumble")]
pub struct CoreProblem {
    content: ContactProblem,
}

fn problem_error(error: &ProblemError) -> PyErr {
    match error {
        ProblemError::Interrupted => PyKeyboardInterrupt::new_err(()),
        other => refused(other),
    }
}

fn matrix(
    name: &str,
    (rows, columns, at, along, values): &ProblemEntries<'_>,
) -> PyResult<SparseMatrix> {
    let values = numbers(name, values)?;
    if at.len() != values.len() || along.len() != values.len() {
        return Err(refused(format!("{name}: one row and one column per entry are needed")));
    }
    let entries =
        at.iter().zip(along).zip(values).map(|((row, column), value)| (*row, *column, *value));
    SparseMatrix::from_triplets(*rows, *columns, entries).map_err(|error| problem_error(&error))
}

fn laws(dimension: usize, given: Vec<GivenLaw>) -> PyResult<Vec<Law>> {
    let of_row = |(name, least, most): &(String, f64, f64)| match name.as_str() {
        "free" => Ok(RowLaw::Free),
        "locked" => Ok(RowLaw::Locked),
        "limit" => Ok(RowLaw::Limit),
        "box" => Ok(RowLaw::Box { least: *least, most: *most }),
        other => {
            Err(refused(format!("laws: {other:?} is unknown; use free, locked, limit or box")))
        }
    };
    let of_group = |(friction, rows): GivenLaw| {
        let law = match (friction, &rows[..]) {
            (Some(friction), _) => Law::contact(dimension, friction),
            (None, [(kind, contact, rolling), _, (_, _, torsional)]) if kind == "rolling" => {
                Law::moment(*contact as usize, *rolling, *torsional)
            }
            (None, rows) => Law::rows_of(rows.iter().map(of_row).collect::<PyResult<_>>()?),
        };
        law.map_err(|error| problem_error(&error))
    };
    given.into_iter().map(of_group).collect()
}

#[pymethods]
impl CoreProblem {
    /// Creates a local problem of W, q and the laws.
    #[staticmethod]
    fn local(
        w: ProblemEntries<'_>,
        q: Numbers<'_>,
        dimension: usize,
        groups: Vec<GivenLaw>,
    ) -> PyResult<Self> {
        let (response, free) = (matrix("W", &w)?, numbers("q", &q)?.to_vec());
        let content = ContactProblem::local(response, free, laws(dimension, groups)?);
        content.map(|content| Self { content }).map_err(|error| problem_error(&error))
    }

    /// Creates a global problem of M, H, f, w and the laws.
    #[staticmethod]
    fn from_bodies(
        m: ProblemEntries<'_>,
        h: ProblemEntries<'_>,
        f: Numbers<'_>,
        w: Numbers<'_>,
        dimension: usize,
        groups: Vec<GivenLaw>,
    ) -> PyResult<Self> {
        let (mass, directions) = (matrix("M", &m)?, matrix("H", &h)?);
        let (momentum, offset) = (numbers("f", &f)?.to_vec(), numbers("w", &w)?.to_vec());
        let laws = laws(dimension, groups)?;
        let content = ContactProblem::global(mass, directions, momentum, offset, laws);
        content.map(|content| Self { content }).map_err(|error| problem_error(&error))
    }

    /// Parses the text format of Siconos.
    #[staticmethod]
    fn from_dat(text: &str) -> PyResult<Self> {
        dat::read(text).map(|content| Self { content }).map_err(refused)
    }

    /// Formats the problem in the text format of Siconos.
    fn to_dat(&self) -> PyResult<String> {
        dat::write(&self.content).map_err(|error| problem_error(&error))
    }

    /// Converts the problem to the local form.
    fn to_local(&self) -> PyResult<Self> {
        let local = self.content.to_local().map_err(|error| problem_error(&error))?;
        Ok(Self { content: local })
    }

    /// True if the problem has the local form.
    #[getter]
    fn is_local(&self) -> bool {
        matches!(self.content.form(), Form::Local { .. })
    }

    /// Number of rows of every group.
    #[getter]
    fn sizes(&self) -> Vec<usize> {
        self.content.laws().iter().map(Law::rows).collect()
    }

    /// Friction coefficient μ of every group, None for groups that are not contacts.
    #[getter]
    fn friction(&self) -> Vec<Option<f64>> {
        let of = |law: &Law| match law {
            Law::Contact { friction, .. } => Some(*friction),
            Law::Moment { .. } | Law::Rows(_) => None,
        };
        self.content.laws().iter().map(of).collect()
    }

    /// Entries of W, M or H: numbers of rows and columns, then rows, columns and values of the
    /// non-zeros.
    #[allow(clippy::type_complexity)]
    fn entries<'py>(
        &self,
        py: Python<'py>,
        name: &str,
    ) -> PyResult<(usize, usize, Vec<usize>, Vec<usize>, Array<'py>)> {
        let matrix = match (self.content.form(), name) {
            (Form::Local { response, .. }, "W") => response,
            (Form::Global(global), "M") => &global.mass,
            (Form::Global(global), "H") => &global.directions,
            (Form::Local { .. }, _) => return Err(refused("a local problem has only W and q")),
            (Form::Global(_), _) => {
                return Err(refused("a global problem has only M, H, f and w"));
            }
        };
        Ok((
            matrix.rows(),
            matrix.columns(),
            matrix.triplets().map(|entry| entry.0).collect(),
            matrix.triplets().map(|entry| entry.1).collect(),
            list(py, matrix.triplets().map(|entry| entry.2).collect())?,
        ))
    }

    /// Vector q, f or w.
    fn vector<'py>(&self, py: Python<'py>, name: &str) -> PyResult<Array<'py>> {
        let vector = match (self.content.form(), name) {
            (Form::Local { free, .. }, "q") => free,
            (Form::Global(global), "f") => &global.momentum,
            (Form::Global(global), "w") => &global.offset,
            (Form::Local { .. }, _) => return Err(refused("a local problem has only W and q")),
            (Form::Global(_), _) => {
                return Err(refused("a global problem has only M, H, f and w"));
            }
        };
        list(py, vector.clone())
    }

    /// Solves the problem. Returns the arrays (impulses, u, v), the errors (residual, relative
    /// error), the counts (iterations, parts), the name of the start, and True if the selection
    /// rule determined the solution.
    #[allow(clippy::type_complexity)]
    fn solve<'py>(
        &self,
        py: Python<'py>,
        residual: f64,
        start: Option<Numbers<'py>>,
        rule: &str,
    ) -> PyResult<([Array<'py>; 3], [f64; 2], (u64, usize), &'static str, bool)> {
        let selection = match rule {
            "any" => Selection::Any,
            "compliance" => Selection::Compliance,
            other => {
                return Err(refused(format!("rule is {other:?}; any or compliance is needed")));
            }
        };
        let start = start.as_ref().map(|start| numbers("start", start)).transpose()?;
        let interrupt = Arc::new(AtomicBool::new(false));
        let work = || {
            let interrupt = Some(&*interrupt);
            self.content.solve(&SolveOptions { residual, start, selection, interrupt })
        };
        let solution = if self.content.row_count() < LONG {
            py.detach(work)
        } else {
            let done = AtomicU64::new(0);
            let watched = Watched { interrupt: &interrupt, done: &done, total: 1, progress: None };
            watched.run(py, work)?
        };
        let solution = solution.map_err(|error| problem_error(&error))?;
        let Solution { impulses, velocities, body_velocities, .. } = solution;
        let arrays = [list(py, impulses)?, list(py, velocities)?, list(py, body_velocities)?];
        let counts = (solution.iterations, solution.parts);
        let errors = [solution.residual, solution.relative_error];
        Ok((arrays, errors, counts, solution.start, solution.selected))
    }

    /// Evaluates impulses. Returns the arrays (u, v) and the errors (residual, relative error).
    #[allow(clippy::type_complexity)]
    fn evaluate<'py>(
        &self,
        py: Python<'py>,
        impulses: Numbers<'py>,
    ) -> PyResult<([Array<'py>; 2], [f64; 2])> {
        let found = self.content.evaluate(numbers("impulses", &impulses)?);
        let arrays = [list(py, found.velocities)?, list(py, found.body_velocities)?];
        Ok((arrays, [found.residual, found.relative_error]))
    }
}
