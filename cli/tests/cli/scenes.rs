//! Scenes of several bodies: shipped scenarios, their tables and physical checks.

use super::scenario::{is_of_several, run_scenario, shipped};
use super::support::{Simulated, Table, everything_in, run, simulate};
use crate::ROOT;
use nalgebra::Vector3;
use std::fs;

/// Table `name` of a run.
pub fn table(done: &Simulated, name: &str) -> Table {
    Table::parse(&fs::read_to_string(done.path(&format!("{name}.csv"))).unwrap())
}

pub fn scene(name: &str, flags: &[&str]) -> Simulated {
    let file = format!("{ROOT}/scenarios/{name}.toml");
    let done = simulate(&[&[file.as_str()], flags].concat());
    assert_eq!(done.end.code, Some(0), "{name}: {:?}", done.end);
    done
}

/// Each shipped scene runs 200 steps without failure, with small overlap and without energy gain.
/// Its tables verify, and no other file is written.
#[test]
fn every_shipped_scene_of_several_bodies_runs_and_verifies() {
    let scenes: Vec<_> = shipped().into_iter().filter(|path| is_of_several(path)).collect();
    assert!(scenes.len() >= 16, "{scenes:?}");
    for path in scenes {
        let name = path.file_stem().unwrap().to_str().unwrap();
        let done = scene(name, &["--steps", "200"]);
        let json = done.run_json();
        assert_eq!(json["summary"]["failed"], 0, "{name}");
        // The contact planes stay constant for a step. Two bodies of size 0.2 m that both turn by ψ
        // = h ω leave them by up to ½ (2ψ)² 0.2 m. At 10 rad/s that is 0.2 mm.
        let overlap = json["largest_overlap_m"].as_f64().unwrap();
        let spins = ["wx_rad_s", "wy_rad_s", "wz_rad_s"].map(|w| table(&done, "states").numbers(w));
        let fastest = spins.iter().flatten().fold(0.0_f64, |most, w| most.max(w.abs()));
        let turn = json["parameters"]["time_step_s"].as_f64().unwrap_or(0.002) * fastest;
        // A hundred boxes of `pile` collide in all attitudes. Bodies of the other scenes turn less.
        let allowed = if name == "pile" { 0.4 * turn * turn } else { 1e-4 };
        assert!(overlap < allowed, "{name}: {overlap}");
        let energy = table(&done, "steps").numbers("energy_J");
        let bodies = json["model"]["bodies"].as_array().unwrap();
        // Motors may add energy. The energy of jointed bodies oscillates by the second order of the
        // step (`joints.rs`).
        let tied = json["model"]["joints"].is_array() || json["model"]["driven"].is_array();
        let mass: f64 = bodies.iter().map(|body| body["mass"].as_f64().unwrap()).sum();
        // The push that separates overlapping bodies lifts at most the total weight by the overlap.
        let pushed = mass * 9.81 * overlap;
        let turning = gain_by_turning(&done);
        let steps = table(&done, "steps");
        let [lengths, shifts] = ["interval_s", "discretisation_J"].map(|c| steps.numbers(c));
        for (k, two) in energy.windows(2).enumerate().filter(|_| !tied) {
            // The measure of the energy (35) depends on the length of the interval.
            let shifted =
                if k > 0 && lengths[k] != lengths[k - 1] { shifts[k].max(0.0) } else { 0.0 };
            let most = pushed + turning[k] + shifted + 1e-12 * two[0].abs();
            assert!(two[1] <= two[0] + most, "{name}, k = {k}: {two:?}");
        }
        let bodies = bodies.len();
        assert!(done.end.stdout.contains(&format!("bodies       {bodies},")), "{:?}", done.end);
        assert!(done.end.stdout.contains("solver       native"), "{:?}", done.end);
        assert!(done.end.stdout.contains("overlap  "), "{:?}", done.end);
        let verified = run(&["verify", done.path("states.csv").to_str().unwrap()]);
        assert_eq!(verified.code, Some(0), "{name}: {verified:?}");
        let files = everything_in(&done.path(""));
        let files: Vec<_> = files.iter().map(|file| file.to_str().unwrap()).collect();
        let geared = json["model"]["gears"].is_array();
        let all = [
            "contacts.csv",
            "ends.csv",
            "gears.csv",
            "joints.csv",
            "run.json",
            "state.bin",
            "states.csv",
            "steps.csv",
        ];
        let divided = table(&done, "steps").numbers("interval").contains(&1.0);
        let is_there = |file: &&str| match *file {
            // Rows of a divided step may all start at the end of the one before.
            "ends.csv" => divided && files.contains(file),
            "gears.csv" => geared,
            "joints.csv" => tied,
            _ => true,
        };
        let expected = all.into_iter().filter(is_there);
        assert!(files.iter().copied().eq(expected), "{name}: {files:?}");
    }
}

