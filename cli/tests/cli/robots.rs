//! Robot files: simulation, use in a scenario and conversion.

use super::scenario::run_scenario;
use super::support::{run, simulate, tumble};
use crate::ROOT;
use std::fs;
use std::path::{Path, PathBuf};

fn model(name: &str) -> PathBuf {
    Path::new(ROOT).join("data/robots").join(name)
}

fn text(path: &Path) -> &str {
    path.to_str().unwrap()
}

#[test]
fn a_file_is_simulated_and_verifies() {
    for name in ["quadruped.urdf", "arm.urdf", "hopper.xml", "classes.xml"] {
        let path = model(name);
        let done = simulate(&[text(&path), "--steps", "60"]);
        assert_eq!(done.end.code, Some(0), "{name}: {:?}", done.end);
        assert!(done.end.stdout.contains("wrote"), "{:?}", done.end);
        let verified = run(&["verify", text(&done.path("states.csv"))]);
        assert_eq!(verified.code, Some(0), "{name}: {verified:?}");
        // The run can be continued.
        let out = done.path("");
        let on = run(&["--continue", text(&out), "--steps", "80", "--quiet"]);
        assert_eq!(on.code, Some(0), "{name}: {on:?}");
    }
    let noted = simulate(&[text(&model("hopper.xml")), "--steps", "3"]);
    assert!(noted.end.stdout.contains("without effect on the motion: 1 <camera>, 1 <light>"));
    let quiet = simulate(&[text(&model("hopper.xml")), "--steps", "3", "--quiet"]);
    assert_eq!(quiet.end.stdout, "");
}

#[test]
fn a_converted_file_leaves_the_same_tables() {
    let directory = tempfile::tempdir().unwrap();
    let written = directory.path().join("hopper.toml");
    let end = run(&["convert", text(&model("hopper.xml")), text(&written)]);
    assert_eq!(end.code, Some(0), "{end:?}");
    assert!(end.stdout.contains("hopper.toml"), "{end:?}");
    let again = simulate(&[text(&written), "--steps", "40"]);
    assert_eq!(again.end.code, Some(0), "{:?}", again.end);
    let first = simulate(&[text(&model("hopper.xml")), "--steps", "40"]);
    let rows =
        |run: &super::support::Simulated| fs::read_to_string(run.path("states.csv")).unwrap();
    assert_eq!(rows(&first).lines().count(), rows(&again).lines().count());
    // A second conversion has the same lines. Its numbers may differ by rounding.
    let twice = directory.path().join("twice.toml");
    run(&["convert", text(&written), text(&twice)]);
    let fields = |path: &Path| {
        let text = fs::read_to_string(path).unwrap();
        text.lines().map(|line| line.split(" = ").next().unwrap().to_owned()).collect::<Vec<_>>()
    };
    assert_eq!(fields(&written), fields(&twice));
}

/// Scene with two geared wheels on axles in the world and a parcel on a belt.
const WHEELS: &str = r#"
start_index = 7
[ground]
friction = 0.5

[[bodies]]
name = "first"
box = [0.2, 0.2, 0.1]
mass = 1.0
position = [0, 0, 1]
spin = [0, 0, 1.5]

[[bodies]]
name = "second"
box = [0.2, 0.2, 0.1]
mass = 2.0
position = [1, 0, 1]
spin = [0, 0, 0.75]

[[bodies]]
name = "parcel"
box = 0.2
mass = 1.0
position = [0, 3, 0.1]

[[surfaces]]
of = "ground"
velocity = [0.5, 0.25, 0]

[[joints]]
type = "revolute"
bodies = ["first"]
anchor = [0, 0, 1]
axis = [0, 0, 1]
name = "a"

[[joints]]
type = "revolute"
bodies = ["second"]
anchor = [1, 0, 1]
axis = [0, 0, 1]
name = "b"

[[gears]]
joints = ["a", "b"]
axes = ["turn", "turn"]
ratio = 2.0
"#;

#[test]
fn converted_scene_has_gears_surfaces_and_start_index() {
    let directory = tempfile::tempdir().unwrap();
    let [first, written, twice] =
        ["first.toml", "written.toml", "twice.toml"].map(|name| directory.path().join(name));
    fs::write(&first, WHEELS).unwrap();
    for (from, to) in [(&first, &written), (&written, &twice)] {
        let end = run(&["convert", text(from), text(to), "--quiet"]);
        assert_eq!(end.code, Some(0), "{end:?}");
    }
    let ends = [&first, &written].map(|path| {
        let done = simulate(&[text(path), "--steps", "40"]);
        assert_eq!(done.end.code, Some(0), "{:?}", done.end);
        let verified = run(&["verify", text(&done.path("states.csv"))]);
        assert_eq!(verified.code, Some(0), "{verified:?}");
        ["states.csv", "gears.csv"].map(|name| {
            let rows = fs::read_to_string(done.path(name)).unwrap();
            let cells = rows.lines().skip(1).flat_map(|line| line.split(','));
            cells.map(|cell| cell.parse::<f64>().unwrap()).collect::<Vec<_>>()
        })
    });
    assert_eq!(ends[0][0][0], 7.0);
    for (a, b) in ends[0].iter().zip(&ends[1]) {
        assert_eq!(a.len(), b.len());
        assert!(a.iter().zip(b).all(|(a, b)| (a - b).abs() < 1e-9), "{a:?}\n{b:?}");
    }
    let driven = format!("{WHEELS}\n[[driven]]\nbody = \"parcel\"\nvelocity = [1, 0, 0]\n");
    fs::write(&first, driven).unwrap();
    let end = run(&["convert", text(&first), text(&twice)]);
    assert_eq!(end.code, Some(0), "{end:?}");
    let written = fs::read_to_string(&twice).unwrap();
    assert!(written.contains("[[driven]]\nname = \"parcel-drive\""), "{written}");
}

