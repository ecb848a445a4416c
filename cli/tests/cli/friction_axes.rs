//! Friction that depends on the direction, from the scenario file to run.json, the verification and back to a
//! file.

use super::scenario::run_scenario;
use super::support::{Table, run};
use serde_json::{Value, json};
use std::fs;

/// A block with its axis across its velocity, and one on a brushed plate.
const SCENE: &str = r#"
steps = 101
time_step = 0.001
[ground]
friction = 0.4
[[bodies]]
name = "block"
box = [0.5, 0.5, 0.004]
mass = 1.0
position = [0, 0, 0.002]
velocity = [1, 0, 0]
[[bodies]]
name = "other"
box = [0.5, 0.5, 0.004]
mass = 1.0
position = [0, 3, 0.102]
velocity = [1, 0, 0]
[[fixed]]
name = "plate"
box = [4.0, 2.0, 0.1]
position = [0, 3, 0.05]
[[surfaces]]
of = "plate"
axis = [1, 0, 0]
factor = 0.25
[[apart]]
between = ["block", "plate"]
[[surfaces]]
of = "block"
axis = [0, 1, 0]
factor = 0.5
"#;

#[test]
fn friction_along_and_across_an_axis() {
    let (end, directory) = run_scenario(SCENE, &[]);
    assert_eq!(end.code, Some(0), "{end:?}");
    let out = directory.path().join("out");
    let states = Table::parse(&fs::read_to_string(out.join("states.csv")).unwrap());
    let speeds = states.numbers("vx_m_s");
    for (body, share) in [(0, 1.0), (1, 0.25)] {
        let speed = speeds[speeds.len() - 2 + body];
        assert!((speed - (1.0 - share * 0.4 * 9.81 * 0.1)).abs() < 1e-9, "{speed}");
    }
    let model = fs::read_to_string(out.join("run.json")).unwrap();
    let model = &serde_json::from_str::<Value>(&model).unwrap()["model"];
    let surface = &model["surfaces"][1];
    assert_eq!((&surface["axis"], &surface["factor"]), (&json!([0.0, 1.0, 0.0]), &json!(0.5)));
    let verified = run(&["verify", out.to_str().unwrap()]);
    assert_eq!(verified.code, Some(0), "{verified:?}");
    let again = directory.path().join("again.toml");
    let scene = directory.path().join("test.toml");
    let written = run(&["convert", scene.to_str().unwrap(), again.to_str().unwrap()]);
    assert_eq!(written.code, Some(0), "{written:?}");
    let text = fs::read_to_string(again).unwrap();
    assert!(text.contains("axis = [0.0, 1.0, 0.0]\nfactor = 0.5"), "{text}");
}

#[test]
fn wrong_axes_are_refused_by_name() {
    for (old, new, words) in [
        ("factor = 0.25", "factor = 0.0", "surfaces[0].factor: a number from 0.001"),
        ("axis = [1, 0, 0]\n", "", "surfaces[0].axis: a factor needs one"),
        ("axis = [1, 0, 0]", "axis = [0, 0, 0]", "surfaces[0].axis: a direction"),
        ("factor = 0.5", "factor = 0.5\naxis_of = \"lid\"", "surfaces[1].axis_of: unknown name"),
        ("factor = 0.5", "factor = 0.5\naxis_of = \"other\"", "to which no joints connect it"),
        ("axis = [0, 1, 0]\nfactor = 0.5", "axis_of = \"other\"", "surfaces[1].velocity: one is"),
        ("of = \"plate\"", "of = \"ground\"", "friction of the ground and of block depends"),
    ] {
        let (end, _directory) = run_scenario(&SCENE.replacen(old, new, 1), &[]);
        end.assert_refused(2, &[words]);
    }
}