/// Energy that rotation may add in each step [J]. An impulse p at the arm c of a body with spin ω
/// follows a chord, Σ |p| |c| ½ h |ω|² (eq. 28). The larger of the initial and final spins counts.
fn gain_by_turning(done: &Simulated) -> Vec<f64> {
    let contacts = table(done, "contacts").of_each_step();
    let json = done.run_json();
    let h = json["model"]["time_step"].as_f64().unwrap();
    let bodies = json["model"]["bodies"].as_array().unwrap().len();
    let states = table(done, "states").of_each_body(bodies);
    let vectors = |table: &Table, names: [&str; 3]| -> Vec<Vector3<f64>> {
        let [x, y, z] = names.map(|name| table.numbers(name));
        (0..x.len()).map(|row| Vector3::new(x[row], y[row], z[row])).collect()
    };
    let places = vectors(&states, ["x_m", "y_m", "z_m"]);
    let spins = vectors(&states, ["wx_rad_s", "wy_rad_s", "wz_rad_s"]);
    let points = vectors(&contacts, ["point_x_m", "point_y_m", "point_z_m"]);
    let forces = vectors(&contacts, ["force_x_N", "force_y_N", "force_z_N"]);
    let intervals = |of: &Table| {
        let numbers = of.numbers("k").into_iter().zip(of.numbers("interval"));
        numbers.map(|(k, interval)| (k as u64, interval as u64)).collect::<Vec<_>>()
    };
    let steps = intervals(&contacts);
    let all = intervals(&table(done, "steps"));
    let body = contacts.numbers("body");
    let (partner, other) = (contacts.texts("partner"), contacts.numbers("partner_index"));
    let mut gains = vec![0.0; places.len() / bodies];
    for row in 0..points.len() {
        let k = all.binary_search(&steps[row]).unwrap();
        let second = (partner[row] == "body").then_some(other[row]);
        for side in [Some(body[row]), second].into_iter().flatten() {
            let at = k * bodies + side as usize;
            let spin = spins[at].norm().max(spins[at + bodies].norm());
            let arm = (points[row] - places[at]).norm();
            gains[k] += h * forces[row].norm() * arm * 0.5 * h * spin * spin;
        }
    }
    gains
}

/// Distance of each body between start and end [m].
fn moved(done: &Simulated) -> Vec<f64> {
    let states = table(done, "states");
    let bodies = done.run_json()["model"]["bodies"].as_array().unwrap().len();
    let places: Vec<Vec<f64>> = ["x_m", "y_m", "z_m"].map(|name| states.numbers(name)).into();
    let last = places[0].len() - bodies;
    let distance = |body: usize| -> f64 {
        let squares = places.iter().map(|axis| (axis[last + body] - axis[body]).powi(2));
        squares.sum::<f64>().sqrt()
    };
    (0..bodies).map(distance).collect()
}

