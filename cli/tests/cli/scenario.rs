//! Scenario files, planes and loads: shipped files, own files and broken files.

use super::support::{End, Table, everything_in, run, simulate, tumble, unseal};
use crate::ROOT;
use std::fs;
use std::path::{Path, PathBuf};

pub fn shipped() -> Vec<PathBuf> {
    let folder = Path::new(ROOT).join("scenarios");
    let mut files: Vec<_> =
        fs::read_dir(folder).unwrap().map(|entry| entry.unwrap().path()).collect();
    files.retain(|path| path.extension().is_some_and(|extension| extension == "toml"));
    files.sort();
    files
}

/// True for a scene of several bodies, which `several.rs` runs.
pub fn is_of_several(path: &Path) -> bool {
    fs::read_to_string(path).unwrap().contains("[[bodies]]")
}

fn text(path: &Path) -> &str {
    path.to_str().unwrap()
}

/// Writes `scenario` to a temporary directory and runs it there with `flags`.
pub fn run_scenario(scenario: &str, flags: &[&str]) -> (End, tempfile::TempDir) {
    let directory = tempfile::tempdir().unwrap();
    fs::write(directory.path().join("test.toml"), scenario).unwrap();
    let output = tumble()
        .args(["test.toml", "--out", "out"])
        .args(flags)
        .current_dir(directory.path())
        .output()
        .unwrap();
    (output.into(), directory)
}

#[test]
fn every_shipped_scenario_runs_and_verifies() {
    let of_one = || shipped().into_iter().filter(|path| !is_of_several(path));
    assert!(of_one().count() >= 7);
    for path in of_one() {
        let done = simulate(&[text(&path)]);
        assert_eq!(done.end.code, Some(0), "{path:?}: {:?}", done.end);
        let verified = run(&["verify", text(&done.path("states.csv"))]);
        assert_eq!(verified.code, Some(0), "{path:?}: {verified:?}");
        assert!(verified.stdout.contains("steps that differ from their rows: 0"), "{verified:?}");
    }
}

#[test]
fn the_tutorials_scenes_are_the_same_from_a_file() {
    for (scene, flags) in [("drop", &["--solver", "native"][..]), ("floating", &[])] {
        let file = format!("{ROOT}/scenarios/{scene}.toml");
        let flags = &[flags, &["--steps", "400"]].concat();
        let named = simulate(&[&["--scene", scene], &flags[..]].concat());
        let read = simulate(&[&[file.as_str()], &flags[..]].concat());
        for name in ["states.csv", "contacts.csv", "steps.csv"] {
            let [named, read] = [&named, &read].map(|run| fs::read(run.path(name)).unwrap());
            assert!(named == read, "{scene}: {name}");
        }
        for field in ["model", "seed", "drawn", "steps", "solver"] {
            assert_eq!(named.run_json()[field], read.run_json()[field], "{scene}");
        }
    }
}

fn table(path: &Path) -> Table {
    Table::parse(&fs::read_to_string(path).unwrap())
}

const BLOCK: &str = r#"
[body]
box = [1.0, 0.3, 0.1]
mass = 3.0
[ground]
normal = [0.2, -0.1, 2.0]
offset = -0.7
friction = 0.5
[start]
frame = "ground"
position = [0.3, 0.1, 0.05]
"#;

