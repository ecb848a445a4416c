//! Mutual exclusion: one thread at a time uses Ipopt, and a thread never enters it twice.

mod common;

use common::{End, HS071, assert_optimal, silent, solve};
use ipopt_sys::{Definition, Reentrant};
use std::ffi::{c_int, c_void};
use std::panic::{AssertUnwindSafe, catch_unwind, resume_unwind};
use std::sync::Barrier;
use std::sync::atomic::{AtomicBool, AtomicUsize, Ordering};
use std::thread;

fn solve_once() -> End {
    let mut lock = ipopt_sys::lock().unwrap();
    solve(&mut silent(&mut lock, &HS071))
}

/// Without the lock, two threads crash the process within a few solves.
#[test]
fn two_threads_that_solve_at_once_both_succeed_one_after_the_other() {
    let alone = solve_once();
    assert_optimal(&alone);
    let (start, inside) = (Barrier::new(2), AtomicBool::new(false));
    thread::scope(|scope| {
        for _ in 0..2 {
            scope.spawn(|| {
                start.wait();
                for _ in 0..200 {
                    let mut lock = ipopt_sys::lock().unwrap();
                    assert!(!inside.swap(true, Ordering::SeqCst), "two threads hold the lock");
                    let end = solve(&mut silent(&mut lock, &HS071));
                    inside.store(false, Ordering::SeqCst);
                    drop(lock);
                    assert_eq!(end, alone);
                }
            });
        }
    });
}

/// Number of callbacks that could not take the lock.
static REFUSED: AtomicUsize = AtomicUsize::new(0);

/// Tries to take the lock in every iteration.
unsafe extern "C" fn enter_again(
    _mode: c_int,
    _iteration: c_int,
    _objective: f64,
    _primal_infeasibility: f64,
    _dual_infeasibility: f64,
    _barrier: f64,
    _d_norm: f64,
    _regularization_size: f64,
    _alpha_du: f64,
    _alpha_pr: f64,
    _ls_trials: c_int,
    _user: *mut c_void,
) -> ipopt_sys::Bool {
    let refused = ipopt_sys::lock().is_err();
    REFUSED.fetch_add(usize::from(refused), Ordering::SeqCst);
    ipopt_sys::to_bool(true)
}

#[test]
fn the_thread_that_holds_the_lock_is_refused_it_and_not_left_to_wait() {
    let mut lock = ipopt_sys::lock().unwrap();
    assert_eq!(ipopt_sys::lock().unwrap_err(), Reentrant);
    let mut problem = silent(&mut lock, &HS071);
    assert!(problem.watch(Some(enter_again)));
    assert_optimal(&solve(&mut problem));
    // HS071 takes eight iterations.
    assert!(REFUSED.load(Ordering::SeqCst) > 5);
    drop(problem);
    assert_eq!(ipopt_sys::lock().unwrap_err(), Reentrant, "still held");
    drop(lock);
    assert_optimal(&solve_once());
}

#[test]
fn a_panic_while_the_lock_is_held_gives_it_back() {
    let payload = catch_unwind(AssertUnwindSafe(|| {
        let mut lock = ipopt_sys::lock().unwrap();
        let _problem = silent(&mut lock, &HS071);
        resume_unwind(Box::new("on purpose"));
    }));
    assert_eq!(payload.unwrap_err().downcast_ref(), Some(&"on purpose"));
    assert_optimal(&solve_once());
    assert_optimal(&thread::spawn(solve_once).join().unwrap());
}

#[test]
fn a_definition_that_is_none_is_not_created() {
    let mut lock = ipopt_sys::lock().unwrap();
    let one = HS071;
    for broken in [
        Definition { x_lower: &[1.0; 3], ..one },
        Definition { g_upper: &[40.0], ..one },
        Definition { x_lower: &[], x_upper: &[], ..one },
        Definition { jacobian_entries: 0, ..one },
        Definition { g_lower: &[], g_upper: &[], ..one },
        Definition { jacobian_entries: 1 << 31, ..one },
        Definition { hessian_entries: usize::MAX, ..one },
        Definition { eval_f: None, ..one },
        Definition { eval_jac_g: None, ..one },
    ] {
        assert!(lock.create(&broken).is_none(), "{broken:?}");
    }
    let mut problem = silent(&mut lock, &one);
    assert!(!problem.set_integer(c"no_such_option", 1));
    assert_optimal(&solve(&mut problem));
}
