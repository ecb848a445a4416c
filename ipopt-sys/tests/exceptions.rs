//! Callbacks that throw C++ exceptions: they become a status, and the next solve works.
#![cfg(target_os = "linux")]

mod common;

use common::{HS071, assert_optimal, silent, solve};
use ipopt_sys::{ApplicationReturnStatus, Bool, Definition, Eval_F_CB, Eval_Grad_F_CB};
use std::ffi::{c_char, c_int, c_void};
use std::mem::transmute;

unsafe extern "C-unwind" {
    /// libstdc++'s `std::__throw_length_error(const char*)`.
    #[link_name = "_ZSt20__throw_length_errorPKc"]
    fn throw_length_error(what: *const c_char) -> !;
}

/// Callback with the signature of `Eval_F_CB` and `Eval_Grad_F_CB` that throws.
unsafe extern "C-unwind" fn throwing(
    _n: c_int,
    _x: *mut f64,
    _new_x: Bool,
    _value: *mut f64,
    _user: *mut c_void,
) -> Bool {
    // SAFETY: the text is zero-terminated; the exception only passes this function.
    unsafe { throw_length_error(c"on purpose".as_ptr()) }
}

#[test]
fn an_exception_in_a_callback_is_a_status() {
    // SAFETY: the types differ only in that this function may throw. Only C++ calls it.
    let eval_f = unsafe { transmute::<*const (), Eval_F_CB>(throwing as *const ()) };
    // SAFETY: as above.
    let eval_grad_f = unsafe { transmute::<*const (), Eval_Grad_F_CB>(throwing as *const ()) };
    let mut lock = ipopt_sys::lock().unwrap();
    for broken in [Definition { eval_f, ..HS071 }, Definition { eval_grad_f, ..HS071 }] {
        let end = solve(&mut silent(&mut lock, &broken));
        assert_eq!(end.status, ApplicationReturnStatus::NonIpopt_Exception_Thrown, "{broken:?}");
        assert_optimal(&solve(&mut silent(&mut lock, &HS071)));
    }
}