/// Friction holds a box with sides 10:1 on a tilted plane with a slope of 6.4°. The box does not
/// move. Its contact forces in the world frame add up to its weight.
#[test]
fn block_on_an_inclined_plane_stays_and_its_weight_is_carried() {
    for solver in ["native", "ipopt"] {
        let (end, directory) = run_scenario(BLOCK, &["--solver", solver, "--steps", "200"]);
        assert_eq!(end.code, Some(0), "{end:?}");
        let states = table(&directory.path().join("out/states.csv"));
        let contacts = table(&directory.path().join("out/contacts.csv")).of_each_step();
        // Ipopt's steps are exact to about 1e-4 m/s over 0.4 s.
        let allowed = if solver == "native" { 1e-12 } else { 1e-4 };
        for column in ["x_m", "y_m", "z_m", "qw", "qx", "qy"] {
            let values = states.numbers(column);
            let moved = values.iter().map(|x| (x - values[0]).abs()).fold(0.0, f64::max);
            assert!(moved < allowed, "{solver} {column}: {moved}");
        }
        let force = |axis: &str, k: f64| -> f64 {
            let forces = contacts.numbers(&format!("force_{axis}_N"));
            let of_step = contacts.numbers("k").into_iter().zip(forces);
            of_step.filter(|(of, _)| *of == k).map(|(_, force)| force).sum()
        };
        let allowed = if solver == "native" { 1e-9 } else { 1.0 };
        for (axis, expected) in [("x", 0.0), ("y", 0.0), ("z", 3.0 * 9.81)] {
            let found = force(axis, 150.0);
            assert!((found - expected).abs() < allowed, "{solver} {axis}: {found}");
        }
        let verified = run(&["verify", text(&directory.path().join("out/states.csv"))]);
        assert_eq!(verified.code, Some(0), "{verified:?}");
    }
}

/// The change of frame loses digits far from the plane's origin, and 1/h magnifies the loss. The
/// file still verifies, and a changed file does not.
#[test]
fn a_slope_far_from_the_origin_verifies() {
    for place in ["5000.0, 0.0, 0.05", "0.0, 3e5, 0.05"] {
        let block = BLOCK.replacen("0.3, 0.1, 0.05", place, 1);
        let (end, directory) = run_scenario(&block, &["--steps", "200", "--mu", "0.05"]);
        assert_eq!(end.code, Some(0), "{end:?}");
        let path = directory.path().join("out/states.csv");
        assert_eq!(run(&["verify", text(&path)]).code, Some(0), "{place:?}");
        // The checksums would detect the change too.
        let run_file = directory.path().join("out/run.json");
        unseal(&run_file);
        let run_json = fs::read_to_string(&run_file).unwrap();
        assert_eq!(run_json.matches("\"friction\": 0.05").count(), 1);
        fs::write(&run_file, run_json.replace("\"friction\": 0.05", "\"friction\": 0.06")).unwrap();
        let other = run(&["verify", text(&path)]);
        assert_eq!(other.code, Some(1), "{other:?}");
        assert!(other.stdout.contains("steps that differ from their rows: 199\n"), "{other:?}");
        assert!(other.stdout.contains("has another coefficient of friction"), "{other:?}");
        assert!(!other.stdout.contains("files changed after the run"), "{other:?}");
    }
}

/// Rounding of the change of frame does not excuse unphysical positions.
#[test]
fn position_out_of_range_fails_verify_on_a_slope() {
    let (end, directory) = run_scenario(BLOCK, &["--exact", "--solver", "native", "--steps", "20"]);
    assert_eq!(end.code, Some(0), "{end:?}");
    unseal(&directory.path().join("out/run.json"));
    let path = directory.path().join("out/states.csv");
    let mut table = table(&path);
    let x = table.column("x_m");
    for far in ["1e12", "1e100", "1e308"] {
        table.rows[10][x] = far.to_owned();
        fs::write(&path, table.text()).unwrap();
        let end = run(&["verify", text(&path)]);
        assert_eq!(end.code, Some(1), "{far}: {end:?}");
        // The steps to the row and from it.
        assert!(end.stdout.contains("steps that differ from their rows: 2\n"), "{end:?}");
        for (k, fault) in [(9, ": its residual in the table"), (10, ": its contact 0 has a point")]
        {
            let line = format!("    k = {k:<7} converged  residual ");
            let line = end.stdout.lines().find(|other| other.starts_with(&line));
            assert!(line.is_some_and(|line| line.contains(fault)), "{end:?}");
        }
        assert!(!end.stdout.contains("files changed after the run"), "{end:?}");
    }
}

/// A load that adds more speed in a step than any state may have is refused.
#[test]
fn load_that_throws_the_body_out_of_range_is_rejected() {
    for flags in [["--set", "load.force=1e9,0,0"], ["--set", "load.torque=1e7,0,0"]] {
        let end: End = tumble().args(flags).output().unwrap().into();
        end.assert_refused(2, &["--set load.", "allowed: up to 1e4"]);
    }
}

