//! Collision groups from the scenario file to run.json, to the verification and back to a file.

use super::scenario::run_scenario;
use super::support::run;
use serde_json::{Value, json};
use std::fs;

/// Sand that falls through a shelf, and a stone on it.
const SCENE: &str = r#"
steps = 400
[ground]
friction = 0.5
[[bodies]]
name = "sand"
sphere = 0.05
mass = 0.1
groups = ["sand"]
collides_with = ["ground", "sand"]
position = [0.0, 0.0, 1.0]
copies = { count = [1, 1, 2], step = [0.02, 0.0, 0.15] }
[[bodies]]
name = "stone"
sphere = 0.1
mass = 1.0
position = [0.3, 0.0, 0.7]
[[fixed]]
name = "shelf"
box = [2.0, 2.0, 0.1]
groups = ["wood"]
position = [0.0, 0.0, 0.5]
"#;

fn run_json(folder: &std::path::Path) -> Value {
    serde_json::from_str(&fs::read_to_string(folder.join("out/run.json")).unwrap()).unwrap()
}

/// Last height of each body (m).
fn heights(folder: &std::path::Path) -> Vec<f64> {
    let text = fs::read_to_string(folder.join("out/states.csv")).unwrap();
    let mut lines = text.lines();
    let head: Vec<&str> = lines.next().unwrap().split(',').collect();
    let z = head.iter().position(|name| *name == "z_m").unwrap();
    let rows: Vec<&str> = lines.collect();
    let last = &rows[rows.len() - 3..];
    last.iter().map(|row| row.split(',').nth(z).unwrap().parse().unwrap()).collect()
}

#[test]
fn groups_are_in_run_json_and_its_steps_verify() {
    let (end, directory) = run_scenario(SCENE, &[]);
    assert_eq!(end.code, Some(0), "{end:?}");
    let folder = directory.path();
    let z = heights(folder);
    assert!(z[0] < 0.2 && z[1] < 0.2 && (z[2] - 0.65).abs() < 1e-9, "{z:?}");
    let model = &run_json(folder)["model"];
    assert_eq!(model["groups"], json!(["sand", "wood"]));
    let own = &model["bodies"][1];
    assert_eq!(own["groups"], json!(["sand"]));
    assert_eq!(own["collides_with"], json!(["ground", "sand"]));
    assert_eq!(model["bodies"][2].get("groups"), None);
    assert_eq!(model["fixed"][0]["groups"], json!(["wood"]));
    let states = folder.join("out/states.csv");
    let verified = run(&["verify", states.to_str().unwrap()]);
    assert_eq!(verified.code, Some(0), "{verified:?}");
}

#[test]
fn a_scene_without_groups_has_none_in_run_json() {
    let plain = SCENE.lines().filter(|line| !line.starts_with("groups"));
    let plain = plain.filter(|line| !line.starts_with("collides_with")).collect::<Vec<_>>();
    let (end, directory) = run_scenario(&plain.join("\n"), &[]);
    assert_eq!(end.code, Some(0), "{end:?}");
    let text = fs::read_to_string(directory.path().join("out/run.json")).unwrap();
    assert!(!text.contains("groups") && !text.contains("collides_with"));
    assert!(heights(directory.path()).iter().all(|z| *z > 0.59));
}

#[test]
fn unknown_groups_are_refused_with_the_nearest_name() {
    for (from, to, words) in [
        ("\"ground\", \"sand\"", "\"ground\", \"sant\"", ["sand-0", "did you mean \"sand\"?"]),
        ("\"ground\", \"sand\"", "\"stone\"", ["there is no group \"stone\"", "\"wood\""]),
        ("[\"wood\"]", "[\"ground\"]", ["fixed[0].groups", "another name"]),
        ("[\"wood\"]", "\"wood\"", ["line", "groups"]),
    ] {
        assert!(SCENE.contains(from));
        let (end, directory) = run_scenario(&SCENE.replace(from, to), &[]);
        end.assert_refused(2, &words);
        assert!(!directory.path().join("out").exists());
    }
}

#[test]
fn a_converted_scene_has_the_same_groups() {
    let (_, directory) = run_scenario(SCENE, &["--steps", "50"]);
    let folder = directory.path();
    let path = |name: &str| folder.join(name).to_str().unwrap().to_owned();
    let end = run(&["convert", &path("test.toml"), &path("same.toml")]);
    assert_eq!(end.code, Some(0), "{end:?}");
    let end = run(&["run", &path("same.toml"), "--steps", "50", "-o", &path("again")]);
    assert_eq!(end.code, Some(0), "{end:?}");
    let states = |folder: &str| fs::read_to_string(path(folder) + "/states.csv").unwrap();
    assert_eq!(states("again"), states("out"));
    let json: Value =
        serde_json::from_str(&fs::read_to_string(path("again") + "/run.json").unwrap()).unwrap();
    assert_eq!(json["model"]["groups"], run_json(folder)["model"]["groups"]);
    assert_eq!(
        json["model"]["bodies"][0]["groups"],
        run_json(folder)["model"]["bodies"][0]["groups"]
    );
}
