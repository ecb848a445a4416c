//! Scenario files with Ipopt: agreement with the native solver for unique motions, counts of
//! fallbacks and failures, and refusals.

use super::scenes::table;
use super::support::{Simulated, Table, everything_in, run, simulate};
use std::fs;

/// Scene with a box at rest.
const BOX: &str = r#"
steps = 60
[ground]
friction = 0.5
[[bodies]]
name = "box"
box = 0.2
mass = 1.0
position = [0.0, 0.0, 0.1]
"#;

/// Scene with a rotated box that flies into the ground.
const COLLISION: &str = r#"
steps = 60
[ground]
friction = 0.3
[[bodies]]
name = "a"
box = 0.2
mass = 1.0
position = [0.0, 0.0, 0.17]
attitude = [0.9, 0.2, 0.3, 0.1]
velocity = [1.0, 0.0, -0.5]
spin = [0.3, 2.0, 1.5]
"#;

fn scene(text: &str, flags: &[&str]) -> Simulated {
    let directory = tempfile::tempdir().unwrap();
    let file = directory.path().join("scene.toml");
    fs::write(&file, text).unwrap();
    simulate(&[&[file.to_str().unwrap()], flags].concat())
}

/// Largest difference between two runs in the given columns of the last states.
fn apart(one: &Simulated, other: &Simulated, columns: [&str; 3]) -> f64 {
    let [one, other] = [one, other].map(|done| table(done, "states"));
    let last = |table: &Table, name: &str| *table.numbers(name).last().unwrap();
    let differences = columns.into_iter().map(|name| (last(&one, name) - last(&other, name)).abs());
    differences.fold(0.0, f64::max)
}

/// Bound of the velocity difference of two runs [m/s]. Each of K contact impulses satisfies the
/// contact law to within the residuals δ and δ' of the runs. The motion adds all impulses up, hence
/// Σ 2 K (δ + δ') over the steps.
fn allowed(one: &Simulated, other: &Simulated) -> f64 {
    let [one, other] = [one, other].map(|done| table(done, "steps"));
    let counts = one.numbers("contacts").into_iter().zip(other.numbers("contacts"));
    let residuals = one.numbers("residual_m_s").into_iter().zip(other.numbers("residual_m_s"));
    // The last row has no step.
    let steps = counts.zip(residuals).filter(|(_, (a, b))| a.is_finite() && b.is_finite());
    steps.map(|((n, m), (a, b))| 2.0 * f64::max(n, m) * (a + b)).sum()
}

/// Both solvers agree for a resting box and a corner collision, whose motions are unique.
#[test]
fn ipopt_and_native_agree_where_the_motion_is_unique() {
    for (name, text) in [("rest", BOX), ("collision", COLLISION)] {
        let native = scene(text, &["--integrator", "euler"]);
        let ipopt = scene(text, &["--integrator", "euler", "--solver", "ipopt"]);
        assert_eq!((native.end.code, ipopt.end.code), (Some(0), Some(0)), "{:?}", ipopt.end);
        assert!(native.end.stdout.contains("solver       native\n"), "{:?}", native.end);
        assert!(
            ipopt.end.stdout.contains("solver       ipopt: the tutorial's program"),
            "{:?}",
            ipopt.end
        );
        let json = ipopt.run_json();
        let (solver, summary) = (&json["solver"], &json["summary"]);
        assert_eq!(solver["name"], "ipopt");
        assert_eq!(&solver["tol"], &1e-6);
        let contact_steps = summary["contact_steps"].as_u64().unwrap();
        let rungs = summary["rungs"].as_object().unwrap().values();
        assert_eq!(rungs.map(|count| count.as_u64().unwrap()).sum::<u64>(), contact_steps);
        assert!(contact_steps > 0, "{name}");
        assert!(name == "rest" || summary["iterations"].as_u64().unwrap() > 0);

        let speed = allowed(&native, &ipopt);
        assert!(speed < 1e-3, "{name}: {speed}");
        let found = apart(&native, &ipopt, ["vx_m_s", "vy_m_s", "vz_m_s"]);
        assert!(found <= speed, "{name}: {found:e}, {speed:e} allowed");
        let moved = apart(&native, &ipopt, ["x_m", "y_m", "z_m"]);
        assert!(moved <= 59.0 * 0.002 * speed, "{name}: {moved:e}");
        let verified = run(&["verify", ipopt.path("states.csv").to_str().unwrap()]);
        assert_eq!(verified.code, Some(0), "{name}: {verified:?}");
    }
}

