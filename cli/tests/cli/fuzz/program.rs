//! Command line arguments from a table and from a random generator.

use super::each;
use crate::support::{End, LIMIT, ONE_BODY, PROGRAM, everything_in, processor_time};
use proptest::prelude::*;
use proptest::sample::select;
use std::ffi::{OsStr, OsString};
use std::fs::File;
use std::path::Path;
use std::process::{Command, Stdio};
use std::thread::sleep;
use std::time::{Duration, Instant};
use tumble_core::step::StepStatus;
use tumble_scene::output::tables::{Streams, TablesReader};

/// Limits of the processor time of a refusal and of a short run. Both usually take milliseconds.
pub const REFUSED_WITHIN: Duration = Duration::from_secs(1);
pub const DONE_WITHIN: Duration = Duration::from_secs(5);

/// Runs the program in `directory` and kills it if it does not end in time. Returns its end and its
/// processor time.
pub fn end_of<S: AsRef<OsStr>>(directory: &Path, args: &[S]) -> (End, Duration) {
    let begin = Instant::now();
    let mut command = Command::new(PROGRAM);
    command.args(args).current_dir(directory).stdin(Stdio::null());
    // Redirects to files, because a pipe could fill up and block the program.
    let streams = ["stdout", "stderr"].map(|name| directory.join(name));
    let [stdout, stderr] = streams.each_ref().map(|path| File::create(path).unwrap());
    let mut child = command.stdout(stdout).stderr(stderr).spawn().unwrap();
    let took = loop {
        let (took, has_ended) = processor_time(child.id());
        if has_ended {
            break took;
        }
        if begin.elapsed() > LIMIT {
            child.kill().unwrap();
            child.wait().unwrap();
            panic!("still running after {LIMIT:?}");
        }
        sleep(Duration::from_micros(300));
    };
    let status = child.wait().unwrap();
    let [stdout, stderr] = streams.map(|path| {
        let text = std::fs::read_to_string(&path).unwrap();
        std::fs::remove_file(path).unwrap();
        text
    });
    (End { code: status.code(), stdout, stderr }, took)
}

/// Asserts one error line with a final newline and without control characters.
pub fn assert_one_line(end: &End) {
    let line = end.stderr.strip_prefix("error: ").unwrap_or_else(|| panic!("{end:?}"));
    let line = line.strip_suffix('\n').unwrap_or_else(|| panic!("{end:?}"));
    assert!(!line.is_empty() && !line.chars().any(char::is_control), "{end:?}");
    assert!(!line.contains("panicked"), "{end:?}");
}

/// Asserts that a simulation with `args` ends in a documented state, and checks its files.
fn check_simulation(args: &[OsString]) {
    let directory = tempfile::tempdir().unwrap();
    let (end, took) = end_of(directory.path(), args);
    match end.code {
        Some(0 | 3) => {
            assert_eq!(end.stderr, "", "{args:?}");
            assert!(took < DONE_WITHIN, "{args:?}: {took:?}");
            if directory.path().join("out").exists() {
                check_files(&directory.path().join("out"), &end);
            }
        }
        Some(2) => {
            assert_one_line(&end);
            assert_eq!(end.stdout, "", "{args:?}");
            assert!(took < REFUSED_WITHIN, "{args:?}: {took:?}");
            assert!(everything_in(directory.path()).is_empty(), "{args:?}");
        }
        _ => panic!("{args:?}: {end:?}"),
    }
}

/// Asserts that the written tables are readable, which are finite then. They must contain failed
/// steps exactly if the exit code is 3.
fn check_files(out: &Path, end: &End) {
    let open = |name: &str| File::open(out.join(name)).unwrap();
    let streams = Streams {
        states: open("states.csv"),
        contacts: Some(open("contacts.csv")),
        steps: open("steps.csv"),
        joints: None,
        gears: None,
        ends: None,
    };
    let reader = TablesReader::new(streams, ONE_BODY).unwrap();
    let mut reader = reader.without_idle_contacts(true).short(true);
    let mut is_solved = true;
    while let Some(step) = reader.next_interval().unwrap() {
        is_solved &= !matches!(step.row.status, StepStatus::Failed | StepStatus::Wild);
    }
    assert_eq!(end.code, Some(if is_solved { 0 } else { 3 }), "{end:?}");
}

/// Flags with a value.
const FLAGS: [&str; 11] = [
    "--scene",
    "--steps",
    "--seed",
    "--dt",
    "--mu",
    "--gravity",
    "--set",
    "--solver",
    "--detection",
    "--tol",
    "--max-iter",
];

/// Unusual values for any flag. None of them is a large step count.
const ODD: [&str; 44] = [
    "",
    " ",
    "  1",
    "1 ",
    "\t",
    "\n",
    "1\n2",
    "-",
    "--",
    "---",
    "=",
    "==1",
    ",",
    ",,",
    "1,",
    ",1",
    "1,,2",
    "0",
    "-0",
    "+1",
    "1.",
    ".5",
    "1e",
    "1e5",
    "1e-400",
    "1e400",
    "-1e400",
    "NaN",
    "inf",
    "-infinity",
    "0x10",
    "1_000",
    "١٢٣",
    "½",
    "∞",
    "null",
    "true",
    "None",
    "'1'",
    "\"1\"",
    "%s%n",
    "$HOME",
    "\u{1b}[31m",
    "\u{202e}1",
];

