//! Output directory: repeated runs, concurrent runs and a closed standard output.

use super::support::{LIMIT, PROGRAM, WRITTEN, everything_in, run, simulate};
use std::fs;
use std::path::{Path, PathBuf};
use std::process::{Child, Command, Stdio};
use std::thread;
use std::time::{Duration, Instant};

const PICTURES: [&str; 6] =
    ["animation.gif", "plot-energy.png", "plot-energy.svg", "plot.png", "plot.svg", "view.html"];

fn names(files: &[&str]) -> Vec<PathBuf> {
    let mut names: Vec<_> = files.iter().chain(&WRITTEN).map(PathBuf::from).collect();
    names.sort();
    names
}

fn text(path: &Path) -> &str {
    path.to_str().unwrap()
}

#[test]
fn a_second_run_removes_the_pictures_of_the_first_and_says_so() {
    let first = simulate(&["--steps", "3", "--plot", "--html", "--gif", "--gif-size", "100"]);
    let out = first.path("");
    assert_eq!(everything_in(&out), names(&PICTURES));
    assert!(!first.end.stdout.contains("removed"), "{:?}", first.end);
    // The user's files stay.
    fs::write(out.join("notes.svg"), "mine").unwrap();
    fs::write(out.join("own.html"), "mine").unwrap();
    let second = run(&["--steps", "4", "--html", "--out", text(&out)]);
    assert_eq!((second.code, second.stderr.as_str()), (Some(0), ""));
    assert_eq!(everything_in(&out), names(&["notes.svg", "own.html", "view.html"]));
    let printed = "removed animation.gif, plot-energy.png, plot-energy.svg, plot.png, plot.svg, \
                view.html from an earlier run\n";
    assert_eq!(second.stdout.matches(printed).count(), 1, "{}", second.stdout);
    let page = fs::read_to_string(out.join("view.html")).unwrap();
    assert_eq!(page.matches(r#""name":"rows","value":""#).count(), 1);
    assert!(page.contains(r#""name":"rows","value":"4""#), "the page is not of the second run");

    let third = run(&["--steps", "5", "--quiet", "--out", text(&out)]);
    assert_eq!((third.code, third.stdout.as_str()), (Some(0), ""));
    assert!(!out.join("view.html").exists());
}

#[test]
fn a_run_that_is_refused_removes_nothing() {
    let first = simulate(&["--steps", "3", "--plot"]);
    let out = first.path("");
    let before = everything_in(&out);
    run(&["--steps", "3", "--set", "body.mass=-1", "--out", text(&out)])
        .assert_refused(2, &["body.mass"]);
    assert_eq!(everything_in(&out), before);
}

/// Starts a run of minutes and waits until it writes to `out`.
fn a_long_run(out: &Path) -> Child {
    let child = Command::new(PROGRAM)
        .args(["--solver", "native", "--steps", "10000000", "--quiet", "--out", text(out)])
        .stdout(Stdio::null())
        .spawn()
        .unwrap();
    let begin = Instant::now();
    let begun = |path: &PathBuf| text(path).starts_with(".tumble-");
    while !everything_in(out).iter().any(begun) {
        assert!(begin.elapsed() < LIMIT, "the run has not begun");
        thread::sleep(Duration::from_millis(1));
    }
    child
}

#[cfg(unix)]
#[test]
fn second_run_into_a_busy_directory_is_rejected() {
    let earlier = simulate(&["--steps", "5"]);
    let out = earlier.path("");
    let mut running = a_long_run(&out);
    let words = ["another tumble process is writing to", text(&out).trim_end_matches('/'), "--out"];
    run(&["--steps", "3", "--out", text(&out)]).assert_refused(1, &words);
    let csv = out.join("states.csv");
    for command in ["gif", "plot", "view"] {
        run(&[command, text(&csv)]).assert_refused(1, &words);
    }
    // Reading, and writing to another directory, are allowed.
    assert_eq!(run(&["verify", text(&csv)]).code, Some(0));
    let other = earlier.path("other");
    assert_eq!(run(&["plot", text(&csv), "--out", text(&other)]).code, Some(0));
    running.kill().unwrap();
    running.wait().unwrap();
    // A killed run releases its lock on the directory.
    assert_eq!(run(&["--steps", "3", "--out", text(&out)]).code, Some(0));
}

#[cfg(unix)]
#[test]
fn pictures_of_one_run_can_be_made_at_once() {
    let simulated = simulate(&["--steps", "240"]);
    let csv = simulated.path("states.csv");
    let make = |command: &str| {
        Command::new(PROGRAM).args([command, text(&csv)]).stdout(Stdio::null()).spawn().unwrap()
    };
    let all: Vec<_> = ["gif", "plot", "view"].map(make).into();
    for mut child in all {
        assert_eq!(child.wait().unwrap().code(), Some(0));
    }
    assert_eq!(everything_in(&simulated.path("")), names(&PICTURES));
}

#[test]
fn pictures_are_written_with_closed_standard_output() {
    let directory = tempfile::tempdir().unwrap();
    let out = directory.path().join("out");
    let (reader, writer) = std::io::pipe().unwrap();
    drop(reader);
    let output = Command::new(PROGRAM)
        .args(["--steps", "3", "--plot", "--html", "--gif", "--gif-size", "100", "--out"])
        .arg(&out)
        .stdout(writer)
        .output()
        .unwrap();
    let end = super::support::End::from(output);
    end.assert_refused(1, &["standard output cannot be written"]);
    assert_eq!(everything_in(&out), names(&PICTURES));
    for command in ["gif", "plot", "view"] {
        let (reader, writer) = std::io::pipe().unwrap();
        drop(reader);
        let place = directory.path().join(command);
        let output = Command::new(PROGRAM)
            .args([command, text(&out.join("states.csv")), "--out", text(&place)])
            .stdout(writer)
            .output()
            .unwrap();
        let end = super::support::End::from(output);
        end.assert_refused(1, &["standard output cannot be written"]);
        assert!(!everything_in(&place).is_empty(), "{command}");
    }
}
