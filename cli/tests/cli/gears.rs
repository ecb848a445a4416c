//! Scenario files with gears.

use super::scenario::run_scenario;
use super::support::{Table, run};
use std::fs;

/// Scene with a rack, a pinion and two gears.
const GEARED: &str = r#"
steps = 100
time_step = 0.002
[ground]
none = true
friction = 0.5
[[bodies]]
name = "rack"
box = [0.1, 0.1, 0.4]
mass = 2.0
position = [0.0, 0.0, 0.0]
[[bodies]]
name = "pinion"
box = [0.2, 0.1, 0.2]
mass = 1.0
position = [1.0, 0.0, 0.0]
[[joints]]
name = "rail"
type = "cylindrical"
bodies = "rack"
anchor = [0.0, 0.0, 0.0]
axis = [0.0, 0.0, 1.0]
slide = { start = 0.05 }
[[joints]]
name = "shaft"
type = "revolute"
bodies = "pinion"
anchor = [1.0, 0.0, 0.0]
axis = [0.0, 1.0, 0.0]
[[gears]]
joints = ["rail", "shaft"]
axes = ["slide", "turn"]
ratio = 0.1
offset = 0.05
[[gears]]
joints = ["rail", "rail"]
axes = ["turn", "slide"]
ratio = 3.0
offset = -0.15
"#;

#[test]
fn gears_of_files_follow_and_verify() {
    let (end, directory) = run_scenario(GEARED, &[]);
    assert_eq!(end.code, Some(0), "{end:?}");
    let path = directory.path().join("out").join("gears.csv");
    let mut gears = Table::parse(&fs::read_to_string(&path).unwrap());
    let (first, second) = (gears.numbers("first"), gears.numbers("second"));
    assert_eq!(first.len(), 2 * 100);
    for k in 0..100 {
        assert!((first[2 * k] - 0.1 * second[2 * k] - 0.05).abs() < 1e-13);
        assert!((first[2 * k + 1] - 3.0 * second[2 * k + 1] + 0.15).abs() < 1e-13);
    }
    // Acceleration a = g m/(m + I/R² + 9 J) with the inertias of solid boxes about their axes.
    let (about_shaft, about_rail) = (0.08 / 12.0, 2.0 * 0.02 / 12.0);
    let rate = 9.81 * 2.0 / (2.0 + about_shaft / 0.01 + 9.0 * about_rail);
    let fallen = 0.05 - first[2 * 99];
    let expected = 0.5 * rate * (99.0 * 0.002_f64).powi(2);
    assert!((fallen - expected).abs() < 1e-4 * expected, "{fallen} {expected}");
    let verify = || run(&["verify", path.to_str().unwrap()]);
    assert_eq!(verify().code, Some(0), "{:?}", verify());
    for column in ["first", "second", "force", "gear_m_s"] {
        let at = gears.column(column);
        let cell = gears.rows[2 * 12][at].clone();
        gears.rows[2 * 12][at] = (cell.parse::<f64>().unwrap() * 1.001 + 1e-5).to_string();
        fs::write(&path, gears.text()).unwrap();
        let end = verify();
        assert!(end.code == Some(1) && end.stdout.contains("k = 12 "), "{column}: {end:?}");
        gears.rows[2 * 12][at] = cell;
    }
    fs::remove_file(&path).unwrap();
    verify().assert_refused(2, &["gears.csv"]);
}

#[test]
fn invalid_gears_are_rejected_in_one_sentence() {
    let broken: &[(&str, &str, &[&str])] = &[
        ("\"rail\", \"shaft\"]", "\"rail\", \"leg\"]", &["gears[0] (rail, leg).joints", "leg"]),
        ("\"rail\", \"shaft\"]", "\"rail\"]", &["gears[0] (rail).joints", "two"]),
        (
            "[\"slide\", \"turn\"]",
            "[\"slide\", \"slide\"]",
            &["gears[0] (rail, shaft).axes", "`turn`"],
        ),
        (
            "[\"slide\", \"turn\"]",
            "[\"slide\"]",
            &["gears[0] (rail, shaft).axes", "one axis per joint"],
        ),
        ("axes = [\"slide\", \"turn\"]", "", &["gears[0] (rail, shaft).axes", "several"]),
        ("[\"turn\", \"slide\"]", "[\"turn\", \"turn\"]", &["gears[1]", "itself"]),
        ("ratio = 0.1", "ratio = 1e9", &["gears[0]", "ratio", "1000000000", "-1e6 to 1e6"]),
        ("offset = 0.05", "", &["gears[0] (rail, shaft)", "5.000e-2", "start"]),
        ("type = \"revolute\"", "type = \"spherical\"", &["shaft", "axis"]),
    ];
    for (old, new, words) in broken {
        assert!(GEARED.contains(old), "{old}");
        let (end, _) = run_scenario(&GEARED.replacen(old, new, 1), &[]);
        end.assert_refused(2, words);
    }
}
