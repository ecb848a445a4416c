//! Callbacks for Ipopt. (A) and (B) are the invariants of the parent module.

use super::Context;
use crate::ipopt::IpoptProgress;
use ipopt_sys as sys;
use std::ffi::c_int;
use std::panic::{AssertUnwindSafe, catch_unwind};
use std::slice;

/// Limit of usable magnitudes. Larger values indicate a numerical breakdown.
const LARGEST: f64 = 1e100;

/// Runs a callback's work. After a panic in one callback, all callbacks refuse until the solve
/// ends.
///
/// # Safety
/// `user` must satisfy (B).
unsafe fn guarded(
    user: sys::UserDataPtr,
    work: impl FnOnce(&mut Context<'_>) -> bool,
) -> sys::Bool {
    // SAFETY: (B), guaranteed by the caller.
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

/// Read-only view of one of Ipopt's arrays.
///
/// # Safety
/// `data` must point to `count` numbers that live and stay unwritten for `'a`.
unsafe fn view<'a>(data: *const f64, count: c_int) -> &'a [f64] {
    match usize::try_from(count) {
        // SAFETY: guaranteed by the caller.
        Ok(count) if count > 0 => unsafe { slice::from_raw_parts(data, count) },
        _ => &[],
    }
}

/// Writable view of one of Ipopt's arrays.
///
/// # Safety
/// `data` must point to `count` numbers that live and are not aliased for `'a`.
unsafe fn view_mut<'a, T>(data: *mut T, count: c_int) -> &'a mut [T] {
    match usize::try_from(count) {
        // SAFETY: guaranteed by the caller.
        Ok(count) if count > 0 => unsafe { slice::from_raw_parts_mut(data, count) },
        _ => &mut [],
    }
}

pub(super) unsafe extern "C" fn eval_f(
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

pub(super) unsafe extern "C" fn eval_grad_f(
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

pub(super) unsafe extern "C" fn eval_g(
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

pub(super) unsafe extern "C" fn eval_jac_g(
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
    // SAFETY: (A), (B). Ipopt requests the structure with `values` null, and x may then be null
    // too. It requests values with x valid.
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

pub(super) unsafe extern "C" fn eval_h(
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
    // SAFETY: as in eval_jac_g; the multipliers are valid together with the values.
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

pub(super) unsafe extern "C" fn intermediate(
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
            context.program.keep_going(&IpoptProgress {
                iteration: context.iterations,
                in_restoration: mode == sys::AlgorithmMode::RestorationPhaseMode as c_int,
                objective,
                primal_infeasibility,
                dual_infeasibility,
                barrier,
            })
        })
    }
}
