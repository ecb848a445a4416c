//! Problem 71 of the collection of Hock and Schittkowski (1981):
//!
//!   min x0 x3 (x0 + x1 + x2) + x2
//!   s.t. x0 x1 x2 x3 ≥ 25,  x0² + x1² + x2² + x3² = 40,  1 ≤ x ≤ 5
//!
//! Known optimum: 17.0140173 at (1, 4.7429994, 3.8211503, 1.3794082).

use ipopt_sys as sys;
use std::ffi::{c_int, c_void};
use std::slice;

/// HS071 with the callbacks below.
pub const HS071: sys::Definition<'static> = sys::Definition {
    x_lower: &[1.0; 4],
    x_upper: &[5.0; 4],
    g_lower: &[25.0, 40.0],
    g_upper: &[2e19, 40.0],
    jacobian_entries: 8,
    hessian_entries: 10,
    eval_f: Some(eval_f),
    eval_grad_f: Some(eval_grad_f),
    eval_g: Some(eval_g),
    eval_jac_g: Some(eval_jac_g),
    eval_h: Some(eval_h),
};

/// Result of a solve.
#[derive(Debug, Clone, PartialEq)]
pub struct End {
    pub status: c_int,
    pub objective: f64,
    pub x: [f64; 4],
    /// Number of evaluations of the objective.
    pub calls: usize,
}

/// Variant of HS071 without output.
pub fn silent<'lock>(
    lock: &'lock mut sys::Exclusive,
    definition: &sys::Definition<'_>,
) -> sys::Problem<'lock> {
    let mut problem = lock.create(definition).expect("a problem");
    assert!(problem.set_integer(c"print_level", 0));
    assert!(problem.set_text(c"sb", c"yes"));
    problem
}

/// Solves a problem with the sizes of HS071 from the published initial point.
pub fn solve(problem: &mut sys::Problem<'_>) -> End {
    let mut end = End { status: c_int::MIN, objective: 0.0, x: [1.0, 5.0, 5.0, 1.0], calls: 0 };
    let [mut g, mut mult_g] = [[0.0; 2]; 2];
    let [mut mult_x_lower, mut mult_x_upper] = [[0.0; 4]; 2];
    let arrays = sys::Arrays {
        x: &mut end.x,
        g: &mut g,
        objective: &mut end.objective,
        mult_g: &mut mult_g,
        mult_x_lower: &mut mult_x_lower,
        mult_x_upper: &mut mult_x_upper,
    };
    // SAFETY: the callbacks keep to their lengths or throw a C++ exception; `user_data` is the
    // counter that `eval_f` expects; the options are harmless.
    end.status = unsafe { problem.solve(arrays, (&raw mut end.calls).cast()) };
    end
}

/// Compares with the published optimum, which has eight digits. Ipopt's default tolerance is 1e-8.
pub fn assert_optimal(end: &End) {
    assert_eq!(end.status, sys::ApplicationReturnStatus::Solve_Succeeded, "{end:?}");
    assert!((end.objective - 17.014_017_3).abs() < 1e-6, "{end:?}");
    for (x, known) in end.x.iter().zip([1.0, 4.742_999_4, 3.821_150_3, 1.379_408_2]) {
        assert!((x - known).abs() < 1e-6, "{x} is not {known}");
    }
    assert!(end.calls > 0);
}

unsafe extern "C" fn eval_f(
    n: c_int,
    x: *mut f64,
    _new_x: sys::Bool,
    value: *mut f64,
    user: *mut c_void,
) -> sys::Bool {
    // SAFETY: Ipopt passes n numbers, one output and the pointer of `solve`.
    unsafe {
        let x = slice::from_raw_parts(x, n as usize);
        *value = x[0] * x[3] * (x[0] + x[1] + x[2]) + x[2];
        *user.cast::<usize>() += 1;
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
    // SAFETY: Ipopt passes either both index arrays or values, of length nele; x is valid with the
    // latter.
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
