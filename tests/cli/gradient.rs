//! `tumble gradient`: derivatives of a run, beside its own differences.

use crate::support::{End, everything_in, tumble};
use serde_json::Value;
use std::fs;
use std::path::{Path, PathBuf};
use tempfile::TempDir;

fn scenario(name: &str) -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("scenarios").join(name)
}

/// The command on a scenario, with its files in a directory of their own.
fn gradient(name: &str, args: &[&str]) -> (TempDir, End) {
    let directory = TempDir::new().unwrap();
    let mut command = tumble();
    command.arg("gradient").arg(scenario(name)).args(args).arg("--out").arg(directory.path());
    let end = command.output().unwrap().into();
    (directory, end)
}

/// A real toss through its first impacts, and a mechanism: every derivative is its difference, to the third order of
/// 1e-6 and the last digits of some hundred steps.
#[test]
fn derivatives_are_the_differences_of_runs() {
    let cases = [
        (
            "real-cube.toml",
            "distance",
            "position,turn,velocity,spin,force,friction,mass,gravity",
            "200",
        ),
        ("double-pendulum.toml", "speed", "spin,torque,gravity,time_step", "200"),
    ];
    for (name, of, by, steps) in cases {
        let args = ["--of", of, "--by", by, "--steps", steps, "--differences", "1e-6"];
        let (directory, end) = gradient(name, &args);
        assert_eq!((end.code, end.stderr.as_str()), (Some(0), ""));
        let json: Value =
            serde_json::from_slice(&fs::read(directory.path().join("gradient.json")).unwrap())
                .unwrap();
        let rows = json["derivatives"].as_array().unwrap();
        let of_row = |row: &Value, what: &str| row[what].as_f64().unwrap();
        let largest =
            |what: &str| rows.iter().map(|row| of_row(row, what).abs()).fold(0.0, f64::max);
        let scale = largest("derivative");
        assert!(rows.len() > 8 && scale > 1e-3, "{name}");
        for row in rows {
            // What starts in a joint cannot start beside it.
            let (found, expected) = (of_row(row, "derivative"), of_row(row, "difference"));
            assert!((found - expected).abs() <= 3e-5 * scale, "{name} {row}");
        }
        assert_eq!([&json["unsolved"], &json["unknown"], &json["kept"]], [0; 3]);
        let csv = fs::read_to_string(directory.path().join("gradient.csv")).unwrap();
        assert_eq!(csv.lines().count(), rows.len() + 1);
        assert!(csv.starts_with("argument,component,unit,derivative,difference\n"));
        assert!(end.stdout.contains("nearest kink"), "{}", end.stdout);
    }
}

#[test]
fn what_cannot_be_differentiated_is_refused() {
    let cases: [(&[&str], &[&str]); 4] = [
        (&["--of", "x", "--by", "colour"], &["--by: \"colour\" is none", "velocity", "friction"]),
        (&["--of", "x", "--body", "nobody"], &["--body nobody"]),
        (&["--of", "x", "--differences", "-1"], &["--differences", "above 0"]),
        (&["--of", "w"], &["--of", "distance"]),
    ];
    for (args, words) in cases {
        let (directory, end) = gradient("slope.toml", args);
        end.assert_refused(2, words);
        assert!(everything_in(directory.path()).is_empty(), "{args:?}");
    }
    let (_, end) = gradient("floating.toml", &["--of", "x", "--steps", "3"]);
    end.assert_refused(2, &["Runge-Kutta"]);
}
