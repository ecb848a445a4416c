//! Scenario files with joints: tables, verification and refusals.

use super::scenario::run_scenario;
use super::support::{End, Table, everything_in, run, unseal};
use std::fs;
use std::path::Path;
use std::sync::OnceLock;

/// Scene with a motorised hinge, a sprung slider, a ball joint, a fixed joint and a box on the
/// ground.
const SCENE: &str = r#"
steps = 40
time_step = 0.002
[ground]
friction = 0.5
[[bodies]]
name = "arm"
box = [0.36, 0.04, 0.04]
mass = 1.0
position = [0.18, 0.0, 1.0]
[[bodies]]
name = "tip"
box = 0.05
mass = 0.5
position = [0.4, 0.0, 1.0]
[[bodies]]
name = "link"
box = [0.02, 0.02, 0.2]
mass = 0.3
position = [0.4, 0.0, 0.86]
[[bodies]]
name = "cart"
box = [0.2, 0.1, 0.1]
mass = 2.0
position = [0.0, 1.0, 0.5]
velocity = [0.5, 0.0, 0.0]
[[bodies]]
name = "box"
box = 0.2
mass = 1.0
position = [0.0, 3.0, 0.1]
[[joints]]
name = "shoulder"
type = "revolute"
bodies = ["arm"]
anchor = [0.0, 0.0, 1.0]
axis = [0.0, 1.0, 0.0]
friction = 0.1
[[joints]]
name = "weld"
type = "fixed"
bodies = ["tip", "arm"]
anchor = [0.4, 0.0, 1.0]
[[joints]]
name = "ball"
type = "spherical"
bodies = ["link", "tip"]
anchor_a = [0.0, 0.0, 0.12]
[[joints]]
name = "rail"
type = "prismatic"
bodies = "cart"
anchor_a = [0.0, 0.0, 0.0]
axis = [1.0, 0.0, 0.0]
start = 0.25
stiffness = 40.0
damping = 0.5
limits = [-0.1, 0.4]
[[motors]]
joint = "shoulder"
speed = -2.0
max_force = 600.0
"#;

const FILES: [&str; 5] = ["states.csv", "contacts.csv", "steps.csv", "joints.csv", "run.json"];

fn files() -> &'static [String; 5] {
    static RUN: OnceLock<[String; 5]> = OnceLock::new();
    RUN.get_or_init(|| {
        let (end, directory) = run_scenario(SCENE, &[]);
        assert_eq!(end.code, Some(0), "{end:?}");
        assert!(end.stdout.contains("joints       4, off by at most"), "{end:?}");
        let out = directory.path().join("out");
        let found = everything_in(&out);
        let mut names = [&FILES[..], &["state.bin"]].concat();
        names.sort_unstable();
        assert!(found.iter().map(|file| file.to_str().unwrap()).eq(names), "{found:?}");
        unseal(&out.join("run.json"));
        FILES.map(|name| fs::read_to_string(out.join(name)).unwrap())
    })
}

fn verify_changed(name: &str, change: impl FnOnce(&mut Table)) -> End {
    let directory = tempfile::tempdir().unwrap();
    for (file, text) in FILES.iter().zip(files()) {
        fs::write(directory.path().join(file), text).unwrap();
    }
    let path = directory.path().join(name);
    let mut table = Table::parse(&fs::read_to_string(&path).unwrap());
    change(&mut table);
    fs::write(path, table.text()).unwrap();
    run(&["verify", directory.path().join("joints.csv").to_str().unwrap()])
}

#[test]
fn tables_of_joints_verify() {
    let end = verify_changed("joints.csv", |_| ());
    assert_eq!((end.code, end.stderr.as_str()), (Some(0), ""), "{end:?}");
    assert!(end.stdout.contains("joints, as recorded: off by at most"), "{end:?}");
}