/// A stack, a pyramid, a mass ratio of 1 : 10⁴, a card house and an arch stand still up to
/// rounding.
#[test]
fn standing_structures_do_not_move() {
    for name in ["stack", "pyramid", "mass-ratio", "card-house", "arch"] {
        let moved = moved(&scene(name, &[]));
        assert!(moved.iter().all(|moved| *moved < 1e-11), "{name}: {moved:?}");
    }
}

/// Four equal corner forces below box i of the stack carry the weight of all boxes from i upwards.
#[test]
fn a_stack_carries_its_weight() {
    let contacts = table(&scene("stack", &["--steps", "5"]), "contacts").of_each_step();
    let (steps, forces) = (contacts.numbers("k"), contacts.numbers("force_z_N"));
    let (bodies, partners) = (contacts.numbers("body"), contacts.numbers("partner_index"));
    let kinds = contacts.texts("partner");
    for lower in 0..10_usize {
        let is_under = |row: usize| match kinds[row] {
            "ground" => lower == 0,
            _ => bodies[row].min(partners[row]) == lower as f64 - 1.0,
        };
        let rows = (0..steps.len()).filter(|&row| steps[row] == 3.0 && is_under(row));
        let corners: Vec<f64> = rows.map(|row| forces[row].abs()).collect();
        assert_eq!(corners.len(), 4, "box {lower}");
        for corner in corners {
            let expected = (10 - lower) as f64 * 9.81 / 4.0;
            assert!((corner - expected).abs() < 1e-9 * expected, "box {lower}: {corner}");
        }
    }
}

/// On a slope of 20° the lower block sticks with μ = 0.5. The upper block slides with μ = 0.2 of
/// the pair from the first step on. Its acceleration is g (sin 20° − μ cos 20°).
#[test]
fn a_block_slides_on_a_block_with_the_friction_of_the_pair() {
    let done = scene("block-on-block", &["--exact", "--steps", "200"]);
    let states = table(&done, "states");
    let [x, z] = ["vx_m_s", "vz_m_s"].map(|name| states.numbers(name));
    let speed = |row: usize| (x[row].powi(2) + z[row].powi(2)).sqrt();
    let angle = 20_f64.to_radians();
    let expected = 9.81 * (angle.sin() - 0.2 * angle.cos()) * 199.0 * 0.002;
    assert!(speed(2 * 199) < 1e-12, "the lower block moves: {}", speed(2 * 199));
    let found = speed(2 * 199 + 1);
    assert!((found - expected).abs() < 1e-10, "{found} {expected}");
}

/// A point mass lands and slides with v = v₀ − μ g T, because friction takes μ times the total
/// normal impulse. The tolerance for Ipopt reflects its error of some 1e-6 m/s a step.
#[test]
fn a_point_mass_lands_and_slides() {
    for (solver, allowed) in [("native", 1e-8), ("ipopt", 1e-3)] {
        let done = scene("point-mass", &["--solver", solver]);
        let states = table(&done, "states");
        let (vy, vz) = (states.numbers("vy_m_s"), states.numbers("vz_m_s"));
        let expected = 4.0 - 0.3 * 9.81 * 499.0 * 0.002;
        assert!((vy[499] - expected).abs() < allowed, "{solver}: {} {expected}", vy[499]);
        assert!(vz[499].abs() < 1e-6, "{solver}: {}", vz[499]);
        // Inertia and spin have no effect.
        assert!(states.numbers("wx_rad_s").iter().all(|spin| *spin == 0.0), "{solver}");
    }
}

#[test]
fn the_same_seed_gives_the_same_bytes_and_another_another_pile() {
    let run = |seed: &str| scene("pile", &["--steps", "150", "--seed", seed]);
    let text = |done: &Simulated, name: &str| fs::read_to_string(done.path(name)).unwrap();
    let (one, again, other) = (run("7"), run("7"), run("8"));
    for name in ["states.csv", "contacts.csv", "steps.csv"] {
        assert_eq!(text(&one, name), text(&again, name), "{name}");
    }
    assert_ne!(text(&one, "states.csv"), text(&other, "states.csv"));
    assert!(one.end.stdout.contains("seed 7,"), "{:?}", one.end);
}

