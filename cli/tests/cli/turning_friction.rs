//! Rolling and torsional friction from the scenario file to run.json, the table of contacts, the
//! verification and back to a file.

use super::scenario::run_scenario;
use super::support::{Table, run};
use serde_json::{Value, json};
use std::fs;

/// A ball that rolls, another one that spins on a shelf, and a slab.
const SCENE: &str = r#"
steps = 900
[ground]
friction = 0.6
rolling_friction = 0.01
[[bodies]]
name = "ball"
sphere = 0.1
mass = 2.0
position = [0, 0, 0.1]
velocity = [1, 0, 0]
spin = [0, 10, 0]
[[bodies]]
name = "top"
sphere = 0.1
mass = 1.0
position = [0, 1, 0.3]
spin = [0, 0, 10]
torsional_friction = 0.01
[[bodies]]
name = "slab"
box = [0.3, 0.3, 0.1]
mass = 1.0
position = [0, 3, 0.05]
rolling_friction = 0.0
[[fixed]]
name = "shelf"
box = [1.0, 1.0, 0.2]
position = [0, 1, 0.1]
rolling_friction = 0.02
[[torsional_friction]]
between = ["ball", "ground"]
coefficient = 0.005
"#;

#[test]
fn moments_are_in_the_table_and_verify() {
    let (end, directory) = run_scenario(SCENE, &[]);
    assert_eq!(end.code, Some(0), "{end:?}");
    let out = directory.path().join("out");
    let states = Table::parse(&fs::read_to_string(out.join("states.csv")).unwrap());
    let last = |column: &str, body: usize| {
        let numbers = states.numbers(column);
        numbers[numbers.len() - 3 + body]
    };
    assert!((last("x_m", 0) - 0.713_558).abs() < 1e-4 && last("vx_m_s", 0) == 0.0);
    assert!(last("wz_rad_s", 1).abs() < 1e-12);
    let contacts = Table::parse(&fs::read_to_string(out.join("contacts.csv")).unwrap());
    let moments = contacts.numbers("moment_y_N_m");
    assert!((moments[0] + 0.01 * 2.0 * 9.81).abs() < 1e-9, "{}", moments[0]);
    let model = fs::read_to_string(out.join("run.json")).unwrap();
    let model = &serde_json::from_str::<Value>(&model).unwrap()["model"];
    let rolling = |of: &Value| of["rolling_friction"].clone();
    assert_eq!(rolling(&model["ground"]), 0.01);
    assert_eq!(
        (rolling(&model["bodies"][2]), rolling(&model["fixed"][0])),
        (json!(0.0), json!(0.02))
    );
    let verified = run(&["verify", out.to_str().unwrap()]);
    assert_eq!(verified.code, Some(0), "{verified:?}");
    let again = directory.path().join("again.toml");
    let scene = directory.path().join("test.toml");
    let problems = directory.path().join("problems");
    let args = ["run", scene.to_str().unwrap(), "--export-problems", problems.to_str().unwrap()];
    run(&args).assert_refused(2, &["--export-problems", "rolling or torsional friction"]);
    assert!(!problems.exists());
    let written = run(&["convert", scene.to_str().unwrap(), again.to_str().unwrap()]);
    assert_eq!(written.code, Some(0), "{written:?}");
    let text = fs::read_to_string(again).unwrap();
    for line in ["rolling_friction = 0.02", "torsional_friction = 0.01", "[[torsional_friction]]"] {
        assert!(text.contains(line), "{text}");
    }
}

/// A moment of a row that its law does not allow is found.
#[test]
fn a_changed_moment_is_found() {
    let (end, directory) = run_scenario(SCENE, &[]);
    assert_eq!(end.code, Some(0), "{end:?}");
    let path = directory.path().join("out/contacts.csv");
    let mut table = Table::parse(&fs::read_to_string(&path).unwrap());
    let column = table.column("moment_y_N_m");
    table.rows[5][column] = "-0.19".to_owned();
    fs::write(&path, table.text()).unwrap();
    super::support::unseal(&directory.path().join("out/run.json"));
    let verified = run(&["verify", directory.path().join("out").to_str().unwrap()]);
    assert_eq!(verified.code, Some(1), "{verified:?}");
}

#[test]
fn wrong_coefficients_are_refused_by_name() {
    for (old, new, words) in [
        ("rolling_friction = 0.02", "rolling_friction = -1.0", "rolling_friction is -1.0"),
        ("coefficient = 0.005", "coefficient = 11.0", "torsional_friction[0]"),
        ("rolling_friction = 0.01", "rolling_friction = 20.0", "rolling_friction"),
    ] {
        let (end, _directory) = run_scenario(&SCENE.replacen(old, new, 1), &[]);
        end.assert_refused(2, &[words]);
    }
}
