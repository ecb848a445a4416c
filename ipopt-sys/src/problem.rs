//! A problem of Ipopt's, from its creation to its end under one lock.

use crate::lock::Exclusive;
use crate::raw::{
    self, Eval_F_CB, Eval_G_CB, Eval_Grad_F_CB, Eval_H_CB, Eval_Jac_G_CB, Intermediate_CB,
    IpoptProblemInfo, UserDataPtr,
};
use std::ffi::{CStr, c_int};
use std::marker::PhantomData;
use std::ptr::NonNull;

/// What `CreateIpoptProblem` takes. n and m are the lengths of the bounds; indices count from 0.
#[derive(Debug, Clone, Copy)]
pub struct Definition<'a> {
    /// Lower bounds of the variables, n numbers; −1e19 and less is none.
    pub x_lower: &'a [f64],
    /// Upper bounds of the variables, n numbers; 1e19 and more is none.
    pub x_upper: &'a [f64],
    /// Lower bounds of the constraints, m numbers.
    pub g_lower: &'a [f64],
    /// Upper bounds of the constraints, m numbers.
    pub g_upper: &'a [f64],
    /// Number of entries of the Jacobian.
    pub jacobian_entries: usize,
    /// Number of entries of the Hessian's lower triangle.
    pub hessian_entries: usize,
    /// f(x).
    pub eval_f: Eval_F_CB,
    /// ∇f(x).
    pub eval_grad_f: Eval_Grad_F_CB,
    /// g(x); may be absent where m = 0.
    pub eval_g: Eval_G_CB,
    /// ∂g/∂x; may be absent where m = 0.
    pub eval_jac_g: Eval_Jac_G_CB,
    /// The Hessian of the Lagrangian; may be absent where Ipopt is to approximate it.
    pub eval_h: Eval_H_CB,
}

/// What `IpoptSolve` reads and writes.
#[derive(Debug)]
pub struct Arrays<'a> {
    /// The start, then the end, n numbers.
    pub x: &'a mut [f64],
    /// Out: the constraints, m numbers.
    pub g: &'a mut [f64],
    /// Out: the objective.
    pub objective: &'a mut f64,
    /// Multipliers of the constraints, m numbers; read in a warm start alone.
    pub mult_g: &'a mut [f64],
    /// Multipliers of the lower bounds, n numbers; read in a warm start alone.
    pub mult_x_lower: &'a mut [f64],
    /// Multipliers of the upper bounds, n numbers; read in a warm start alone.
    pub mult_x_upper: &'a mut [f64],
}

/// An `IpoptProblem`, freed when dropped. One at a time: it borrows the lock.
///
/// ```compile_fail,E0499
/// fn two(definition: &ipopt_sys::Definition<'_>) {
///     let mut lock = ipopt_sys::lock().unwrap();
///     let (one, two) = (lock.create(definition), lock.create(definition));
/// }
/// ```
#[derive(Debug)]
pub struct Problem<'lock> {
    /// From `ipopt_sys_create`, freed by `drop` alone.
    handle: NonNull<IpoptProblemInfo>,
    n: usize,
    m: usize,
    _lock: PhantomData<&'lock mut Exclusive>,
}