/// The rows contain positions, speeds and loads of the joints from the start to the end.
#[test]
fn joints_table_has_coordinates_and_forces() {
    let joints = Table::parse(&files()[3]);
    let (k, h) = (joints.numbers("k"), 0.002);
    assert_eq!(k.len(), 4 * 40);
    let of = |joint: usize, column: &str| -> Vec<f64> {
        joints.numbers(column).into_iter().skip(joint).step_by(4).collect()
    };
    // A sufficiently strong motor keeps its speed.
    let (angle, rate) = (of(0, "angle_z_rad"), of(0, "wz_rad_s"));
    assert_eq!(angle[0], 0.0);
    assert!(rate[1..39].iter().all(|rate| (rate + 2.0).abs() < 1e-9), "{rate:?}");
    assert!((angle[39] + 2.0 * 39.0 * h).abs() < 1e-9, "{angle:?}");
    // The cart's position follows from its start and its speed.
    let (place, speed, force) = (of(3, "z_m"), of(3, "vz_m_s"), of(3, "force_z_N"));
    assert!((place[0] - 0.25).abs() < 1e-12, "{place:?}");
    for step in 0..39 {
        assert!((place[step + 1] - place[step] - h * speed[step]).abs() < 1e-14);
        if step > 0 {
            // Spring and damper act at the middle of the speeds.
            let change = speed[step] - speed[step - 1];
            let spring = -40.0 * (place[step] + 0.25 * h * change);
            let damper = -0.25 * (speed[step] + speed[step - 1]);
            assert!((force[step] - spring - damper).abs() < 1e-9, "{} {spring}", force[step]);
        }
    }
    // The last row has a position without a step.
    for joint in 0..4 {
        assert_eq!(of(joint, "force_z_N")[39], 0.0);
        assert_eq!(of(joint, "joint_m_s")[39], 0.0);
    }
    // Locked directions stay at zero.
    for (joint, columns) in [(1, &["x_m", "angle_x_rad", "angle_z_rad"][..]), (2, &["x_m", "z_m"])]
    {
        for column in columns {
            assert!(of(joint, column).iter().all(|x| x.abs() < 1e-14), "{joint} {column}");
        }
    }
}

/// Universal joints and gimbals in a scenario: initial angles, drives, motors and verification.
#[test]
fn angles_of_gimbals_are_driven_from_files() {
    let text = r#"
steps = 300
time_step = 0.002
gravity = 0.0
[ground]
none = true
friction = 0.5
[[bodies]]
name = "camera"
box = [0.1, 0.2, 0.3]
mass = 2.0
position = [0.0, 0.0, 0.0]
[[bodies]]
name = "shaft"
box = [0.1, 0.1, 0.4]
mass = 1.0
position = [2.0, 0.0, 0.0]
[[joints]]
name = "mount"
type = "gimbal"
bodies = "camera"
anchor = [0.0, 0.0, 0.0]
attitude = { axis = [1.0, 1.0, 0.0], degrees = 40.0 }
turn_x = { start = 0.5, damping = 0.01 }
turn_y = { start = -2.5, limits = [-3.0, 0.5] }
turn_z = { start = 0.3 }
[[joints]]
name = "cardan"
type = "universal"
bodies = "shaft"
anchor = [2.0, 0.0, 0.2]
attitude = { axis = [0.0, 0.0, 1.0], degrees = 10.0 }
turn_x = { start = 0.4, stiffness = 10.0, damping = 1.0 }
turn_y = { start = -0.2, stiffness = 10.0, damping = 1.0 }
[[motors]]
joint = "mount"
axis = "turn_x"
speed = 3.0
max_force = 100.0
[[motors]]
joint = "mount"
axis = "turn_z"
position = 0.8
stiffness = 40.0
damping = 2.0
max_force = 100.0
[[motors]]
joint = "mount"
axis = "turn_y"
speed = -2.0
max_force = 50.0
"#;
    let (end, directory) = run_scenario(text, &[]);
    assert_eq!(end.code, Some(0), "{end:?}");
    let path = directory.path().join("out").join("joints.csv");
    let joints = Table::parse(&fs::read_to_string(&path).unwrap());
    let of = |joint: usize, column: &str| -> Vec<f64> {
        joints.numbers(column).into_iter().skip(joint).step_by(2).collect()
    };
    for (joint, angles) in [(0, [0.5, -2.5, 0.3]), (1, [0.4, -0.2, 0.0])] {
        for (column, start) in ["angle_x_rad", "angle_y_rad", "angle_z_rad"].iter().zip(angles) {
            assert!((of(joint, column)[0] - start).abs() < 1e-12, "{joint} {column}");
        }
    }
    let last = of(0, "k").len() - 1;
    let turned = of(0, "angle_x_rad")[last] - 0.5;
    assert!((turned - 3.0 * 0.002 * last as f64).abs() < 1e-9, "{turned}");
    assert!((of(0, "angle_y_rad")[last] + 3.0).abs() < 1e-12);
    assert!(of(1, "angle_x_rad")[last].abs() < 0.4);
    let verify = || run(&["verify", path.to_str().unwrap()]);
    assert_eq!(verify().code, Some(0), "{:?}", verify());
    let mut table = joints;
    let column = table.column("angle_y_rad");
    table.rows[2 * 7][column] = "-2.6".to_owned();
    fs::write(&path, table.text()).unwrap();
    let end = verify();
    assert!(end.code == Some(1) && end.stdout.contains("k = 7 "), "{end:?}");
}

