//! The calls into Ipopt: the only module of this package with `unsafe`.
//!
//! Invariants that the `SAFETY` notes refer to:
//!
//! - (A) *lengths*: n, m and the entry counts given to `ipopt_sys_create` are those
//!   of the [`Solver`], and every array handed over has the length they imply.
//! - (B) *context*: `user_data` is a pointer to the [`Context`] on the stack of
//!   [`Solver::solve`], which outlives the call and is not touched by it meanwhile;
//!   Ipopt calls back on the same thread, one callback at a time.
//! - (C) *exclusion*: create, solve and free run under [`IPOPT_LOCK`].

use super::options::Setting;
use super::{Bounds, IpoptError, NonlinearProgram, Options, Progress, ReturnStatus, Start};
use crate::sparsity::SparsityPattern;
use ipopt_sys as sys;
use std::any::Any;
use std::cell::Cell;
use std::collections::HashSet;
use std::ffi::{CString, c_int};
use std::panic::{AssertUnwindSafe, catch_unwind, resume_unwind};
use std::slice;
use std::sync::{Mutex, MutexGuard, PoisonError};

/// Ipopt 3.11 and MUMPS keep global state: two problems at once crash the process.
static IPOPT_LOCK: Mutex<()> = Mutex::new(());

thread_local! {
    /// Whether this thread is inside [`Solver::solve`].
    static INSIDE: Cell<bool> = const { Cell::new(false) };
}

/// Magnitudes from here on are taken for the result of a breakdown, not a number.
const LARGEST: f64 = 1e100;

/// Ipopt reads bounds beyond ±1e19 as infinite.
const NO_BOUND: f64 = 2e19;

/// A checked pattern as C sees it.
struct CPattern {
    rows: Vec<c_int>,
    cols: Vec<c_int>,
}

/// A solver for problems of one structure: owns the checked patterns, the options
/// and all scratch arrays, so that repeated solves allocate little.
pub struct Solver {
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

/// The end of a solve.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Outcome<'a> {
    /// What Ipopt said.
    pub status: ReturnStatus,
    /// Iterations taken.
    pub iterations: u32,
    /// The last iterate, where Ipopt iterated at all and every number is finite.
    pub point: Option<Point<'a>>,
}

/// The last iterate of a solve; borrowed from the [`Solver`].
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Point<'a> {
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

/// What the callbacks share during one solve.
struct Context<'a> {
    program: &'a mut dyn NonlinearProgram,
    jacobian: &'a CPattern,
    hessian: &'a CPattern,
    iterations: u32,
    panic: Option<Box<dyn Any + Send>>,
}

impl Solver {
    /// Checks the structure of `program` and makes room for its solves.
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

    /// The settings in use.
    #[must_use]
    pub fn options(&self) -> &Options {
        &self.options
    }

    /// Solves `program`, which must have the structure given to [`Solver::new`].
    /// Waits while another thread solves.
    ///
    /// # Errors
    /// Refusals before Ipopt runs. How the solve itself ended is in
    /// [`Outcome::status`].
    ///
    /// # Panics
    /// Only with a panic of `program`'s own, resumed here; the solver stays usable.
    pub fn solve(
        &mut self,
        program: &mut dyn NonlinearProgram,
        bounds: &Bounds,
        start: &Start<'_>,
    ) -> Result<Outcome<'_>, IpoptError> {
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

        let _exclusive = enter()?;
        self.load_bounds(bounds);
        self.load_start(start);
        let problem = Problem::create(self)?;
        for setting in self.options.settings(start.is_warm()) {
            problem.set(setting)?;
        }
        problem.watch()?;

