//! `tumble plan`: output files, exact replay and refusals.

use super::support::{run, tumble};
use crate::ROOT;
use serde_json::Value;
use std::fs;
use std::path::{Path, PathBuf};

fn shipped(name: &str) -> String {
    let path = Path::new(ROOT).join("scenarios/plans").join(name);
    path.to_string_lossy().into_owned()
}

fn text(path: PathBuf) -> String {
    fs::read_to_string(&path).unwrap_or_else(|error| panic!("{}: {error}", path.display()))
}

/// Temporary directory with a planning problem of a box on level ground.
fn problem(fields: &str) -> (tempfile::TempDir, String) {
    let directory = tempfile::tempdir().unwrap();
    fs::copy(shipped("box.toml"), directory.path().join("box.toml")).unwrap();
    let path = directory.path().join("problem.toml");
    fs::write(&path, format!("scene = \"box.toml\"\n{fields}")).unwrap();
    let path = path.to_string_lossy().into_owned();
    (directory, path)
}

const SLIDE: &str = "
steps = 30
[[controls]]
kind = \"force\"
x = [-20, 20]
[target]
x = 0.4
tolerance = { position = 1e-3 }
[search]
runs = 300
";

/// A plan replays to the byte from its own controls and from the written scene. `verify` accepts
/// its tables.
#[test]
fn a_plan_runs_again_to_the_byte() {
    let (directory, problem) = problem(SLIDE);
    let out = |name: &str| directory.path().join(name);
    let [first, again, scene] =
        ["first", "again", "scene"].map(|name| out(name).to_string_lossy().into_owned());
    let end = run(&["plan", &problem, "--out", &first]);
    assert_eq!(end.code, Some(0), "{end:?}");
    assert!(end.stdout.contains("box: replayed after 30 steps, 30 variables"), "{end:?}");
    let plan: Value = serde_json::from_str(&text(out("first").join("plan.json"))).unwrap();
    assert_eq!(plan["status"], "replayed");
    assert!(plan["targets"][0]["missed_by"].as_f64().unwrap() <= 1e-3);
    assert_eq!(plan["modes"].as_array().unwrap().len(), 30);

    let controls = out("first").join("controls.csv").to_string_lossy().into_owned();
    let end = run(&["plan", &problem, "--start", &controls, "--replay", "--out", &again]);
    assert_eq!(end.code, Some(0), "{end:?}");
    let written = out("first").join("scene.toml").to_string_lossy().into_owned();
    let end = run(&[&written, "--out", &scene]);
    assert_eq!(end.code, Some(0), "{end:?}");
    for table in ["states.csv", "contacts.csv", "steps.csv"] {
        let rows = text(out("first").join(table));
        assert_eq!(rows, text(out("again").join(table)), "{table}");
        assert_eq!(rows, text(out("scene").join(table)), "{table}");
    }
    assert_eq!(text(out("first").join("controls.csv")), text(out("again").join("controls.csv")));
    let states = out("first").join("states.csv").to_string_lossy().into_owned();
    let end = run(&["verify", &states]);
    assert_eq!(end.code, Some(0), "{end:?}");
}

