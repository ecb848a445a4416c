//! `tumble stands`.

use super::support::{End, tumble};
use serde_json::Value;
use std::path::Path;

/// Two blocks, the upper one on the lower one.
const TOWER: &str = "name = \"tower\"\n[ground]\nfriction = 0.5\n[[bodies]]\nname = \"low\"\n\
                     box = [0.6, 0.6, 0.2]\nmass = 3.0\nposition = [0.0, 0.0, 0.1]\n[[bodies]]\n\
                     name = \"high\"\nbox = 0.2\nmass = 1.0\nposition = [0.0, 0.0, 0.3]\n";

fn stands(directory: &Path, args: &[&str]) -> End {
    let args = [&["stands", "scene.toml"], args].concat();
    tumble().args(&args).current_dir(directory).output().unwrap().into()
}

fn scene(text: &str) -> tempfile::TempDir {
    let directory = tempfile::tempdir().unwrap();
    std::fs::write(directory.path().join("scene.toml"), text).unwrap();
    directory
}

#[test]
fn a_tower_stands_up_to_its_limit() {
    let directory = scene(TOWER);
    let here = directory.path();
    let end = stands(here, &["--tilt", "0,1,0", "--least-friction"]);
    assert_eq!((end.code, end.stderr.as_str()), (Some(0), ""), "{end:?}");
    for line in ["tower can stand", "stays", "none is needed", "tilt         up to a slope of 0."] {
        assert!(end.stdout.contains(line), "{line}: {}", end.stdout);
    }
    let asked = ["--push", "high=1,0,0", "--by", "ground.friction=0.4", "--json"];
    let end = stands(here, &asked);
    assert_eq!(end.code, Some(0), "{end:?}");
    let answer: Value = serde_json::from_str(&end.stdout).unwrap();
    let number = |path: &str| answer.pointer(path).and_then(Value::as_f64).unwrap();
    assert!((number("/limit/factor") - 0.5 * 9.81).abs() < 1e-5);
    assert!((number("/limit/slopes/0/slope") - 9.81).abs() < 1e-3);
    assert_eq!(answer["limit"]["slopes"][0]["is_unique"], true);
    assert_eq!(answer["limit"]["weak"][0]["between"], serde_json::json!(["low", "high"]));
    let end = stands(here, &["--base", "1,0,0", "--friction", "0.2..0.5"]);
    assert_eq!(end.code, Some(0), "{end:?}");
    assert!(end.stdout.contains("the worst of 0.2 to 0.5"), "{}", end.stdout);
    assert!(!end.stdout.contains("simulator"), "it has another friction: {}", end.stdout);
}

#[test]
fn a_scene_that_cannot_stand_ends_with_code_3() {
    let directory = scene(&TOWER.replace("0.0, 0.3]", "0.0, 0.4]"));
    let end = stands(directory.path(), &[]);
    assert_eq!(end.code, Some(3), "{end:?}");
    assert!(end.stdout.contains("tower cannot stand") && end.stdout.contains("moves"), "{end:?}");
}

#[test]
fn wrong_questions_are_refused() {
    let directory = scene(TOWER);
    let here = directory.path();
    for (args, words) in [
        (&["--push", "hihg=1,0,0"][..], &["--push", "high"][..]),
        (&["--push", "high=1,0"], &["three numbers"]),
        (&["--tilt", "0,0,1"], &["--tilt", "horizontal"]),
        (&["--friction", "0.5..0.3"], &["smaller first"]),
        (&["--at", "0,0,1"], &["--at", "no meaning"]),
        (&["--push", "high=1,0,0", "--tilt", "0,1,0"], &["--push", "--tilt"]),
        (&["--by", "ground.friction=0.4"], &["--push"]),
        (&["--push", "high=1,0,0", "--by", "ground.frction=0.4"], &["frction"]),
    ] {
        stands(here, args).assert_refused(2, words);
    }
}