        let mut context = Context {
            program,
            jacobian: &self.jacobian,
            hessian: &self.hessian,
            iterations: 0,
            panic: None,
        };
        let mut objective = 0.0;
        // SAFETY: (A), (B), (C).
        let code = unsafe {
            sys::ipopt_sys_solve(
                problem.0,
                self.x.as_mut_ptr(),
                self.constraints.as_mut_ptr(),
                &raw mut objective,
                self.constraint_multipliers.as_mut_ptr(),
                self.lower_multipliers.as_mut_ptr(),
                self.upper_multipliers.as_mut_ptr(),
                (&raw mut context).cast(),
            )
        };
        let Context { iterations, panic, .. } = context;
        drop(problem);
        if let Some(payload) = panic {
            drop(_exclusive);
            resume_unwind(payload);
        }
        let status = ReturnStatus::from_code(code);
        Ok(Outcome { status, iterations, point: self.point(status, objective) })
    }

    /// The arrays that the solve wrote, if they mean something.
    fn point(&self, status: ReturnStatus, objective: f64) -> Option<Point<'_>> {
        let arrays = [
            &self.x,
            &self.constraints,
            &self.constraint_multipliers,
            &self.lower_multipliers,
            &self.upper_multipliers,
        ];
        let finite = objective.is_finite()
            && arrays.iter().all(|array| array.iter().all(|value| value.is_finite()));
        (status.has_point() && finite).then_some(Point {
            objective,
            x: &self.x,
            constraints: &self.constraints,
            constraint_multipliers: &self.constraint_multipliers,
            lower_multipliers: &self.lower_multipliers,
            upper_multipliers: &self.upper_multipliers,
        })
    }

    /// Bounds in Ipopt's convention for infinity.
    fn load_bounds(&mut self, bounds: &Bounds) {
        let sources =
            [&bounds.lower, &bounds.upper, &bounds.constraint_lower, &bounds.constraint_upper];
        for (target, source) in self.c_bounds.iter_mut().zip(sources) {
            for (target, value) in target.iter_mut().zip(source) {
                *target = value.clamp(-NO_BOUND, NO_BOUND);
            }
        }
    }

    fn load_start(&mut self, start: &Start<'_>) {
        match *start {
            Start::Cold { x } => {
                self.x.copy_from_slice(x);
                self.constraint_multipliers.fill(0.0);
                self.lower_multipliers.fill(0.0);
                self.upper_multipliers.fill(0.0);
            }
            Start::Warm { x, constraint_multipliers, lower_multipliers, upper_multipliers } => {
                self.x.copy_from_slice(x);
                self.constraint_multipliers.copy_from_slice(constraint_multipliers);
                self.lower_multipliers.copy_from_slice(lower_multipliers);
                self.upper_multipliers.copy_from_slice(upper_multipliers);
            }
        }
    }
}

/// Ranges, triangle and doubles of a pattern; then as C integers.
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
            "is above the diagonal; the lower triangle is needed"
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

/// An index already known to be below a count that fits C's int.
fn c_index(index: usize) -> c_int {
    c_int::try_from(index).unwrap_or(c_int::MAX)
}

/// Exclusive use of Ipopt by this thread, until dropped.
struct Exclusive {
    _guard: MutexGuard<'static, ()>,
}

fn enter() -> Result<Exclusive, IpoptError> {
    if INSIDE.get() {
        return Err(IpoptError::Reentrant);
    }
    // The lock protects no data: a panic while it was held leaves nothing broken.
    let guard = IPOPT_LOCK.lock().unwrap_or_else(PoisonError::into_inner);
    INSIDE.set(true);
    Ok(Exclusive { _guard: guard })
}

impl Drop for Exclusive {
    fn drop(&mut self) {
        INSIDE.set(false);
    }
}

/// An `IpoptProblem` that frees itself.
struct Problem(sys::IpoptProblem);