/// Planes and loads from flags equal those from a file.
#[test]
fn flags_make_the_same_planes_and_loads_as_files() {
    let flags = [
        "--set",
        "ground.slope=25",
        "--set",
        "start.frame=ground",
        "--set",
        "start.position=0,0,1",
        "--set",
        "start.attitude=1,0,0,0",
        "--set",
        "start.velocity=0,0,0",
        "--set",
        "start.spin=0,0,0",
        "--set",
        "body.inertia=solid",
        "--solver",
        "native",
        "--steps",
        "300",
        "--mu",
        "0.4",
        "--set",
        "load.force=[[0, 0, 0, 0], [0.3, 9, 5, 0]]",
        "--set",
        "load.torque=0.1,0,0",
        "--set",
        "load.at=0,0,0.5",
    ];
    let scenario = r#"
        steps = 300
        integrator = "euler"
        [body]
        box = 2.0
        mass = 10.0
        [ground]
        normal = [0.42261826174069944, 0.0, 0.9063077870366499]
        friction = 0.4
        [start]
        frame = "ground"
        position = [0.0, 0.0, 1.0]
        [load]
        force = [[0.0, 0.0, 0.0, 0.0], [0.3, 9.0, 5.0, 0.0]]
        torque = [0.1, 0.0, 0.0]
        at = [0.0, 0.0, 0.5]
    "#;
    let by_flags = simulate(&flags);
    assert_eq!(by_flags.end.code, Some(0), "{:?}", by_flags.end);
    let (end, directory) = run_scenario(scenario, &["--solver", "native"]);
    assert_eq!(end.code, Some(0), "{end:?}");
    let (one, other) = (by_flags.table(), table(&directory.path().join("out/states.csv")));
    for column in ["x_m", "y_m", "z_m", "vx_m_s", "wy_rad_s"] {
        // The normals differ in their last digit.
        for (a, b) in one.numbers(column).iter().zip(other.numbers(column)) {
            assert!((a - b).abs() < 1e-12, "{column}: {a} {b}");
        }
    }
}

/// Flags override the values of a scenario file.
#[test]
fn flags_go_before_the_file() {
    let flags = ["--steps", "7", "--dt", "0.001", "--mu", "0.4"];
    let (end, directory) = run_scenario(BLOCK, &flags);
    assert_eq!(end.code, Some(0), "{end:?}");
    let json = fs::read_to_string(directory.path().join("out/run.json")).unwrap();
    let json: serde_json::Value = serde_json::from_str(&json).unwrap();
    assert_eq!(json["steps"], 7);
    assert_eq!(json["model"]["time_step"], 0.001);
    assert_eq!(json["model"]["bodies"][0]["mass"], 3.0);
    assert_eq!(json["model"]["ground"]["friction"], 0.4);
    assert_eq!(json["scene"], "test");
    // Solid box of 3 kg with I = m (b² + c²)/12.
    let inertia = json["model"]["bodies"][0]["inertia"][0][0].as_f64().unwrap();
    assert!((inertia - 3.0 * (0.09 + 0.01) / 12.0).abs() < 1e-15);
}

#[test]
fn pictures_show_slopes() {
    let flags = ["--solver", "native", "--steps", "60", "--plot", "--gif", "--gif-size", "200"];
    let (end, directory) = run_scenario(BLOCK, &flags);
    assert_eq!(end.code, Some(0), "{end:?}");
    let svg = fs::read_to_string(directory.path().join("out/plot.svg")).unwrap();
    assert!(svg.contains("test, native"), "the heading has the scenario's name");
    assert!(directory.path().join("out/animation.gif").exists());
}