/// One scene has all kinds of shapes, frames, copies, rings, loads and friction entries. It runs
/// and verifies, and its masses follow from the shapes.
#[test]
fn every_shape_has_its_mass_and_verifies() {
    let scenario = r#"
        steps = 120
        [ground]
        friction = 0.4
        slope = 5.0
        [[bodies]]
        name = "ball"
        sphere = 0.1
        density = 1000.0
        frame = "ground"
        position = [0.0, 0.0, 0.3]
        [[bodies]]
        name = "rod"
        capsule = { length = 0.4, radius = 0.05 }
        density = 1000.0
        frame = "ground"
        position = [1.0, 0.0, 0.2]
        attitude = { axis = [0, 1, 0], degrees = 80 }
        velocity = [1.0, 0.0, 0.0]
        [[bodies]]
        name = "corner"
        pieces = [
            { box = [0.4, 0.2, 0.1], position = [0.2, 0.0, 0.05] },
            { box = [0.1, 0.2, 0.3], position = [0.05, 0.0, 0.25] },
        ]
        density = 500.0
        frame = "ground"
        position = [0.0, 1.0, 0.1]
        spin = [0.0, 0.0, 1.0]
        load = { force = [[0.0, 0, 0, 0], [0.2, 1.0, 0, 0]], at = [0.1, 0.0, 0.0] }
        [[bodies]]
        name = "stone"
        mesh = "tetrahedron.obj"
        scale = 0.001
        radius = 0.01
        mass = 1.0
        frame = "ground"
        position = [0.0, -1.0, 0.2]
        [[bodies]]
        name = "tripod"
        points = [[0.1, 0.0, -0.1], [-0.1, 0.1, -0.1], [-0.1, -0.1, -0.1]]
        mass = 2.0
        inertia = [0.1, 0.1, 0.1]
        frame = "ground"
        position = [-1.0, 0.0, 0.2]
        [[fixed]]
        name = "step"
        box = [0.5, 3.0, 0.1]
        frame = "ground"
        position = [1.6, 0.0, 0.05]
        [[friction]]
        between = ["rod", "step"]
        coefficient = 0.9
        [[friction]]
        between = ["ground", "ball"]
        coefficient = 0.0
    "#;
    let directory = tempfile::tempdir().unwrap();
    let file = directory.path().join("scene.toml");
    fs::write(&file, scenario).unwrap();
    let mesh = "v 0 0 0\nv 300 0 0\nv 0 300 0\nv 0 0 300\nf 1 3 2\nf 1 2 4\nf 1 4 3\nf 2 3 4\n";
    fs::write(directory.path().join("tetrahedron.obj"), mesh).unwrap();
    let done = simulate(&[file.to_str().unwrap()]);
    assert_eq!(done.end.code, Some(0), "{:?}", done.end);
    let verified = run(&["verify", done.path("contacts.csv").to_str().unwrap()]);
    assert_eq!(verified.code, Some(0), "{verified:?}");
    let json = done.run_json();
    let mass = |body: usize| json["model"]["bodies"][body]["mass"].as_f64().unwrap();
    let ball = 4.0 / 3.0 * std::f64::consts::PI * 1e-3 * 1000.0;
    let rod = std::f64::consts::PI * (0.05_f64.powi(2) * 0.4 + 4.0 / 3.0 * 0.05_f64.powi(3)) * 1e3;
    let corner = 500.0 * (0.4 * 0.2 * 0.1 + 0.1 * 0.2 * 0.3);
    for (body, expected) in [ball, rod, corner, 1.0, 2.0].into_iter().enumerate() {
        assert!((mass(body) - expected).abs() < 1e-12 * expected, "{body}: {}", mass(body));
    }
    // Volumes of 8 and 6 dm³ with centres at x = 0.2 and 0.05 and z = 0.05 and 0.25.
    let centre = &json["model"]["bodies"][2]["centre"];
    for (axis, expected) in [(0, (1.6 + 0.3) / 14.0), (1, 0.0), (2, (0.4 + 1.5) / 14.0)] {
        let found = centre[axis].as_f64().unwrap();
        assert!((found - expected).abs() < 1e-15, "{axis}: {found} {expected}");
    }
    // Both friction entries of pairs are in the model.
    assert_eq!(json["model"]["friction"].as_array().unwrap().len(), 2);
}

