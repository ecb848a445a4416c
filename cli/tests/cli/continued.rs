//! `--continue`: a run in parts writes the same bytes as a run in one go.

use super::support::{everything_in, run, unseal};
use crate::ROOT;
use serde_json::Value;
use std::fs;
use std::path::{Path, PathBuf};
use tempfile::TempDir;

const ROWS: [&str; 4] = ["trajectory.csv", "states.csv", "contacts.csv", "steps.csv"];

struct Places(TempDir);

impl Places {
    fn new() -> Self {
        Self(tempfile::tempdir().unwrap())
    }

    fn path(&self, name: &str) -> PathBuf {
        self.0.path().join(name)
    }

    fn text(&self, name: &str) -> String {
        self.path(name).to_str().unwrap().to_owned()
    }

    fn run(&self, args: &[&str], out: &str) {
        let out = self.text(out);
        let end = run(&[args, &["--out", &out]].concat());
        assert!(matches!(end.code, Some(0 | 3)), "{args:?}: {end:?}");
    }
}

/// Tables of a run and its run.json without the solve time.
fn left(folder: &Path) -> (Vec<(PathBuf, String)>, Value) {
    let files =
        everything_in(folder).into_iter().filter(|name| ROWS.iter().any(|row| name.ends_with(row)));
    let files = files.map(|name| {
        let text = fs::read_to_string(folder.join(&name)).unwrap();
        (name, text)
    });
    let json = fs::read_to_string(folder.join("run.json")).unwrap();
    let mut json: Value = serde_json::from_str(&json).unwrap();
    let seconds = json["summary"]["solve_seconds"].take();
    // The file list and the checksum differ if only one of the runs has pictures.
    let _ = (json["files"].take(), json["checksum"].take());
    assert!(seconds.as_f64().unwrap() > 0.0);
    (files.collect(), json)
}

fn assert_same(places: &Places, one: &str, other: &str) {
    let [one, other] = [one, other].map(|name| left(&places.path(name)));
    for (file, again) in one.0.iter().zip(&other.0) {
        assert_eq!(file.0, again.0);
        assert!(file.1 == again.1, "{} differs", file.0.display());
    }
    assert_eq!(one.0.len(), other.0.len());
    assert_eq!(one.1, other.1);
}

fn scenario(name: &str) -> String {
    format!("{ROOT}/scenarios/{name}.toml")
}

/// Asserts that `rows` rows of a run with `args` are equal in one go and in parts.
fn assert_continues(args: &[&str], parts: &[&str], rows: &str) {
    let places = Places::new();
    places.run(&[args, &["--steps", rows]].concat(), "whole");
    places.run(&[args, &["--steps", parts[0]]].concat(), "parts");
    for part in parts[1..].iter().chain(&[rows]) {
        let end = run(&["--continue", &places.text("parts"), "--steps", part]);
        assert!(matches!(end.code, Some(0 | 3)), "{args:?}: {end:?}");
    }
    assert_same(&places, "whole", "parts");
    let file = places.path("parts").join("states.csv");
    let verified = run(&["verify", file.to_str().unwrap()]);
    assert!(matches!(verified.code, Some(0 | 3)), "{args:?}: {verified:?}");
}

#[test]
#[ignore = "slow"]
fn every_scenario_continued_equals_one_run() {
    for entry in fs::read_dir(Path::new(ROOT).join("scenarios")).unwrap() {
        let path = entry.unwrap().path();
        if path.extension().is_some_and(|extension| extension == "toml") {
            assert_continues(&[path.to_str().unwrap()], &["2", "90", "91"], "150");
        }
    }
}

#[test]
fn continued_ipopt_run_equals_one_run() {
    assert_continues(&["--set", "start.position=0,0,1.75"], &["20", "45"], "60");
    assert_continues(&["--seed", "3"], &["215", "228"], "240");
    assert_continues(&["--preset", "tutorial", "--set", "start.position=0,0,1.75"], &["30"], "50");
    assert_continues(
        &["--on-failure", "record", "--set", "start.position=0,0,1.75"],
        &["30"],
        "50",
    );
}

