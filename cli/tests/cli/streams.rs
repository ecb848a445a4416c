//! Standard streams that are closed, full or unused.

use super::support::{FAILING_RUN, PROGRAM, contact_files, simulate};
use std::io::pipe;
use std::process::{Command, Stdio};

/// Writing end of a pipe without reader.
fn closed_pipe() -> Stdio {
    let (reader, writer) = pipe().unwrap();
    drop(reader);
    writer.into()
}

/// Commands that print, and a directory with a run.
fn printing_commands() -> (tempfile::TempDir, Vec<Vec<String>>) {
    let directory = contact_files();
    let file = |name: &str| directory.path().join(name).to_str().unwrap().to_owned();
    let commands: [&[&str]; 5] = [
        &["--steps", "5", "--out", &file("out")],
        &["verify", &file("states.csv")],
        &["--help"],
        &["verify", "--help"],
        &["--version"],
    ];
    let commands = commands.map(|args| args.iter().map(|&arg| arg.to_owned()).collect()).to_vec();
    (directory, commands)
}

#[test]
fn a_closed_standard_output_ends_with_code_1_and_one_line() {
    let (_directory, commands) = printing_commands();
    for args in commands {
        let output = Command::new(PROGRAM).args(&args).stdout(closed_pipe()).output().unwrap();
        let end = super::support::End::from(output);
        end.assert_refused(1, &["standard output cannot be written"]);
    }
}

#[cfg(target_os = "linux")]
#[test]
fn a_full_standard_output_ends_with_code_1_and_one_line() {
    let (_directory, commands) = printing_commands();
    for args in commands {
        let full = std::fs::OpenOptions::new().write(true).open("/dev/full").unwrap();
        let output = Command::new(PROGRAM).args(&args).stdout(full).output().unwrap();
        let end = super::support::End::from(output);
        end.assert_refused(1, &["standard output cannot be written"]);
    }
}

#[test]
fn a_closed_standard_error_does_not_change_the_exit_code() {
    let (directory, out) = (tempfile::tempdir().unwrap(), "states.csv");
    std::fs::create_dir(directory.path().join(out)).unwrap();
    for (args, code) in [(["--steps", "0"], 2), (["--steps", "5"], 2), (["verify", "/"], 2)] {
        let mut command = Command::new(PROGRAM);
        command.args(args).stdout(Stdio::null()).stderr(closed_pipe());
        if args[1] == "5" {
            // A directory has the name of an output file.
            command.arg("--out").arg(directory.path());
        }
        assert_eq!(command.status().unwrap().code(), Some(code), "{args:?}");
    }
}

#[test]
fn quiet_runs_print_nothing() {
    for args in [
        ["--quiet", "--steps", "230"].as_slice(),
        &[&["--quiet"], FAILING_RUN.as_slice()].concat(),
        &["--quiet", "--scene", "floating", "--steps", "50"],
    ] {
        let end = simulate(args).end;
        assert_eq!((end.stdout.as_str(), end.stderr.as_str()), ("", ""), "{args:?}");
    }
}

#[test]
fn a_quiet_run_needs_no_standard_output() {
    let directory = tempfile::tempdir().unwrap();
    let output = Command::new(PROGRAM)
        .args(["--quiet", "--steps", "5", "--out"])
        .arg(directory.path())
        .stdout(closed_pipe())
        .output()
        .unwrap();
    assert!(output.status.success() && output.stderr.is_empty());
}

#[test]
fn progress_bar_needs_a_terminal() {
    let end = simulate(&["--steps", "230"]).end;
    assert_eq!(end.stderr, "");
    assert!(!end.stdout.contains(['\r', '\u{1b}']), "{:?}", end.stdout);
}
