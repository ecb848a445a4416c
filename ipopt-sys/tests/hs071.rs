//! Problem 71 of the collection of Hock and Schittkowski (1981), solved through
//! the raw calls:
//!
//!   min x0 x3 (x0 + x1 + x2) + x2
//!   s.t. x0 x1 x2 x3 ≥ 25,  x0² + x1² + x2² + x3² = 40,  1 ≤ x ≤ 5
//!
//! Known optimum: 17.0140173 at (1, 4.7429994, 3.8211503, 1.3794082).

use ipopt_sys as sys;
use std::ffi::{CString, c_int, c_void};
use std::slice;

/// The count of callbacks, handed through `user_data`.
struct Calls(usize);

unsafe extern "C" fn eval_f(
    n: c_int,
    x: *mut f64,
    _new_x: sys::Bool,
    value: *mut f64,
    user: *mut c_void,
) -> sys::Bool {
    // SAFETY: Ipopt passes n numbers, one output and the pointer given to solve.
    unsafe {
        let x = slice::from_raw_parts(x, n as usize);
        *value = x[0] * x[3] * (x[0] + x[1] + x[2]) + x[2];
        (*user.cast::<Calls>()).0 += 1;
    }
    sys::to_bool(true)
}

unsafe extern "C" fn eval_grad_f(
    n: c_int,
    x: *mut f64,
    _new_x: sys::Bool,
    gradient: *mut f64,
    _user: *mut c_void,
) -> sys::Bool {
    // SAFETY: both arrays hold n numbers.
    let (x, gradient) = unsafe {
        (slice::from_raw_parts(x, n as usize), slice::from_raw_parts_mut(gradient, n as usize))
    };
    gradient.copy_from_slice(&[
        x[3] * (2.0 * x[0] + x[1] + x[2]),
        x[0] * x[3],
        x[0] * x[3] + 1.0,
        x[0] * (x[0] + x[1] + x[2]),
    ]);
    sys::to_bool(true)
}

unsafe extern "C" fn eval_g(
    n: c_int,
    x: *mut f64,
    _new_x: sys::Bool,
    m: c_int,
    g: *mut f64,
    _user: *mut c_void,
) -> sys::Bool {
    // SAFETY: x holds n and g holds m numbers.
    let (x, g) =
        unsafe { (slice::from_raw_parts(x, n as usize), slice::from_raw_parts_mut(g, m as usize)) };
    g[0] = x.iter().product();
    g[1] = x.iter().map(|x| x * x).sum();
    sys::to_bool(true)
}

unsafe extern "C" fn eval_jac_g(
    n: c_int,
    x: *mut f64,
    _new_x: sys::Bool,
    _m: c_int,
    nele: c_int,
    rows: *mut c_int,
    cols: *mut c_int,
    values: *mut f64,
    _user: *mut c_void,
) -> sys::Bool {
    // SAFETY: Ipopt passes either both index arrays or values, of length nele; x
    // is valid with the latter.
    unsafe {
        if values.is_null() {
            let rows = slice::from_raw_parts_mut(rows, nele as usize);
            let cols = slice::from_raw_parts_mut(cols, nele as usize);
            for k in 0..8 {
                rows[k] = (k / 4) as c_int;
                cols[k] = (k % 4) as c_int;
            }
        } else {
            let x = slice::from_raw_parts(x, n as usize);
            let values = slice::from_raw_parts_mut(values, nele as usize);
            let product: f64 = x.iter().product();
            for k in 0..4 {
                values[k] = product / x[k];
                values[4 + k] = 2.0 * x[k];
            }
        }
    }
    sys::to_bool(true)
}

