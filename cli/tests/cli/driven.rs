//! Scenario files with driven bodies and moving surfaces: two scenes against closed forms,
//! verification, continuation and refusals.

use super::scenes::{scene, table};
use super::support::{Simulated, run, simulate};
use crate::ROOT;
use nalgebra::Vector3;
use std::fs;

const G: f64 = 9.81;
const H: f64 = 0.002;

/// Position and velocity of body `index` in every row.
fn body(done: &Simulated, index: usize) -> Vec<(Vector3<f64>, Vector3<f64>)> {
    let states = table(done, "states");
    let columns = ["body", "x_m", "y_m", "z_m", "vx_m_s", "vy_m_s", "vz_m_s"];
    let [of, x, y, z, vx, vy, vz] = columns.map(|name| states.numbers(name));
    let rows = (0..of.len()).filter(|row| of[*row] == index as f64);
    rows.map(|row| (Vector3::new(x[row], y[row], z[row]), Vector3::new(vx[row], vy[row], vz[row])))
        .collect()
}

fn verified(done: &Simulated) {
    let end = run(&["verify", done.path("states.csv").to_str().unwrap()]);
    assert_eq!(end.code, Some(0), "{end:?}");
}

/// Runs a scenario with the content `text`. The run may be refused.
fn simulated_text(text: &str, more: &[&str]) -> Simulated {
    let folder = tempfile::tempdir().unwrap();
    let file = folder.path().join("scene.toml");
    fs::write(&file, text).unwrap();
    simulate(&[&[file.to_str().unwrap()], more].concat())
}

/// A parcel on the belt accelerates by μ g until it has the belt's speed, after the time v/(μ g).
/// The tray and the pusher follow the linear interpolation of their knots to rounding.
#[test]
fn belt_accelerates_a_parcel_and_tray_follows_its_motion() {
    let done = scene("tray-and-conveyor", &["--exact"]);
    assert_eq!(done.run_json()["summary"]["failed"], 0);
    verified(&done);
    let parcel = body(&done, 3);
    for (k, (_, velocity)) in parcel.iter().take(900).enumerate() {
        let expected = (0.4 * G * H * k as f64).min(0.8);
        // Where the slip ends, the velocity is the one of the middle of the step.
        let ends = (0.4 * G * H * k as f64 - 0.8).abs() < 0.4 * G * H;
        let allowed = if ends { 0.4 * G * H } else { 1e-9 };
        assert!((velocity[0] - expected).abs() < allowed, "{k}: {velocity} {expected}");
    }
    // The parcel has left the belt over the chute.
    assert!(parcel.last().unwrap().0[2] < 0.3);
    let between = |t: f64, knots: &[(f64, f64)]| {
        let after = knots.partition_point(|(knot, _)| *knot <= t);
        match (after.checked_sub(1), knots.get(after)) {
            (None, Some((_, x))) => *x,
            (Some(last), None) => knots[last].1,
            (Some(last), Some((to, b))) => {
                let (from, a) = knots[last];
                a + (b - a) * (t - from) / (to - from)
            }
            (None, None) => unreachable!(),
        }
    };
    let knots = [
        (0, vec![(0.0, -0.9), (0.2, -0.9), (1.2, -0.52), (1.4, -0.52)]),
        (2, vec![(1.3, -1.3), (2.5, -0.42), (3.0, -1.0)]),
    ];
    for (index, knots) in knots {
        for (k, (place, _)) in body(&done, index).iter().enumerate() {
            let expected = between(k as f64 * H, &knots);
            assert!((place[0] - expected).abs() < 1e-12, "{index} {k}: {place} {expected}");
        }
    }
    // The cube slips by v²/(2 μ g) while friction accelerates it to the tray's 0.38 m/s. Later it
    // moves at the belt's speed.
    let cube = body(&done, 1);
    let slipped = cube[590].0[0] - body(&done, 0)[590].0[0];
    assert!((slipped + 0.38 * 0.38 / (2.0 * 0.4 * G)).abs() < 1e-3, "{slipped}");
    assert!((cube[1749].1[0] - 0.8).abs() < 1e-9);
    // The pusher moves the cube at constant speed over the tray and carries a part T of its weight.
    // It pushes with μ (m g − T).
    let joints = table(&done, "joints");
    let (force, weight) = (joints.numbers("force_x_N"), joints.numbers("force_z_N"));
    for k in 1150..1200 {
        let (force, borne) = (force[2 * k + 1], weight[2 * k + 1] - 1.0 * G);
        assert!(borne.abs() <= 0.4 * force + 1e-6, "{k}: {borne}");
        assert!((force - 0.4 * (0.5 * G - borne)).abs() < 1e-6, "{k}: {force} {borne}");
    }
    let json = done.run_json();
    assert!(json["joints"]["largest_error_m"].as_f64().unwrap() < 1e-12);
    assert_eq!(json["model"]["driven"][0]["course"]["times"][3], 1.4);
    assert_eq!(json["model"]["surfaces"][0]["velocity"][0], 0.8);
    let tables = table(&done, "steps");
    let stiffest = tables.numbers("stiffness").into_iter().fold(0.0, f64::max);
    assert_eq!(json["joints"]["largest_stiffness"], stiffest);
}

