//! Meshes that are not convex: decomposed in scenes and by `convert`.

use super::support::{End, run, tumble};
use crate::ROOT;
use std::f64::consts::TAU;
use std::fmt::Write as _;
use std::fs;
use std::path::Path;
use tempfile::TempDir;

/// OBJ text of a torus about z with the given radii.
fn torus(radius: f64, tube: f64) -> String {
    let (around, across) = (32, 16);
    let mut text = String::new();
    for i in 0..around * across {
        let [a, b] = [i / across, i % across];
        let (a, b) = (TAU * a as f64 / around as f64, TAU * b as f64 / across as f64);
        let reach = radius + tube * b.cos();
        let _ = writeln!(text, "v {} {} {}", reach * a.cos(), reach * a.sin(), tube * b.sin());
    }
    let number = |i: usize, j: usize| 1 + i % around * across + j % across;
    for i in 0..around {
        for j in 0..across {
            let [p, q, r, s] =
                [number(i, j), number(i + 1, j), number(i + 1, j + 1), number(i, j + 1)];
            let _ = writeln!(text, "f {p} {q} {r} {s}");
        }
    }
    text
}

/// Directory with `scene.toml`, `bowl.obj` and `ring.obj`, a torus of 1 m and 0.3 m.
fn folder(scene: &str) -> TempDir {
    let directory = tempfile::tempdir().unwrap();
    let place = directory.path();
    fs::copy(Path::new(ROOT).join("data/meshes/bowl.obj"), place.join("bowl.obj")).unwrap();
    fs::write(place.join("ring.obj"), torus(1.0, 0.3)).unwrap();
    fs::write(place.join("scene.toml"), scene).unwrap();
    directory
}

fn run_in(directory: &TempDir, args: &[&str]) -> End {
    tumble().current_dir(directory.path()).args(args).output().unwrap().into()
}

/// Last row of body `index` in states.csv: position and speed.
fn last(directory: &TempDir, index: usize) -> ([f64; 3], f64) {
    let table = fs::read_to_string(directory.path().join("out/states.csv")).unwrap();
    let header: Vec<&str> = table.lines().next().unwrap().split(',').collect();
    let column = |name: &str| header.iter().position(|column| *column == name).unwrap();
    let mut rows = table.lines().rev().map(|row| row.split(',').collect::<Vec<_>>());
    let row = rows.find(|row| row[column("body")] == index.to_string()).unwrap();
    let value = |name: &str| -> f64 { row[column(name)].parse().unwrap() };
    let speeds = ["vx_m_s", "vy_m_s", "vz_m_s"].map(value);
    let speed = speeds.iter().map(|part| part * part).sum::<f64>().sqrt();
    (["x_m", "y_m", "z_m"].map(value), speed)
}

const BOWL: &str = r#"
    steps = 4500
    [ground]
    friction = 0.5
    [[bodies]]
    name = "bowl"
    mesh = "bowl.obj"
    decompose = { pieces = 24 }
    density = 700.0
    position = [0.0, 0.0, 0.0]
    [[bodies]]
    name = "ball"
    sphere = 0.04
    density = 500.0
    position = [0.08, 0.02, 0.2]
"#;

