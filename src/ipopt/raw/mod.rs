//! Solve through the C interface: the only module of this package with `unsafe` code.
//!
//! Invariants of the `SAFETY` notes:
//!
//! - (A) *lengths*: Ipopt receives n, m and the entry counts of the [`RawSolver`]. The arrays that
//!   it passes to the callbacks have the corresponding lengths.
//! - (B) *context*: `user_data` points to the [`Context`] on the stack of [`RawSolver::solve`]. The
//!   context outlives the call, and `solve` does not touch it during the call. Ipopt calls back on
//!   the same thread, one callback at a time.

mod callbacks;

use super::options::OptionValue;
use super::{Bounds, IpoptError, NonlinearProgram, Options, ReturnStatus, StartPoint};
use crate::sparsity::SparsityPattern;
use ipopt_sys as sys;
use std::any::Any;
use std::collections::HashSet;
use std::ffi::{CString, c_int};
use std::panic::resume_unwind;

/// Bound value that Ipopt reads as infinite: its limit is ±1e19.
const NO_BOUND: f64 = 2e19;

/// Checked sparsity pattern with C integers.
struct CPattern {
    rows: Vec<c_int>,
    cols: Vec<c_int>,
}

/// Solver for problems of one structure. It owns the checked patterns, the options and all scratch
/// arrays, so that repeated solves allocate little.
pub struct RawSolver {
    n: usize,
    m: usize,
    jacobian: CPattern,
    hessian: CPattern,
    options: Options,
    x: Vec<f64>,
    constraints: Vec<f64>,
    constraint_multipliers: Vec<f64>,
    lower_multipliers: Vec<f64>,
    upper_multipliers: Vec<f64>,
    c_bounds: [Vec<f64>; 4],
}

/// Result of a solve.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct SolveOutcome<'a> {
    /// Return status of Ipopt.
    pub status: ReturnStatus,
    /// Number of iterations.
    pub iterations: u32,
    /// Last iterate, if Ipopt iterated and every number is finite.
    pub point: Option<IteratePoint<'a>>,
}

/// Last iterate of a solve, borrowed from the [`RawSolver`]. Ipopt finally projects x onto its
/// bounds; objective and constraints belong to x before this projection.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct IteratePoint<'a> {
    /// Objective value.
    pub objective: f64,
    /// Variables, n numbers.
    pub x: &'a [f64],
    /// Constraint values, m numbers.
    pub constraints: &'a [f64],
    /// Constraint multipliers, m numbers.
    pub constraint_multipliers: &'a [f64],
    /// Multipliers of the lower bounds, n numbers.
    pub lower_multipliers: &'a [f64],
    /// Multipliers of the upper bounds, n numbers.
    pub upper_multipliers: &'a [f64],
}

/// Data shared by the callbacks during one solve.
struct Context<'a> {
    program: &'a mut dyn NonlinearProgram,
    jacobian: &'a CPattern,
    hessian: &'a CPattern,
    iterations: u32,
    panic: Option<Box<dyn Any + Send>>,
}

impl RawSolver {
    /// Checks the structure of `program` and allocates memory for its solves.
    ///
    /// # Errors
    /// [`IpoptError::Size`], [`IpoptError::Structure`] or [`IpoptError::Option`].
    pub fn new(program: &dyn NonlinearProgram, options: Options) -> Result<Self, IpoptError> {
        options.validate()?;
        let (n, m) = (program.variable_count(), program.constraint_count());
        if n == 0 || c_int::try_from(n).is_err() || c_int::try_from(m).is_err() {
            return Err(IpoptError::Size { variables: n, constraints: m });
        }
        Ok(Self {
            n,
            m,
            jacobian: check_pattern("Jacobian", program.jacobian_pattern(), m, n, false)?,
            hessian: check_pattern("Hessian", program.hessian_pattern(), n, n, true)?,
            options,
            x: vec![0.0; n],
            constraints: vec![0.0; m],
            constraint_multipliers: vec![0.0; m],
            lower_multipliers: vec![0.0; n],
            upper_multipliers: vec![0.0; n],
            c_bounds: [vec![0.0; n], vec![0.0; n], vec![0.0; m], vec![0.0; m]],
        })
    }