/// A puck sticks to the turntable if ω² r < μ g and slips outwards otherwise.
#[test]
fn the_turntable_carries_pucks_as_far_as_friction_reaches() {
    let done = scene("turntable", &[]);
    verified(&done);
    for (index, radius, stays) in [(1, 0.2, true), (2, 0.42, true), (3, 0.47, false)] {
        assert_eq!(9.0 * radius < 0.4 * G, stays);
        let way = body(&done, index);
        let far = |k: usize| way[k].0.xy().norm();
        if stays {
            let off = (0..way.len()).map(|k| (far(k) - radius).abs()).fold(0.0, f64::max);
            assert!(off < 1e-4, "{index}: {off}");
            // The puck turns with the table by ω t.
            let angle = way[500].0[1].atan2(way[500].0[0]) - way[0].0[1].atan2(way[0].0[0]);
            let turned = (3.0 - angle).rem_euclid(std::f64::consts::TAU);
            assert!(turned.min(std::f64::consts::TAU - turned) < 1e-3, "{index}: {angle}");
        } else {
            assert!((1..200).all(|k| far(k) >= far(k - 1) - 1e-9) && far(600) > 0.8, "{index}");
            assert!(way.last().unwrap().0[2] < 0.03);
        }
    }
    // The table turns at a constant rate.
    let states = table(&done, "states");
    let (of, z) = (states.numbers("body"), states.numbers("qz"));
    let angles = z.iter().zip(&of).filter(|(_, of)| **of == 0.0).map(|(z, _)| z);
    for (k, z) in angles.enumerate() {
        assert!((z.abs() - (0.5 * 3.0 * H * k as f64).sin().abs()).abs() < 1e-12, "{k}");
    }
}