/// Replaced text of `BLOCK`, new text and words of the refusal.
const BROKEN: [(&str, &str, &[&str]); 52] = [
    ("[body]", "[load]\nforce = []\n[body]", &["load.force", "no knots"]),
    ("[body]", "[[body]]", &["body: ", "list", "expected a single table", "[[bodies]]"]),
    ("mass = 3.0", "mass = -3.0", &["body.mass", "-3", "1e-9 to 1e9"]),
    ("mass = 3.0", "mass = nan", &["mass", "NaN"]),
    ("mass = 3.0", "mass = \"heavy\"", &["line 4", "mass", "heavy"]),
    ("mass = 3.0", "", &["line 2", "mass"]),
    ("mass = 3.0", "mass = 3.0\nmass = 4.0", &["line 5", "mass", "duplicate"]),
    ("mass = 3.0", "mass = 3.0\ncolour = \"red\"", &["line 5", "colour", "unknown"]),
    ("mass = 3.0", "mass = 3.0\npoints = [[0, 0, 1]]", &["box", "points"]),
    ("box = [1.0, 0.3, 0.1]", "", &["box", "points"]),
    ("box = [1.0, 0.3, 0.1]", "box = [1.0, 0.3]", &["line 3", "one number", "three"]),
    ("box = [1.0, 0.3, 0.1]", "box = [1.0, 0.3, 0.0]", &["box: side of the box (m) is 0.0"]),
    ("box = [1.0, 0.3, 0.1]", "points = [[0.0, 0.0, -0.05]]", &["inertia", "points"]),
    ("mass = 3.0", "mass = 3.0\ninertia = \"hollow\"", &["line 5", "solid"]),
    ("mass = 3.0", "mass = 3.0\ninertia = [1.0, 1.0, -1.0]", &["inertia", "positive definite"]),
    ("friction = 0.5", "", &["line 5", "friction"]),
    ("friction = 0.5", "friction = 11.0", &["ground.friction", "11", "0 to 10"]),
    ("friction = 0.5", "friction = 0.5\nslope = 10.0", &["slope", "normal"]),
    ("normal = [0.2, -0.1, 2.0]", "normal = [0.0, 0.0, 0.0]", &["ground.normal"]),
    ("normal = [0.2, -0.1, 2.0]", "normal = [0.0, nan, 1.0]", &["ground", "normal"]),
    ("normal = [0.2, -0.1, 2.0]", "slope = 270.0", &["ground.slope", "270"]),
    ("offset = -0.7", "offset = inf", &["ground.offset"]),
    ("frame = \"ground\"", "frame = \"moon\"", &["line 10", "world", "ground"]),
    ("position = [0.3, 0.1, 0.05]", "", &["line 9", "position"]),
    (
        "position = [0.3, 0.1, 0.05]",
        "position = [0.3, 0.1, 0.04]",
        &["position", "below the ground", "raise it"],
    ),
    (
        "position = [0.3, 0.1, 0.05]",
        "position = [0.3, 0.1, 0.05]\nattitude = [0, 0, 0, 0]",
        &["body.attitude", "w, x, y, z"],
    ),
    (
        "position = [0.3, 0.1, 0.05]",
        "position = [0.3, 0.1, 0.05]\nattitude = \"upright\"",
        &["line 12", "random", "four numbers"],
    ),
    ("position = [0.3, 0.1, 0.05]", "position = [0.3, 0.1, 0.05]\nspin = [1e9, 0, 0]", &["spin"]),
    ("[body]", "steps = 0\n[body]", &["steps", "1 to 10000000"]),
    ("[body]", "time_step = 1.0\n[body]", &["time_step", "1e-6 to 0.1"]),
    ("[body]", "name = \"\"\n[body]", &["name"]),
    ("[body]", "[load]\nforce = [[1.0, 0, 0, 0], [0.5, 0, 0, 0]]\n[body]", &["load.force", "time"]),
    (
        "[body]",
        "[load]\ntorque = [[1, 0, 0, 0], [1, 2, 0, 0], [1, 0, 0, 0]]\n[body]",
        &["load.torque: the load has more than two knots at 1.0 s", "two for a jump"],
    ),
    ("[body]", "[load]\nforce = [1.0, 0.0]\n[body]", &["line 3", "three numbers"]),
    (
        "position = [0.3, 0.1, 0.05]",
        "position = [0.3, 0.1, 0.05, 77]",
        &["start.position", "length 4"],
    ),
    ("position = [0.3, 0.1, 0.05]", "position = [0.3, 0.1]", &["start.position", "length 2"]),
    (
        "position = [0.3, 0.1, 0.05]",
        "position = [0.3, 0.1, 0.05]\nvelocity = [1, 2, 3, 4, 5]",
        &["start.velocity", "length 5"],
    ),
    (
        "position = [0.3, 0.1, 0.05]",
        "position = [0.3, 0.1, 0.05]\nspin = [1, 2, 3, 4]",
        &["start.spin", "length 4"],
    ),
    (
        "position = [0.3, 0.1, 0.05]",
        "position = [0.3, 0.1, 0.05]\nattitude = [1, 0, 0, 0, 0]",
        &["start.attitude", "four numbers"],
    ),
    ("[0.2, -0.1, 2.0]", "[0.2, -0.1, 2.0, 0.0]", &["ground.normal", "length 4"]),
    (
        "box = [1.0, 0.3, 0.1]",
        "inertia = 1.0\npoints = [[0, 0, -1], [0, 0, 1, 2]]",
        &["body.points[1]", "length 4"],
    ),
    ("box = [1.0, 0.3, 0.1]", "box = [1.0, 0.3, 0.1, 0.1]", &["body.box", "three"]),
    ("mass = 3.0", "mass = 3.0\ninertia = [1, 1, 1, 1]", &["body.inertia", "three"]),
    (
        "mass = 3.0",
        "mass = 3.0\ninertia = [[1, 0, 0], [0, 1, 0], [0, 0, 1, 0]]",
        &["body.inertia", "matrix"],
    ),
    ("mass = 3.0", "mass = 3.0\ninertia = 1e-12", &["body.inertia", "1e-12", "allowed"]),
    ("[body]", "gravity = [0, 0, -9.81, 0]\n[body]", &["gravity", "three"]),
    ("[body]", "[load]\nforce = [[0, 1, 2, 3, 4]]\n[body]", &["load.force", "knots [t, x, y, z]"]),
    ("[body]", "[load]\nforce = [1, 0, 0]\nat = [0, 0, 0, 1]\n[body]", &["load.at", "length 4"]),
    ("[body]", "[load]\nforce = [1e9, 0, 0]\n[body]", &["load.", "body", "allowed: up to 1e4"]),
    (
        "[body]",
        "[solver]\nname = \"ipopt\"\ntolerance = 1e-16\n[body]",
        &["solver.tolerance", "rounding"],
    ),
    ("[body]", "[load]\nat = [0, 0, 1.0]\n[body]", &["load.at", "load.force"]),
    (
        "[body]",
        "[solver]\nname = \"native\"\ntolerance = 1e-8\n[body]",
        &["solver.tolerance", "native"],
    ),
];