#[test]
#[ignore = "slow"]
fn invalid_flag_values_end_with_documented_exit_codes() {
    for flag in FLAGS.into_iter().chain(["--on-failure", "--worst", "--quiet", "--wrong"]) {
        for value in ODD {
            // Both forms of a flag, alternating: separate and joined with `=`.
            let args = if value.len() % 2 == 0 {
                vec![flag.to_owned(), value.to_owned()]
            } else {
                vec![format!("{flag}={value}")]
            };
            let mut args: Vec<OsString> = args.into_iter().map(OsString::from).collect();
            if flag != "--steps" {
                args.extend(["--steps", "1"].map(OsString::from));
            }
            check_simulation(&args);
        }
    }
}

/// Strategy for values after a flag: numbers, lists, text and control characters.
fn value() -> impl Strategy<Value = String> {
    let number = prop_oneof![
        super::wild().prop_map(|number| format!("{number:?}")),
        super::wild().prop_map(|number| format!("{number}")),
        any::<i64>().prop_map(|number| number.to_string()),
        "[-+]?[0-9]{0,3}\\.?[0-9]{0,3}([eE][-+]?[0-9]{0,4})?",
    ];
    let list = proptest::collection::vec(number, 1..11).prop_map(|numbers| numbers.join(","));
    prop_oneof![
        4 => list,
        1 => "\\PC{0,12}",
        1 => "[^\\x00]{0,12}",
        1 => select(ODD.to_vec()).prop_map(str::to_owned),
        1 => "[0-9,e-]{100,3000}",
    ]
}

/// True for a step count that takes too long for a test.
fn is_long_run(flag: &str, value: &str) -> bool {
    flag == "--steps" && value.trim().parse::<u64>().is_ok_and(|steps| steps > 300)
}

#[test]
#[ignore = "slow"]
fn random_flag_values_end_with_documented_exit_codes() {
    let flags = proptest::collection::vec((select(FLAGS.to_vec()), value()), 1..3);
    each(500, flags, |flags| {
        let long = flags.iter().any(|(flag, value)| is_long_run(flag, value));
        let steps = flags.iter().any(|(flag, _)| *flag == "--steps");
        if !long {
            let words = flags.into_iter().map(|(flag, value)| format!("{flag}={value}"));
            let mut args: Vec<OsString> = words.map(OsString::from).collect();
            if !steps {
                args.push("--steps=3".into());
            }
            check_simulation(&args);
        }
        Ok(())
    });
}

#[cfg(unix)]
#[test]
#[ignore = "slow"]
fn non_unicode_arguments_end_with_documented_exit_codes() {
    use std::os::unix::ffi::OsStringExt;
    let bytes = proptest::collection::vec(1..=255_u8, 0..12);
    each(200, (select(FLAGS.to_vec()), bytes), |(flag, mut bytes)| {
        bytes.push(0xff);
        let value = OsString::from_vec(bytes);
        let mut joined = OsString::from(format!("{flag}="));
        joined.push(&value);
        for args in [vec![flag.into(), value.clone()], vec![joined], vec![value]] {
            check_simulation(&args);
        }
        Ok(())
    });
}

/// Extreme but valid arguments write a readable file that `verify` accepts with the same exit code.
#[test]
#[ignore = "slow"]
fn a_run_of_any_valid_arguments_writes_a_file_that_can_be_read() {
    // exp(ln(high)) may exceed `high` by rounding.
    let number = |low: f64, high: f64| {
        (low.ln()..high.ln()).prop_map(move |power| power.exp().clamp(low, high))
    };
    let numbers = (number(1e-6, 0.1), number(1e-9, 1e9), number(6e-7, 1e6), number(2e-6, 2e4));
    let motion = proptest::array::uniform6(-1e5..1e5_f64);
    let rest = (numbers, 0.0..10.0_f64, -1e3..1e3_f64, motion, any::<bool>());
    each(80, rest, |((dt, mass, ratio, side), mu, gravity, [x, y, z, a, b, c], native)| {
        let inertia = ratio * mass * side * side;
        // No corner starts below the ground, and some bodies soon touch it.
        let height = 0.867 * side + 1e-3 * dt * z.abs();
        let mut args = vec![
            format!("--dt={dt:?}"),
            format!("--set=body.mass={mass:?}"),
            format!("--set=body.inertia={inertia:?}"),
            format!("--set=body.box={side:?}"),
            format!("--mu={mu:?}"),
            format!("--gravity={gravity:?}"),
            format!("--set=start.position=0,0,{height:?}"),
            format!("--set=start.velocity={x:?},{y:?},{z:?}"),
            format!("--set=start.spin={a:?},{b:?},{c:?}"),
            "--steps=6".to_owned(),
        ];
        args.push(if native { "--solver=native" } else { "--max-iter=60" }.to_owned());
        let directory = tempfile::tempdir().unwrap();
        let (end, took) = end_of(directory.path(), &args);
        prop_assert!(matches!(end.code, Some(0 | 3)) && end.stderr.is_empty(), "{:?}", end);
        prop_assert!(took < DONE_WITHIN, "{:?}", took);
        check_files(&directory.path().join("out"), &end);
        let (verified, _) = end_of(directory.path(), &["verify", "out/states.csv"]);
        prop_assert_eq!(verified.code, end.code, "{:?} {:?}", verified, end);
        Ok(())
    });
}