/// Runs with prescribed motion continue to the same bytes. They may start at a later index if the
/// initial position fits.
#[test]
fn driven_runs_continue_exactly_and_may_start_later() {
    let folder = tempfile::tempdir().unwrap();
    let out = folder.path().join("parts");
    let out = out.to_str().unwrap();
    let file = format!("{ROOT}/scenarios/tray-and-conveyor.toml");
    let whole = scene("tray-and-conveyor", &["--steps", "900"]);
    assert_eq!(run(&[&file, "--steps", "333", "--out", out]).code, Some(0));
    assert_eq!(run(&["--continue", out, "--steps", "900"]).code, Some(0));
    for name in ["states.csv", "contacts.csv", "steps.csv", "joints.csv"] {
        let (one, other) = (fs::read(whole.path(name)), fs::read(format!("{out}/{name}")));
        assert!(one.unwrap() == other.unwrap(), "{name}");
    }
    // The tray's prescribed position at a later start index differs from its initial position.
    let end = run(&[&file, "--start-index", "300", "--out", out]);
    assert_eq!(end.code, Some(2), "{end:?}");
    assert!(
        end.stderr.contains(
            "driven[0] (tray).positions: at t = 0.6 s the prescribed motion is 1.520e-1 m"
        ),
        "{end:?}"
    );
    // A constant velocity starts at the body's position for every start index.
    let file = file.replace("tray-and-conveyor", "turntable");
    let later = simulate(&[&file, "--start-index", "5000", "--steps", "200"]);
    assert_eq!(later.end.code, Some(0), "{:?}", later.end);
    verified(&later);
    let first = scene("turntable", &["--steps", "200"]);
    let (mine, its) = (body(&later, 1), body(&first, 1));
    for ((mine, _), (its, _)) in mine.iter().zip(&its) {
        assert!((mine - its).norm() < 1e-9);
    }
}

/// `verify` rejects tables after a change of the prescribed motion, a belt's velocity or a
/// stiffness.
#[test]
fn changed_prescribed_motion_or_belt_fails_verify() {
    let done = scene("tray-and-conveyor", &["--steps", "300"]);
    let text = fs::read_to_string(done.path("run.json")).unwrap();
    let mut json: serde_json::Value = serde_json::from_str(&text).unwrap();
    let mut judged = |path: &str, value: f64, words: &str| {
        let before = json.pointer(path).unwrap().clone();
        *json.pointer_mut(path).unwrap() = value.into();
        fs::write(done.path("run.json"), json.to_string()).unwrap();
        *json.pointer_mut(path).unwrap() = before;
        let end = run(&["verify", done.path("states.csv").to_str().unwrap()]);
        assert_eq!(end.code, Some(1), "{path}: {end:?}");
        assert!(end.stdout.contains(words), "{path}: {end:?}");
    };
    judged(
        "/model/driven/0/course/times/2",
        1.3,
        "does not match the places or motion of its bodies",
    );
    judged("/model/surfaces/0/velocity/0", 0.9, "its residual in the table is");
    let steps = fs::read_to_string(done.path("steps.csv")).unwrap();
    fs::write(done.path("run.json"), text).unwrap();
    verified(&done);
    let line = steps.lines().nth(100).unwrap();
    let changed = format!("{},0.5", line.rsplit_once(',').unwrap().0);
    fs::write(done.path("steps.csv"), steps.replace(line, &changed)).unwrap();
    let end = run(&["verify", done.path("states.csv").to_str().unwrap()]);
    assert_eq!(end.code, Some(1), "{end:?}");
    assert!(end.stdout.contains("its stiffness in the table is 5.000e-1"), "{end:?}");
}

const TWO: &str = r#"
ground = { friction = 0.4 }
[[bodies]]
name = "tray"
box = [1, 1, 0.1]
mass = 1
position = [0, 0, 0.5]
[[bodies]]
name = "cube"
box = 0.2
mass = 1
position = [0, 0, 2]
copies = { count = [2, 1, 1], step = [1, 0, 0] }
[[fixed]]
name = "belt"
box = [1, 1, 0.1]
position = [3, 0, 0.5]
"#;

