//! Problem of Ipopt, which lives under one lock.

use crate::lock::Exclusive;
use crate::raw::{
    self, Eval_F_CB, Eval_G_CB, Eval_Grad_F_CB, Eval_H_CB, Eval_Jac_G_CB, Intermediate_CB,
    IpoptProblemInfo, UserDataPtr,
};
use std::ffi::{CStr, c_int};
use std::marker::PhantomData;
use std::ptr::NonNull;

/// Arguments of `CreateIpoptProblem`.
///
/// The lengths of the bounds are the numbers n of variables and m of constraints. Indices start at
/// 0.
#[derive(Debug, Clone, Copy)]
pub struct Definition<'a> {
    /// Lower bounds of the variables, n numbers; −1e19 or less means unbounded.
    pub x_lower: &'a [f64],
    /// Upper bounds of the variables, n numbers; 1e19 or more means unbounded.
    pub x_upper: &'a [f64],
    /// Lower bounds of the constraints, m numbers.
    pub g_lower: &'a [f64],
    /// Upper bounds of the constraints, m numbers.
    pub g_upper: &'a [f64],
    /// Number of entries of the Jacobian.
    pub jacobian_entries: usize,
    /// Number of entries of the Hessian's lower triangle.
    pub hessian_entries: usize,
    /// Objective f(x).
    pub eval_f: Eval_F_CB,
    /// Gradient ∇f(x).
    pub eval_grad_f: Eval_Grad_F_CB,
    /// Constraints g(x); optional if m = 0.
    pub eval_g: Eval_G_CB,
    /// Jacobian ∂g/∂x; optional if m = 0.
    pub eval_jac_g: Eval_Jac_G_CB,
    /// Hessian of the Lagrangian; optional if Ipopt approximates it.
    pub eval_h: Eval_H_CB,
}

/// Arrays that `IpoptSolve` reads and writes.
#[derive(Debug)]
pub struct Arrays<'a> {
    /// Initial point, replaced by the final point; n numbers.
    pub x: &'a mut [f64],
    /// Output: constraints, m numbers.
    pub g: &'a mut [f64],
    /// Output: objective.
    pub objective: &'a mut f64,
    /// Multipliers of the constraints, m numbers; input only for a warm start.
    pub mult_g: &'a mut [f64],
    /// Multipliers of the lower bounds, n numbers; input only for a warm start.
    pub mult_x_lower: &'a mut [f64],
    /// Multipliers of the upper bounds, n numbers; input only for a warm start.
    pub mult_x_upper: &'a mut [f64],
}

/// Owned `IpoptProblem`, freed on drop. It borrows the lock, so that only one can exist.
///
/// ```compile_fail,E0499
/// fn two(definition: &ipopt_sys::Definition<'_>) {
///     let mut lock = ipopt_sys::lock().unwrap();
///     let (one, two) = (lock.create(definition), lock.create(definition));
/// }
/// ```
#[derive(Debug)]
pub struct Problem<'lock> {
    /// Handle from `ipopt_sys_create`. Only `drop` frees it.
    handle: NonNull<IpoptProblemInfo>,
    n: usize,
    m: usize,
    _lock: PhantomData<&'lock mut Exclusive>,
}

impl Exclusive {
    /// Creates a problem. The bounds are copied.
    ///
    /// Returns `None` if two bounds differ in length, a count exceeds C's int, a callback is
    /// missing or Ipopt cannot create the problem. Ipopt needs memory and at least one variable. It
    /// also needs both constraints and entries of the Jacobian, or neither.
    pub fn create(&mut self, definition: &Definition<'_>) -> Option<Problem<'_>> {
        let Definition { x_lower, x_upper, g_lower, g_upper, .. } = *definition;
        let (n, m) = (x_lower.len(), g_lower.len());
        if x_upper.len() != n || g_upper.len() != m {
            return None;
        }
        let count = |count: usize| c_int::try_from(count).ok();
        let [c_n, c_m] = [count(n)?, count(m)?];
        let entries = [count(definition.jacobian_entries)?, count(definition.hessian_entries)?];
        // SAFETY: the bounds have the given lengths and are copied during the call; the callbacks
        // are only stored; `self` is the lock.
        let handle = unsafe {
            raw::ipopt_sys_create(
                c_n,
                x_lower.as_ptr(),
                x_upper.as_ptr(),
                c_m,
                g_lower.as_ptr(),
                g_upper.as_ptr(),
                entries[0],
                entries[1],
                definition.eval_f,
                definition.eval_g,
                definition.eval_grad_f,
                definition.eval_jac_g,
                definition.eval_h,
            )
        };
        Some(Problem { handle: NonNull::new(handle)?, n, m, _lock: PhantomData })
    }
}

impl Problem<'_> {
    /// Sets a text option. Returns `false` if Ipopt rejects it; Ipopt then prints a line.
    ///
    /// This and the other settings take effect in [`Problem::solve`].
    pub fn set_text(&mut self, name: &CStr, value: &CStr) -> bool {
        // SAFETY: the problem is alive and under the lock; Ipopt copies both strings.
        unsafe { raw::ipopt_sys_set_text(self.handle.as_ptr(), name.as_ptr(), value.as_ptr()) != 0 }
    }