impl Exclusive {
    /// A problem; the bounds are copied. `None` where two bounds differ in length, a count is
    /// beyond C's int, a callback is missing, or Ipopt cannot create it: without variables, with
    /// entries of the Jacobian but no constraints or the other way round, without memory.
    pub fn create(&mut self, definition: &Definition<'_>) -> Option<Problem<'_>> {
        let Definition { x_lower, x_upper, g_lower, g_upper, .. } = *definition;
        let (n, m) = (x_lower.len(), g_lower.len());
        if x_upper.len() != n || g_upper.len() != m {
            return None;
        }
        let count = |count: usize| c_int::try_from(count).ok();
        let [c_n, c_m] = [count(n)?, count(m)?];
        let entries = [count(definition.jacobian_entries)?, count(definition.hessian_entries)?];
        // SAFETY: the bounds have the lengths given and are copied before the call returns; the
        // callbacks are only kept; `self` is the lock.
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
    /// Sets an option that is text; `false` where Ipopt refuses it, with a line on the
    /// terminal. This and the other settings take effect in [`Problem::solve`].
    #[must_use]
    pub fn set_text(&mut self, name: &CStr, value: &CStr) -> bool {
        // SAFETY: the problem is alive and under the lock; Ipopt copies both strings.
        unsafe { raw::ipopt_sys_set_text(self.handle.as_ptr(), name.as_ptr(), value.as_ptr()) != 0 }
    }

    /// Sets an option that is a number.
    #[must_use]
    pub fn set_number(&mut self, name: &CStr, value: f64) -> bool {
        // SAFETY: the problem is alive and under the lock; Ipopt copies the name.
        unsafe { raw::ipopt_sys_set_number(self.handle.as_ptr(), name.as_ptr(), value) != 0 }
    }

    /// Sets an option that is an integer.
    #[must_use]
    pub fn set_integer(&mut self, name: &CStr, value: c_int) -> bool {
        // SAFETY: the problem is alive and under the lock; Ipopt copies the name.
        unsafe { raw::ipopt_sys_set_integer(self.handle.as_ptr(), name.as_ptr(), value) != 0 }
    }

    /// Sets the callback that every iteration of the solve calls.
    #[must_use]
    pub fn watch(&mut self, callback: Intermediate_CB) -> bool {
        // SAFETY: the problem is alive and under the lock; the callback is only kept.
        unsafe { raw::ipopt_sys_watch(self.handle.as_ptr(), callback) != 0 }
    }

    /// Solves the problem, and gives the number of Ipopt's
    /// [`ApplicationReturnStatus`](crate::ApplicationReturnStatus), −101 where a C++ exception
    /// ended the solve.
    ///
    /// # Safety
    /// For the length of the call,
    ///
    /// - each callback reads and writes the arrays it is given, to the lengths that its
    ///   arguments say, and `user_data` as what it is; it does not unwind;
    /// - asked for a structure (`values` is null), `eval_jac_g` and `eval_h` fill both index
    ///   arrays with positions inside the matrix, `eval_h` in the lower triangle;
    /// - a callback that returns true has written numbers that are finite: others corrupt
    ///   memory in 3.11;
    /// - the options are ones with which this build of Ipopt survives. In 3.11 not all are:
    ///   some linear solvers and `mumps_pivot_order 4` end the process, and
    ///   `check_derivatives_for_naninf yes` reads memory that was never filled.
    ///
    /// # Panics
    /// If an array has another length than the problem.
    pub unsafe fn solve(&mut self, arrays: Arrays<'_>, user_data: UserDataPtr) -> c_int {
        let Arrays { x, g, objective, mult_g, mult_x_lower, mult_x_upper } = arrays;
        for array in [&*x, mult_x_lower, mult_x_upper] {
            assert_eq!(array.len(), self.n, "numbers for the variables");
        }
        for array in [&*g, mult_g] {
            assert_eq!(array.len(), self.m, "numbers for the constraints");
        }
        // SAFETY: the problem is alive and under the lock, the arrays have its lengths, and
        // what the callbacks and options must keep to is the caller's promise.
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
        // SAFETY: made by `create`, freed once, here, under the lock.
        unsafe { raw::ipopt_sys_free(self.handle.as_ptr()) }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::to_bool;
    use std::ffi::c_void;
    use std::ptr::null;

    unsafe extern "C" fn refuse(
        _n: c_int,
        _x: *mut f64,
        _new_x: crate::Bool,
        _value: *mut f64,
        _user: *mut c_void,
    ) -> crate::Bool {
        to_bool(false)
    }

    /// A name that is a null pointer, which no safe function passes, makes `std::string` throw.
    #[test]
    fn an_exception_in_a_setter_is_a_refusal() {
        let definition = Definition {
            x_lower: &[0.0],
            x_upper: &[1.0],
            g_lower: &[],
            g_upper: &[],
            jacobian_entries: 0,
            hessian_entries: 0,
            eval_f: Some(refuse),
            eval_grad_f: Some(refuse),
            eval_g: None,
            eval_jac_g: None,
            eval_h: None,
        };
        let mut lock = crate::lock().unwrap();
        let mut problem = lock.create(&definition).unwrap();
        let handle = problem.handle.as_ptr();
        // SAFETY: the problem is alive and under the lock; std::string refuses null pointers.
        unsafe {
            assert_eq!(raw::ipopt_sys_set_text(handle, null(), c"yes".as_ptr()), 0);
            assert_eq!(raw::ipopt_sys_set_text(handle, c"sb".as_ptr(), null()), 0);
            assert_eq!(raw::ipopt_sys_set_number(handle, null(), 1.0), 0);
            assert_eq!(raw::ipopt_sys_set_integer(handle, null(), 1), 0);
        }
        assert!(problem.set_text(c"sb", c"yes"));
    }
}