impl Problem {
    /// Ipopt copies the bounds here and offers no way to change them later: a
    /// problem is created for every solve (100 µs, a few per cent of a solve).
    fn create(solver: &mut Solver) -> Result<Self, IpoptError> {
        let [x_lower, x_upper, g_lower, g_upper] = &mut solver.c_bounds;
        // SAFETY: (A), (C); the bounds are copied before the call returns.
        let problem = unsafe {
            sys::ipopt_sys_create(
                c_index(solver.n),
                x_lower.as_mut_ptr(),
                x_upper.as_mut_ptr(),
                c_index(solver.m),
                g_lower.as_mut_ptr(),
                g_upper.as_mut_ptr(),
                c_index(solver.jacobian.rows.len()),
                c_index(solver.hessian.rows.len()),
                Some(eval_f),
                Some(eval_g),
                Some(eval_grad_f),
                Some(eval_jac_g),
                Some(eval_h),
            )
        };
        if problem.is_null() { Err(IpoptError::Create) } else { Ok(Self(problem)) }
    }

    fn set(&self, setting: Setting) -> Result<(), IpoptError> {
        let (Setting::Text(name, _) | Setting::Number(name, _) | Setting::Integer(name, _)) =
            setting;
        let refused = |_| IpoptError::OptionRefused { name };
        let key = CString::new(name).map_err(refused)?;
        let key = key.as_ptr().cast_mut();
        // SAFETY: the problem is alive, the strings are null-terminated and copied by
        // Ipopt, which does not write to them; (C).
        let accepted = unsafe {
            match setting {
                Setting::Text(_, value) => {
                    let value = CString::new(value).map_err(refused)?;
                    sys::AddIpoptStrOption(self.0, key, value.as_ptr().cast_mut())
                }
                Setting::Number(_, value) => sys::AddIpoptNumOption(self.0, key, value),
                Setting::Integer(_, value) => sys::AddIpoptIntOption(self.0, key, value),
            }
        };
        if sys::is_true(accepted) { Ok(()) } else { Err(IpoptError::OptionRefused { name }) }
    }

    /// Installs the callback that counts iterations and can stop the solve.
    fn watch(&self) -> Result<(), IpoptError> {
        // SAFETY: the problem is alive; (C).
        let accepted = unsafe { sys::SetIntermediateCallback(self.0, Some(intermediate)) };
        if sys::is_true(accepted) { Ok(()) } else { Err(IpoptError::Create) }
    }
}

impl Drop for Problem {
    fn drop(&mut self) {
        // SAFETY: created by `create`, freed once, here; (C).
        unsafe { sys::FreeIpoptProblem(self.0) }
    }
}

