//! Inputs that are not files, have no end or hold bad values. Each refusal is one sentence with the
//! file and the field.

use super::support::{End, contact_files, contact_run, run, simulate, tumble};
use crate::ROOT;
use std::fs;
use std::path::Path;
use std::process::Command;

/// Commands that read a run.
const READERS: [&str; 4] = ["verify", "plot", "view", "gif"];

fn read(command: &str, directory: &Path) -> End {
    tumble().args([command, "states.csv"]).current_dir(directory).output().unwrap().into()
}

#[cfg(unix)]
#[test]
fn pipes_and_devices_are_refused_and_not_waited_for() {
    let directory = tempfile::tempdir().unwrap();
    let pipe = directory.path().join("pipe");
    assert!(Command::new("mkfifo").arg(&pipe).status().unwrap().success());
    for place in [pipe.to_str().unwrap(), "/dev/zero", "/dev/null"] {
        let words = [place, "a pipe or a device"];
        for command in READERS {
            run(&[command, place]).assert_refused(2, &words);
        }
        run(&[place]).assert_refused(2, &words);
    }
    for command in READERS {
        run(&[command, "/"]).assert_refused(2, &["a directory"]);
    }
}

#[cfg(unix)]
#[test]
fn run_json_that_is_a_pipe_or_device_is_rejected() {
    for command in READERS {
        let directory = contact_files();
        let json = directory.path().join("run.json");
        fs::remove_file(&json).unwrap();
        std::os::unix::fs::symlink("/dev/zero", &json).unwrap();
        read(command, directory.path()).assert_refused(2, &["run.json", "a pipe or a device"]);
        fs::remove_file(&json).unwrap();
        // A sparse file of 16 GB.
        fs::File::create(&json).unwrap().set_len(1 << 34).unwrap();
        read(command, directory.path()).assert_refused(2, &["run.json", "longer than 268435456"]);
    }
}

/// Temporary directory with a contact run whose run.json has `old` replaced by `new`.
fn with_json(old: &str, new: &str) -> tempfile::TempDir {
    let directory = contact_files();
    let json = &contact_run()[3];
    assert!(json.contains(old), "{old}");
    fs::write(directory.path().join("run.json"), json.replacen(old, new, 1)).unwrap();
    directory
}

/// First field of the body in run.json.
const NAME: &str = "\"name\": \"body\"";

#[test]
fn bad_values_of_a_run_json_name_the_file_and_the_field() {
    let long = format!("\"{}\"", "x".repeat(1 << 20));
    for (old, new, words) in [
        ("\"drop\"", long.as_str(), ["scene", "80 characters"]),
        ("\"ipopt\"", &long, ["solver.name", "80 characters"]),
        ("\"mass\": 10.0", "\"mass\": -1", ["model.bodies[0].mass", "1e-9 to 1e9"]),
        ("\"mass\": 10.0", "\"mass\": \"10\"", ["model.bodies[0].mass", "expected a number"]),
        ("\"mass\": 10.0", "\"mass\": 1e9", ["model.bodies[0]", "0.01"]),
        ("\"time_step\": 0.002", "\"time_step\": 7", ["model.time_step", "7"]),
        ("\"friction\": 0.3", "\"friction\": -3", ["model.ground.friction", "-3"]),
        ("\"gravity\": [", "\"gravity\": [0,", ["model.gravity", "three are needed"]),
        ("\"normal\": [", "\"normal\": [0,", ["model.ground.normal", "length 4"]),
        ("\"box\": [", "\"box\": [0,", ["model.bodies[0].pieces[0].box", "three are needed"]),
        ("\"position\": [", "\"position\": [0,", ["model.bodies[0].position", "length 4"]),
        ("\"attitude\": [", "\"attitude\": [0,", ["model.bodies[0].attitude", "four numbers"]),
        ("\"drawn\": true", "\"drawn\": 1", ["drawn", "boolean"]),
        ("\"seed\": 42", "\"seed\": -42", ["seed", "-42"]),
        (NAME, "\"load\": 7, \"name\": \"body\"", ["model.bodies[0].load", "expected a table"]),
        (
            NAME,
            "\"load\": {\"force\": [[0, 1, 2, 3, 4]]}, \"name\": \"body\"",
            ["model.bodies[0].load.force", "three numbers"],
        ),
        (
            NAME,
            "\"load\": {\"force\": [[0, 1, 2, 1e30]]}, \"name\": \"body\"",
            ["model.bodies[0].load.force", "1e30"],
        ),
        ("\"format\": 2", "\"format\": 1", ["format of tumble", "run the scene again"]),
    ] {
        let directory = with_json(old, new);
        for command in READERS {
            let end = read(command, directory.path());
            end.assert_refused(2, &[&["run.json"], words.as_slice()].concat());
            assert!(!end.stderr.contains("struct ") && end.stderr.len() < 1000, "{end:?}");
        }
    }
}

