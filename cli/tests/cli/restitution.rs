//! Restitution: flags, scenario, columns and verification.

use super::scenario::run_scenario;
use super::scenes::table;
use super::support::{Table, run, simulate, unseal};
use std::fs;

#[test]
fn a_run_that_bounces_says_so_and_verifies() {
    let bouncing = ["--restitution", "0.6", "--set", "body.inertia=solid"];
    let args = [&["--steps", "300", "--solver", "native"], &bouncing[..]].concat();
    let simulated = simulate(&args);
    assert_eq!(simulated.end.code, Some(0), "{:?}", simulated.end);
    assert!(
        simulated.end.stdout.contains("with changed restitution, body.inertia"),
        "{:?}",
        simulated.end
    );
    let states = table(&simulated, "states");
    let shares = table(&simulated, "steps").numbers("restitution_share");
    assert!(shares.iter().all(|share| (0.0..=1.0).contains(share)));
    assert!(states.numbers("vz_m_s").iter().any(|speed| *speed > 0.1), "it bounces");
    assert_eq!(simulated.run_json()["model"]["ground"]["restitution"], 0.6);
    let path = simulated.path("states.csv");
    let end = run(&["verify", path.to_str().unwrap()]);
    assert_eq!((end.code, end.stderr.as_str()), (Some(0), ""), "{end:?}");
    // The steps do not satisfy another restitution coefficient. The checksums would detect the
    // change too.
    unseal(&simulated.path("run.json"));
    let mut other = simulated.run_json();
    other["model"]["ground"]["restitution"] = 0.2.into();
    fs::write(simulated.path("run.json"), other.to_string()).unwrap();
    let end = run(&["verify", path.to_str().unwrap()]);
    assert_eq!(end.code, Some(1), "{end:?}");
    assert!(end.stdout.contains("rebounds differently from the restitution law"), "{end:?}");
    assert!(!end.stdout.contains("files changed after the run"), "{end:?}");
}

/// A cube bounces on rough ground. The full rebound of some impacts would add energy, so they get a
/// share of it.
#[test]
fn impacts_that_would_make_energy_are_counted() {
    let args = ["--seed", "0", "--restitution", "0.9", "--mu", "1", "--set", "body.inertia=solid"];
    let simulated = simulate(&[&args[..], &["--solver", "native"]].concat());
    assert_eq!(simulated.end.code, Some(0), "{:?}", simulated.end);
    let shares = table(&simulated, "steps").numbers("restitution_share");
    let tempered = shares.iter().filter(|share| **share < 1.0).count();
    assert!(tempered > 0 && tempered < 10, "{tempered}");
    assert!(simulated.end.stdout.contains(&format!("reduced in {tempered} steps")));
    assert_eq!(simulated.run_json()["summary"]["tempered"], tempered);
    let path = simulated.path("states.csv");
    let end = run(&["verify", path.to_str().unwrap()]);
    assert_eq!((end.code, end.stderr.as_str()), (Some(0), ""), "{end:?}");
}

#[test]
fn coefficients_out_of_range_are_refused_by_name() {
    let cases: [(&[&str], &str); 6] = [
        (&["--restitution", "1.1"], "--restitution"),
        (&["--restitution", "-0.1"], "--restitution"),
        (&["--restitution", "nan"], "--restitution"),
        (&["--rebound-speed", "-1"], "--rebound-speed"),
        (&["--scene", "floating", "--restitution", "0.5"], "--restitution"),
        (&["--scene", "floating", "--integrator", "leapfrog"], "--integrator"),
    ];
    for (args, word) in cases {
        let simulated = simulate(args);
        simulated.end.assert_refused(2, &[word]);
        assert!(!simulated.path("states.csv").exists());
    }
}

/// Scene with a ball that bounces on the ground but not on the plate, and a ball that bounces on
/// both.
const SCENE: &str = r#"
steps = 400
[ground]
friction = 0.3
restitution = 0.5
rebound_speed = 0.1
[[bodies]]
name = "dull"
sphere = 0.1
mass = 1.0
position = [0.0, 0.0, 0.6]
[[bodies]]
name = "bright"
sphere = 0.1
mass = 1.0
restitution = 0.9
position = [1.0, 0.0, 0.6]
[[fixed]]
name = "plate"
box = [4.0, 1.0, 0.2]
position = [0.0, 0.0, 0.1]
[[restitution]]
between = ["dull", "plate"]
coefficient = 0.0
"#;