/// `verify` finds a change of a thousandth in any number of a joint and names the step.
#[test]
fn a_changed_number_of_a_joint_is_found() {
    let columns: Vec<_> = Table::parse(&files()[3]).header[3..].to_vec();
    for column in columns {
        for joint in 0..4 {
            let end = verify_changed("joints.csv", |table| {
                let column = table.column(&column);
                let cell = &mut table.rows[4 * 12 + joint][column];
                *cell = (cell.parse::<f64>().unwrap() * 1.001 + 1e-5).to_string();
            });
            if column.starts_with("interval") {
                // Not the interval of the other tables.
                assert_eq!(end.code, Some(2), "{joint} {column}: {end:?}");
                continue;
            }
            assert_eq!(end.code, Some(1), "{joint} {column}: {end:?}");
            assert!(end.stdout.contains("k = 12 "), "{joint} {column}: {end:?}");
        }
    }
    // An additional full turn, and a force in the last row.
    for (row, column, change) in
        [(4 * 12, "angle_z_rad", std::f64::consts::TAU), (4 * 39, "force_z_N", 1.0)]
    {
        let end = verify_changed("joints.csv", |table| {
            let column = table.column(column);
            let cell = &mut table.rows[row][column];
            *cell = (cell.parse::<f64>().unwrap() + change).to_string();
        });
        assert_eq!(end.code, Some(1), "{column}: {end:?}");
    }
}

/// `verify` compares the summary and the model in run.json with the rows.
#[test]
fn a_changed_run_json_is_found() {
    let changed = |old: &str, new: &str| {
        let directory = tempfile::tempdir().unwrap();
        for (file, text) in FILES.iter().zip(files()) {
            let text = if *file == "run.json" {
                assert!(text.contains(old), "{old}");
                text.replacen(old, new, 1)
            } else {
                text.clone()
            };
            fs::write(directory.path().join(file), text).unwrap();
        }
        run(&["verify", directory.path().join("states.csv").to_str().unwrap()])
    };
    let end = changed("\"largest_residual_m_s\": ", "\"largest_residual_m_s\": 1");
    assert_eq!(end.code, Some(1), "{end:?}");
    let end = changed("\"stiffness\": 40.0", "\"stiffness\": 41.0");
    assert_eq!(end.code, Some(1), "{end:?}");
    let end = changed("\"stiffness\": 40.0", "\"stiffness\": -41.0");
    assert_eq!(end.code, Some(2), "{end:?}");
    assert!(end.stderr.contains("joints[3] (rail): stiffness"), "{end:?}");
}

/// A missing or truncated table of joints is refused.
#[test]
fn a_table_of_joints_is_needed() {
    let directory = tempfile::tempdir().unwrap();
    for (file, text) in FILES.iter().zip(files()) {
        fs::write(directory.path().join(file), text).unwrap();
    }
    let verify = || run(&["verify", directory.path().join("states.csv").to_str().unwrap()]);
    let path = directory.path().join("joints.csv");
    let half: String = files()[3].lines().take(100).map(|line| format!("{line}\n")).collect();
    fs::write(&path, half).unwrap();
    verify().assert_refused(2, &["joints", "cut off"]);
    fs::remove_file(path).unwrap();
    verify().assert_refused(2, &["joints.csv"]);
}

/// A run without joints removes the joint table of the previous run.
#[test]
fn a_run_without_joints_removes_their_table() {
    let directory = tempfile::tempdir().unwrap();
    let out = directory.path().join("out");
    let scene = directory.path().join("scene.toml");
    fs::write(&scene, SCENE).unwrap();
    let [scene, out_text] = [&scene, &out].map(|path| path.to_str().unwrap());
    let end = run(&[scene, "--out", out_text, "--steps", "3"]);
    assert_eq!(end.code, Some(0), "{end:?}");
    assert!(out.join("joints.csv").exists());
    fs::write(scene, SCENE.split("[[joints]]").next().unwrap()).unwrap();
    let end = run(&[scene, "--out", out_text, "--steps", "3"]);
    assert_eq!(end.code, Some(0), "{end:?}");
    assert!(end.stdout.contains("removed joints.csv"), "{end:?}");
    assert!(!end.stdout.contains("joints   "), "{end:?}");
    assert!(!Path::new(&out).join("joints.csv").exists());
}

