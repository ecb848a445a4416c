//! Command line arguments: help, version and refused values.

use super::support::{everything_in, run, tumble};

#[test]
fn the_version_names_the_ipopt_it_is_linked_with() {
    for flag in ["--version", "-V"] {
        let end = run(&[flag]);
        let expected =
            format!("tumble {} (Ipopt {})\n", env!("CARGO_PKG_VERSION"), tumble::ipopt::VERSION);
        assert_eq!((end.code, end.stdout, end.stderr), (Some(0), expected, String::new()));
    }
}

#[test]
fn help_lists_the_flags_of_a_run() {
    let end = run(&["run", "--help"]);
    assert_eq!((end.code, end.stderr.as_str()), (Some(0), ""));
    for word in [
        "--scene",
        "--steps",
        "--seed",
        "--dt",
        "--mu",
        "--gravity",
        "--threads",
        "SCENE",
        "--detection",
        "--tol",
        "--max-iter",
        "--out",
        "--quiet",
        "--solver",
        "--start-index",
        "--substeps",
        "--on-failure",
        "--every",
        "--tables",
        "--compact",
        "--overwrite",
        "--export-problems",
        "--live",
        "--continue",
        "--help",
        "run.json",
        "Solver:",
        "Output:",
        "Pictures:",
    ] {
        assert!(end.stdout.contains(word), "{word}");
    }
    let end = run(&["--help"]);
    assert_eq!((end.code, end.stderr.as_str()), (Some(0), ""));
    for word in ["run", "verify", "--seed 42", "Exit codes", "--version"] {
        assert!(end.stdout.contains(word), "{word}");
    }
    assert!(end.stdout.lines().count() < 60, "{}", end.stdout);
    for args in [["verify", "--help"], ["view", "--help"], ["help", "verify"]] {
        let end = run(&args);
        assert_eq!((end.code, end.stderr.as_str()), (Some(0), ""), "{args:?}");
        assert!(end.stdout.contains("Usage"), "{args:?}");
    }
}

/// Refused arguments and the strings that the error line must contain.
const REFUSED: [(&[&str], &[&str]); 61] = [
    (&["--steps", "0"], &["--steps", "it is 0", "1 to"]),
    (&["--steps", "1000000000"], &["--steps", "1000000000"]),
    (&["--steps", "-5"], &["--steps"]),
    (&["--steps=-5"], &["--steps", "-5"]),
    (&["--steps", "2.5"], &["--steps"]),
    (&["--steps", "many"], &["--steps", "many"]),
    (&["--steps", ""], &["--steps"]),
    (&["--steps"], &["--steps"]),
    (&["--steps", "18446744073709551616"], &["--steps"]),
    (&["--steps", "5", "--steps", "6"], &["--steps"]),
    (&["--seed", "-1"], &["--seed"]),
    (&["--seed=-1"], &["--seed", "-1"]),
    (&["--seed", "4294967296"], &["--seed", "4294967296", "4294967295"]),
    (&["--seed", "1.0"], &["--seed"]),
    (&["--seed", "x"], &["--seed"]),
    (&["--dt", "nan"], &["--dt", "NaN"]),
    (&["--dt", "inf"], &["--dt"]),
    (&["--dt", "0"], &["dt", "time step", "1e-6 to 0.1"]),
    (&["--dt", "-0.002"], &["dt", "-0.002"]),
    (&["--dt", "0.2"], &["dt", "0.2"]),
    (&["--dt", "1e-7"], &["dt"]),
    (&["--dt", "1e999"], &["--dt"]),
    (&["--mu", "nan"], &["--mu"]),
    (&["--mu", "-0.1"], &["mu", "-0.1"]),
    (&["--mu", "11"], &["mu", "11", "0 to 10"]),
    (&["--gravity", "nan"], &["--gravity"]),
    (&["--gravity", "0,0"], &["--gravity", "three"]),
    (&["--gravity", "0,0,inf"], &["--gravity"]),
    (&["--gravity", "1001"], &["gravity", "1001"]),
    (&["--tol", "0"], &["tol", "above 0"]),
    (&["--tol", "-1e-6"], &["tol"]),
    (&["--tol", "1"], &["tol"]),
    (&["--tol", "2"], &["tol", "2"]),
    (&["--tol", "nan"], &["--tol"]),
    (&["--max-iter", "0"], &["--max-iter", "1 to 1000000"]),
    (&["--max-iter", "1000001"], &["--max-iter"]),
    (&["--max-iter", "-3"], &["--max-iter"]),
    (&["--detection", "wrong"], &["--detection", "wrong", "height", "predictive"]),
    (&["--scene", "wrong"], &["--scene", "wrong", "drop", "floating"]),
    (&["--scene", "floating", "--mu", "0.3"], &["--mu", "floating"]),
    (&["--scene", "floating", "--tol", "1e-6"], &["--tol", "floating"]),
    (&["--scene", "floating", "--max-iter", "9"], &["--max-iter", "floating"]),
    (&["--scene", "floating", "--detection", "height"], &["--detection", "floating"]),
    (&["--scene", "floating", "--dt", "1"], &["dt"]),
    (&["--solver", "wrong"], &["--solver", "wrong", "ipopt", "native"]),
    (&["--solver", "native", "--tol", "1e-6"], &["--tol", "native"]),
    (&["--solver", "native", "--max-iter", "9"], &["--max-iter", "native"]),
    (&["--scene", "floating", "--solver", "native"], &["--solver", "floating"]),
    (&["--threads", "0"], &["--threads", "a whole number from 1 to 1024"]),
    (&["--threads", "1025"], &["--threads", "1025", "1 to 1024"]),
    (&["--threads", "-2"], &["--threads", "-2", "1 to 1024"]),
    (&["--threads", "all"], &["--threads", "all", "1 to 1024"]),
    (&["--out"], &["--out"]),
    (&["--quiet=yes"], &["--quiet"]),
    (&["--wrong"], &["--wrong"]),
    (&["--step", "5"], &["--step"]),
    (&["wrong"], &["wrong"]),
    (&["--steps", "5", "verify", "x.csv"], &["--steps", "verify"]),
    (&["verify"], &["FILE.csv"]),
    (&["verify", "x.csv", "--worst", "-1"], &["--worst"]),
    (&["verify", "x.csv", "--worst", "many"], &["--worst", "a whole number from 0"]),
];

#[test]
fn every_bad_value_is_refused_in_one_line_that_names_its_flag_and_nothing_is_written() {
    let directory = tempfile::tempdir().unwrap();
    let mut faults = Vec::new();
    for (args, words) in REFUSED {
        let output = tumble().args(args).current_dir(directory.path()).output().unwrap();
        let end = super::support::End::from(output);
        let told = std::panic::catch_unwind(|| end.assert_refused(2, words));
        if told.is_err() {
            faults.push(format!("{args:?}: {:?}, exit code {:?}", end.stderr.trim(), end.code));
        }
    }
    assert!(everything_in(directory.path()).is_empty(), "a refused command wrote something");
    assert!(
        faults.is_empty(),
        "{} refusals are not as they should be:\n{}",
        faults.len(),
        faults.join("\n")
    );
}

#[test]
fn error_messages_fit_a_few_terminal_lines() {
    // 1e300 written out has 301 digits.
    for args in [["--gravity", "1e300"], ["--mu", "1e300"], ["--dt", "-1e300"]] {
        let end = run(&args);
        end.assert_refused(2, &[args[0].trim_start_matches('-')]);
        assert!(end.stderr.len() < 240, "{} bytes: {}", end.stderr.len(), end.stderr);
    }
}
