//! Broken scenes of several bodies are refused in one sentence, and no file is written.

use super::scenario::run_scenario;
use super::support::{End, PROGRAM, everything_in, run};
use std::fs;

const SCENE: &str = r#"
steps = 5
[ground]
friction = 0.5
[[bodies]]
name = "lower"
box = [0.4, 0.4, 0.2]
mass = 1.0
position = [0.0, 0.0, 0.1]
[[bodies]]
name = "upper"
box = 0.2
density = 500.0
position = [0.0, 0.0, 0.3]
copies = { count = [1, 1, 2], step = [0.0, 0.0, 0.2] }
[[fixed]]
name = "wall"
box = [0.1, 1.0, 1.0]
position = [1.0, 0.0, 0.5]
[[friction]]
between = ["lower", "upper"]
coefficient = 0.3
"#;

/// Replaced text of `SCENE`, new text and words of the refusal.
const BROKEN: [(&str, &str, &[&str]); 69] = [
    ("mass = 1.0", "mass = -1.0", &["bodies[0].mass", "-1", "1e-9 to 1e9"]),
    ("mass = 1.0", "mass = nan", &["bodies[0].mass", "NaN"]),
    ("mass = 1.0", "mass = \"heavy\"", &["line 8", "heavy", "number"]),
    ("mass = 1.0", "", &["bodies[0].mass", "density"]),
    ("mass = 1.0", "mass = 1.0\ndensity = 2.0", &["bodies[0].mass", "one of `mass` and `density`"]),
    ("mass = 1.0", "mass = 1.0\ntint = 1", &["line 9", "tint"]),
    ("mass = 1.0", "mass = 1.0\ncolour = 1", &["line 9", "bodies[0].colour"]),
    ("mass = 1.0", "mass = 1.0\ncolour = \"mauve\"", &["bodies[0].colour", "mauve", "#rrggbb"]),
    ("mass = 1.0", "mass = 1.0\ncolour = \"#12345g\"", &["bodies[0].colour", "red, white"]),
    ("mass = 1.0", "mass = 1.0\nlabel = \"\"", &["bodies[0].label", "1 to 40 characters"]),
    ("density = 500.0", "density = 0.0", &["bodies[1].density", "1e-6 to 1e9"]),
    ("box = 0.2", "box = 0.0", &["bodies[1].box: side of the box (m) is 0.0"]),
    ("box = 0.2", "box = [0.2, 0.2]", &["line 12", "three"]),
    ("box = 0.2", "", &["bodies[1]", "sphere", "point_mass"]),
    (
        "box = 0.2",
        "box = 0.2\nsphere = 0.1",
        &["bodies[1].sphere: only one shape", "already `box`"],
    ),
    ("box = 0.2", "sphere = -0.1", &["bodies[1].sphere", "radius"]),
    ("box = 0.2", "capsule = { length = 0.0, radius = 0.1 }", &["bodies[1].capsule"]),
    ("box = 0.2", "capsule = { length = 0.1 }", &["line 12", "radius"]),
    ("box = 0.2", "hull = [[0, 0, 0], [1, 0, 0], [0, 1, 0]]", &["bodies[1].hull", "3", "4 to"]),
    (
        "box = 0.2",
        "hull = [[0, 0, 0], [1, 0, 0], [0, 1, 0], [1, 1, 0]]",
        &["bodies[1].hull", "flat"],
    ),
    (
        "box = 0.2",
        "hull = [[0, 0, 0], [1, 0, 0], [0, 1, 0], [0, 0, nan]]",
        &["bodies[1].hull", "NaN"],
    ),
    ("box = 0.2", "hull = [[0,0,0],[1,0,0],[0,1,0],[0,0,1]]\nradius = -1.0", &["bodies[1].radius"]),
    ("box = 0.2", "box = 0.2\nradius = 0.1", &["bodies[1].radius", "no meaning"]),
    ("box = 0.2", "box = 0.2\nscale = 0.1", &["bodies[1].scale", "no meaning"]),
    ("box = 0.2", "mesh = \"none.obj\"", &["bodies[1].mesh", "none.obj"]),
    ("box = 0.2", "mesh = \"test.toml\"", &["bodies[1].mesh", ".obj or .stl"]),
    ("box = 0.2", "pieces = []", &["bodies[1]", "pieces"]),
    ("box = 0.2", "pieces = [{ box = 0.2 }, { sphere = 0.0 }]", &["bodies[1].pieces[1].sphere"]),
    ("box = 0.2", "pieces = [{ position = [0, 0, 0] }]", &["bodies[1].pieces[0]", "one shape"]),
    (
        "box = 0.2",
        "pieces = [{ box = 0.2, attitude = \"random\" }]",
        &["bodies[1].pieces[0].attitude", "random"],
    ),
    ("box = 0.2", "points = [[0, 0, -0.1]]", &["bodies[1].density", "points"]),
    ("box = [0.4, 0.4, 0.2]", "points = [[0, 0, -0.1]]", &["bodies[0].inertia", "required"]),
    (
        "mass = 1.0",
        "mass = 1.0\ninertia = [1.0, 1.0, -1.0]",
        &["bodies[0].inertia", "positive definite"],
    ),
    ("mass = 1.0", "mass = 1.0\ncentre = [0, 0, 0]", &["bodies[0].centre", "inertia"]),
    ("mass = 1.0", "mass = 1.0\nfriction = 11.0", &["bodies[0].friction", "0 to 10"]),
    ("mass = 1.0", "mass = 1.0\njitter = -0.1", &["bodies[0].jitter"]),
    ("mass = 1.0", "mass = 1.0\nvelocity = [1e9, 0, 0]", &["bodies[0].velocity"]),
    ("mass = 1.0", "mass = 1.0\nspin = [nan, 0, 0]", &["bodies[0].spin"]),
    ("mass = 1.0", "mass = 1.0\nattitude = [0, 0, 0, 0]", &["bodies[0].attitude", "quaternion"]),
    ("mass = 1.0", "mass = 1.0\nattitude = \"up\"", &["line 9", "random", "axis"]),
    (
        "mass = 1.0",
        "mass = 1.0\nattitude = { axis = [0, 0, 0], degrees = 3 }",
        &["bodies[0].attitude", "axis"],
    ),
    ("mass = 1.0", "mass = 1.0\nload = { at = [0, 0, 1] }", &["bodies[0].load.at", "load.force"]),
    ("mass = 1.0", "mass = 1.0\nload = { force = [] }", &["bodies[0].load.force", "no knots"]),
    (
        "mass = 1.0",
        "mass = 1.0\nload = { force = [1e9, 0, 0] }",
        &["load of lower", "allowed: up to 1e4 m/s"],
    ),
    ("[0.0, 0.0, 0.1]", "[0.0, 0.0, 0.09]", &["lower", "below the ground", "1.000e-2"]),
    ("[0.0, 0.0, 0.3]", "[0.0, 0.0, 0.29]", &["lower", "upper-0", "overlap by 1.000e-2 m"]),
    ("[1.0, 0.0, 0.5]", "[0.2, 0.0, 0.5]", &["wall", "overlap"]),
    ("count = [1, 1, 2]", "count = [0, 1, 2]", &["bodies[1].copies.count", "1 or more"]),
    ("count = [1, 1, 2]", "count = [1000, 1000, 1000]", &["bodies[1].copies.count", "20000"]),
    ("copies = {", "ring = { count = 2, degrees = 3 }\ncopies = {", &["bodies[1].copies", "ring"]),
    ("name = \"upper\"", "name = \"lower\"", &["lower", "twice"]),
    ("name = \"upper\"", "name = \"ground\"", &["bodies[1].name", "ground"]),
    ("name = \"upper\"", "name = \"a,b\"", &["bodies[1].name", "a,b"]),
    ("\"lower\", \"upper\"]", "\"lower\", \"roof\"]", &["friction[0].between", "roof"]),
    ("\"lower\", \"upper\"]", "\"wall\", \"ground\"]", &["friction[0].between", "two bodies"]),
    ("coefficient = 0.3", "coefficient = -1.0", &["friction[0].coefficient", "0 to 10"]),
    ("[ground]\nfriction = 0.5\n", "", &["[ground] is needed", "none = true"]),
    ("[ground]", "[[ground]]", &["line 3", "ground: ", "list", "expected a single table"]),
    ("friction = 0.5", "friction = 0.5\nnone = true\noffset = 1.0", &["ground.offset", "none"]),
    ("friction = 0.5", "friction = 0.5\nnone = true\nslope = 1.0", &["ground.slope", "none"]),
    ("friction = 0.5", "none = true", &["friction"]),
    ("friction = 0.5\n", "friction = 0.5\nnone = 3\n", &["none", "3"]),
    ("mass = 1.0", "mass = 1.0\nframe = \"fixed\"", &["fixed", "ground"]),
    ("steps = 5", "steps = 0", &["steps", "1 to 10000000"]),
    ("steps = 5", "time_step = 1.0", &["time_step", "1e-6 to 0.1"]),
    ("steps = 5", "[solver]\nname = \"ipopt\"", &["solver", "one body", "native"]),
    ("steps = 5", "[solver]\npreset = \"tutorial\"", &["preset", "one body only"]),
    ("steps = 5", "[solver]\ntolerance = 1e-8", &["solver.tolerance", "native"]),
    ("steps = 5", "[body]\nbox = 1.0\nmass = 1.0", &["body has no meaning", "[[bodies]]"]),
];

