//! Adhesion from the scenario file to run.json, the table of contacts, the verification, a continued run and back
//! to a file.

use super::scenario::run_scenario;
use super::support::{Table, run, unseal};
use serde_json::{Value, json};
use std::fs;

/// A plate under a beam, a magnet on a wall, and a cup that a growing load pulls off the ground.
const SCENE: &str = r#"
steps = 300
[ground]
friction = 0.5
[[fixed]]
name = "beam"
box = [2.0, 0.4, 0.1]
position = [0, 0, 1.05]
[[fixed]]
name = "wall"
box = [0.1, 2.0, 2.0]
position = [-2.05, 0, 1]
[[bodies]]
name = "plate"
box = [0.2, 0.2, 0.1]
mass = 2.0
position = [0, 0, 0.95]
[[bodies]]
name = "magnet"
box = [0.04, 0.2, 0.2]
mass = 1.0
position = [-1.98, 0, 1]
adhesion = 30.0
[[bodies]]
name = "cup"
box = [0.2, 0.2, 0.1]
mass = 1.0
position = [1, 0, 0.05]
load = { force = [[0, 0, 0, 0], [1, 0, 0, 100]] }
[[adhesion]]
between = ["plate", "beam"]
coefficient = 25.0
[[adhesion]]
between = ["cup", "ground"]
coefficient = 20.0
"#;

#[test]
fn pulls_are_in_the_table_and_verify() {
    let (end, directory) = run_scenario(SCENE, &["--exact"]);
    assert_eq!(end.code, Some(0), "{end:?}");
    let out = directory.path().join("out");
    let states = Table::parse(&fs::read_to_string(out.join("states.csv")).unwrap());
    let heights = states.numbers("z_m");
    let height = |row: usize, body: usize| heights[3 * row + body];
    assert!((height(299, 0) - 0.95).abs() < 1e-12 && (height(299, 1) - 1.0).abs() < 1e-12);
    // m g + F of 100 N/s.
    let leaves = (0..300).find(|row| height(*row, 2) > 0.05 + 1e-7).unwrap();
    assert!((0.002 * leaves as f64 - 0.2981).abs() < 0.005, "{leaves}");
    let contacts = Table::parse(&fs::read_to_string(out.join("contacts.csv")).unwrap());
    let of_plate = |column: &str| -> f64 {
        let rows = contacts.numbers("body").into_iter().zip(contacts.numbers("k"));
        let own =
            rows.zip(contacts.numbers(column)).filter(|((body, k), _)| *body == 0.0 && *k == 0.0);
        own.map(|(_, number)| number).sum()
    };
    assert!((of_plate("force_z_N") - 2.0 * 9.81).abs() < 1e-8);
    let model = fs::read_to_string(out.join("run.json")).unwrap();
    let model = &serde_json::from_str::<Value>(&model).unwrap()["model"];
    assert_eq!(model["bodies"][1]["adhesion"], json!(30.0));
    assert_eq!(model["adhesion"][1]["coefficient"], json!(20.0));
    let verified = run(&["verify", out.to_str().unwrap()]);
    assert_eq!(verified.code, Some(0), "{verified:?}");
    let scene = directory.path().join("test.toml");
    let again = directory.path().join("again.toml");
    let written = run(&["convert", scene.to_str().unwrap(), again.to_str().unwrap()]);
    assert_eq!(written.code, Some(0), "{written:?}");
    let text = fs::read_to_string(again).unwrap();
    assert!(text.contains("adhesion = 30.0") && text.contains("[[adhesion]]"), "{text}");
}

/// Located impacts, an accuracy, rows of loaded contacts only and euler verify too.
#[test]
fn pulls_of_all_kinds_of_runs_verify() {
    for flags in [
        &["--set", "impacts=located"][..],
        &["--set", "accuracy=1e-5"],
        &["--set", "integrator=euler"],
        &["--every", "7"],
    ] {
        let (end, directory) = run_scenario(SCENE, flags);
        assert!(matches!(end.code, Some(0)), "{flags:?} {end:?}");
        let out = directory.path().join("out");
        let verified = run(&["verify", out.to_str().unwrap()]);
        assert_eq!(verified.code, Some(0), "{flags:?} {verified:?}");
    }
}

/// Planted errors are found: a force, a larger pull in the model, and no pull at all.
#[test]
fn planted_errors_are_found() {
    let verify = |change: &dyn Fn(&std::path::Path)| {
        let (end, directory) = run_scenario(SCENE, &[]);
        assert_eq!(end.code, Some(0), "{end:?}");
        let out = directory.path().join("out");
        change(&out);
        unseal(&out.join("run.json"));
        run(&["verify", out.to_str().unwrap()]).code
    };
    let of_model = |old: &'static str, new: &'static str| {
        move |out: &std::path::Path| {
            let path = out.join("run.json");
            let text = fs::read_to_string(&path).unwrap();
            assert!(text.contains(old), "{text}");
            fs::write(&path, text.replacen(old, new, 1)).unwrap();
        }
    };
    assert_eq!(verify(&|_| ()), Some(0));
    // The plate weighs 19.62 N.
    assert_eq!(verify(&of_model("25.0", "19.0")), Some(1));
    assert_eq!(verify(&of_model("20.0", "21.0")), Some(1));
    assert_eq!(verify(&of_model("20.0", "0.0")), Some(1));
    let forces = |out: &std::path::Path| {
        let path = out.join("contacts.csv");
        let mut table = Table::parse(&fs::read_to_string(&path).unwrap());
        let column = table.column("force_z_N");
        table.rows[2][column] = "-30.0".to_owned();
        fs::write(&path, table.text()).unwrap();
    };
    assert_eq!(verify(&forces), Some(1));
}

#[test]
fn wrong_pulls_are_refused_by_name() {
    for (old, new, words) in [
        ("adhesion = 30.0", "adhesion = -1.0", "adhesion is -1.0"),
        ("coefficient = 25.0", "coefficient = 2e9", "adhesion[0]"),
        ("friction = 0.5", "friction = 0.5\nadhesion = -2.0", "adhesion"),
    ] {
        let (end, _directory) = run_scenario(&SCENE.replacen(old, new, 1), &[]);
        end.assert_refused(2, &[words]);
    }
    let (_, directory) = run_scenario(SCENE, &[]);
    let scene = directory.path().join("test.toml");
    run(&["stands", scene.to_str().unwrap()]).assert_refused(2, &["adhesion"]);
}