/// Invalid prescribed motions and moving surfaces are refused, also with Ipopt or with a single
/// body.
#[test]
fn invalid_prescribed_motions_and_surfaces_are_rejected() {
    let driven = |fields: &str| format!("{TWO}\n[[driven]]\n{fields}\n");
    let tray = |fields: &str| driven(&format!("body = \"tray\"\n{fields}"));
    let way = "times = [0, 1]\npositions = [[0, 0, 0.5], [1, 0, 0.5]]";
    let refused = [
        (driven("body = \"none\"\nspin = [0, 0, 1]"), "driven[0] (none).body: unknown name"),
        (
            driven("body = \"belt\"\nspin = [0, 0, 1]"),
            "driven[0] (belt).body: \"belt\" never moves",
        ),
        (
            driven("body = \"cube\"\nspin = [0, 0, 1]"),
            "body: \"cube\" names 2 bodies; one is needed",
        ),
        (tray(""), "driven[0] (tray).times: `times` with `positions` or"),
        (tray("times = [0, 1]"), "positions: `times` needs `positions` or `attitudes`"),
        (tray("positions = [[0, 0, 0.5]]"), "times: required with `positions`"),
        (
            tray("times = [0, 1]\npositions = [[0, 0, 0.5]]"),
            "positions has 1 entries, but times has 2",
        ),
        (
            tray("times = [0, 0]\npositions = [[0, 0, 0.5], [0, 0, 0.5]]"),
            "times: time of a prescribed motion",
        ),
        (tray("times = []\npositions = []"), "times: knots of a prescribed motion: 0 given"),
        (tray("times = [0]\nattitudes = [\"random\"]"), "attitudes: random ones are not supported"),
        (
            tray("times = [0]\npositions = [[1e5, 0, 0.5]]"),
            "positions: coordinates from -1e4 to 1e4",
        ),
        (
            tray("times = [0, 1]\npositions = [[1, 0, 0.5], [0, 0, 0.5]]"),
            "positions: at t = 0 s the prescribed motion is 1.000e0 m",
        ),
        (
            tray("times = [0]\nattitudes = [{ axis = [0, 0, 1], degrees = 5 }]"),
            "attitudes: at t = 0 s",
        ),
        (tray(&format!("{way}\nabout = [0, 0, 0]")), "about has no meaning with `times`"),
        (tray("velocity = [1, 0, 0]\nabout = [0, 0, 0]"), "about has no meaning without `spin`"),
        (
            tray("velocity = [1e6, 0, 0]"),
            "driven[0] (tray).velocity: velocity of a prescribed motion",
        ),
        (tray("spin = [0, 0, 1e6]"), "driven[0] (tray).spin: spin of a prescribed motion"),
        (tray("spin = [0, 0, 1]\nspeed = 3"), "unknown field `speed`"),
        (tray("spin = [0, 0, 1]\nname = \"a b\""), "driven[0] (tray).name: \"a b\" is not allowed"),
        (
            format!("{}[[driven]]\nbody = \"tray\"\nspin = [0, 0, 1]\n", tray(way)),
            "driven[1] (tray).body: \"tray\" is already driven",
        ),
        (
            format!("{TWO}[[surfaces]]\nof = \"none\"\nvelocity = [1, 0, 0]\n"),
            "surfaces[0].of: unknown name",
        ),
        (
            format!("{TWO}[[surfaces]]\nof = \"belt\"\nvelocity = [1e6, 0, 0]\n"),
            "surfaces[0].velocity: components from",
        ),
        (
            format!("{TWO}[[surfaces]]\nof = \"belt\"\nvelocity = [1, 0, 0]\n")
                + "[[surfaces]]\nof = \"belt\"\nvelocity = [2, 0, 0]\n",
            "surfaces[1].of: the surface of \"belt\" is given twice",
        ),
    ];
    for (text, words) in refused {
        let done = simulated_text(&text, &["--steps", "3"]);
        assert_eq!(done.end.code, Some(2), "{words}: {:?}", done.end);
        assert!(done.end.stderr.contains(words), "{words}: {:?}", done.end);
        assert!(!done.path("states.csv").exists());
    }
    // Ipopt supports neither driven bodies nor moving surfaces, because a driven body has a joint.
    for (more, what) in [
        ("[[driven]]\nbody = \"tray\"\nspin = [0, 0, 1]\n", "does not support joints"),
        (
            "[[surfaces]]\nof = \"ground\"\nvelocity = [1, 0, 0]\n",
            "does not support moving surfaces",
        ),
    ] {
        let done = simulated_text(&format!("{TWO}{more}"), &["--steps", "3", "--solver", "ipopt"]);
        done.end.assert_refused(2, &["--solver", what, "native solver"]);
    }
}