#[test]
fn broken_scenes_are_refused_in_one_line_with_the_file_and_the_field() {
    let (end, _directory) = run_scenario(SCENE, &[]);
    assert_eq!(end.code, Some(0), "{end:?}");
    for (old, new, words) in BROKEN {
        assert!(SCENE.contains(old), "{old}");
        let (end, directory) = run_scenario(&SCENE.replacen(old, new, 1), &[]);
        assert_eq!(end.code, Some(2), "{new}: {end:?}");
        end.assert_refused(2, &[&["test.toml"], words].concat());
        assert_eq!(everything_in(directory.path()).len(), 1, "{new}: something was written");
    }
}

/// Values from flags are reported under the flag's name.
#[test]
fn flags_of_the_tutorials_solver_are_refused_by_their_names() {
    for (flags, flag) in [
        (["--preset", "tutorial"].as_slice(), "--preset: "),
        (&["--solver", "ipopt"], "--solver: "),
    ] {
        let (end, directory) = run_scenario(SCENE, flags);
        end.assert_refused(2, &[flag]);
        assert_eq!(everything_in(directory.path()).len(), 1, "{flag}: something was written");
    }
}

/// Flags for a single body and flags of pictures that are not requested are refused. Flags of the
/// model apply.
#[test]
fn flags_without_effect_are_rejected() {
    for flags in [
        ["--camera", "0,10"].as_slice(),
        &["--gif-speed", "2"],
        &["--tol", "1e-8"],
        &["--max-iter", "10"],
        &["--preset", "tutorial"],
        &["--on-failure", "ladder"],
        &["--seed", "1"],
        &["--solver", "ipopt"],
    ] {
        let (end, directory) = run_scenario(SCENE, flags);
        let named = match flags[0] {
            "--preset" => "preset",
            flag => flag,
        };
        end.assert_refused(2, &[named]);
        assert_eq!(everything_in(directory.path()).len(), 1, "{flags:?}");
    }
    let flags = ["--dt", "0.001", "--mu", "0.2", "--gravity", "3.0", "--steps", "4"];
    let (end, directory) = run_scenario(SCENE, &flags);
    assert_eq!(end.code, Some(0), "{end:?}");
    let json = fs::read_to_string(directory.path().join("out/run.json")).unwrap();
    let json: serde_json::Value = serde_json::from_str(&json).unwrap();
    let model = &json["model"];
    assert_eq!((&model["time_step"], &model["ground"]["friction"]), (&0.001.into(), &0.2.into()));
    assert_eq!((&model["gravity"][2], &json["steps"]), (&(-3.0).into(), &4.into()));
}

