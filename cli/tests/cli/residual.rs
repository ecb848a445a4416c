//! `--residual`: requested residual of the native solver and its use by `verify`.

use super::scenario::run_scenario;
use super::support::{run, simulate};

const DROP: [&str; 6] = ["--solver", "native", "--steps", "700", "--seed", "42"];

/// A larger requested residual is stored in run.json, reached by the solver and used by `verify`.
#[test]
fn requested_residual_is_stored_reached_and_verified() {
    let of = |residual: &str| simulate(&[&DROP[..], &["--residual", residual]].concat());
    let (usual, exact, less) = (simulate(&DROP), of("1e-9"), of("1e-4"));
    assert_eq!(usual.csv(), exact.csv(), "the usual residual is 1e-9");
    let (json, before) = (less.run_json(), usual.run_json());
    assert_eq!(json["solver"]["residual"], 1e-4);
    let promised = |json: &serde_json::Value| json["solver"]["accepted_residual_m_s"].as_f64();
    let ratio = promised(&json).unwrap() / promised(&before).unwrap();
    assert!((ratio - 1e5).abs() < 1e-6, "{ratio}");
    let reached = json["summary"]["certificate_max_m_s"].as_f64().unwrap();
    // A larger requested residual is reached and not exceeded.
    assert!((1e-9..=promised(&json).unwrap()).contains(&reached), "{reached}");
    assert!(
        less.end.stdout.contains("0.0001 m/s requested")
            || less.end.stdout.contains("1e-4 m/s requested")
    );
    let verified = run(&["verify", less.path("states.csv").to_str().unwrap()]);
    assert_eq!(verified.code, Some(0), "{verified:?}");
}

/// `residual` in a scenario is used, continued and checked for its range.
#[test]
fn residual_of_a_scenario_is_used_and_continued() {
    let text = "steps = 60\n[body]\nbox = 1.0\nmass = 1.0\n[ground]\nfriction = 0.3\n[start]\n\
                position = [0, 0, 0.6]\n[solver]\nname = \"native\"\nresidual = 1e-5\n";
    let (end, directory) = run_scenario(text, &[]);
    assert_eq!(end.code, Some(0), "{end:?}");
    let out = directory.path().join("out");
    let residual = || {
        let json = std::fs::read_to_string(out.join("run.json")).unwrap();
        let json: serde_json::Value = serde_json::from_str(&json).unwrap();
        json["solver"]["residual"].as_f64()
    };
    assert_eq!(residual(), Some(1e-5));
    let end = run(&["--continue", out.to_str().unwrap(), "--steps", "80"]);
    assert_eq!(end.code, Some(0), "{end:?}");
    assert_eq!(residual(), Some(1e-5));
    let (end, _directory) = run_scenario(&text.replace("1e-5", "1.0"), &[]);
    end.assert_refused(2, &["test.toml", "solver.residual", "1e-9 to 1e-2"]);
}

#[test]
fn residual_is_rejected_where_it_has_no_effect() {
    for residual in ["0", "-1e-6", "1e-10", "0.1"] {
        let end = run(&[&DROP[..], &["--residual", residual]].concat());
        end.assert_refused(2, &["--residual", "1e-9 to 1e-2"]);
    }
    run(&["--solver", "native", "--residual", "much"]).assert_refused(2, &["--residual"]);
    run(&["--residual", "1e-6"]).assert_refused(2, &["--residual", "no meaning", "Ipopt"]);
    let floating = ["--scene", "floating", "--residual", "1e-6"];
    run(&floating).assert_refused(2, &["--residual", "no meaning"]);
}