/// Runs a callback's work. Once one has panicked, all refuse until the solve ends.
///
/// # Safety
/// `user` must satisfy (B).
unsafe fn guarded(
    user: sys::UserDataPtr,
    work: impl FnOnce(&mut Context<'_>) -> bool,
) -> sys::Bool {
    // SAFETY: (B), promised by the caller.
    let context = unsafe { &mut *user.cast::<Context<'_>>() };
    if context.panic.is_some() {
        return sys::to_bool(false);
    }
    let accepted = match catch_unwind(AssertUnwindSafe(|| work(context))) {
        Ok(accepted) => accepted,
        Err(payload) => {
            context.panic = Some(payload);
            false
        }
    };
    sys::to_bool(accepted)
}

fn all_usable(values: &[f64]) -> bool {
    values.iter().all(|value| value.abs() < LARGEST)
}

/// A read-only view of one of Ipopt's arrays.
///
/// # Safety
/// `data` must point to `count` numbers that live and stay unwritten for `'a`.
unsafe fn view<'a>(data: *const f64, count: c_int) -> &'a [f64] {
    match usize::try_from(count) {
        // SAFETY: promised by the caller.
        Ok(count) if count > 0 => unsafe { slice::from_raw_parts(data, count) },
        _ => &[],
    }
}

/// A writable view of one of Ipopt's arrays.
///
/// # Safety
/// `data` must point to `count` numbers that live and are not aliased for `'a`.
unsafe fn view_mut<'a, T>(data: *mut T, count: c_int) -> &'a mut [T] {
    match usize::try_from(count) {
        // SAFETY: promised by the caller.
        Ok(count) if count > 0 => unsafe { slice::from_raw_parts_mut(data, count) },
        _ => &mut [],
    }
}

unsafe extern "C" fn eval_f(
    n: c_int,
    x: *mut f64,
    _new_x: sys::Bool,
    value: *mut f64,
    user: sys::UserDataPtr,
) -> sys::Bool {
    // SAFETY: (A), (B); `value` is one number.
    unsafe {
        guarded(user, |context| {
            *value = context.program.objective(view(x, n));
            all_usable(slice::from_ref(&*value))
        })
    }
}

unsafe extern "C" fn eval_grad_f(
    n: c_int,
    x: *mut f64,
    _new_x: sys::Bool,
    gradient: *mut f64,
    user: sys::UserDataPtr,
) -> sys::Bool {
    // SAFETY: (A), (B).
    unsafe {
        guarded(user, |context| {
            let gradient = view_mut(gradient, n);
            context.program.gradient(view(x, n), gradient);
            all_usable(gradient)
        })
    }
}

unsafe extern "C" fn eval_g(
    n: c_int,
    x: *mut f64,
    _new_x: sys::Bool,
    m: c_int,
    constraints: *mut f64,
    user: sys::UserDataPtr,
) -> sys::Bool {
    // SAFETY: (A), (B).
    unsafe {
        guarded(user, |context| {
            let constraints = view_mut(constraints, m);
            context.program.constraints(view(x, n), constraints);
            all_usable(constraints)
        })
    }
}

unsafe extern "C" fn eval_jac_g(
    n: c_int,
    x: *mut f64,
    _new_x: sys::Bool,
    _m: c_int,
    count: c_int,
    rows: *mut c_int,
    cols: *mut c_int,
    values: *mut f64,
    user: sys::UserDataPtr,
) -> sys::Bool {
    // SAFETY: (A), (B); Ipopt asks for the structure with `values` null, where x may
    // be null too, and for values with x valid.
    unsafe {
        guarded(user, |context| {
            if values.is_null() {
                view_mut(rows, count).copy_from_slice(&context.jacobian.rows);
                view_mut(cols, count).copy_from_slice(&context.jacobian.cols);
                return true;
            }
            let values = view_mut(values, count);
            context.program.jacobian(view(x, n), values);
            all_usable(values)
        })
    }
}

unsafe extern "C" fn eval_h(
    n: c_int,
    x: *mut f64,
    _new_x: sys::Bool,
    objective_factor: f64,
    m: c_int,
    multipliers: *mut f64,
    _new_multipliers: sys::Bool,
    count: c_int,
    rows: *mut c_int,
    cols: *mut c_int,
    values: *mut f64,
    user: sys::UserDataPtr,
) -> sys::Bool {
    // SAFETY: as in eval_jac_g; the multipliers are valid with the values.
    unsafe {
        guarded(user, |context| {
            if values.is_null() {
                view_mut(rows, count).copy_from_slice(&context.hessian.rows);
                view_mut(cols, count).copy_from_slice(&context.hessian.cols);
                return true;
            }
            let values = view_mut(values, count);
            let (x, multipliers) = (view(x, n), view(multipliers, m));
            context.program.hessian(x, objective_factor, multipliers, values);
            all_usable(values)
        })
    }
}

unsafe extern "C" fn intermediate(
    mode: c_int,
    iteration: c_int,
    objective: f64,
    primal_infeasibility: f64,
    dual_infeasibility: f64,
    barrier: f64,
    _d_norm: f64,
    _regularization_size: f64,
    _alpha_du: f64,
    _alpha_pr: f64,
    _ls_trials: c_int,
    user: sys::UserDataPtr,
) -> sys::Bool {
    // SAFETY: (B).
    unsafe {
        guarded(user, |context| {
            context.iterations = u32::try_from(iteration).unwrap_or(0);
            context.program.keep_going(&Progress {
                iteration: context.iterations,
                in_restoration: mode == sys::RestorationPhaseMode as c_int,
                objective,
                primal_infeasibility,
                dual_infeasibility,
                barrier,
            })
        })
    }
}