/// A scenario may select the solver and its settings. Flags override them.
#[test]
fn a_scenario_names_its_solver() {
    let settings = "[solver]\nname = \"ipopt\"\ntolerance = 1e-7\nmax_iterations = 200\n";
    let text = format!("{BOX}{settings}");
    let done = scene(&text, &["--steps", "4", "--max-iter", "100"]);
    assert_eq!(done.end.code, Some(0), "{:?}", done.end);
    let solver = &done.run_json()["solver"];
    assert_eq!(solver["name"], "ipopt");
    assert_eq!((&solver["tol"], &solver["max_iter"]), (&1e-7.into(), &100.into()));
    let native = scene(&text, &["--steps", "4", "--solver", "native"]);
    native.end.assert_refused(2, &["solver.tolerance", "native"]);
}

/// The native solution replaces Ipopt's after an iteration limit of 1 and is counted as a fallback.
/// Without the ladder the step fails and either stays in the file or ends the run.
#[test]
fn fallbacks_and_failures_are_counted() {
    let flags = ["--solver", "ipopt", "--max-iter", "1"];
    let ladder = scene(COLLISION, &flags);
    let count = |done: &Simulated, name: &str| done.run_json()["summary"][name].as_u64().unwrap();
    let (contact, fallback) = (count(&ladder, "contact_steps"), count(&ladder, "fallback"));
    assert!(contact > 0 && fallback > 0, "{:?}", ladder.end);
    assert_eq!((ladder.end.code, count(&ladder, "failed")), (Some(0), 0));
    assert!(ladder.end.stdout.contains(&format!("fallback {fallback}")), "{:?}", ladder.end);

    let record = scene(COLLISION, &[&flags[..], &["--on-failure", "record"]].concat());
    let failed = count(&record, "failed");
    assert_eq!((record.end.code, count(&record, "rows")), (Some(3), 60), "{:?}", record.end);
    assert!(failed > 0 && count(&record, "fallback") == 0, "{:?}", record.end);
    assert!(record.end.stdout.contains(&format!("failed       {failed}\n")), "{:?}", record.end);
    let verified = run(&["verify", record.path("states.csv").to_str().unwrap()]);
    assert_eq!(verified.code, Some(3), "{verified:?}");

    let stop = scene(COLLISION, &[&flags[..], &["--on-failure", "stop"]].concat());
    assert_eq!(stop.end.code, Some(3), "{:?}", stop.end);
    assert_eq!(stop.run_json()["outcome"], "stopped");
    assert!(count(&stop, "rows") < 60, "{:?}", stop.end);
}

/// Ipopt refuses scenes outside its program in one sentence and names the alternative.
#[test]
fn scenes_outside_the_program_are_refused() {
    let settings = "[solver]\nname = \"ipopt\"\n";
    let two = format!("{BOX}copies = {{ count = [1, 1, 2], step = [0.0, 0.0, 0.2] }}\n");
    let bouncing = BOX.replace("friction = 0.5", "friction = 0.5\nrestitution = 0.5");
    let block = format!("{BOX}[[fixed]]\nname = \"block\"\nbox = 1.0\nposition = [9, 0, 0]\n");
    let ball = BOX.replace("box = 0.2", "sphere = 0.1");
    for (text, word) in [
        (two, "one body"),
        (bouncing, "restitution"),
        (block, "fixed pieces"),
        (ball, "rounded points"),
    ] {
        for (text, flags, named) in [
            (text.clone(), ["--solver", "ipopt"].as_slice(), "--solver"),
            (format!("{text}{settings}"), &[], "solver.name"),
        ] {
            let done = scene(&text, flags);
            done.end.assert_refused(2, &[named, word, "native solver"]);
            assert_eq!(everything_in(done.directory.path()).len(), 0);
        }
    }
}

/// A thrown cube outside the program takes the native solver, with a note.
#[test]
fn a_cube_that_bounces_takes_the_native_solver_with_a_note() {
    let done = simulate(&["--steps", "4", "--restitution", "0.5"]);
    assert_eq!(done.end.code, Some(0), "{:?}", done.end);
    assert_eq!(done.run_json()["solver"]["name"], "native");
    let note =
        "the native solver solves this scene: the tutorial's program does not support restitution";
    assert!(done.end.stdout.contains(note), "{:?}", done.end);
}
