//! Steps without a solution are unsolved everywhere, and steps with one are solved.

use super::scenario::run_scenario;
use super::support::{Table, run};
use std::fs;
use std::path::Path;

fn table(out: &Path, name: &str) -> Table {
    Table::parse(&fs::read_to_string(out.join(name)).unwrap())
}

/// A cube of 0.2 m in a slot of 0.1998 m. No motion removes both overlaps of 0.1 mm, which are 0.05 m/s in
/// a step of 2 ms: every step is unsolved in the table, the summary, the exit code and `verify`.
#[test]
fn overlaps_that_no_motion_removes_are_unsolved() {
    const JAM: &str = r#"
steps = 11
[ground]
none = true
friction = 0.1
[[fixed]]
name = "left"
box = 0.2
position = [-0.1999, 0.0, 0.0]
[[fixed]]
name = "right"
box = 0.2
position = [0.1999, 0.0, 0.0]
[[bodies]]
name = "cube"
box = 0.2
mass = 1.0
position = [0.0, 0.0, 0.0]
"#;
    let flags: [&[&str]; 4] =
        [&[], &["--integrator", "euler"], &["--accuracy", "1e-5"], &["--impacts", "located"]];
    for flags in flags {
        let (end, directory) = run_scenario(JAM, flags);
        assert_eq!(end.code, Some(3), "{end:?}");
        let why = "no solution exists: cube, left, right have 2.0e-4 m too little room";
        assert!(end.stdout.contains(why), "{end:?}");
        let out = directory.path().join("out");
        let steps = table(&out, "steps.csv");
        let (statuses, residuals) = (steps.texts("status"), steps.numbers("residual_m_s"));
        assert!(statuses[..10].iter().all(|status| *status == "failed"), "{statuses:?}");
        assert!(residuals[..10].iter().all(|of| (of - 0.05).abs() < 1e-9), "{residuals:?}");
        // The cube stays: nothing but its overlap is wrong.
        let states = table(&out, "states.csv");
        assert!(states.numbers("x_m").iter().all(|x| x.abs() < 1e-12));
        assert_failed(&out, 10);
    }
}

/// `verify` finds `count` failed steps, and that all rows are right.
fn assert_failed(out: &Path, count: usize) {
    let verified = run(&["verify", out.join("steps.csv").to_str().unwrap()]);
    assert!(verified.stdout.contains(&format!("status `failed`: {count}")), "{verified:?}");
    assert!(verified.stdout.contains("steps that differ from their rows: 0"), "{verified:?}");
}

/// Two driven jaws close on a cube at 1 m/s and meet it after 50 steps of 2 ms. From then on no step has a solution.
/// With located impacts the rest of each step is one interval, and the run ends.
#[test]
fn jaws_that_close_on_a_cube_are_unsolved() {
    let mut scene = "steps = 61\n[ground]\nfriction = 0.3\n".to_owned();
    for (name, x) in [("left", -0.25), ("right", 0.25), ("cube", 0.0)] {
        let place = format!("position = [{x}, 0.0, 0.1]");
        scene += &format!("[[bodies]]\nname = \"{name}\"\nbox = 0.2\nmass = 1.0\n{place}\n");
    }
    for (name, speed) in [("left", 0.5), ("right", -0.5)] {
        scene += &format!("[[driven]]\nbody = \"{name}\"\nvelocity = [{speed}, 0, 0]\n");
    }
    for flags in [&[][..], &["--impacts", "located"], &["--accuracy", "1e-5"]] {
        let (end, directory) = run_scenario(&scene, flags);
        assert_eq!(end.code, Some(3), "{end:?}");
        let why =
            "k = 50       no solution exists: left, right, cube have 2.0e-3 m too little room";
        assert!(end.stdout.contains(why), "{end:?}");
        assert_failed(&directory.path().join("out"), 10);
    }
}

/// A mechanism of eight bodies with a mass ratio of 3.6e4. Newton's method alternates between its motor and
/// its brake; the method of multipliers does not. A few steps miss the limit by rounding.
#[test]
fn a_motor_against_a_locked_brake_is_solved() {
    let scene = format!("{}/cli/tests/cli/hard/mechanism.toml", crate::ROOT);
    let (_, directory) = run_scenario(&fs::read_to_string(scene).unwrap(), &["--steps", "101"]);
    let steps = table(&directory.path().join("out"), "steps.csv");
    let (statuses, residuals) = (steps.texts("status"), steps.numbers("residual_m_s"));
    let missed = statuses.iter().filter(|status| ["failed", "wild"].contains(*status)).count();
    assert!(missed <= 3, "{missed}");
    assert!(residuals.iter().all(|residual| *residual < 1e-8), "{residuals:?}");
    let iterations: f64 = steps.numbers("iterations").iter().sum();
    assert!(iterations < 1e4, "{iterations}");
}

/// Two boxes hit each other edge to edge at 8 m/s, and turn within the step. The plane across the edges does not
/// turn with them, so the force acts 1.6 mm from where they touch. With euler no shorter interval is tried.
#[test]
fn a_force_away_from_where_pieces_touch_is_wild_and_nothing_else() {
    const SCENE: &str = r#"
steps = 30
time_step = 0.002
integrator = "euler"
[ground]
friction = 0.6542244394378204
[[bodies]]
box = [0.21421699169102134, 0.24325822523248026, 0.14506221591756868]
mass = 1.0
position = [-0.3, -0.015300249230011961, 0.3]
attitude = [0.047841670922372195, 0.5731532426948651, -0.5379176867033645, 0.6163206123791556]
velocity = [4.0, 0.0, 0.0]
spin = [0.40711410569638273, -1.7187250222921429, -2.070870415729604]
[[bodies]]
box = [0.23782933494800148, 0.17860309799394844, 0.10669114594516117]
mass = 1.0
position = [0.3, -0.02891725537830219, 0.3]
attitude = [-0.094920797722557, 0.0636448537512414, -0.27648658210131083, 0.9541983780475796]
velocity = [-4.0, 0.0, 0.0]
spin = [0.35158994791088016, 0.6592972813308688, 0.8664300084419239]
"#;
    let (end, directory) = run_scenario(SCENE, &[]);
    assert_eq!(end.code, Some(3), "{end:?}");
    assert!(end.stdout.contains("m from where they touch"), "{end:?}");
    let out = directory.path().join("out");
    let verify = || run(&["verify", out.join("steps.csv").to_str().unwrap()]);
    assert!(verify().stdout.contains("steps that differ from their rows: 0"), "{:?}", verify());
    // With half kicks the step is taken in shorter intervals.
    let (end, _) = run_scenario(&SCENE.replace("euler", "leapfrog"), &[]);
    assert_eq!(end.code, Some(0), "{end:?}");

    let text = fs::read_to_string(out.join("steps.csv")).unwrap();
    assert_eq!(text.matches(",wild,").count(), 1);
    fs::write(out.join("steps.csv"), text.replace(",wild,", ",converged,")).unwrap();
    let refused = verify();
    assert_eq!(refused.code, Some(1), "{refused:?}");
    assert!(refused.stdout.contains("its status is `converged`, but a contact"), "{refused:?}");
}