/// Loads, tilted planes, restitution, the floating scene and start indices continue correctly.
#[test]
fn loads_slopes_and_bounces_continue_exactly() {
    let native = ["--solver", "native", "--set", "start.position=0,0,1.8"];
    let with = |more: &[&'static str]| [&native[..], more].concat();
    assert_continues(
        &with(&["--set", "ground.slope=17.3", "--set", "body.inertia=solid"]),
        &["60"],
        "200",
    );
    assert_continues(
        &with(&[
            "--set",
            "ground.normal=0.3,0.2,0.9",
            "--set",
            "ground.offset=-0.1",
            "--restitution",
            "0.7",
        ]),
        &["60", "77"],
        "200",
    );
    assert_continues(
        &with(&[
            "--set",
            "load.force=[[0, 0, 0, 0], [0.4, 300, 0, 20]]",
            "--set",
            "load.at=0,0,0.2",
        ]),
        &["50"],
        "250",
    );
    assert_continues(&["--scene", "floating"], &["1", "7"], "40");
    assert_continues(
        &with(&["--start-index", "700", "--set", "load.force=[[1.5, 0, 0, 0], [2, 90, 0, 0]]"]),
        &["60"],
        "250",
    );
    let pile = scenario("door");
    assert_continues(&[&pile, "--start-index", "123456"], &["60"], "150");
}

/// `--continue` without `--steps` completes the number of rows in run.json.
#[test]
fn continue_without_steps_completes_the_requested_rows() {
    let places = Places::new();
    places.run(&["--solver", "native", "--steps", "300"], "whole");
    // A run that ended early has fewer rows than its run.json requests.
    places.run(&["--solver", "native", "--steps", "120"], "early");
    let file = places.path("early").join("run.json");
    unseal(&file);
    let json = fs::read_to_string(&file).unwrap().replace("\"steps\": 120", "\"steps\": 300");
    fs::write(file, json).unwrap();
    let end = run(&["--continue", &places.text("early")]);
    assert_eq!(end.code, Some(0), "{end:?}");
    assert_same(&places, "whole", "early");
    // A complete run has no remaining steps.
    let end = run(&["--continue", &places.text("early")]);
    assert_eq!(end.code, Some(0), "{end:?}");
    assert_same(&places, "whole", "early");
}

/// `--continue` with another `--out` writes the whole run there and keeps the first one.
#[test]
fn continue_into_new_directory_keeps_old_run() {
    let places = Places::new();
    let pile = scenario("bricks");
    places.run(&[&pile, "--steps", "80"], "first");
    places.run(&[&pile, "--steps", "60"], "again");
    places.run(&[&pile, "--steps", "60"], "kept");
    places.run(
        &[
            "--continue",
            &places.text("again"),
            "--steps",
            "80",
            "--gif",
            "--gif-size",
            "100",
            "--html",
        ],
        "on",
    );
    assert_same(&places, "first", "on");
    assert_same(&places, "again", "kept");
    assert!(places.path("on").join("view.html").exists());
    let states = places.path("on").join("states.csv");
    for command in ["verify", "view", "gif"] {
        let end = run(&[command, states.to_str().unwrap()]);
        assert_eq!(end.code, Some(0), "{command}: {end:?}");
    }
}

/// `--continue` refuses changed settings, a damaged state and rows that do not fit the state.
#[test]
fn invalid_continuations_are_rejected_in_one_sentence() {
    let places = Places::new();
    let native = ["--solver", "native", "--steps", "40"];
    places.run(&native, "run");
    let folder = places.text("run");
    let refused = |args: &[&str], words: &[&str]| run(args).assert_refused(2, words);
    refused(&["--continue", &folder, "--mu", "0.5"], &["--mu", "run.json"]);
    refused(&["--continue", &folder, "--solver", "ipopt"], &["--solver", "run.json"]);
    refused(&["--continue", &folder, "--seed", "1"], &["--seed", "run.json"]);
    refused(&["--continue", &folder, "--scene", "drop"], &["--continue", "--scene"]);
    refused(&["--continue", &folder, "--steps", "39"], &["--steps", "already has 40 rows"]);
    refused(&["--continue", &places.text("nowhere")], &["nowhere", "no run.json"]);
    assert!(!places.path("nowhere").exists());

    let state = places.path("run").join("state.bin");
    let bytes = fs::read(&state).unwrap();
    let on = ["--continue", &folder, "--steps", "60"];
    fs::write(&state, &bytes[..bytes.len() / 2]).unwrap();
    refused(&on, &["state.bin", "cut off"]);
    let mut changed = bytes.clone();
    changed[200] ^= 4;
    fs::write(&state, changed).unwrap();
    refused(&on, &["state.bin", "damaged"]);
    fs::remove_file(&state).unwrap();
    refused(&on, &["state.bin"]);
    fs::write(&state, &bytes).unwrap();

    // State of a different world, then tables with a different last row.
    let json = places.path("run").join("run.json");
    unseal(&json);
    let text = fs::read_to_string(&json).unwrap();
    fs::write(&json, text.replace("\"friction\": 0.3", "\"friction\": 0.31")).unwrap();
    refused(&on, &["state.bin", "another world"]);
    fs::write(&json, &text).unwrap();
    places.run(&["--solver", "native", "--steps", "35"], "other");
    for table in ["states.csv", "contacts.csv", "steps.csv"] {
        fs::copy(places.path("other").join(table), places.path("run").join(table)).unwrap();
    }
    refused(&on, &["state.bin", "k = 39", "is not the last row of"]);
}