/// A scene without ground runs, verifies and is drawn without ground. A free body falls past the
/// fixed one.
#[test]
fn a_scene_needs_no_ground() {
    let scenario = r#"
        steps = 200
        [ground]
        none = true
        friction = 0.3
        [[fixed]]
        name = "shelf"
        box = [1.0, 1.0, 0.1]
        position = [0.0, 0.0, -0.05]
        [[bodies]]
        name = "stays"
        box = 0.2
        mass = 1.0
        position = [0.0, 0.0, 0.1]
        [[bodies]]
        name = "falls"
        sphere = 0.1
        mass = 1.0
        position = [2.0, 0.0, 0.0]
    "#;
    let (end, directory) = run_scenario(scenario, &["--exact", "--html", "--plot"]);
    assert_eq!(end.code, Some(0), "{end:?}");
    let out = directory.path().join("out");
    let states = Table::parse(&fs::read_to_string(out.join("states.csv")).unwrap());
    let z = states.numbers("z_m");
    assert!((z[2 * 199] - 0.1).abs() < 1e-12, "{}", z[2 * 199]);
    let fallen = 0.5 * 9.81 * (0.002_f64 * 199.0).powi(2);
    assert!((z[2 * 199 + 1] + fallen).abs() < 1e-12, "{}", z[2 * 199 + 1]);
    let json = fs::read_to_string(out.join("run.json")).unwrap();
    let json: serde_json::Value = serde_json::from_str(&json).unwrap();
    assert_eq!(json["model"]["ground"]["none"], true);
    let verified = run(&["verify", out.join("states.csv").to_str().unwrap()]);
    assert_eq!(verified.code, Some(0), "{verified:?}");

    let placed = scenario.replacen("sphere = 0.1", "sphere = 0.1\nframe = \"ground\"", 1);
    let (end, _directory) = run_scenario(&placed, &[]);
    end.assert_refused(2, &["bodies[1].frame", "no ground"]);
    let pair = "[[friction]]\nbetween = [\"stays\", \"ground\"]\ncoefficient = 0.1\n";
    let (end, _directory) = run_scenario(&format!("{scenario}{pair}"), &[]);
    end.assert_refused(2, &["friction[0].between", "no ground"]);
}

/// Copies in a ring are rotated in position and attitude. A ball in the centre touches all eight
/// plates.
#[test]
fn a_ring_turns_positions_and_attitudes() {
    let scenario = r#"
        steps = 2
        gravity = 0.0
        [ground]
        friction = 0.3
        offset = -100.0
        [[fixed]]
        box = [0.02, 0.3, 0.3]
        position = [0.11, 0.0, 0.0]
        ring = { count = 8, degrees = 45.0 }
        [[bodies]]
        sphere = 0.1
        mass = 1.0
        position = [0.0, 0.0, 0.0]
    "#;
    let (end, directory) = run_scenario(scenario, &["--all-contacts"]);
    assert_eq!(end.code, Some(0), "{end:?}");
    let text = fs::read_to_string(directory.path().join("out/contacts.csv")).unwrap();
    let contacts = Table::parse(&text);
    assert_eq!(contacts.rows.len(), 8, "{:?}", contacts.rows);
    for (plate, (x, y)) in
        contacts.numbers("normal_x").iter().zip(contacts.numbers("normal_y")).enumerate()
    {
        let angle = 45_f64.to_radians() * plate as f64;
        assert!((x + angle.cos()).abs() < 1e-12 && (y + angle.sin()).abs() < 1e-12, "{plate}");
    }
}