    /// Current settings.
    pub fn options(&self) -> &Options {
        &self.options
    }

    /// Changes the iteration limit and the tolerance of later solves.
    ///
    /// # Errors
    /// [`IpoptError::Option`] for a value that [`Options::validate`] refuses.
    pub fn set_limits(&mut self, max_iterations: u32, tolerance: f64) -> Result<(), IpoptError> {
        let options = Options { max_iterations, tolerance, ..self.options.clone() };
        options.validate()?;
        self.options = options;
        Ok(())
    }

    /// Solves `program`, which must have the structure passed to [`RawSolver::new`]. Waits while
    /// another thread solves.
    ///
    /// # Errors
    /// Refusals before Ipopt runs. [`SolveOutcome::status`] holds the result of the solve itself.
    ///
    /// # Panics
    /// Resumes a panic of `program`. The solver stays usable.
    pub fn solve(
        &mut self,
        program: &mut dyn NonlinearProgram,
        bounds: &Bounds,
        start: &StartPoint<'_>,
    ) -> Result<SolveOutcome<'_>, IpoptError> {
        // The program has to be the one whose structure is known.
        let sizes = [
            ("variables", self.n, program.variable_count()),
            ("constraints", self.m, program.constraint_count()),
            ("Jacobian entries", self.jacobian.rows.len(), program.jacobian_pattern().len()),
            ("Hessian entries", self.hessian.rows.len(), program.hessian_pattern().len()),
        ];
        for (what, expected, found) in sizes {
            if expected != found {
                return Err(IpoptError::Length { what, expected, found });
            }
        }
        bounds.validate(self.n, self.m)?;
        start.validate(self.n, self.m)?;

        let mut lock = sys::lock().map_err(|sys::Reentrant| IpoptError::Reentrant)?;
        self.load_bounds(bounds);
        self.load_start(start);
        let mut problem = self.create(&mut lock)?;
        for setting in self.options.settings(matches!(start, StartPoint::Warm { .. })) {
            set(&mut problem, setting)?;
        }
        if !problem.watch(Some(callbacks::intermediate)) {
            return Err(IpoptError::Create);
        }

