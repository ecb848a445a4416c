//! Shipped mechanisms and notes about their joints.

use super::scenario::run_scenario;
use super::scenes::{scene, table};
use super::support::{Table, run};
use crate::ROOT;
use std::fs;

/// Undriven mechanisms keep their energy, and a motor keeps its speed. The door opens to its limit
/// and closes. No chain link enters the ground.
#[test]
fn the_shipped_mechanisms_move_as_they_should() {
    for name in ["double-pendulum", "four-bar"] {
        let energy = table(&scene(name, &[]), "steps").numbers("energy_J");
        let off = energy.iter().map(|e| (e - energy[0]).abs()).fold(0.0, f64::max);
        // The energy error is of second order in the step and has no drift.
        assert!(
            off < 1e-3 * energy[0] && (energy.last().unwrap() - energy[0]).abs() < 1e-4,
            "{off}"
        );
    }
    let crank = table(&scene("slider-crank", &[]), "joints");
    let of = |joint: usize, column: &str| -> Vec<f64> {
        crank.numbers(column).into_iter().skip(joint).step_by(4).collect()
    };
    let turned = of(0, "angle_z_rad");
    let turn = turned[2000] - turned[1000];
    assert!((turn - std::f64::consts::TAU).abs() < 1e-9, "{turn}");
    // Slider position x = r cos θ + √(l² − r² sin² θ), measured from 0.7 m.
    for (angle, place) in turned.iter().zip(of(3, "z_m")) {
        let x = 0.2 * angle.cos() + (0.25 - (0.2 * angle.sin()).powi(2)).sqrt();
        assert!((x - 0.7 - place).abs() < 1e-12, "{angle}: {place} {x}");
    }
    let door = table(&scene("door", &[]), "joints").numbers("angle_z_rad");
    let (most, least) = (door.iter().copied().fold(0.0, f64::max), door.last().unwrap().abs());
    assert!((most - 1.4).abs() < 1e-12 && least < 1e-12, "{most} {least}");
    let chain = scene("chain", &[]);
    let low = table(&chain, "states").numbers("z_m");
    assert!(low.iter().all(|z| *z > 0.0119), "a link is in the ground");
    let intervals = table(&chain, "joints").numbers("interval");
    assert_eq!(intervals.iter().filter(|interval| **interval == 0.0).count(), 20 * 1501);
}

/// Scene with two shafts joined by a cardan joint, and a rod that hangs on a ball joint with a cone
/// and twist limits.
const SHAFT: &str = r#"
steps = 401
time_step = 0.001
[ground]
none = true
friction = 0.5
[[bodies]]
name = "drive"
box = [0.3, 0.04, 0.04]
mass = 1.0
position = [-0.15, 0.0, 1.0]
[[bodies]]
name = "driven"
box = [0.3, 0.03, 0.05]
mass = 1.0
position = [0.1299038105676658, 0.075, 1.0]
attitude = { axis = [0, 0, 1], degrees = 30 }
[[bodies]]
name = "rod"
box = [0.05, 0.08, 0.4]
mass = 1.0
position = [0.0, 2.0, 0.8]
[[joints]]
name = "in"
type = "revolute"
bodies = "drive"
anchor = [-0.3, 0.0, 1.0]
axis = [1, 0, 0]
[[joints]]
name = "cardan"
type = "universal"
bodies = ["driven", "drive"]
anchor_a = [-0.15, 0.0, 0.0]
attitude_a = [1, 0, 0, 1]
attitude_b = { axis = [1, 0, 0], degrees = 90 }
[[joints]]
name = "out"
type = "cylindrical"
bodies = "driven"
anchor_a = [0.15, 0.0, 0.0]
axis_a = [1, 0, 0]
[[joints]]
name = "neck"
type = "ball"
bodies = "rod"
anchor_a = [0.0, 0.0, 0.2]
axis = [0, 0, 1]
cone = 0.4
limits = [-0.2, 0.3]
force = 0.5
[[motors]]
joint = "in"
speed = 10.0
max_force = 100.0
"#;

