//! Runs with an accuracy: files, checks of the files, continued runs and refusals.

use super::scenario::run_scenario;
use super::support::{Table, run};
use std::fs;

/// A tilted box that falls, bounces and slides, beside a pendulum with a spring.
const SCENE: &str = r#"
steps = 101
time_step = 0.01
accuracy = 1e-5
[ground]
friction = 0.4
restitution = 0.3
[[bodies]]
name = "box"
box = [0.3, 0.2, 0.1]
mass = 1.0
position = [0, 0, 0.4]
attitude = [0.9, 0.3, 0.2, 0.1]
velocity = [1, 0, 0]
[[bodies]]
name = "rod"
box = [0.02, 0.02, 0.4]
mass = 0.5
position = [1.2, 1, 1.0]
attitude = { axis = [0, 1, 0], degrees = 90 }
[[joints]]
name = "hinge"
type = "revolute"
bodies = "rod"
anchor = [1.0, 1, 1.0]
axis = [0, 1, 0]
stiffness = 2.0
"#;

#[test]
fn a_run_with_an_accuracy_is_verified() {
    let (end, directory) = run_scenario(SCENE, &[]);
    assert_eq!(end.code, Some(0), "{end:?}");
    assert!(end.stdout.contains("  substeps     "), "{end:?}");
    let steps = Table::parse(&fs::read_to_string(directory.path().join("out/steps.csv")).unwrap());
    let errors = steps.numbers("error_m");
    assert!(errors.iter().sum::<f64>() <= 3e-5 && errors.iter().any(|error| *error > 0.0));
    assert!(steps.numbers("substeps").iter().sum::<f64>() >= 100.0);
    let states = directory.path().join("out/states.csv");
    let verified = run(&["verify", states.to_str().unwrap()]);
    assert_eq!(verified.code, Some(0), "{verified:?}");
    // A length of a substep that is not that of the row.
    let path = directory.path().join("out/steps.csv");
    super::support::unseal(&directory.path().join("out/run.json"));
    let text = fs::read_to_string(&path).unwrap();
    let length = steps.numbers("substep_s")[50];
    fs::write(&path, text.replacen(&format!(",{length},"), &format!(",{},", 2.0 * length), 1))
        .unwrap();
    assert_eq!(run(&["verify", states.to_str().unwrap()]).code, Some(1));
}

/// Sixteen balls with friction, whose rows often have one substep and the next one another length.
#[test]
fn rows_of_one_substep_are_verified() {
    let path = format!("{}/scenarios/billiard.toml", crate::ROOT);
    let directory = tempfile::tempdir().unwrap();
    let out = directory.path().join("out").to_str().unwrap().to_owned();
    let end = run(&["run", &path, "--steps", "200", "--accuracy", "1e-6", "--out", &out]);
    assert_eq!(end.code, Some(0), "{end:?}");
    let verified = run(&["verify", &out]);
    assert_eq!(verified.code, Some(0), "{verified:?}");
}

/// Steps that begin with a short substep, in which contacts keep their gap, are verified too. Balls in
/// the rack meet at nearly the same time, and the summary says so.
#[test]
fn a_run_with_located_impacts_is_verified() {
    let path = format!("{}/scenarios/billiard.toml", crate::ROOT);
    let directory = tempfile::tempdir().unwrap();
    let out = directory.path().join("out").to_str().unwrap().to_owned();
    let end = run(&["run", &path, "--steps", "150", "--impacts", "located", "--out", &out]);
    assert_eq!(end.code, Some(0), "{end:?}");
    assert!(end.stdout.contains("impacts are closer than the error"), "{end:?}");
    let file = fs::read_to_string(directory.path().join("out/run.json")).unwrap();
    assert!(file.contains("\"ambiguous\": ") && !file.contains("\"coarse\""), "{file}");
    let verified = run(&["verify", &out]);
    assert_eq!(verified.code, Some(0), "{verified:?}");
    let both = run(&["run", &path, "--impacts", "stepped", "--accuracy", "1e-5", "--out", &out]);
    assert_eq!(both.code, Some(2), "{both:?}");
    assert!(both.stderr.contains("leave out impacts, or the accuracy"), "{both:?}");
}

#[test]
fn a_run_with_an_accuracy_goes_on() {
    let (whole, directory) = run_scenario(SCENE, &[]);
    assert_eq!(whole.code, Some(0), "{whole:?}");
    let path = |name: &str| directory.path().join(name).to_str().unwrap().to_owned();
    let half = run(&["run", &path("test.toml"), "--steps", "50", "--out", &path("half")]);
    assert_eq!(half.code, Some(0), "{half:?}");
    let more = run(&["--continue", &path("half"), "--steps", "101"]);
    assert_eq!(more.code, Some(0), "{more:?}");
    let states = |name: &str| fs::read_to_string(path(&format!("{name}/states.csv"))).unwrap();
    assert_eq!(states("out"), states("half"));
}

#[test]
fn an_accuracy_needs_the_leapfrog_integrator() {
    let (end, directory) = run_scenario(SCENE, &["--integrator", "euler"]);
    end.assert_refused(2, &["accuracy", "leapfrog"]);
    assert!(!directory.path().join("out").exists());
    let (end, _directory) = run_scenario(SCENE, &["--accuracy", "0"]);
    end.assert_refused(2, &["accuracy", "1e-10 to 1"]);
}