        // Callbacks find the program through the context.
        let mut context = Context {
            program,
            jacobian: &self.jacobian,
            hessian: &self.hessian,
            iterations: 0,
            panic: None,
        };
        let mut objective = 0.0;
        let arrays = sys::Arrays {
            x: &mut self.x,
            g: &mut self.constraints,
            objective: &mut objective,
            mult_g: &mut self.constraint_multipliers,
            mult_x_lower: &mut self.lower_multipliers,
            mult_x_upper: &mut self.upper_multipliers,
        };
        // SAFETY: (A), (B). The callbacks catch every panic, fill in the checked patterns and
        // refuse numbers that are not finite. `Options::validate` refuses values that crash 3.11.
        let code = unsafe { problem.solve(arrays, (&raw mut context).cast()) };
        let Context { iterations, panic, .. } = context;
        drop(problem);
        drop(lock);
        if let Some(payload) = panic {
            resume_unwind(payload);
        }
        let status = ReturnStatus::from_code(code);
        Ok(SolveOutcome { status, iterations, point: self.point(status, objective) })
    }

    /// Creates the C problem. Ipopt copies the bounds here and cannot change them later, so every
    /// solve creates a problem (100 µs, a few per cent of a solve).
    fn create<'lock>(
        &self,
        lock: &'lock mut sys::Exclusive,
    ) -> Result<sys::Problem<'lock>, IpoptError> {
        let [x_lower, x_upper, g_lower, g_upper] = &self.c_bounds;
        let definition = sys::Definition {
            x_lower,
            x_upper,
            g_lower,
            g_upper,
            jacobian_entries: self.jacobian.rows.len(),
            hessian_entries: self.hessian.rows.len(),
            eval_f: Some(callbacks::eval_f),
            eval_grad_f: Some(callbacks::eval_grad_f),
            eval_g: Some(callbacks::eval_g),
            eval_jac_g: Some(callbacks::eval_jac_g),
            eval_h: Some(callbacks::eval_h),
        };
        lock.create(&definition).ok_or(IpoptError::Create)
    }

    /// Last iterate, if the status has a point and all numbers are finite.
    fn point(&self, status: ReturnStatus, objective: f64) -> Option<IteratePoint<'_>> {
        let arrays = [
            &self.x,
            &self.constraints,
            &self.constraint_multipliers,
            &self.lower_multipliers,
            &self.upper_multipliers,
        ];
        let finite = objective.is_finite()
            && arrays.iter().all(|array| array.iter().all(|value| value.is_finite()));
        (status.has_point() && finite).then_some(IteratePoint {
            objective,
            x: &self.x,
            constraints: &self.constraints,
            constraint_multipliers: &self.constraint_multipliers,
            lower_multipliers: &self.lower_multipliers,
            upper_multipliers: &self.upper_multipliers,
        })
    }

    /// Copies the bounds in Ipopt's convention for infinity.
    fn load_bounds(&mut self, bounds: &Bounds) {
        let sources =
            [&bounds.lower, &bounds.upper, &bounds.constraint_lower, &bounds.constraint_upper];
        for (target, source) in self.c_bounds.iter_mut().zip(sources) {
            for (target, value) in target.iter_mut().zip(source) {
                *target = value.clamp(-NO_BOUND, NO_BOUND);
            }
        }
    }

    fn load_start(&mut self, start: &StartPoint<'_>) {
        match *start {
            StartPoint::Cold { x } => {
                self.x.copy_from_slice(x);
                self.constraint_multipliers.fill(0.0);
                self.lower_multipliers.fill(0.0);
                self.upper_multipliers.fill(0.0);
            }
            StartPoint::Warm {
                x,
                constraint_multipliers,
                lower_multipliers,
                upper_multipliers,
            } => {
                self.x.copy_from_slice(x);
                self.constraint_multipliers.copy_from_slice(constraint_multipliers);
                self.lower_multipliers.copy_from_slice(lower_multipliers);
                self.upper_multipliers.copy_from_slice(upper_multipliers);
            }
        }
    }
}

/// Checks ranges, triangle and duplicates of a pattern and converts it to C integers.
fn check_pattern(
    what: &'static str,
    pattern: &SparsityPattern,
    row_count: usize,
    col_count: usize,
    lower_triangle: bool,
) -> Result<CPattern, IpoptError> {
    let mut seen = HashSet::with_capacity(pattern.len());
    let mut checked = CPattern { rows: Vec::new(), cols: Vec::new() };
    for (index, (row, col)) in pattern.positions().enumerate() {
        let why = if row >= row_count || col >= col_count {
            "is outside the matrix"
        } else if lower_triangle && col > row {
            "is above the diagonal; use the lower triangle"
        } else if !seen.insert((row, col)) {
            "is listed twice"
        } else {
            checked.rows.push(c_index(row));
            checked.cols.push(c_index(col));
            continue;
        };
        return Err(IpoptError::Structure { what, index, row, col, why });
    }
    Ok(checked)
}

/// Converts an index below a count that fits C's int.
fn c_index(index: usize) -> c_int {
    c_int::try_from(index).unwrap_or(c_int::MAX)
}

/// Passes one option to Ipopt.
fn set(problem: &mut sys::Problem<'_>, setting: OptionValue) -> Result<(), IpoptError> {
    let (OptionValue::Text(name, _) | OptionValue::Number(name, _) | OptionValue::Integer(name, _)) =
        setting;
    let refused = |_| IpoptError::OptionRefused { name };
    let key = CString::new(name).map_err(refused)?;
    let accepted = match setting {
        OptionValue::Text(_, value) => {
            problem.set_text(&key, &CString::new(value).map_err(refused)?)
        }
        OptionValue::Number(_, value) => problem.set_number(&key, value),
        OptionValue::Integer(_, value) => problem.set_integer(&key, value),
    };
    if accepted { Ok(()) } else { Err(IpoptError::OptionRefused { name }) }
}