    /// Sets a numeric option.
    pub fn set_number(&mut self, name: &CStr, value: f64) -> bool {
        // SAFETY: the problem is alive and under the lock; Ipopt copies the name.
        unsafe { raw::ipopt_sys_set_number(self.handle.as_ptr(), name.as_ptr(), value) != 0 }
    }

    /// Sets an integer option.
    pub fn set_integer(&mut self, name: &CStr, value: c_int) -> bool {
        // SAFETY: the problem is alive and under the lock; Ipopt copies the name.
        unsafe { raw::ipopt_sys_set_integer(self.handle.as_ptr(), name.as_ptr(), value) != 0 }
    }

    /// Sets the callback that Ipopt calls in every iteration.
    pub fn watch(&mut self, callback: Intermediate_CB) -> bool {
        // SAFETY: the problem is alive and under the lock; the callback is only stored.
        unsafe { raw::ipopt_sys_watch(self.handle.as_ptr(), callback) != 0 }
    }

    /// Solves the problem and returns the number of the
    /// [`ApplicationReturnStatus`](crate::ApplicationReturnStatus).
    ///
    /// The number is −101 if a C++ exception ended the solve.
    ///
    /// # Safety
    /// During the call,
    ///
    /// - each callback reads and writes its arrays within the lengths in its arguments, treats
    ///   `user_data` as its actual type, and does not unwind;
    /// - for a structure request (`values` is null), `eval_jac_g` and `eval_h` fill both index
    ///   arrays with positions inside the matrix, `eval_h` in the lower triangle;
    /// - a callback that returns true has written finite numbers: others corrupt memory in 3.11;
    /// - the options are safe in this build of Ipopt. In 3.11 some linear solvers and
    ///   `mumps_pivot_order 4` end the process, and `check_derivatives_for_naninf yes` reads
    ///   uninitialised memory.
    ///
    /// # Panics
    /// If an array has a wrong length.
    pub unsafe fn solve(&mut self, arrays: Arrays<'_>, user_data: UserDataPtr) -> c_int {
        let Arrays { x, g, objective, mult_g, mult_x_lower, mult_x_upper } = arrays;
        for array in [&*x, mult_x_lower, mult_x_upper] {
            assert_eq!(array.len(), self.n, "numbers for the variables");
        }
        for array in [&*g, mult_g] {
            assert_eq!(array.len(), self.m, "numbers for the constraints");
        }
        // SAFETY: the problem is alive and under the lock, the arrays have its lengths, and the
        // caller guarantees the obligations of callbacks and options.
        unsafe {
            raw::ipopt_sys_solve(
                self.handle.as_ptr(),
                x.as_mut_ptr(),
                g.as_mut_ptr(),
                objective,
                mult_g.as_mut_ptr(),
                mult_x_lower.as_mut_ptr(),
                mult_x_upper.as_mut_ptr(),
                user_data,
            )
        }
    }
}

impl Drop for Problem<'_> {
    fn drop(&mut self) {
        // SAFETY: `create` made the handle, and it is freed only here, under the lock.
        unsafe { raw::ipopt_sys_free(self.handle.as_ptr()) }
    }
}

#[cfg(test)]
#[path = "tests/problem.rs"]
mod tests;