/// Packages are searched from the file's directory upwards or in the directory of `--packages`.
/// `convert` has the same flag.
#[test]
fn packages_have_a_flag() {
    let directory = tempfile::tempdir().unwrap();
    let at = |name: &str| directory.path().join(name);
    fs::create_dir_all(at("arm/urdf")).unwrap();
    fs::create_dir_all(at("arm/parts")).unwrap();
    fs::copy(model("parts/wedge.obj"), at("arm/parts/wedge.obj")).unwrap();
    let robot = "<robot name='m'><link name='a'><inertial><mass value='1'/><inertia ixx='0.4' iyy='0.4' izz='0.4' ixy='0' ixz='0' iyz='0'/>\
        </inertial><collision><geometry><mesh filename='package://arm/parts/wedge.obj'/></geometry></collision></link></robot>";
    fs::write(at("arm/urdf/arm.urdf"), robot).unwrap();
    fs::write(at("alone.urdf"), robot.replace("package://arm", "package://leg")).unwrap();
    let out = at("out");
    let simulate = |file: &str, flags: &[&str]| {
        let file = at(file);
        let base = [text(&file), "--steps", "3", "--quiet", "--out", text(&out)];
        run(&[&base[..], flags].concat())
    };
    assert_eq!(simulate("arm/urdf/arm.urdf", &[]).code, Some(0));
    simulate("alone.urdf", &[]).assert_refused(2, &["leg/parts/wedge.obj", "--packages"]);
    fs::create_dir_all(at("there")).unwrap();
    fs::rename(at("arm"), at("there/leg")).unwrap();
    let there = at("there");
    assert_eq!(simulate("alone.urdf", &["--packages", text(&there)]).code, Some(0));
    let toml = at("alone.toml");
    let robot = at("alone.urdf");
    let end = run(&["convert", text(&robot), text(&toml), "--packages", text(&there)]);
    assert_eq!(end.code, Some(0), "{end:?}");
    run(&[text(&toml), "--packages", text(&there)])
        .assert_refused(2, &["--packages", "[[robots]]"]);
    run(&["--leave-out", "link"]).assert_refused(2, &["--leave-out"]);
}

/// Broken robot files and unsuitable flags are refused in one sentence.
#[test]
fn invalid_robot_options_are_rejected_in_one_sentence() {
    let directory = tempfile::tempdir().unwrap();
    let broken = directory.path().join("broken.urdf");
    fs::write(&broken, "<robot name='a'>\n<link name='b'/>\n<joint name='c' type='bent'><parent link='b'/><child link='d'/></joint></robot>").unwrap();
    run(&[text(&broken)]).assert_refused(2, &["broken.urdf", "line 3", "<joint>", "\"d\""]);
    let xacro = directory.path().join("a.urdf");
    fs::write(&xacro, "<robot xmlns:xacro='http://www.ros.org/wiki/xacro' name='a'>\n<xacro:include filename='b'/></robot>").unwrap();
    run(&[text(&xacro)]).assert_refused(2, &["a.urdf", "Xacro"]);
    run(&[text(&model("hopper.xml")), "--mu", "0.5"]).assert_refused(2, &["--mu"]);
    run(&[text(&model("hopper.xml")), "--set", "start.position=0,0,1"])
        .assert_refused(2, &["--set", "start.position", "[[robots]]"]);
    run(&["convert", text(&model("hopper.xml")), "out.txt"])
        .assert_refused(2, &["out.txt", ".toml"]);
    let own = directory.path().join("own.toml");
    run(&["convert", text(&model("hopper.xml")), text(&own)]);
    let before = fs::read(&own).unwrap();
    run(&["convert", text(&own), text(&own)]).assert_refused(2, &["own.toml", "another"]);
    assert_eq!(fs::read(&own).unwrap(), before);
    run(&["convert", "missing.urdf", "out.toml"]).assert_refused(2, &["missing.urdf"]);
    let (end, _) = run_scenario("[ground]\nfriction = 0.5\n[[robots]]\nfile = \"no.urdf\"\n", &[]);
    end.assert_refused(2, &["robots[0]", "no.urdf"]);
    let (end, _) = run_scenario("[ground]\nfriction = 0.5\n", &[]);
    end.assert_refused(2, &["[[bodies]]"]);
    let end: super::support::End = tumble().args(["convert"]).output().unwrap().into();
    assert_eq!(end.code, Some(2));
}
