//! Unit tests of `problem.rs`.

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

/// A null pointer as a name makes `std::string` throw. No safe function passes one.
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
    // SAFETY: the problem is alive and under the lock; std::string rejects null pointers.
    unsafe {
        assert_eq!(raw::ipopt_sys_set_text(handle, null(), c"yes".as_ptr()), 0);
        assert_eq!(raw::ipopt_sys_set_text(handle, c"sb".as_ptr(), null()), 0);
        assert_eq!(raw::ipopt_sys_set_number(handle, null(), 1.0), 0);
        assert_eq!(raw::ipopt_sys_set_integer(handle, null(), 1), 0);
    }
    assert!(problem.set_text(c"sb", c"yes"));
}
