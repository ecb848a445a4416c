//! Surfaces that turn from the scenario file to run.json, the verification, a continued run and back to a file.

use super::scenario::run_scenario;
use super::support::{Table, run, unseal};
use serde_json::{Value, json};
use std::fs;

/// A puck on a turntable, and a parcel on a belt in a curve.
const SCENE: &str = r#"
steps = 400
[ground]
friction = 0.5
[[fixed]]
name = "belt"
box = [2.0, 2.0, 0.1]
position = [5, 0, 0.45]
[[bodies]]
name = "puck"
box = [0.04, 0.04, 0.01]
mass = 1.0
position = [1, 0, 0.005]
velocity = [0, 2, 0]
spin = [0, 0, 2]
[[bodies]]
name = "parcel"
box = [0.2, 0.16, 0.1]
mass = 0.5
position = [5, 0, 0.55]
[[surfaces]]
of = "ground"
spin = [0, 0, 2]
[[surfaces]]
of = "belt"
velocity = [0.1, 0, 0]
spin = [0, 0, 0.6]
centre = [5, 1.5, 0]
"#;

#[test]
fn turning_surfaces_carry_bodies_and_verify() {
    for flags in [&[][..], &["--set", "integrator=euler"], &["--set", "accuracy=1e-5"]] {
        let (end, directory) = run_scenario(SCENE, flags);
        assert_eq!(end.code, Some(0), "{end:?}");
        let out = directory.path().join("out");
        let verified = run(&["verify", out.to_str().unwrap()]);
        assert_eq!(verified.code, Some(0), "{flags:?} {verified:?}");
        let states = Table::parse(&fs::read_to_string(out.join("states.csv")).unwrap());
        let last = |column: &str, body: usize| {
            let numbers = states.numbers(column);
            numbers[numbers.len() - 2 + body]
        };
        let allowed = if flags.contains(&"integrator=euler") { 0.02 } else { 1e-4 };
        assert!((last("x_m", 0).hypot(last("y_m", 0)) - 1.0).abs() < allowed, "{flags:?}");
        assert!((last("wz_rad_s", 1) - 0.6).abs() < 0.01, "{flags:?}");
    }
    let (_, directory) = run_scenario(SCENE, &[]);
    let out = directory.path().join("out");
    let model = fs::read_to_string(out.join("run.json")).unwrap();
    let model = &serde_json::from_str::<Value>(&model).unwrap()["model"];
    assert_eq!(model["surfaces"][1]["centre"], json!([5.0, 1.5, 0.0]));
    let scene = directory.path().join("test.toml");
    let again = directory.path().join("again.toml");
    let written = run(&["convert", scene.to_str().unwrap(), again.to_str().unwrap()]);
    assert_eq!(written.code, Some(0), "{written:?}");
    assert!(fs::read_to_string(again).unwrap().contains("spin = [0.0, 0.0, 0.6]"));
    let part = directory.path().join("part");
    let whole = directory.path().join("whole");
    let go = |args: &[&str]| assert_eq!(run(args).code, Some(0), "{args:?}");
    let [scene, part, whole] = [&scene, &part, &whole].map(|path| path.to_str().unwrap());
    go(&["run", scene, "--out", whole]);
    go(&["run", scene, "--out", part, "--steps", "150"]);
    go(&["run", "--continue", part, "--steps", "400"]);
    let states = |folder: &str| fs::read_to_string(format!("{folder}/states.csv")).unwrap();
    assert_eq!(states(part), states(whole));
}

/// Another spin or centre in the model is found.
#[test]
fn planted_errors_are_found() {
    for (old, new) in [("0.6", "0.61"), ("1.5", "1.4")] {
        let (end, directory) = run_scenario(SCENE, &[]);
        assert_eq!(end.code, Some(0), "{end:?}");
        let path = directory.path().join("out/run.json");
        let text = fs::read_to_string(&path).unwrap();
        let at = text.find("\"surfaces\"").unwrap();
        let changed = text[at..].replacen(old, new, 1);
        fs::write(&path, format!("{}{changed}", &text[..at])).unwrap();
        unseal(&path);
        let verified = run(&["verify", directory.path().join("out").to_str().unwrap()]);
        assert_eq!(verified.code, Some(1), "{old} {verified:?}");
    }
}

#[test]
fn wrong_motions_are_refused_by_name() {
    for (old, new, words) in [
        ("spin = [0, 0, 0.6]", "spin = [0, 0, 1e6]", "spin"),
        ("centre = [5, 1.5, 0]", "centre = [5, 1e7, 0]", "centre"),
        ("spin = [0, 0, 0.6]\n", "", "spin: a centre needs one"),
        ("spin = [0, 0, 0.6]", "spin = 0.6", "spin"),
    ] {
        let (end, _directory) = run_scenario(&SCENE.replacen(old, new, 1), &[]);
        end.assert_refused(2, &["surfaces", words]);
    }
}