/// A body turns about a point outside it. A box on the moving ground reaches the ground's velocity.
#[test]
fn a_body_turns_about_a_place_and_the_ground_moves() {
    let text = r#"
ground = { friction = 0.5 }
steps = 501
[[bodies]]
name = "arm"
box = [0.6, 0.1, 0.1]
mass = 1
position = [1.3, 0, 1]
[[bodies]]
name = "cube"
box = 0.2
mass = 1
position = [0, 0, 0.1]
[[driven]]
name = "crank"
body = "arm"
spin = [0, 0, 2]
about = [1, 0, 1]
[[surfaces]]
of = "ground"
velocity = [0, -0.5, 0]
"#;
    let done = simulated_text(text, &[]);
    assert_eq!(done.end.code, Some(0), "{:?}", done.end);
    verified(&done);
    for (k, (place, _)) in body(&done, 0).iter().enumerate() {
        let angle = 2.0 * H * k as f64;
        let expected = Vector3::new(1.0 + 0.3 * angle.cos(), 0.3 * angle.sin(), 1.0);
        assert!((place - expected).norm() < 1e-12, "{k}: {place}");
    }
    assert!((body(&done, 1)[500].1[1] + 0.5).abs() < 1e-9);
    let json = done.run_json();
    assert_eq!(json["model"]["driven"][0]["name"], "crank");
}

/// Two pads that close on a block, or a pad that presses two blocks against a wall, finally leave
/// too little room. The report names the bodies and the overlap.
#[test]
fn bodies_without_room_are_reported_by_name() {
    const PINCHED: &str = r#"
steps = 129
[ground]
friction = 0.5
[[fixed]]
name = "wall"
box = [0.1, 1, 1]
position = [0.0, 3.0, 0.5]
[[bodies]]
name = "block"
box = 0.2
mass = 1.0
position = [0, 0, 0.1]
[[bodies]]
name = "left"
box = [0.1, 0.3, 0.3]
mass = 5.0
position = [-0.2, 0, 0.2]
[[bodies]]
name = "right"
box = [0.1, 0.3, 0.3]
mass = 5.0
position = [0.2, 0, 0.2]
[[driven]]
body = "left"
velocity = [0.2, 0, 0]
[[driven]]
body = "right"
velocity = [-0.2, 0, 0]
"#;
    let done = simulated_text(PINCHED, &[]);
    assert_eq!(done.end.code, Some(3), "{:?}", done.end);
    // A gap of 0.1 m closes at 0.4 m/s. It is zero after 125 steps of 2 ms. After 126 steps the
    // overlap is 0.8 mm.
    let printed = done.end.stdout.lines().find(|line| line.contains("k = 125")).unwrap();
    assert!(printed.contains("block, left, right have 8.0e-4 m too little room"), "{printed}");

    let pile = PINCHED
        .replace("name = \"right\"\nbox = [0.1, 0.3, 0.3]", "name = \"second\"\nbox = 0.2")
        .replace("position = [0.2, 0, 0.2]", "position = [0.21, 0, 0.1]")
        .replace("position = [0.0, 3.0, 0.5]", "position = [0.38, 0.0, 0.5]")
        .replace("[[driven]]\nbody = \"right\"\nvelocity = [-0.2, 0, 0]\n", "")
        .replace("steps = 129", "steps = 204");
    let done = simulated_text(&pile, &[]);
    assert_eq!(done.end.code, Some(3), "{:?}", done.end);
    let lines = done.end.stdout.lines();
    let printed = lines.filter(|line| line.contains("block, left, second, wall have")).count();
    assert!(printed > 0, "{:?}", done.end);
}