/// The page contains the joints with their anchors. The plot of a body labels the curves of its
/// joints.
#[test]
fn pictures_show_joints() {
    let (end, directory) = run_scenario(SCENE, &["--html", "--gif"]);
    assert_eq!(end.code, Some(0), "{end:?}");
    let out = directory.path().join("out");
    let page = fs::read_to_string(out.join("view.html")).unwrap();
    assert!(page.contains(
        r#""joints":[{"name":"shoulder","body":0,"other":null,"anchor":[-0.18,0.0,0.0]"#
    ));
    assert!(out.join("animation.gif").exists());
    let states = out.join("states.csv");
    let drawn = run(&["plot", states.to_str().unwrap(), "--body", "tip"]);
    assert_eq!(drawn.code, Some(0), "{drawn:?}");
    let plot = fs::read_to_string(out.join("plot.svg")).unwrap();
    for joint in ["weld", "ball"] {
        assert!(plot.contains(&format!(">{joint}</text>")), "{joint}");
    }
    // A panel without a joint of the body is left out.
    assert!(!plot.contains(">rail</text>") && !plot.contains("id=\"slide\""));
}

/// Replaced text of `SCENE`, new text and words of the refusal.
const BROKEN: &[(&str, &str, &[&str])] = &[
    ("type = \"revolute\"", "type = \"hinge\"", &["hinge", "revolute"]),
    ("bodies = [\"arm\"]", "bodies = [\"leg\"]", &["joints[0] (shoulder).bodies", "leg"]),
    ("bodies = [\"arm\"]", "bodies = []", &["joints[0] (shoulder).bodies", "two"]),
    ("bodies = [\"arm\"]", "bodies = [\"arm\", \"arm\"]", &["joints[0] (shoulder).bodies", "two"]),
    ("bodies = [\"arm\"]", "bodies = [\"arm\", \"ground\"]", &["(shoulder).bodies", "never moves"]),
    ("name = \"weld\"", "name = \"shoulder\"", &["joints[1] (shoulder).name", "twice"]),
    ("name = \"weld\"", "name = \"we ld\"", &["joints[1] (we ld).name", "letters"]),
    ("axis = [0.0, 1.0, 0.0]", "", &["joints[0] (shoulder).axis", "needed"]),
    ("axis = [0.0, 1.0, 0.0]", "axis = [0.0, 0.0, 0.0]", &["(shoulder).axis", "length"]),
    ("anchor = [0.0, 0.0, 1.0]", "", &["joints[0] (shoulder).anchor", "anchor_a"]),
    ("anchor = [0.0, 0.0, 1.0]", "anchor = [0.0, 1e9, 1.0]", &["(shoulder).anchor", "1e4"]),
    ("friction = 0.1", "friction = -0.1", &["joints[0] (shoulder)", "friction", "-0.1", "0 to"]),
    ("friction = 0.1", "length = 0.0", &["joints[0] (shoulder)", "length"]),
    ("friction = 0.1", "restitution = 0.5", &["(shoulder)", "restitution", "without `limits`"]),
    (
        "friction = 0.1",
        "limits = [-1, 1]\nrestitution = 1.5",
        &["joints[0] (shoulder)", "restitution", "0 to 1"],
    ),
    (
        "friction = 0.1",
        "friction_curve = [[0, 1], [1, 0.5]]",
        &["(shoulder)", "friction_curve", "without `friction`"],
    ),
    (
        "friction = 0.1",
        "friction = 0.1\nfriction_curve = [[0.5, 1], [1, 0.5]]",
        &["joints[0]", "friction_curve", "speed of a friction curve is 0.5", "0 at the first"],
    ),
    ("friction = 0.1", "turn = { friction = 0.1 }", &["(shoulder).turn", "itself"]),
    ("friction = 0.1", "slide = { friction = 0.1 }", &["(shoulder).slide", "no meaning"]),
    ("friction = 0.1", "start = 4.0", &["joints[0] (shoulder).start", "4", "rad"]),
    ("friction = 0.1", "anchor_b = [0.0, 0.0, 1.01]", &["shoulder is 1.000e-2 m", "1e-6"]),
    ("friction = 0.1", "axis_b = [0.0, 1.0, 0.1]", &["shoulder is", "9.963e-2 rad", "1e-6"]),
    ("limits = [-0.1, 0.4]", "limits = [0.4, -0.1]", &["joints[3] (rail)", "upper limit"]),
    ("limits = [-0.1, 0.4]", "limits = [0.4]", &["limits", "2"]),
    (
        "axis = [0.0, 1.0, 0.0]",
        "axis = [0.0, nan, 0.0]",
        &["(shoulder).axis", "component of a joint's axis is NaN"],
    ),
    ("type = \"fixed\"", "type = \"fixed\"\naxis = [0, 0, 1]", &["(weld).axis", "no meaning"]),
    ("type = \"fixed\"", "type = \"fixed\"\nfriction = 1.0", &["(weld).friction", "no meaning"]),
    ("type = \"fixed\"", "type = \"fixed\"\ncolour = 1.0", &["colour"]),
    ("type = \"prismatic\"", "type = \"cylindrical\"", &["(rail).start", "`slide`, `turn`"]),
    ("joint = \"shoulder\"", "joint = \"elbow\"", &["motors[0] (elbow).joint", "elbow"]),
    ("joint = \"shoulder\"", "joint = \"ball\"", &["motors[0] (ball).axis", "`turn_x`"]),
    ("speed = -2.0", "speed = -2.0\naxis = \"slide\"", &["motors[0] (shoulder).axis", "`turn`"]),
    ("speed = -2.0", "", &["motors[0] (shoulder).speed", "position"]),
    (
        "speed = -2.0",
        "speed = -2.0\nposition = 1.0",
        &["motors[0] (shoulder).speed", "only one of"],
    ),
    ("speed = -2.0", "speed = -2.0\nstiffness = 1.0", &["(shoulder).stiffness", "no meaning"]),
    ("speed = -2.0", "position = 1.0", &["motors[0] (shoulder).stiffness", "required"]),
    ("type = \"spherical\"", "type = \"ball\"", &["(ball).cone", "required"]),
    (
        "type = \"spherical\"",
        "type = \"universal\"",
        &["(ball).attitude: a rotation", "`attitude_a`"],
    ),
    ("type = \"spherical\"", "type = \"spherical\"\ncone = 0.5", &["(ball).cone", "no meaning"]),
    (
        "type = \"spherical\"",
        "type = \"ball\"\naxis = [0, 0, 1]\ncone = 9.0",
        &["joints[2] (ball)", "cone", "3.1"],
    ),
    (
        "type = \"prismatic\"",
        "type = \"gimbal\"",
        &["(rail).start", "`turn_x`, `turn_y`, `turn_z`"],
    ),
    (
        "type = \"prismatic\"",
        "type = \"universal\"",
        &["(rail).axis", "about two axes", "give `attitude` instead"],
    ),
    ("max_force = 600.0", "", &["max_force"]),
    ("max_force = 600.0", "max_force = -600.0", &["joints[0] (shoulder)", "max_force", "-600"]),
];