/// A ball comes to rest inside a bowl. The run has the pieces: it is continued and verified without
/// the mesh. Mass properties are those of the mesh.
#[test]
fn a_ball_rests_in_a_bowl_whose_pieces_are_stored() {
    let directory = folder(BOWL);
    let end = run_in(&directory, &["run", "scene.toml", "--out", "out"]);
    assert_eq!(end.code, Some(0), "{end:?}");
    let json = fs::read_to_string(directory.path().join("out/run.json")).unwrap();
    let json: serde_json::Value = serde_json::from_str(&json).unwrap();
    let pieces = json["model"]["bodies"][0]["pieces"].as_array().unwrap();
    assert!((4..=24).contains(&pieces.len()), "{}", pieces.len());
    assert!(pieces.iter().all(|piece| piece["hull"].is_array()));
    // The drawing is the mesh itself.
    let look = &json["model"]["bodies"][0]["look"][0]["surface"];
    assert_eq!(look["triangles"].as_array().unwrap().len(), 288);
    // A solid of revolution about z with 24 sectors, summed over the cones between the rings:
    // V = A h (r² + r s + s²)/3 for radii r and s, with A = 12 sin(2π/24) instead of π.
    let cone = |from: [f64; 2], to: [f64; 2]| {
        let [[r, a], [s, b]] = [from, to];
        12.0 * (TAU / 24.0).sin() * (b - a) * (r * r + r * s + s * s) / 3.0
    };
    let outside = cone([0.1, 0.0], [0.2, 0.1]) + cone([0.2, 0.1], [0.2, 0.16]);
    let inside = cone([0.09, 0.03], [0.17, 0.11]) + cone([0.17, 0.11], [0.17, 0.16]);
    let mass = json["model"]["bodies"][0]["mass"].as_f64().unwrap();
    // The numbers of the file have six digits.
    assert!((mass / (700.0 * (outside - inside)) - 1.0).abs() < 1e-4, "{mass}");
    // The floor of the bowl is at 0.03 m, its rim at 0.16 m.
    let ([x, y, z], speed) = last(&directory, 1);
    assert!(x.hypot(y) < 0.1 && z > 0.06 && z < 0.1, "{x} {y} {z}");
    assert!(speed < 1e-3, "{speed}");

    fs::remove_file(directory.path().join("bowl.obj")).unwrap();
    let verified = run_in(&directory, &["verify", "out/states.csv"]);
    assert_eq!(verified.code, Some(0), "{verified:?}");
    let on = run_in(&directory, &["run", "--continue", "out", "--steps", "4540", "--quiet"]);
    assert_eq!(on.code, Some(0), "{on:?}");
    let verified = run_in(&directory, &["verify", "out/states.csv"]);
    assert_eq!(verified.code, Some(0), "{verified:?}");
}

/// A fixed ring holds a ball in its hole: the ball reaches the ground.
#[test]
fn a_ball_falls_through_the_hole_of_a_fixed_ring() {
    let scene = "steps = 500\n[ground]\nfriction = 0.5\n\
        [[fixed]]\nname = \"ring\"\nmesh = \"ring.obj\"\ndecompose = {}\nposition = [0, 0, 0.3]\n\
        [[bodies]]\nname = \"ball\"\nsphere = 0.4\ndensity = 100.0\nposition = [0.1, 0, 1.2]\n";
    let directory = folder(scene);
    let end = run_in(&directory, &["run", "scene.toml", "--out", "out"]);
    assert_eq!(end.code, Some(0), "{end:?}");
    let ([x, y, z], _) = last(&directory, 0);
    // The hull of the ring would hold the ball at 1 m.
    assert!((z - 0.4).abs() < 1e-3 && x.hypot(y) < 0.3, "{x} {y} {z}");
    let verified = run_in(&directory, &["verify", "out/states.csv"]);
    assert_eq!(verified.code, Some(0), "{verified:?}");
}

/// Two conversions have the same bytes. The scene runs, and its conversion does not change it.
#[test]
fn a_mesh_is_converted_to_a_scene_of_hulls() {
    let directory = folder("");
    let flags = ["--pieces", "12", "--scale", "0.1", "--density", "2500"];
    let convert =
        |out: &str| run_in(&directory, &[&["convert", "ring.obj", out][..], &flags].concat());
    let end = convert("one.toml");
    assert_eq!(end.code, Some(0), "{end:?}");
    for words in [
        "ring.obj: 0.26 × 0.26 × 0.06 m, ",
        " pieces with ",
        " of the mesh's",
        " m outside it",
        "wrote ",
    ] {
        assert!(end.stdout.contains(words), "{words}: {}", end.stdout);
    }
    assert_eq!(convert("two.toml").code, Some(0));
    let read = |name: &str| fs::read_to_string(directory.path().join(name)).unwrap();
    assert_eq!(read("one.toml"), read("two.toml"));
    assert!(!read("one.toml").contains("decompose"));
    let again = run_in(&directory, &["convert", "one.toml", "again.toml", "--quiet"]);
    assert_eq!((again.code, &*again.stdout), (Some(0), ""), "{again:?}");
    assert_eq!(read("one.toml"), read("again.toml"));
    let end = run_in(&directory, &["run", "one.toml", "--steps", "30", "--out", "out"]);
    assert_eq!(end.code, Some(0), "{end:?}");
    // The ring rests on the ground.
    let ([x, y, z], _) = last(&directory, 0);
    assert!(x.hypot(y) < 1e-9 && (z - 0.03).abs() < 1e-4, "{x} {y} {z}");
}