/// The shaft angles satisfy tan out = tan in cos β for the initial attitude of the cross.
#[test]
fn a_cardan_shaft_turns_as_it_should_and_a_ball_joint_stays_in_its_cone() {
    let (end, directory) = run_scenario(SHAFT, &[]);
    assert_eq!(end.code, Some(0), "{end:?}");
    let out = directory.path().join("out");
    let table = Table::parse(&fs::read_to_string(out.join("joints.csv")).unwrap());
    let of = |joint: usize, column: &str| -> Vec<f64> {
        table.numbers(column).into_iter().skip(joint).step_by(4).collect()
    };
    let (turned, followed) = (of(0, "angle_z_rad"), of(2, "angle_z_rad"));
    assert!((turned[400] - 4.0).abs() < 1e-9, "{}", turned[400]);
    let cosine = 30.0_f64.to_radians().cos();
    let pairs = turned.iter().zip(&followed);
    let off = pairs.map(|(a, b)| (b - (a.sin() * cosine).atan2(a.cos())).sin().abs());
    let off = off.fold(0.0, f64::max);
    assert!(off < 1e-12, "{off}");
    let (swing, twist) = (of(3, "angle_x_rad"), of(3, "angle_z_rad"));
    assert!(swing.iter().all(|angle| *angle < 0.4 + 1e-12));
    assert!((twist.iter().copied().fold(0.0, f64::max) - 0.3).abs() < 1e-9);
    let verified = run(&["verify", out.join("joints.csv").to_str().unwrap()]);
    assert_eq!(verified.code, Some(0), "{verified:?}");
}

/// A joint between copies of one name makes a chain of them.
#[test]
fn copies_make_a_chain() {
    const CHAIN: &str = r#"
steps = 3
[ground]
none = true
friction = 0.5
[[bodies]]
name = "link"
box = [0.02, 0.02, 0.1]
mass = 0.1
position = [0.0, 0.0, -0.05]
copies = { count = [1, 1, 5], step = [0.0, 0.0, -0.1] }
[[joints]]
name = "hook"
type = "spherical"
bodies = "link-0"
anchor = [0.0, 0.0, 0.0]
[[joints]]
name = "pin"
type = "spherical"
bodies = ["link", "link"]
anchor_a = [0.0, 0.0, 0.05]
"#;
    let (end, directory) = run_scenario(CHAIN, &[]);
    assert_eq!(end.code, Some(0), "{end:?}");
    let out = directory.path().join("out");
    let json: serde_json::Value =
        serde_json::from_str(&fs::read_to_string(out.join("run.json")).unwrap()).unwrap();
    let joints = json["model"]["joints"].as_array().unwrap();
    let names: Vec<_> = joints.iter().map(|joint| joint["name"].as_str().unwrap()).collect();
    assert_eq!(names, ["hook", "pin-0", "pin-1", "pin-2", "pin-3"]);
    let table = Table::parse(&fs::read_to_string(out.join("joints.csv")).unwrap());
    // Each joint carries the weight of all links below it.
    let force: Vec<_> = ["force_x_N", "force_y_N", "force_z_N"].map(|f| table.numbers(f)).into();
    for (joint, below) in (0..5).zip([5.0, 4.0, 3.0, 2.0, 1.0]) {
        let size = force.iter().map(|f| f[5 + joint].powi(2)).sum::<f64>().sqrt();
        assert!((size - 0.981 * below).abs() < 1e-9, "{joint}: {size}");
    }
}