unsafe extern "C" fn eval_h(
    _n: c_int,
    x: *mut f64,
    _new_x: sys::Bool,
    sigma: f64,
    _m: c_int,
    multipliers: *mut f64,
    _new_multipliers: sys::Bool,
    nele: c_int,
    rows: *mut c_int,
    cols: *mut c_int,
    values: *mut f64,
    _user: *mut c_void,
) -> sys::Bool {
    // SAFETY: as in eval_jac_g; the multipliers come with the values.
    unsafe {
        if values.is_null() {
            let rows = slice::from_raw_parts_mut(rows, nele as usize);
            let cols = slice::from_raw_parts_mut(cols, nele as usize);
            let lower = (0..4).flat_map(|row| (0..=row).map(move |col| (row, col)));
            for (k, (row, col)) in lower.enumerate() {
                (rows[k], cols[k]) = (row, col);
            }
        } else {
            let x = slice::from_raw_parts(x, 4);
            let l = slice::from_raw_parts(multipliers, 2);
            let values = slice::from_raw_parts_mut(values, nele as usize);
            values.copy_from_slice(&[
                sigma * 2.0 * x[3] + l[1] * 2.0,
                sigma * x[3] + l[0] * x[2] * x[3],
                l[1] * 2.0,
                sigma * x[3] + l[0] * x[1] * x[3],
                l[0] * x[0] * x[3],
                l[1] * 2.0,
                sigma * (2.0 * x[0] + x[1] + x[2]) + l[0] * x[1] * x[2],
                sigma * x[0] + l[0] * x[0] * x[2],
                sigma * x[0] + l[0] * x[0] * x[1],
                l[1] * 2.0,
            ]);
        }
    }
    sys::to_bool(true)
}

#[test]
fn hs071_reaches_its_known_optimum() {
    let (mut lower, mut upper) = ([1.0; 4], [5.0; 4]);
    let (mut g_lower, mut g_upper) = ([25.0, 40.0], [2e19, 40.0]);
    let mut x = [1.0, 5.0, 5.0, 1.0];
    let (mut g, mut objective) = ([0.0; 2], 0.0);
    let (mut mult_g, mut mult_lower, mut mult_upper) = ([0.0; 2], [0.0; 4], [0.0; 4]);
    let mut calls = Calls(0);

    // SAFETY: all arrays have the lengths given, live until the problem is freed,
    // and the callbacks above keep to them. This test binary has one test, so no
    // other thread is inside Ipopt.
    let status = unsafe {
        let problem = sys::ipopt_sys_create(
            4,
            lower.as_mut_ptr(),
            upper.as_mut_ptr(),
            2,
            g_lower.as_mut_ptr(),
            g_upper.as_mut_ptr(),
            8,
            10,
            Some(eval_f),
            Some(eval_g),
            Some(eval_grad_f),
            Some(eval_jac_g),
            Some(eval_h),
        );
        assert!(!problem.is_null());
        let [print_level, sb, yes] =
            ["print_level", "sb", "yes"].map(|text| CString::new(text).unwrap());
        let set = sys::AddIpoptIntOption(problem, print_level.as_ptr().cast_mut(), 0);
        assert!(sys::is_true(set));
        let set = sys::AddIpoptStrOption(problem, sb.as_ptr().cast_mut(), yes.as_ptr().cast_mut());
        assert!(sys::is_true(set));
        let status = sys::ipopt_sys_solve(
            problem,
            x.as_mut_ptr(),
            g.as_mut_ptr(),
            &mut objective,
            mult_g.as_mut_ptr(),
            mult_lower.as_mut_ptr(),
            mult_upper.as_mut_ptr(),
            (&raw mut calls).cast(),
        );
        sys::FreeIpoptProblem(problem);
        status
    };

    assert_eq!(status, sys::Solve_Succeeded as c_int);
    // The published optimum has eight digits; Ipopt's default tolerance is 1e-8.
    assert!((objective - 17.014_017_3).abs() < 1e-6, "{objective}");
    for (x, known) in x.iter().zip([1.0, 4.742_999_4, 3.821_150_3, 1.379_408_2]) {
        assert!((x - known).abs() < 1e-6, "{x} is not {known}");
    }
    assert!(calls.0 > 0);
    assert!(sys::VERSION.starts_with("3."), "{}", sys::VERSION);
}