#[test]
fn broken_scenarios_are_refused_in_one_line_with_the_file_and_the_fault() {
    for (old, new, words) in BROKEN {
        assert!(BLOCK.contains(old), "{old}");
        let (end, directory) = run_scenario(&BLOCK.replacen(old, new, 1), &[]);
        end.assert_refused(2, &[&["test.toml"], words].concat());
        assert!(!end.stderr.contains("--"), "{end:?}");
        assert!(!end.stderr.contains("struct "), "{end:?}");
        assert_eq!(everything_in(directory.path()).len(), 1, "{new}: something was written");
    }
    for (name, contents) in [("empty", ""), ("no TOML", "{\"body\": 1}"), ("cut off", "[body")] {
        let (end, _directory) = run_scenario(contents, &[]);
        end.assert_refused(2, &["test.toml"]);
        assert!(!end.stderr.contains('|'), "{name}: {}", end.stderr);
    }
    run(&["/nowhere.toml"]).assert_refused(2, &["/nowhere.toml", "cannot be read"]);
    run(&["a.toml", "--scene", "drop"]).assert_refused(2, &["--scene", "SCENE"]);
}

/// The computed inertia of a solid box of any size is in the allowed range, even for 1 mm of water.
#[test]
fn a_body_of_any_size_has_the_range_of_its_own_inertia() {
    for (side, mass) in [(1e-3, 1e-6), (1e-2, 1e-3), (1.0, 1e3), (100.0, 1e9)] {
        let sides = format!("[body]\nbox = {side:?}\nmass = {mass:?}\n[ground]\nfriction = 0.3\n");
        let start = format!("[start]\nposition = [0.0, 0.0, {:?}]\n", 0.6 * side);
        let (end, _directory) =
            run_scenario(&(sides + &start), &["--solver", "native", "--steps", "50"]);
        assert_eq!(end.code, Some(0), "{side} m: {end:?}");
    }
}

