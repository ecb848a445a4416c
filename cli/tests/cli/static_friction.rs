//! Friction over the slip from the scenario file to run.json, the verification, and back to a file.

use super::scenario::run_scenario;
use super::support::{Table, run};
use serde_json::{Value, json};
use std::fs;

/// A block that slides while its friction grows from 0.3 to 0.6.
const SCENE: &str = r#"
steps = 31
integrator = "euler"
[ground]
friction = 0.3
static_friction = 0.6
stick_speed = [[0, 1], [0.5, 0]]
[[bodies]]
box = [1.0, 1.0, 0.04]
mass = 1.0
position = [0, 0, 0.02]
velocity = [0.4, 0, 0]
"#;

#[test]
fn a_table_of_friction_runs_and_verifies() {
    let (end, directory) = run_scenario(SCENE, &[]);
    assert_eq!(end.code, Some(0), "{end:?}");
    let out = directory.path().join("out");
    let states = Table::parse(&fs::read_to_string(out.join("states.csv")).unwrap());
    let speeds = states.numbers("vx_m_s");
    for pair in speeds.windows(2) {
        let expected = pair[0] - 0.002 * 9.81 * (0.6 - 0.6 * pair[0]);
        assert!((pair[1] - expected).abs() < 1e-10, "{pair:?} {expected}");
    }
    let file = fs::read_to_string(out.join("run.json")).unwrap();
    let model = &serde_json::from_str::<Value>(&file).unwrap()["model"];
    assert_eq!(model["ground"]["stick_speed"], json!([[0.0, 1.0], [0.5, 0.0]]));
    let verified = run(&["verify", out.to_str().unwrap()]);
    assert_eq!(verified.code, Some(0), "{verified:?}");
    let [scene, again] = ["test.toml", "again.toml"].map(|name| directory.path().join(name));
    let written = run(&["convert", scene.to_str().unwrap(), again.to_str().unwrap()]);
    assert_eq!(written.code, Some(0), "{written:?}");
    let text = fs::read_to_string(again).unwrap();
    assert!(text.contains("stick_speed = [[0.0, 1.0], [0.5, 0.0]]"), "{text}");
}

/// With another table the same rows have wrong friction.
#[test]
fn another_table_does_not_verify() {
    let (end, directory) = run_scenario(SCENE, &[]);
    assert_eq!(end.code, Some(0), "{end:?}");
    let path = directory.path().join("out/run.json");
    let mut file: Value = serde_json::from_str(&fs::read_to_string(&path).unwrap()).unwrap();
    file["model"]["ground"]["stick_speed"][1][0] = json!(0.6);
    file.as_object_mut().unwrap().remove("checksums");
    fs::write(&path, file.to_string()).unwrap();
    let verified = run(&["verify", directory.path().join("out").to_str().unwrap()]);
    assert_eq!(verified.code, Some(1), "{verified:?}");
}

#[test]
fn wrong_tables_are_refused_by_name() {
    for (table, words) in [
        ("[[0.5, 1], [0.1, 0]]", "slip of stick_speed"),
        ("[[0, 2]]", "share of stick_speed"),
        ("[]", "rows of stick_speed"),
        ("\"fast\"", "a slip or a table"),
        ("-1", "stick speed"),
    ] {
        let scene = SCENE.replacen("[[0, 1], [0.5, 0]]", table, 1);
        let (end, _directory) = run_scenario(&scene, &[]);
        end.assert_refused(2, &[words]);
    }
}