/// Control and direction characters in paths and arguments are escaped in all output.
#[cfg(unix)]
#[test]
fn control_characters_are_escaped_in_all_output() {
    let evil = "a\u{1b}]0;owned\u{7}\u{1b}[31m\u{202e}b";
    let directory = tempfile::tempdir().unwrap();
    let place = directory.path().join(evil);
    let place = place.to_str().unwrap();
    let ends = [
        run(&["verify", place]),
        run(&["plot", place]),
        run(&["gif", place]),
        run(&["view", place]),
        run(&[place]),
        run(&["--out", "/dev/null/x\u{1b}[31my", "--steps", "2"]),
    ];
    for end in &ends {
        assert!(end.stderr.contains("\\u{1b}"), "{end:?}");
    }
    let done = run(&["--steps", "3", "--plot", "--html", "--gif", "--out", place]);
    assert_eq!(done.code, Some(0), "{done:?}");
    assert!(done.stdout.contains("\\u{1b}"), "{done:?}");
    for end in ends.iter().chain([&done, &run(&["--set", evil]), &run(&[evil])]) {
        let invalid = ['\u{1b}', '\u{7}', '\u{202e}'];
        assert!(!end.stderr.contains(invalid) && !end.stdout.contains(invalid), "{end:?}");
    }
}

#[test]
fn flag_without_its_value_is_named() {
    for args in [
        ["--steps", "--out", "x"].as_slice(),
        &["--mu", "--steps", "5"],
        &["--gravity", "--out", "verify"],
        &["gif", "--gif-size", "--out", "x", "y.csv"],
    ] {
        let lacking = args.windows(2).find(|pair| pair.iter().all(|arg| arg.starts_with("--")));
        let lacking = lacking.unwrap();
        let words = format!("{} needs a value, and {} follows", lacking[0], lacking[1]);
        run(args).assert_refused(2, &[&words]);
    }
    // A negative vector is a value and not a flag.
    let directory = tempfile::tempdir().unwrap();
    let out = directory.path().join("out");
    let args = ["--steps", "3", "--set", "start.velocity=-1,2,3", "--out", out.to_str().unwrap()];
    assert_eq!(run(&args).code, Some(0));
}

/// Error messages keep the typed notation of a number and stay short.
#[test]
fn numbers_are_shown_as_they_are_typed() {
    for args in [
        ["--set", "start.position=0,0,1e-320"],
        ["--set", "start.position=0,0,-1e300"],
        ["--tol", "1e-320"],
        ["--set", "body.mass=1e-320"],
    ] {
        let end = run(&args);
        end.assert_refused(2, &[args[0]]);
        assert!(end.stderr.len() < 240, "{end:?}");
    }
}

#[test]
fn a_tolerance_that_rounding_cannot_reach_is_refused_with_the_reason() {
    for tolerance in ["1e-16", "9e-13", "1e-300"] {
        let words = ["--tol", tolerance, "1e-12", "rounding", "native"];
        run(&["--steps", "5", "--tol", tolerance]).assert_refused(2, &words);
    }
    assert_eq!(simulate(&["--steps", "5", "--tol", "1e-12"]).end.code, Some(0));
}

/// Changed settings appear in the summary, in run.json and in pictures.
#[test]
fn titles_name_the_changed_settings() {
    for (flags, title) in [
        ([].as_slice(), "drop scene, seed 42, "),
        (&["--mu", "0.3", "--set", "start.position=0,0,2.5"], "drop scene, seed 42, "),
        (&["--mu", "0.2"], "drop scene with changed mu, seed 42, "),
        (
            &["--set", "body.box=1", "--set", "start.position=0,0,3", "--set", "body.mass=2"],
            "with changed body.box, start.position, body.mass, seed 42",
        ),
        (
            &["--scene", "floating", "--set", "start.spin=1,1,1"],
            "floating scene with changed start.spin, ",
        ),
        (
            &[
                "--mu",
                "0",
                "--set",
                "body.mass=2",
                "--dt",
                "0.001",
                "--set",
                "start.position=0,0,4",
                "--gravity",
                "2",
            ],
            "drop scene with 5 changed settings, seed 42, ",
        ),
    ] {
        let args = [flags, &["--steps", "5", "--plot", "--html"]].concat();
        let run = simulate(&args);
        assert_eq!(run.end.code, Some(0), "{:?}", run.end);
        assert!(run.end.stdout.contains(title), "{flags:?}: {}", run.end.stdout);
        let svg = fs::read_to_string(run.path("plot.svg")).unwrap();
        assert!(svg.contains(title), "{flags:?}");
        let changed = run.run_json()["changed"].as_array().unwrap().len();
        assert_eq!(changed == 0, !title.contains("changed"), "{flags:?}");
    }
    let scenario = &format!("{ROOT}/scenarios/slope.toml");
    let flags = [scenario, "--solver", "native", "--mu", "0.9", "--steps", "5"];
    let run = simulate(&flags);
    assert!(run.end.stdout.contains(" with changed mu, 5 rows"), "{}", run.end.stdout);
}

/// Error messages shorten long input and still name the file.
#[test]
fn error_messages_shorten_long_input() {
    let directory = tempfile::tempdir().unwrap();
    let long = "x".repeat(500_000);
    for (name, text) in [
        ("a.toml", format!("[body]\nbox = 1.0\nmass = \"{long}\"\n[start]\nposition = [0,0,0]\n")),
        ("b.toml", format!("{long} = 1\n")),
        ("c.toml", long.clone()),
    ] {
        let path = directory.path().join(name);
        fs::write(&path, text).unwrap();
        let end = run(&[path.to_str().unwrap()]);
        end.assert_refused(2, &[name]);
        assert!(end.stderr.len() < 1000, "{name}: {} bytes", end.stderr.len());
    }
    let end = run(&["--mu", &"9".repeat(100_000)]);
    end.assert_refused(2, &["--mu"]);
    assert!(end.stderr.len() < 1000, "{} bytes", end.stderr.len());
}
