//! Robots from the command line: alone, in a scenario, and written down.

use super::scenario::run_scenario;
use super::support::{run, simulate, tumble};
use std::fs;
use std::path::{Path, PathBuf};

fn model(name: &str) -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("data/robots").join(name)
}

fn text(path: &Path) -> &str {
    path.to_str().unwrap()
}

#[test]
fn a_file_is_simulated_and_verifies() {
    for name in ["quadruped.urdf", "arm.urdf", "hopper.xml", "classes.xml"] {
        let path = model(name);
        let done = simulate(&["--scenario", text(&path), "--steps", "60"]);
        assert_eq!(done.end.code, Some(0), "{name}: {:?}", done.end);
        assert!(done.end.stdout.contains("wrote"), "{:?}", done.end);
        let verified = run(&["verify", text(&done.path("states.csv"))]);
        assert_eq!(verified.code, Some(0), "{name}: {verified:?}");
        // It goes on from where it ended, as any other run.
        let out = done.path("");
        let on = run(&["--continue", text(&out), "--steps", "80", "--quiet"]);
        assert_eq!(on.code, Some(0), "{name}: {on:?}");
    }
    let noted = simulate(&["--scenario", text(&model("hopper.xml")), "--steps", "3"]);
    assert!(noted.end.stdout.contains("without a part in the motion: 1 <camera>, 1 <light>"));
    let quiet = simulate(&["--scenario", text(&model("hopper.xml")), "--steps", "3", "--quiet"]);
    assert_eq!(quiet.end.stdout, "");
}

#[test]
fn a_converted_file_leaves_the_same_tables() {
    let directory = tempfile::tempdir().unwrap();
    let written = directory.path().join("hopper.toml");
    let end = run(&["convert", text(&model("hopper.xml")), text(&written)]);
    assert_eq!(end.code, Some(0), "{end:?}");
    assert!(end.stdout.contains("hopper.toml"), "{end:?}");
    let again = simulate(&["--scenario", text(&written), "--steps", "40"]);
    assert_eq!(again.end.code, Some(0), "{:?}", again.end);
    let first = simulate(&["--scenario", text(&model("hopper.xml")), "--steps", "40"]);
    let rows =
        |run: &super::support::Simulated| fs::read_to_string(run.path("states.csv")).unwrap();
    assert_eq!(rows(&first).lines().count(), rows(&again).lines().count());
    // Written down once more it has the same lines, with numbers that are as much alike as sums are.
    let twice = directory.path().join("twice.toml");
    run(&["convert", text(&written), text(&twice)]);
    let fields = |path: &Path| {
        let text = fs::read_to_string(path).unwrap();
        text.lines().map(|line| line.split(" = ").next().unwrap().to_owned()).collect::<Vec<_>>()
    };
    assert_eq!(fields(&written), fields(&twice));
}

#[test]
fn what_cannot_be_is_said_in_one_sentence() {
    let directory = tempfile::tempdir().unwrap();
    let broken = directory.path().join("broken.urdf");
    fs::write(&broken, "<robot name='a'>\n<link name='b'/>\n<joint name='c' type='bent'><parent link='b'/><child link='d'/></joint></robot>").unwrap();
    run(&["--scenario", text(&broken)])
        .assert_refused(2, &["broken.urdf", "line 3", "<joint>", "\"d\""]);
    let xacro = directory.path().join("a.urdf");
    fs::write(&xacro, "<robot xmlns:xacro='http://www.ros.org/wiki/xacro' name='a'>\n<xacro:include filename='b'/></robot>").unwrap();
    run(&["--scenario", text(&xacro)]).assert_refused(2, &["a.urdf", "Xacro"]);
    run(&["--scenario", text(&model("hopper.xml")), "--mu", "0.5"]).assert_refused(2, &["--mu"]);
    run(&["--scenario", text(&model("hopper.xml")), "--position", "0,0,1"])
        .assert_refused(2, &["--position"]);
    run(&["convert", text(&model("hopper.xml")), "out.txt"])
        .assert_refused(2, &["out.txt", ".toml"]);
    run(&["convert", "missing.urdf", "out.toml"]).assert_refused(2, &["missing.urdf"]);
    let (end, _) = run_scenario("[ground]\nfriction = 0.5\n[[robots]]\nfile = \"no.urdf\"\n", &[]);
    end.assert_refused(2, &["robots[0]", "no.urdf"]);
    let (end, _) = run_scenario("[ground]\nfriction = 0.5\n", &[]);
    end.assert_refused(2, &["body"]);
    let end: super::support::End = tumble().args(["convert"]).output().unwrap().into();
    assert_eq!(end.code, Some(2));
}