#[test]
fn wrong_fields_and_meshes_are_refused() {
    let box_and_box = "v 0 0 0\nv 1 0 0\nv 0 1 0\nv 0 0 1\nv 0.1 0.1 -1\nv 0.3 0.1 -1\nv 0.1 0.3 -1\n\
        v 0.1 0.1 2\nf 1 3 2\nf 1 2 4\nf 1 4 3\nf 2 3 4\nf 5 7 6\nf 5 6 8\nf 5 8 7\nf 6 7 8\n";
    let open = torus(1.0, 0.3).replacen("f 1 17 18 2\n", "", 1);
    let cases = [
        ("decompose = { pieces = 24 }", "decompose = { pieces = 0 }", "pieces: 0 given"),
        ("decompose = { pieces = 24 }", "decompose = { pieces = 4000000000 }", "1 to 32"),
        ("decompose = { pieces = 24 }", "decompose = { resolution = 9 }", "16 to 128"),
        ("decompose = { pieces = 24 }", "decompose = { concavity = 2 }", "concavity is 2"),
        ("decompose = { pieces = 24 }", "decompose = { hulls = 3 }", "hulls"),
        ("decompose = { pieces = 24 }", "decompose = 24", "decompose"),
        ("decompose = { pieces = 24 }", "decompose = {}\nradius = 0.1", "bodies[0].radius"),
        ("decompose = { pieces = 24 }", "decompose = {}\nbox = 1", "already `box`"),
        ("decompose = { pieces = 24 }", "decompose = {}\npoint_mass = true", "bodies[0].decompose"),
        ("mesh = \"bowl.obj\"", "sphere = 1", "without a `mesh` file"),
        ("decompose = { pieces = 24 }", "", "decompose it into convex pieces"),
        ("\"bowl.obj\"", "\"open.obj\"", "the mesh is open"),
        ("\"bowl.obj\"", "\"none.obj\"", "none.obj"),
        ("\"bowl.obj\"", "\"empty.obj\"", "triangles of the mesh: 0 given"),
        ("\"bowl.obj\"", "\"crossed.obj\"", "intersects itself"),
    ];
    for (from, to, words) in cases {
        let directory = folder(&BOWL.replacen(from, to, 1));
        fs::write(directory.path().join("open.obj"), &open).unwrap();
        fs::write(directory.path().join("empty.obj"), "v 0 0 0\n").unwrap();
        fs::write(directory.path().join("crossed.obj"), box_and_box).unwrap();
        let end = run_in(&directory, &["run", "scene.toml", "--out", "out"]);
        end.assert_refused(2, &["scene.toml", words]);
        assert!(!directory.path().join("out").exists());
    }
    // A piece of a list is convex.
    let listed = "[ground]\nfriction = 0.5\n[[bodies]]\nmass = 1.0\nposition = [0, 0, 1]\n\
        pieces = [{ mesh = \"bowl.obj\", decompose = {} }]\n";
    let end = run_in(&folder(listed), &["run", "scene.toml", "--out", "out"]);
    end.assert_refused(2, &["pieces", "decompose"]);
}

