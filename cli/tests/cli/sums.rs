//! `[[gears]]` with a drive or a motor: tables, verification and refusals.

use super::scenario::run_scenario;
use super::support::{Table, run};
use std::fs;

/// Scene with two sliders. A spring, a damper and a limit act on x₁ + 2 x₂. A servo acts on the
/// difference.
const SUMMED: &str = r#"
steps = 300
time_step = 0.002
[ground]
none = true
friction = 0.5
[[bodies]]
name = "one"
box = [0.1, 0.1, 0.4]
mass = 2.0
position = [0.0, 0.0, 0.0]
[[bodies]]
name = "two"
box = [0.2, 0.1, 0.2]
mass = 1.0
position = [1.0, 0.0, 0.0]
[[joints]]
name = "first"
type = "prismatic"
bodies = "one"
anchor = [0.0, 0.0, 0.0]
axis = [0.0, 0.0, 1.0]
[[joints]]
name = "second"
type = "prismatic"
bodies = "two"
anchor = [1.0, 0.0, 0.0]
axis = [0.0, 0.0, 1.0]
[[gears]]
joints = ["first", "second"]
ratio = -2.0
drive = { limits = [-0.3, 1.0], stiffness = 50.0, damping = 2.0 }
[[gears]]
joints = ["second", "first"]
motor = { position = 0.1, stiffness = 400.0, damping = 20.0, max_force = 30.0 }
"#;

/// Drive and motor forces on sums of joint positions follow their laws, and `verify` finds changed
/// cells.
#[test]
fn laws_on_sums_run_and_verify() {
    let (end, directory) = run_scenario(SUMMED, &[]);
    assert_eq!(end.code, Some(0), "{end:?}");
    let path = directory.path().join("out").join("gears.csv");
    let mut gears = Table::parse(&fs::read_to_string(&path).unwrap());
    let [first, second, force] = ["first", "second", "force"].map(|name| gears.numbers(name));
    let sum = |k: usize| first[2 * k] + 2.0 * second[2 * k];
    let mut stopped = 0;
    for k in 0..299 {
        let (now, next) = (sum(k), sum(k + 1));
        let pull = -50.0 * next - 2.0 * (next - now) / 0.002;
        // Rounding of positions divided by the time step.
        if next > -0.3 + 1e-9 {
            assert!((force[2 * k] - pull).abs() < 1e-9, "{k}: {} {pull}", force[2 * k])
        } else {
            assert!(next >= -0.3 - 1e-12 && force[2 * k] >= pull - 1e-9, "{k}");
            stopped += 1;
        }
        assert!(force[2 * k + 1].abs() <= 30.0);
    }
    assert!(stopped > 0 && stopped < 250, "{stopped}");
    let verify = || run(&["verify", path.to_str().unwrap()]);
    assert_eq!(verify().code, Some(0), "{:?}", verify());
    for column in ["force", "gear_m_s"] {
        for row in [2 * 12, 2 * 12 + 1] {
            let at = gears.column(column);
            let cell = gears.rows[row][at].clone();
            gears.rows[row][at] = (cell.parse::<f64>().unwrap() * 1.001 + 1e-5).to_string();
            fs::write(&path, gears.text()).unwrap();
            let end = verify();
            assert!(end.code == Some(1) && end.stdout.contains("k = 12 "), "{column}: {end:?}");
            gears.rows[row][at] = cell;
        }
    }
}

#[test]
fn invalid_gear_laws_are_rejected_in_one_sentence() {
    let broken: &[(&str, &str, &[&str])] = &[
        ("damping = 2.0", "start = 2.0", &["gears[0] (first, second).drive.start", "leave it out"]),
        ("damping = 2.0", "damping = -2.0", &["gears[0] (first, second)", "damping", "0 to 1e12"]),
        (
            "damping = 2.0",
            "armature = 2.0",
            &[
                "gears[0] (first, second)",
                "armature, static friction, friction curve or restitution of a gear's drive",
            ],
        ),
        ("damping = 2.0", "slack = 2.0", &["slack"]),
        ("[-0.3, 1.0]", "[0.3, 1.0]", &["gears[0] (first, second)", "3.000e-1", "start"]),
        ("position = 0.1, ", "", &["gears[1] (second, first).motor.speed", "`position`"]),
        ("position = 0.1", "speed = 0.1", &["gears[1] (second, first).motor.stiffness"]),
    ];
    for (old, new, words) in broken {
        assert!(SUMMED.contains(old), "{old}");
        let (end, _) = run_scenario(&SUMMED.replacen(old, new, 1), &[]);
        end.assert_refused(2, words);
    }
}