/// A bad flag is reported without the scenario file's name.
#[test]
fn a_flag_beside_a_scenario_is_named_as_a_flag() {
    for (flags, word) in
        [(["--dt", "7"], "--dt"), (["--mu", "-1"], "--mu"), (["--residual", "1.0"], "--residual")]
    {
        let (end, _directory) = run_scenario(BLOCK, &flags);
        end.assert_refused(2, &[word]);
        assert!(!end.stderr.contains("test.toml"), "{end:?}");
    }
}

#[test]
fn flags_without_effect_on_a_scenario_are_rejected() {
    let seed = run_scenario(BLOCK, &["--seed", "3"]).0;
    seed.assert_refused(2, &["--seed", "random"]);
    let floating = BLOCK
        .replacen("[ground]\nnormal = [0.2, -0.1, 2.0]\noffset = -0.7\nfriction = 0.5\n", "", 1)
        .replacen("frame = \"ground\"", "", 1);
    let mu = run_scenario(&floating, &["--mu", "0.3"]).0;
    mu.assert_refused(2, &["--mu", "floating"]);
    let (end, _directory) = run_scenario(&floating, &["--steps", "50"]);
    assert_eq!(end.code, Some(0), "{end:?}");
}

/// scenarios/README.md lists every shipped file. Its fields are compared with the schema.
#[test]
fn the_description_names_every_file() {
    let page = fs::read_to_string(Path::new(ROOT).join("scenarios/README.md")).unwrap();
    for path in shipped() {
        let name = path.file_name().unwrap().to_str().unwrap();
        assert!(page.contains(&format!("`{name}`")), "{name}");
    }
}

/// A field set by a flag has the bits of the same field in the file, and its path is in run.json.
#[test]
fn a_field_can_be_set_by_a_flag() {
    let scenario = |friction: f64, mass: f64| {
        format!(
            "steps = 60\n[ground]\nfriction = {friction}\n[[bodies]]\nname = \"brick\"\nbox = 0.2\n\
             mass = {mass}\nposition = [0, 0, 0.1]\nvelocity = [1, 0, 0]\n"
        )
    };
    let (end, written) = run_scenario(&scenario(0.4, 2.0), &[]);
    assert_eq!(end.code, Some(0), "{end:?}");
    let flags = ["--set", "ground.friction=0.4", "--set", "bodies.brick.mass=2"];
    let (end, flagged) = run_scenario(&scenario(0.3, 1.0), &flags);
    assert_eq!(end.code, Some(0), "{end:?}");
    let read = |directory: &tempfile::TempDir, name: &str| {
        fs::read_to_string(directory.path().join("out").join(name)).unwrap()
    };
    for name in ["states.csv", "contacts.csv"] {
        assert_eq!(read(&written, name), read(&flagged, name), "{name}");
    }
    let json: serde_json::Value = serde_json::from_str(&read(&flagged, "run.json")).unwrap();
    assert_eq!(json["changed"], serde_json::json!(["ground.friction", "bodies.brick.mass"]));
    for (field, words) in [
        ("bodies.ball.mass=2", "there are: brick"),
        ("ground.grip=2", "unknown field `grip`"),
        ("ground.friction", "for example ground.friction=0.4"),
        ("ground.friction=rough", "friction"),
    ] {
        let (end, _) = run_scenario(&scenario(0.3, 1.0), &["--set", field]);
        end.assert_refused(2, &[words]);
    }
}