/// Meshes that are open, inside out, not convex or unreadable are refused.
#[test]
fn meshes_that_are_open_inside_out_or_hollow_are_refused() {
    let corners = "v 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\nv 0 0 1\nv 1 0 1\nv 1 1 1\nv 0 1 1\n";
    let faces = "f 1 4 3 2\nf 1 2 6 5\nf 2 3 7 6\nf 3 4 8 7\nf 4 1 5 8\nf 5 6 7 8\n";
    let closed = format!("{corners}{faces}");
    let open = format!("{corners}{}", faces.replace("f 5 6 7 8\n", ""));
    let turned: String = faces
        .lines()
        .map(|line| {
            let mut numbers: Vec<_> = line.split(' ').skip(1).collect();
            numbers.reverse();
            format!("f {}\n", numbers.join(" "))
        })
        .collect();
    let dented = closed.replace("v 1 1 1\n", "v 0.2 0.2 0.5\n");
    let cases: [(&str, &str, &[&str]); 4] = [
        ("open", &open, &["is open", "edge"]),
        ("turned", &format!("{corners}{turned}"), &["inside-out"]),
        ("dented", &dented, &["not convex"]),
        ("none", "no mesh\n", &["mesh"]),
    ];
    let run_mesh = |text: &str| {
        let directory = tempfile::tempdir().unwrap();
        let scene = SCENE.replacen("box = 0.2", "mesh = \"m.obj\"\nscale = 0.1", 1);
        let scene = scene.replacen("[0.0, 0.0, 0.3]", "[0.0, 0.0, 0.2]", 1);
        fs::write(directory.path().join("test.toml"), scene).unwrap();
        fs::write(directory.path().join("m.obj"), text).unwrap();
        let file = directory.path().join("test.toml");
        let out = directory.path().join("out");
        let args = [file.to_str().unwrap(), "--out", out.to_str().unwrap()];
        (run(&args), directory)
    };
    let (end, _directory) = run_mesh(&closed);
    assert_eq!(end.code, Some(0), "{end:?}");
    for (name, text, words) in cases {
        let (end, directory) = run_mesh(text);
        end.assert_refused(2, &[&["bodies[1].mesh", "m.obj"], words].concat());
        assert_eq!(everything_in(directory.path()).len(), 2, "{name}");
    }
}