#[test]
fn pairs_bounce_by_their_own_coefficients() {
    let (end, directory) = run_scenario(SCENE, &["--exact"]);
    assert_eq!(end.code, Some(0), "{end:?}");
    let out = directory.path().join("out");
    let states = Table::parse(&fs::read_to_string(out.join("states.csv")).unwrap());
    let speeds: Vec<_> = states.numbers("vz_m_s");
    let fastest = |body: usize| speeds[body..].iter().step_by(2).copied().fold(0.0, f64::max);
    // Speed after a fall of 0.3 m [m/s].
    let arriving = f64::sqrt(2.0 * 9.81 * 0.3);
    assert!(fastest(0) < 1e-9, "{}", fastest(0));
    let expected = f64::sqrt(0.9 * 0.5) * arriving;
    assert!((fastest(1) - expected).abs() < 0.02 * expected, "{} {expected}", fastest(1));
    let steps = out.join("steps.csv");
    let end = run(&["verify", steps.to_str().unwrap()]);
    assert_eq!((end.code, end.stderr.as_str()), (Some(0), ""), "{end:?}");

    let contacts = out.join("contacts.csv");
    let mut table = Table::parse(&fs::read_to_string(&contacts).unwrap());
    let column = table.column("rebound_m_s");
    let row = table.numbers("rebound_m_s").iter().position(|rebound| *rebound > 0.0).unwrap();
    table.rows[row][column] = "0.0".to_owned();
    fs::write(&contacts, table.text()).unwrap();
    let end = run(&["verify", steps.to_str().unwrap()]);
    assert_eq!(end.code, Some(1), "{end:?}");
    assert!(end.stdout.contains("a contact rebounds differently"), "{end:?}");
}

/// Boxes collide with each other and the ground. Rebounds include contacts that separate before the
/// impact and stay open after it.
#[test]
fn boxes_that_strike_each_other_verify() {
    for (restitution, spin) in [(0.1, 1.0), (0.3, 4.0), (0.5, -3.0), (0.8, 2.0)] {
        let mut scene =
            format!("steps = 250\n[ground]\nfriction = 0.5\nrestitution = {restitution}\n");
        for i in 0..4 {
            let (mass, aside, height) = (i + 1, 0.05 * f64::from(i), 0.3 + 0.35 * f64::from(i));
            scene += &format!(
                "[[bodies]]\nname = \"b{i}\"\nbox = [0.2, 0.{}, 0.3]\nmass = {mass}.0\n\
                 position = [{aside}, 0, {height}]\nvelocity = [0.3, -0.5, -2]\n\
                 spin = [{spin}, 2, {}]\n",
                i + 1,
                3 - i
            );
        }
        let (end, directory) = run_scenario(&scene, &[]);
        assert_eq!(end.code, Some(0), "{end:?}");
        let out = directory.path().join("out");
        let contacts = Table::parse(&fs::read_to_string(out.join("contacts.csv")).unwrap());
        assert!(
            contacts.numbers("rebound_m_s").iter().any(|rebound| *rebound < 0.0),
            "none struck"
        );
        let end = run(&["verify", out.join("states.csv").to_str().unwrap()]);
        assert_eq!((end.code, end.stderr.as_str()), (Some(0), ""), "{end:?}");
    }
}

#[test]
fn wrong_entries_of_pairs_are_named() {
    let cases = [
        ("coefficient = 0.0", "coefficient = 1.5", "restitution[0].coefficient"),
        ("between = [\"dull\", \"plate\"]", "between = [\"dull\", \"nobody\"]", "nobody"),
        ("restitution = 0.9", "restitution = 2.0", "bodies[1].restitution"),
        ("restitution = 0.5", "restitution = -2.0", "restitution"),
    ];
    for (old, new, word) in cases {
        let (end, directory) = run_scenario(&SCENE.replace(old, new), &[]);
        end.assert_refused(2, &[word]);
        assert!(!directory.path().join("out").exists(), "{new}");
    }
}