/// A heavy bob tightens light rods. The summary and run.json name joints that are too stiff for the
/// time step and a time step that suffices. The estimate is ω² = 12 T/(m L), and `verify`
/// recomputes it.
#[test]
fn stiff_joints_are_reported_with_a_suitable_time_step() {
    const TAUT: &str = r#"
steps = 12
time_step = 0.007
[ground]
none = true
friction = 0.5
[[bodies]]
name = "rod"
box = [0.004, 0.004, 0.1]
mass = 0.01
position = [0.0, 0.0, -0.05]
copies = { count = [1, 1, 6], step = [0.0, 0.0, -0.1] }
[[bodies]]
name = "bob"
box = 0.1
mass = 1.0
position = [0.0, 0.0, -0.6]
[[joints]]
name = "hook"
type = "spherical"
bodies = "rod-0"
anchor = [0.0, 0.0, 0.0]
[[joints]]
name = "pin"
type = "spherical"
bodies = ["rod", "rod"]
anchor_a = [0.0, 0.0, 0.05]
[[joints]]
name = "eye"
type = "spherical"
bodies = ["bob", "rod-5"]
anchor = [0.0, 0.0, -0.6]
"#;
    let (end, directory) = run_scenario(TAUT, &[]);
    assert!(end.stdout.contains("too stiff for h"), "{end:?}");
    assert!(end.stdout.contains("pin-0") && end.stdout.contains("at most 5.4e-3 s"), "{end:?}");
    let out = directory.path().join("out");
    let path = out.join("run.json");
    let text = fs::read_to_string(&path).unwrap();
    let json: serde_json::Value = serde_json::from_str(&text).unwrap();
    let taut = json["taut_joints"].as_array().unwrap();
    assert!(taut.len() >= 5, "{taut:?}");
    for joint in taut {
        // The tension is the weight of the bob and of up to six rods.
        let time_step = joint["time_step_s"].as_f64().unwrap();
        let of = |tension: f64| 0.95 * 2.0 / (12.0 * tension / (0.01 * 0.1)).sqrt();
        assert!(time_step > of(1.06 * 9.81) && time_step < of(9.81), "{joint}");
    }
    let steps = out.join("steps.csv");
    let steps = steps.to_str().unwrap();
    let verified = run(&["verify", steps]);
    assert!(!verified.stdout.contains("taut_joints"), "{verified:?}");
    let first = &taut[0]["stiffness"].to_string();
    fs::write(&path, text.replace(first.as_str(), "2.1")).unwrap();
    let verified = run(&["verify", steps]);
    assert_eq!(verified.code, Some(1), "{verified:?}");
    assert!(verified.stdout.contains("taut_joints differ from the rows"), "{verified:?}");
    // The suggested number of substeps suffices and keeps the number of rows.
    assert!(end.stdout.contains("--substeps 2"), "{end:?}");
    let (end, directory) = run_scenario(TAUT, &["--substeps", "2"]);
    assert!(!end.stdout.contains("too stiff"), "{end:?}");
    let steps = directory.path().join("out/steps.csv");
    assert_eq!(fs::read_to_string(&steps).unwrap().lines().count(), 1 + 12);
    let verified = run(&["verify", steps.to_str().unwrap()]);
    assert_eq!(verified.code, Some(0), "{verified:?}");
    // A shorter time step suffices.
    let short = TAUT.replace("time_step = 0.007", "time_step = 0.005");
    let (end, _) = run_scenario(&short, &[]);
    assert!(!end.stdout.contains("too stiff"), "{end:?}");
}

/// Ipopt refuses joints before any file is written.
#[test]
fn ipopt_refuses_mechanisms() {
    for name in ["double-pendulum", "slider-crank", "four-bar", "tray-and-conveyor"] {
        let path = format!("{ROOT}/scenarios/{name}.toml");
        let text = fs::read_to_string(path).unwrap();
        let (end, directory) = run_scenario(&text, &["--solver", "ipopt", "--steps", "30"]);
        end.assert_refused(2, &["does not support joints", "native solver"]);
        assert!(!directory.path().join("out").exists(), "{name}");
    }
}
