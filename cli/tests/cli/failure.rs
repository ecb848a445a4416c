//! Failures: output that cannot be written ends with exit code 1 and no partial file. Steps without
//! a solution end with exit code 3.

use super::support::{FAILING_RUN, LIMIT, PROGRAM, WRITTEN, everything_in, run, simulate, tumble};
use std::fs;
use std::path::PathBuf;
use std::process::{Command, Stdio};
use std::thread;
use std::time::{Duration, Instant};

#[test]
fn an_output_directory_that_cannot_be_made_is_bad_input() {
    let directory = tempfile::tempdir().unwrap();
    let file = directory.path().join("file");
    fs::write(&file, "kept").unwrap();
    let mut places = vec![file.clone(), file.join("below")];
    if cfg!(target_os = "linux") {
        // Root can write almost everywhere else.
        places.push(PathBuf::from("/proc/xyz"));
    }
    for place in places {
        let end = run(&["--steps", "5", "--out", place.to_str().unwrap()]);
        end.assert_refused(2, &[place.to_str().unwrap(), "--out"]);
    }
    assert_eq!(everything_in(directory.path()), [PathBuf::from("file")]);
    assert_eq!(fs::read_to_string(&file).unwrap(), "kept");
}

#[test]
fn a_directory_in_the_place_of_a_file_is_refused_and_leaves_nothing_else() {
    for name in ["states.csv", "run.json"] {
        let directory = tempfile::tempdir().unwrap();
        fs::create_dir(directory.path().join(name)).unwrap();
        let end = run(&["--steps", "5", "--out", directory.path().to_str().unwrap()]);
        end.assert_refused(2, &[name, "is a directory"]);
        assert_eq!(everything_in(directory.path()), [PathBuf::from(name)]);
    }
}

#[cfg(unix)]
#[test]
fn a_full_disk_ends_with_code_1_and_leaves_the_earlier_files() {
    let earlier = simulate(&["--steps", "5"]);
    let (csv, json) = (earlier.csv(), earlier.run_json());
    let directory = earlier.directory.path().join("out");
    // The shell's file size limit replaces a full disk. The tables of 240 rows have about 90 kB. The
    // limit is 8 blocks of 512 or 1024 bytes.
    let output = Command::new("sh")
        .args(["-c", "trap '' XFSZ; ulimit -f 8; exec \"$0\" \"$@\"", PROGRAM])
        .args(["--steps", "240", "--out", directory.to_str().unwrap()])
        .output()
        .unwrap();
    super::support::End::from(output).assert_refused(1, &["states.csv"]);
    assert_eq!(everything_in(&directory), WRITTEN.map(PathBuf::from));
    assert_eq!((earlier.csv(), earlier.run_json()), (csv, json));
}

#[test]
fn refused_input_leaves_the_earlier_files() {
    let earlier = simulate(&["--steps", "5"]);
    let csv = earlier.csv();
    let out = earlier.directory.path().join("out");
    let bad = ["--steps", "5", "--set", "body.mass=-1", "--out", out.to_str().unwrap()];
    run(&bad).assert_refused(2, &["mass"]);
    assert_eq!(earlier.csv(), csv);
}

#[test]
fn a_run_that_is_killed_leaves_no_table() {
    let directory = tempfile::tempdir().unwrap();
    let out = directory.path().join("out");
    let mut child = Command::new(PROGRAM)
        .args(["--steps", "1000000", "--quiet", "--out", out.to_str().unwrap()])
        .stdout(Stdio::null())
        .stderr(Stdio::null())
        .spawn()
        .unwrap();
    let begin = Instant::now();
    // Wait until the run has opened its files.
    while !out.exists() || fs::read_dir(&out).unwrap().count() < 2 {
        assert!(begin.elapsed() < LIMIT && child.try_wait().unwrap().is_none());
        thread::sleep(Duration::from_millis(2));
    }
    child.kill().unwrap();
    child.wait().unwrap();
    assert!(!out.join("states.csv").exists() && !out.join("run.json").exists());
}

#[cfg(unix)]
#[test]
fn the_files_are_as_readable_as_the_umask_allows() {
    use std::os::unix::fs::PermissionsExt;
    let directory = tempfile::tempdir().unwrap();
    let status = Command::new("sh")
        .args(["-c", "umask 027; exec \"$0\" \"$@\"", PROGRAM, "--steps", "5", "--quiet", "--out"])
        .arg(directory.path())
        .status()
        .unwrap();
    assert!(status.success());
    for name in ["states.csv", "run.json"] {
        let mode = fs::metadata(directory.path().join(name)).unwrap().permissions().mode();
        assert_eq!(mode & 0o777, 0o640, "{name}");
    }
}

#[test]
fn an_ipopt_opt_in_the_working_directory_changes_nothing() {
    let plain = simulate(&["--steps", "230"]);
    for content in [Some("max_iter 1\nprint_level 5\n"), Some("no_such_option 1\n"), None] {
        let directory = tempfile::tempdir().unwrap();
        let options = directory.path().join("ipopt.opt");
        match content {
            Some(content) => fs::write(&options, content).unwrap(),
            None => fs::create_dir(&options).unwrap(),
        }
        let mut command = tumble();
        command.args(["--steps", "230", "--quiet"]).current_dir(directory.path());
        command.assert().success().stdout("").stderr("");
        let written = fs::read_to_string(directory.path().join("out/trajectory.csv")).unwrap();
        assert_eq!(written, plain.csv());
    }
}

/// Both solvers report failure. The certificate allows rounding in proportion to speed. The huge
/// speed of this body must not make its residual pass as rounding.
#[test]
fn runaway_step_fails_with_every_solver() {
    for solver in ["ipopt", "native"] {
        let simulated = simulate(&[&FAILING_RUN[..], &["--solver", solver]].concat());
        assert_eq!(simulated.end.code, Some(3), "{solver}: {}", simulated.end.stdout);
    }
}