#[test]
fn wrong_flags_of_a_conversion_are_refused() {
    let directory = folder("");
    let cases = [
        (["--pieces", "33"], "--pieces"),
        (["--resolution", "129"], "--resolution"),
        (["--concavity", "-1"], "--concavity"),
        (["--scale", "0"], "scale"),
        (["--density", "0"], "density"),
        (["--packages", "."], "--packages"),
    ];
    for (flag, words) in cases {
        let end = run_in(&directory, &[&["convert", "bowl.obj", "out.toml"], &flag[..]].concat());
        end.assert_refused(2, &[words]);
        assert!(!directory.path().join("out.toml").exists());
    }
    let robot = Path::new(ROOT).join("data/robots/arm.urdf");
    let args = ["convert", robot.to_str().unwrap(), "out.toml", "--density", "100"];
    run(&args).assert_refused(2, &["--density", "mesh"]);
}

/// A part of 26 m is asked about its unit. A run and a check say how far the pieces are off.
#[test]
fn sizes_and_deviations_of_parts_are_reported() {
    let scene = "[ground]\nfriction = 0.5\n[[fixed]]\nmesh = \"ring.obj\"\ndecompose = { resolution = 32 }\n\
                 [[bodies]]\nsphere = 0.4\nmass = 1.0\nposition = [0, 0, 3]\n";
    let directory = folder(scene);
    let end = run_in(
        &directory,
        &["convert", "ring.obj", "large.toml", "--scale", "10", "--density", "2"],
    );
    for words in ["ring.obj: 26 × 26 × 6 m, ", "is the file in millimetres? Then add --scale 0.001"]
    {
        assert!(end.stdout.contains(words), "{words}: {}", end.stdout);
    }
    let end = run_in(
        &directory,
        &["convert", "ring.obj", "small.toml", "--scale", "0.1", "--density", "2"],
    );
    assert!(!end.stdout.contains("millimetres"), "{}", end.stdout);
    for command in ["check", "run"] {
        let end = run_in(&directory, &[command, "scene.toml", "--steps", "3"]);
        assert!(
            end.stdout.contains("ring.obj: its pieces reach up to "),
            "{command}: {}",
            end.stdout
        );
    }
}

/// A part in millimetres is asked about its unit by every command, also where its mass is refused. A
/// given scale is an answer.
#[test]
fn parts_without_a_scale_are_asked_about_millimetres() {
    let scene = |density: f64, scale: &str| {
        format!(
            "steps = 3\n[[bodies]]\nmesh = \"ring.obj\"\n{scale}\ndecompose = {{}}\ndensity = {density}\n\
             position = [0, 0, 0]\n"
        )
    };
    let directory = folder(&scene(1.0, ""));
    fs::write(directory.path().join("ring.obj"), torus(100.0, 30.0)).unwrap();
    let question = "is the file in millimetres? Then add";
    let note = format!("ring.obj is 260 m long; {question} `scale = 0.001`");
    for command in ["check", "run"] {
        let end = run_in(&directory, &[command, "scene.toml"]);
        assert!(end.code == Some(0) && end.stdout.contains(&note), "{end:?}");
    }
    fs::write(directory.path().join("scene.toml"), scene(1.0, "scale = 1.0")).unwrap();
    let end = run_in(&directory, &["check", "scene.toml"]);
    assert!(!end.stdout.contains("millimetres"), "{end:?}");
    fs::write(directory.path().join("scene.toml"), scene(2700.0, "")).unwrap();
    let words = ["bodies[0].mass is ", "allowed: 1e-9 to 1e9", question];
    run_in(&directory, &["check", "scene.toml"]).assert_refused(2, &words);
    let plate = "steps = 3\n[[bodies]]\nname = \"plate\"\nbox = [80, 40, 20]\ndensity = 7800\nposition = [0, 0, 0]\n";
    fs::write(directory.path().join("scene.toml"), plate).unwrap();
    let end = run_in(&directory, &["check", "scene.toml"]);
    let note = "plate is 80 m long and has 499200 t; lengths are in m, not in millimetres";
    assert!(end.code == Some(0) && end.stdout.contains(note), "{end:?}");
    let convert = ["convert", "ring.obj", "out.toml", "--density", "2700"];
    run_in(&directory, &convert).assert_refused(2, &[&words[..], &["--scale 0.001"]].concat());
}