/// Overlapping pieces would count their common volume twice in the mass. Contact is allowed.
/// Overlap is allowed if mass and inertia are given.
#[test]
fn pieces_of_one_body_that_overlap_are_refused_with_their_depth() {
    let scene = |second: &str, rest: &str| {
        format!(
            "steps = 2\n[ground]\nfriction = 0.5\n[[bodies]]\n\
             pieces = [{{ box = 0.2 }}, {{ {second} }}]\nposition = [0, 0, 1]\n{rest}\n"
        )
    };
    let density = "density = 1000.0";
    for (second, depth) in [
        ("box = 0.2, position = [0.15, 0, 0]", "5.000e-2 m"),
        ("sphere = 0.1, position = [0.19, 0, 0]", "1.000e-2 m"),
        ("capsule = { length = 0.2, radius = 0.05 }, position = [0.13, 0, 0]", "2.000e-2 m"),
    ] {
        let (end, _directory) = run_scenario(&scene(second, density), &[]);
        end.assert_refused(2, &["bodies[0].pieces[1]", "pieces[0]", depth]);
    }
    for (second, rest) in [
        ("box = 0.2, position = [0.2, 0, 0]", density),
        ("sphere = 0.1, position = [0.2, 0, 0]", density),
        ("sphere = 0.1", "mass = 1.0\ncentre = [0, 0, 0]\ninertia = [1, 1, 1]"),
    ] {
        let (end, _directory) = run_scenario(&scene(second, rest), &[]);
        assert_eq!(end.code, Some(0), "{second}: {end:?}");
    }
}

#[test]
fn error_about_a_thin_box_names_the_box() {
    for table in ["[[fixed]]", "[[bodies]]\nmass = 1.0"] {
        let scene = format!(
            "steps = 2\n[ground]\nfriction = 0.5\n{table}\nbox = [3, 3, 1e-5]\n\
             position = [0, 0, 0.1]\n[[bodies]]\nbox = 0.2\nmass = 1.0\nposition = [0, 0, 1]\n"
        );
        let (end, _directory) = run_scenario(&scene, &[]);
        end.assert_refused(2, &["[0].box: the box is flat"]);
    }
}

/// Copies that lie on or near each other have pairs by the hundred million. They are refused at the
/// first ones, within the memory of a small scene.
#[test]
fn copies_at_one_place_are_refused_within_bounded_memory() {
    let scene = |shape: &str, copies: &str| {
        format!(
            "steps = 3\n[ground]\nfriction = 0.5\n[[bodies]]\n{shape}\nmass = 1\n\
             position = [0, 0, 40]\n{copies}\n"
        )
    };
    let grid = |count: u32, step: &str| {
        format!("copies = {{ count = [{count}, 1, 1], step = [{step}, 0, 0] }}")
    };
    let far = "\n[[fixed]]\nname = \"far\"\nsphere = 0.1\nposition = [0, 0, 9]";
    for (shape, copies, words) in [
        ("sphere = 0.1", grid(20_000, "0"), ["overlap by 2.000e-1 m", "body-0 and body-1"]),
        ("box = 0.1", grid(20_000, "1e-9"), ["overlap by", "body-0 and"]),
        ("box = 0.1", grid(20_000, "0") + far, ["overlap by", "body-0 and body-1"]),
        // The rounding of a world of 1 km exceeds the boxes.
        (
            "box = 0.0004",
            grid(2000, "0")
                + "\n[[bodies]]\nbox = [2000, 2000, 1]\nmass = 1000\nposition = [0, 0, 5000]",
            ["overlap by 4.000e-4 m", "body-0 and body-1"],
        ),
        // Slanted rods, 10 mm thick and 10.3 mm apart, whose boxes overlap.
        (
            "attitude = { axis = [0, 1, 0], degrees = 45 }\ncapsule = { length = 9, radius = 0.005 }",
            grid(20_000, "0.0146"),
            ["millions of pieces are near each other", "of body-"],
        ),
    ] {
        let directory = tempfile::tempdir().unwrap();
        let path = directory.path().join("scene.toml");
        fs::write(&path, scene(shape, &copies)).unwrap();
        // 2 GB of address space.
        let limited = "ulimit -v 2000000; exec \"$0\" check \"$1\"";
        let mut command = std::process::Command::new("sh");
        command.args(["-c", limited, PROGRAM]).arg(&path);
        let end: End = command.output().unwrap().into();
        end.assert_refused(2, &words);
    }
}
