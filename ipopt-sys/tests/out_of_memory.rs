//! Ipopt without memory throws `std::bad_alloc` outside its own handlers; the guard catches it.
//!
//! The limit applies to the whole process, so this program has a single test.
#![cfg(target_os = "linux")]

mod common;

use common::{HS071, assert_optimal, silent, solve};
use ipopt_sys::{ApplicationReturnStatus, Arrays, Definition};
use std::ffi::c_int;
use std::fs;
use std::ptr;

unsafe extern "C" {
    fn getrlimit(resource: c_int, limit: *mut [u64; 2]) -> c_int;
    fn setrlimit(resource: c_int, limit: *const [u64; 2]) -> c_int;
}

/// `RLIMIT_AS`, the address space in bytes, on every Linux processor except MIPS and SPARC.
const ADDRESS_SPACE: c_int = 9;

/// Number of variables: 80 MB per array, more than malloc keeps in reserve.
const MANY: usize = 10_000_000;

/// Runs `work` while the process may allocate at most 40 MB more.
fn without_memory<T>(work: impl FnOnce() -> T) -> T {
    let status = fs::read_to_string("/proc/self/status").unwrap();
    let size = status.lines().find_map(|line| line.strip_prefix("VmSize:")).unwrap();
    let taken: u64 = size.trim().strip_suffix(" kB").unwrap().parse().unwrap();
    let mut usual = [0; 2];
    // SAFETY: both calls access two numbers, the soft limit and the hard limit.
    unsafe {
        assert_eq!(getrlimit(ADDRESS_SPACE, &mut usual), 0);
        assert_eq!(setrlimit(ADDRESS_SPACE, &[1024 * taken + 40_000_000, usual[1]]), 0);
    }
    let done = work();
    // SAFETY: as above.
    unsafe { assert_eq!(setrlimit(ADDRESS_SPACE, &usual), 0) };
    done
}

#[test]
fn a_lack_of_memory_is_no_problem_or_a_status() {
    let [mut x, mut mult_x_lower, mut mult_x_upper] = [0.0, 0.0, 0.0].map(|zero| vec![zero; MANY]);
    let bounds = vec![1.0; MANY];
    let (mut g, mut mult_g, mut objective) = ([0.0; 2], [0.0; 2], 0.0);
    let many = Definition { x_lower: &bounds, x_upper: &bounds, ..HS071 };
    let mut lock = ipopt_sys::lock().unwrap();

    assert!(without_memory(|| lock.create(&many).is_none()), "no room for the bounds");

    let mut problem = silent(&mut lock, &many);
    let arrays = Arrays {
        x: &mut x,
        g: &mut g,
        objective: &mut objective,
        mult_g: &mut mult_g,
        mult_x_lower: &mut mult_x_lower,
        mult_x_upper: &mut mult_x_upper,
    };
    // SAFETY: memory is too short for Ipopt's copy of the initial point, so no callback runs.
    let status = without_memory(|| unsafe { problem.solve(arrays, ptr::null_mut()) });
    assert_eq!(status, ApplicationReturnStatus::NonIpopt_Exception_Thrown);
    drop(problem);

    assert_optimal(&solve(&mut silent(&mut lock, &HS071)));
}