#[test]
fn invalid_joints_are_rejected_in_one_sentence() {
    for (old, new, words) in BROKEN {
        assert!(SCENE.contains(old), "{old}");
        let (end, directory) = run_scenario(&SCENE.replacen(old, new, 1), &[]);
        end.assert_refused(2, words);
        let left = everything_in(directory.path());
        assert!(left.len() == 1, "{old} -> {new}: {left:?}");
    }
    let body = "[body]\nbox = 1.0\nmass = 1.0\n[start]\nposition = [0, 0, 1]\n\
                [[joints]]\ntype = \"fixed\"\nbodies = \"body\"\nanchor = [0, 0, 1]\n";
    run_scenario(body, &[])
        .0
        .assert_refused(2, &["ground: a table [ground] is needed", "none = true"]);
}

/// A continued run writes the same bytes as an uninterrupted one.
#[test]
fn a_run_with_joints_is_continued() {
    let (whole, directory) = run_scenario(SCENE, &[]);
    assert_eq!(whole.code, Some(0), "{whole:?}");
    let (first, part) = run_scenario(SCENE, &["--steps", "15"]);
    assert_eq!(first.code, Some(0), "{first:?}");
    let out = part.path().join("out");
    let end = run(&["--continue", out.to_str().unwrap(), "--steps", "40"]);
    assert_eq!(end.code, Some(0), "{end:?}");
    for file in ["states.csv", "joints.csv", "steps.csv"] {
        let [a, b] =
            [&out, &directory.path().join("out")].map(|at| fs::read(at.join(file)).unwrap());
        assert!(a == b, "{file} differs");
    }
    let verified = run(&["verify", out.join("joints.csv").to_str().unwrap()]);
    assert_eq!(verified.code, Some(0), "{verified:?}");
}
