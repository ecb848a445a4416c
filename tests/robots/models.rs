//! Robots from files, compared with MuJoCo's reading of the same files (`data/generate/robots.py`).
//! The files are in `data/robots`, or in the folder whose figures `TUMBLE_ROBOT_FIGURES` names.

use nalgebra::{Matrix3, Vector3};
use serde_json::Value;
use std::path::{Path, PathBuf};
use tumble_robot::model::{Moves, Robot};
use tumble_robot::{Reading, read};

/// Tolerance for numbers of size 1, relative to the largest number of a kind if that is above 1.
const ALIKE: f64 = 1e-12;

fn data() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("data/robots")
}

/// Robot of a file. The root of a URDF is fixed, as in MuJoCo.
fn robot_of(path: &Path, is_fixed: bool) -> Result<Robot, String> {
    let text = std::fs::read_to_string(path).map_err(|error| error.to_string())?;
    let folder = path.parent().unwrap_or(Path::new(""));
    let read_file = |path: &Path, _: u64| std::fs::read(path);
    read(&text, &Reading { folder, read: &read_file, is_fixed, ..Reading::none() })
}

fn numbers(value: &Value) -> Vec<f64> {
    value.as_array().unwrap().iter().map(|number| number.as_f64().unwrap()).collect()
}

/// Checks that numbers agree, relative to the largest one if that is above 1.
fn alike(what: &str, ours: &[f64], theirs: &[f64]) {
    assert_eq!(ours.len(), theirs.len(), "{what}: {ours:?} {theirs:?}");
    let scale = theirs.iter().fold(1.0_f64, |most, number| most.max(number.abs()));
    for (a, b) in ours.iter().zip(theirs) {
        assert!((a - b).abs() <= ALIKE * scale, "{what}: {a:?} is not {b:?}, by {:e}", a - b);
    }
}

fn range(value: &Value) -> Option<Vec<f64>> {
    value.as_array().map(|_| numbers(value))
}

fn compare(name: &str, robot: &Robot, figures: &Value) {
    let bodies = figures["bodies"].as_array().unwrap();
    // The first link of a fixed URDF is MuJoCo's world.
    let link = |(index, body): (usize, &Value)| match body["name"].as_str() {
        Some(called) => robot.link(called).unwrap(),
        None => index + 1,
    };
    let links: Vec<usize> = bodies.iter().enumerate().map(link).collect();
    let joints = figures["joints"].as_array().unwrap();
    assert_eq!(robot.joints.len(), joints.len(), "{name}");
    for (ours, theirs) in robot.joints.iter().zip(joints) {
        let what = format!("{name}: {}", ours.name);
        if let Some(called) = theirs["name"].as_str() {
            assert_eq!(ours.name, called, "{what}");
        }
        let kinds = [Moves::Free, Moves::Ball, Moves::Slide, Moves::Hinge];
        assert_eq!(ours.moves, kinds[theirs["kind"].as_u64().unwrap() as usize], "{what}");
        assert_eq!(ours.range.is_some(), theirs["range"].is_array(), "{what}");
        if let (Some(ours), Some(theirs)) = (ours.range, range(&theirs["range"])) {
            alike(&what, &ours, &theirs);
        }
        let own =
            [ours.reference, ours.rest, ours.damping, ours.friction, ours.armature, ours.stiffness];
        let fields = ["reference", "rest", "damping", "friction", "armature", "stiffness"];
        alike(&what, &own, &fields.map(|field| theirs[field].as_f64().unwrap()));
    }
    let actuators = figures["actuators"].as_array().unwrap();
    assert_eq!(robot.actuators.len(), actuators.len(), "{name}");
    for (ours, theirs) in robot.actuators.iter().zip(actuators) {
        let what = format!("{name}: {}", ours.name);
        assert_eq!(ours.joints, [(theirs["joint"].as_u64().unwrap() as usize, 1.0)], "{what}");
        alike(
            &what,
            &[ours.gear, ours.gain],
            &["gear", "gain"].map(|f| theirs[f].as_f64().unwrap()),
        );
        alike(&what, &ours.bias, &numbers(&theirs["bias"]));
        assert_eq!(ours.control_range.map(Vec::from), range(&theirs["control_range"]), "{what}");
    }
    let gravity = Vector3::from_vec(numbers(&figures["gravity"]));
    alike(name, robot.options.gravity.as_slice(), gravity.as_slice());
    for pose in figures["poses"].as_array().unwrap() {
        let (q, v) = (numbers(&pose["q"]), numbers(&pose["v"]));
        let motion = robot.motion(&q, &v).unwrap();
        for ((link, body), told) in links.iter().zip(pose["bodies"].as_array().unwrap()).zip(bodies)
        {
            let what = format!("{name}: {}", robot.links[*link].name);
            let (frame, mass) = (motion.links()[*link].frame, robot.links[*link].mass);
            alike(&what, &[mass.mass], &[told["mass"].as_f64().unwrap()]);
            alike(&what, frame.position.as_slice(), &numbers(&body["position"]));
            alike(&what, frame.rotation().transpose().as_slice(), &numbers(&body["rotation"]));
            if mass.mass == 0.0 {
                continue;
            }
            alike(&what, frame.point(&mass.centre).as_slice(), &numbers(&body["centre"]));
            let inertia: Matrix3<f64> =
                frame.rotation() * mass.inertia * frame.rotation().transpose();
            alike(&what, inertia.as_slice(), &numbers(&body["inertia"]));
        }
        let matrix = motion.mass_matrix(robot);
        alike(&format!("{name}: M"), matrix.as_slice(), &numbers(&pose["mass_matrix"]));
        alike(
            &format!("{name}: bias"),
            motion.bias(robot, &gravity).as_slice(),
            &numbers(&pose["bias"]),
        );
        // Frames converted back to coordinates.
        let frames: Vec<_> = motion.links().iter().map(|link| link.frame).collect();
        let reference = robot.reference();
        let back = robot.coordinates(&frames, &reference).unwrap();
        let there = robot.motion(&back, &v).unwrap();
        for (now, then) in there.links().iter().zip(motion.links()) {
            alike(name, now.frame.position.as_slice(), then.frame.position.as_slice());
            alike(name, now.frame.rotation().as_slice(), then.frame.rotation().as_slice());
        }
    }
}

/// Compares all models of a file of figures. Returns the number of equal models, and the refused
/// files.
fn compare_all(figures: &Path) -> (usize, Vec<String>) {
    let text = std::fs::read_to_string(figures).unwrap();
    let told: Value = serde_json::from_str(&text).unwrap();
    let folder = match told["folder"].as_str() {
        Some(".") | None => data(),
        Some(folder) => PathBuf::from(folder),
    };
    let (mut alike, mut refused) = (0, Vec::new());
    for (name, figures) in told["models"].as_object().unwrap() {
        match robot_of(&folder.join(name), true) {
            Ok(robot) => {
                compare(name, &robot, figures);
                alike += 1;
            }
            Err(why) => refused.push(format!("{name}: {why}")),
        }
    }
    (alike, refused)
}

#[test]
fn robots_are_those_that_mujoco_reads() {
    let figures = std::env::var_os("TUMBLE_ROBOT_FIGURES");
    let figures = figures.map_or_else(|| data().join("figures.json"), PathBuf::from);
    let (alike, refused) = compare_all(&figures);
    assert!(refused.is_empty(), "{alike} models are alike; refused: {refused:#?}");
    assert!(alike >= 4, "{alike}");
}
