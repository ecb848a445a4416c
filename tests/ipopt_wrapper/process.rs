//! Effects that are visible only outside the process: crashes, output, files that it reads, memory.
//! Each test starts itself again as a child.

use super::probe::{Call, Callback, Probe, solve, solver};
use super::problems::{all, hs071};
use std::fs;
use std::panic::{AssertUnwindSafe, catch_unwind, resume_unwind};
use std::path::Path;
use std::process::{Command, Stdio};
use std::thread;
use std::time::{Duration, Instant};
use tumble::ipopt::StartPoint;

/// Environment variable of a child. Its value is passed to the job.
const CHILD: &str = "TUMBLE_WRAPPER_TEST_CHILD";

/// Time limit. Jobs take a few seconds, unless they deadlock.
const LIMIT: Duration = Duration::from_secs(600);

/// Value passed to this process if it is a child.
fn child_value() -> Option<String> {
    std::env::var(CHILD).ok()
}

/// Runs the test `name` of this binary in its own process, in `directory`, with `value` passed to
/// it. Exactly this test must run, ignored or not. It must pass in time and print only the lines of
/// the test harness.
fn run_child(name: &str, directory: Option<&Path>, value: &str) {
    let mut command = Command::new(std::env::current_exe().unwrap());
    command.args([name, "--exact", "--include-ignored", "--nocapture", "--test-threads=1"]);
    command.arg("--color=never");
    command.env(CHILD, value).env("RUST_BACKTRACE", "0");
    command.stdout(Stdio::piped()).stderr(Stdio::piped());
    if let Some(directory) = directory {
        command.current_dir(directory);
    }
    let mut child = command.spawn().unwrap();
    let begin = Instant::now();
    while child.try_wait().unwrap().is_none() {
        if begin.elapsed() > LIMIT {
            child.kill().unwrap();
            panic!("{name} {value:?}: still running after {LIMIT:?}");
        }
        thread::sleep(Duration::from_millis(2));
    }
    let output = child.wait_with_output().unwrap();
    let stdout = String::from_utf8_lossy(&output.stdout);
    let stderr = String::from_utf8_lossy(&output.stderr);
    let said = format!("{name} {value:?}: {}\n{stdout}\n{stderr}", output.status);
    assert!(output.status.success(), "{said}");
    assert_eq!(stderr, "", "{said}");
    let lines: Vec<_> = stdout.lines().filter(|line| !line.is_empty()).collect();
    let [first, ran, result] = lines[..] else { panic!("{said}") };
    assert_eq!((first, ran), ("running 1 test", &*format!("test {name} ... ok")), "{said}");
    assert!(result.starts_with("test result: ok. 1 passed; 0 failed; 0 ignored; "), "{said}");
}

/// Runs `job` in its own child process and waits for it. See [`run_child`].
pub fn in_child(name: &str, job: impl FnOnce()) {
    match child_value() {
        Some(_) => job(),
        None => run_child(name, None, "run"),
    }
}

#[test]
fn nothing_is_printed_by_solves_that_succeed_or_fail() {
    in_child("process::nothing_is_printed_by_solves_that_succeed_or_fail", || {
        for problem in all() {
            solve(&problem);
        }
        let mut infeasible = hs071();
        infeasible.bounds.upper.fill(1.5);
        solve(&infeasible);
        let problem = hs071();
        for broken in [Callback::Objective, Callback::Jacobian, Callback::Hessian] {
            let mut probe = Probe::new(&problem, |call: Call<'_>| {
                if call.callback == broken {
                    call.values.fill(f64::NAN);
                }
                true
            });
            let start = StartPoint::Cold { x: &problem.start };
            let mut solver = solver(&problem);
            let outcome = solver.solve(&mut probe, &problem.bounds, &start).unwrap();
            assert!(!outcome.status.is_success());
        }
    });
}

#[test]
fn an_ipopt_opt_in_the_working_directory_is_not_read() {
    let answer = || format!("{:?}", solve(&hs071()).bits());
    if let Some(expected) = child_value() {
        assert_eq!(answer(), expected);
        return;
    }
    let name = "process::an_ipopt_opt_in_the_working_directory_is_not_read";
    let contents: [&[u8]; 6] = [
        b"max_iter 1\n",
        b"tol 0.5\nmu_strategy adaptive\n",
        b"print_level 5\nsb no\n",
        b"output_file ipopt.out\nfile_print_level 5\n",
        b"no_such_option 1\n",
        b"\xff\xfe\x00 linear_solver",
    ];
    for content in contents {
        let directory = tempfile::tempdir().unwrap();
        fs::write(directory.path().join("ipopt.opt"), content).unwrap();
        run_child(name, Some(directory.path()), &answer());
        // Ipopt does not write a file there.
        assert_eq!(fs::read_dir(directory.path()).unwrap().count(), 1);
    }
    let directory = tempfile::tempdir().unwrap();
    fs::create_dir(directory.path().join("ipopt.opt")).unwrap();
    run_child(name, Some(directory.path()), &answer());
}

/// Resident memory [pages].
#[cfg(target_os = "linux")]
fn resident_pages() -> i64 {
    let statm = fs::read_to_string("/proc/self/statm").unwrap();
    statm.split_whitespace().nth(1).unwrap().parse().unwrap()
}

/// Limit for 2000 cycles: 1 MiB of fragmentation, 256 pages of 4 KiB, half a kilobyte per cycle. A
/// problem that is not freed takes tens of kilobytes.
#[cfg(target_os = "linux")]
const MOST_NEW_PAGES: i64 = 256;

#[cfg(target_os = "linux")]
#[test]
#[ignore = "slow"]
fn memory_stays_flat_over_two_thousand_create_solve_free_cycles() {
    in_child("process::memory_stays_flat_over_two_thousand_create_solve_free_cycles", || {
        let problem = hs071();
        // Alternates between success, a stop by the user, a NaN and a panic. All must free their
        // memory.
        let cycle = |round: usize| {
            let mut solver = solver(&problem);
            let mut probe = Probe::new(&problem, |call: Call<'_>| match round % 4 {
                1 => call.progress.is_none_or(|progress| progress.iteration < 2),
                2 if call.callback == Callback::Hessian && call.earlier == 1 => {
                    call.values.fill(f64::NAN);
                    true
                }
                3 if call.callback == Callback::Jacobian && call.earlier == 2 => {
                    resume_unwind(Box::new("on purpose"))
                }
                _ => true,
            });
            let start = StartPoint::Cold { x: &problem.start };
            let _ = catch_unwind(AssertUnwindSafe(|| {
                solver.solve(&mut probe, &problem.bounds, &start).unwrap();
            }));
        };
        (0..200).for_each(cycle);
        let before = resident_pages();
        (0..2000).for_each(cycle);
        let grown = resident_pages() - before;
        assert!(grown <= MOST_NEW_PAGES, "{grown} pages more after 2000 cycles");
    });
}