const ARM: &str = "
time_step = 0.005
[ground]
none = true
friction = 0.5
[[bodies]]
name = \"arm\"
box = [0.4, 0.06, 0.05]
density = 700.0
position = [0.1, 0.2, 1.3]
attitude = { axis = [0.3, -1.0, 0.4], degrees = 37.0 }
[[bodies]]
name = \"tip\"
box = [0.3, 0.04, 0.05]
mass = 0.4
position = [0.6, 0.1, 1.5]
attitude = [0.7071067811865475, -0.7071067811865475, 0.0, 0.0]
[[joints]]
name = \"shoulder\"
type = \"universal\"
bodies = \"arm\"
anchor = [0.0, 0.2, 1.25]
attitude = [0.7071067811865476, -0.7, 0.1, 0.0]
[[joints]]
name = \"elbow\"
type = \"revolute\"
bodies = [\"tip\", \"arm\"]
anchor = [0.45, 0.15, 1.45]
axis = [0.3, 1.0, 0.1]
damping = 0.01
";

/// The written scene has the same joint frames to the last bit, for joints about general axes of
/// rotated bodies.
#[test]
fn plan_by_a_motor_runs_as_a_scene() {
    let directory = tempfile::tempdir().unwrap();
    fs::write(directory.path().join("arm.toml"), ARM).unwrap();
    let file = directory.path().join("problem.toml");
    let problem = "scene = \"arm.toml\"\nsteps = 40\n[[controls]]\nkind = \"motor\"\njoint = \"elbow\"\nforce = [-3, 3]\nknots = 8\n\
        [target]\nbody = \"tip\"\nx = 0.9\n[search]\nstages = [\"sample\"]\nruns = 40\n";
    fs::write(&file, problem).unwrap();
    let problem = file.to_string_lossy().into_owned();
    let [first, scene] =
        ["first", "scene"].map(|name| directory.path().join(name).to_string_lossy().into_owned());
    let end = run(&["plan", &problem, "--out", &first]);
    assert_eq!(end.code, Some(3), "{end:?}");
    let end = run(&[&format!("{first}/scene.toml"), "--out", &scene]);
    assert_eq!(end.code, Some(0), "{end:?}");
    for table in ["states.csv", "joints.csv", "steps.csv"] {
        let [first, scene] =
            [&first, &scene].map(|of| text(PathBuf::from(format!("{of}/{table}"))));
        assert!(first == scene, "{table}");
    }
}

/// The plan of a single `[body]` is a scene. The body is a point mass with a force and an initial
/// velocity.
#[test]
fn plan_of_one_body_runs_as_a_scene() {
    let directory = tempfile::tempdir().unwrap();
    let out = |name: &str| directory.path().join(name);
    let text_of = |name: &str, table: &str| text(out(name).join(table));
    fs::copy(shipped("point.toml"), out("point.toml")).unwrap();
    let file = out("problem.toml");
    let (force, start) = (
        "kind = \"force\"\nx = [0, 30]\nz = [0, 30]\nknots = 3",
        "kind = \"start\"\nof = \"velocity\"\nx = [0, 1]",
    );
    let problem = format!(
        "scene = \"point.toml\"\nsteps = 20\n[[controls]]\n{force}\n[[controls]]\n{start}\n[target]\nx = 0.3\n[search]\nruns = 300\n"
    );
    fs::write(&file, problem).unwrap();
    let [file, first, scene] =
        [file, out("first"), out("scene")].map(|path| path.to_string_lossy().into_owned());
    let end = run(&["plan", &file, "--out", &first]);
    assert_eq!(end.code, Some(0), "{end:?}");
    let written = out("first").join("scene.toml").to_string_lossy().into_owned();
    let end = run(&[&written, "--out", &scene]);
    assert_eq!(end.code, Some(0), "{end:?}");
    let tables = fs::read_dir(out("first")).unwrap().map(|entry| entry.unwrap().file_name());
    let tables = tables.map(|name| name.to_string_lossy().into_owned());
    let tables: Vec<_> =
        tables.filter(|name| name.ends_with(".csv") && name != "controls.csv").collect();
    assert!(!tables.is_empty());
    for table in tables {
        assert_eq!(text_of("first", &table), text_of("scene", &table), "{table}");
    }
}

/// The files do not depend on the number of threads.
#[test]
fn threads_do_not_change_a_plan() {
    let (directory, problem) = problem(SLIDE);
    let files = ["1", "3"].map(|threads| {
        let out = directory.path().join(threads);
        let end = run(&["plan", &problem, "--threads", threads, "--out", out.to_str().unwrap()]);
        assert_eq!(end.code, Some(0), "{end:?}");
        (text(out.join("controls.csv")), text(out.join("plan.json")))
    });
    assert_eq!(files[0], files[1]);
}

/// A target out of reach ends with status `missed` and exit code 3.
#[test]
fn unreachable_target_is_reported_as_missed() {
    let (directory, problem) = problem(&SLIDE.replace("[-20, 20]", "[-3, 3]"));
    let out = directory.path().join("out");
    let end = run(&["plan", &problem, "--out", out.to_str().unwrap()]);
    assert_eq!(end.code, Some(3), "{end:?}");
    let plan: Value = serde_json::from_str(&text(out.join("plan.json"))).unwrap();
    assert_eq!(plan["status"], "missed");
    assert!(plan["reason"].as_str().unwrap().contains("box.position is missed"), "{plan}");
    assert!(out.join("states.csv").exists());
}

/// The shipped problem `stop.toml` finds the initial velocity with which the box stops at its
/// target.
#[test]
fn plan_command_finds_the_velocity_that_stops_at_the_target() {
    let directory = tempfile::tempdir().unwrap();
    let out = directory.path().join("out");
    let end = run(&["plan", &shipped("stop.toml"), "--out", out.to_str().unwrap()]);
    assert_eq!(end.code, Some(0), "{end:?}");
    let controls = text(out.join("controls.csv"));
    assert!(controls.starts_with("k,t,box.velocity.x\n0,0,2.84"), "{controls}");
}

#[test]
fn broken_problems_are_refused_and_leave_nothing() {
    for (fields, words) in [
        ("steps = 30\n", "targets: there are none"),
        (&SLIDE.replace("x = [-20, 20]", "x = [20, -20]"), "the bounds are 20 to -20"),
        (&SLIDE.replace("kind = \"force\"", "kind = \"pull\""), "line 5"),
        (&SLIDE.replace("steps = 30", "steps = 0"), "steps is 0; allowed: 1 to 100000"),
        (&SLIDE.replace("runs = 300", "start = \"none.csv\""), "none.csv"),
        (&SLIDE.replace("runs = 300", "stages = [\"walk\"]"), "walk"),
        (&SLIDE.replace("runs = 300", "stages = []"), "search.stages: the list is empty"),
        (&SLIDE.replace("runs = 300", "rounds = 300"), "expected a whole number from 0 to 255"),
        (&SLIDE.replace("runs = 300", "knots = 70000"), "expected a whole number from 0 to 65535"),
        ("scene = \"\"\n", "scene"),
    ] {
        let (directory, problem) = problem(fields);
        let out = directory.path().join("out");
        let end = run(&["plan", &problem, "--out", out.to_str().unwrap()]);
        end.assert_refused(2, &[words]);
        assert!(!out.exists(), "{fields}");
    }
    run(&["plan", "nowhere.toml"]).assert_refused(2, &["nowhere.toml"]);
}

#[test]
fn controls_of_another_problem_are_refused() {
    let (directory, problem) = problem(SLIDE);
    let table = directory.path().join("controls.csv");
    for (rows, words) in [
        ("k,t,box.force.x\n0,0,1\n", "it has 1 rows; 30 are needed"),
        ("k,t,box.force.y\n", "is not a control of the problem"),
        ("k,t\n", "0 rows"),
    ] {
        fs::write(&table, rows).unwrap();
        let start = table.to_str().unwrap();
        let end = run(&["plan", &problem, "--start", start, "--out", "never"]);
        end.assert_refused(2, &["controls.csv", words]);
    }
    let row = |value: &str| format!("k,t,box.force.x\n{}", format!("0,0,{value}\n").repeat(30));
    fs::write(&table, row("one")).unwrap();
    let start = table.to_str().unwrap();
    let end =
        tumble().args(["plan", &problem, "--start", start, "--out", "never"]).output().unwrap();
    super::support::End::from(end).assert_refused(2, &["\"one\" is not a number"]);
}

/// Table of controls with one row a step and the times of the box problem.
fn table(controls: impl Fn(usize) -> f64) -> String {
    let row = |k: usize| format!("{k},{},{}\n", k as f64 * 0.02, controls(k));
    format!("k,t,box.force.x\n{}", (0..30).map(row).collect::<String>())
}

/// A table of controls that does not fit causes a note in a search and an error in a replay.
#[test]
fn controls_that_do_not_fit_are_reported_or_rejected() {
    let (directory, problem) = problem(&SLIDE.replace("runs = 300", "stages = []"));
    let (pieces, out) = (directory.path().join("pieces.toml"), directory.path().join("out"));
    fs::write(
        &pieces,
        text((&problem).into()).replace("x = [-20, 20]", "x = [-20, 20]\nknots = 3"),
    )
    .unwrap();
    let pieces = pieces.to_str().unwrap();
    let file = directory.path().join("controls.csv");
    let start = file.to_str().unwrap();
    for (problem, rows, words) in [
        (problem.as_str(), table(|k| if k < 4 { 21.0 } else { 1.0 }), "4 numbers are beyond"),
        (pieces, table(|k| k as f64 / 10.0), "27 values differ from the first step"),
        (problem.as_str(), table(|_| 1.0).replace("\n3,", "\n4,"), "1 values of k differ"),
        (problem.as_str(), table(|_| 1.0).replace(",0.02,", ",0.03,"), "1 values of t differ"),
    ] {
        fs::write(&file, rows).unwrap();
        let args = ["plan", problem, "--start", start, "--out", out.to_str().unwrap()];
        let end = run(&args);
        assert_eq!(end.code, Some(3), "{end:?}");
        assert!(end.stdout.contains("controls.csv") && end.stdout.contains(words), "{end:?}");
        fs::remove_dir_all(&out).unwrap();
        run(&[&args[..], &["--replay"]].concat()).assert_refused(2, &["controls.csv", words]);
        assert!(!out.exists());
    }
    // A table that fits causes no note.
    fs::write(&file, table(|_| 1.0)).unwrap();
    let end =
        run(&["plan", &problem, "--start", start, "--replay", "--out", out.to_str().unwrap()]);
    assert!(end.code == Some(3) && !end.stdout.contains("controls.csv:"), "{end:?}");
}

/// The stages `shoot` and `sample` refuse 100 000 variables.
#[test]
fn plans_with_too_many_variables_are_rejected() {
    let fields = SLIDE.replace("steps = 30", "steps = 100000");
    for (stage, words) in
        [("shoot", "shoot: there are 100000 variables; allowed: up to"), ("sample", "sample:")]
    {
        let search = format!("stages = [\"{stage}\"]\nknots = 65535");
        let (directory, problem) = problem(&fields.replace("runs = 300", &search));
        let out = directory.path().join("out");
        let end = run(&["plan", &problem, "--out", out.to_str().unwrap()]);
        end.assert_refused(2, &["problem.toml", words]);
        assert!(!out.exists());
    }
}
