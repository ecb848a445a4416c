//! Files in the output directory that no run.json lists stay, unless `--overwrite` is given.

use super::support::{WRITTEN, everything_in, run};
use std::fs;
use std::path::Path;

const SIMULATE: [&str; 5] = ["--steps", "20", "--solver", "native", "--quiet"];

/// Names of files that a run, a plan, a picture or a killed run may write.
const NAMES: [&str; 20] = [
    "run.json",
    "state.bin",
    "trajectory.csv",
    "trajectory.csv.gz",
    "states.csv",
    "states.csv.gz",
    "contacts.csv",
    "steps.csv",
    "joints.csv",
    "gears.csv",
    "ends.csv",
    "plot.png",
    "plot.svg",
    "plot-energy.png",
    "animation.gif",
    "view.html",
    "controls.csv",
    "plan.json",
    "scene.toml",
    "checkpoint.bin",
];

fn simulate_in(directory: &Path, flags: &[&str]) -> super::support::End {
    run(&[&SIMULATE[..], &["--out", directory.to_str().unwrap()], flags].concat())
}

#[test]
fn unlisted_files_are_not_overwritten() {
    for name in NAMES {
        let directory = tempfile::tempdir().unwrap();
        let file = directory.path().join(name);
        fs::write(&file, "mine").unwrap();
        let end = simulate_in(directory.path(), &[]);
        assert_eq!(fs::read_to_string(&file).unwrap(), "mine", "{name}");
        let is_in_the_way =
            ["run.json", "state.bin", "checkpoint.bin"].contains(&name) || name.contains(".csv");
        if is_in_the_way && name != "controls.csv" {
            let remedy = if name == "checkpoint.bin" { "--continue" } else { name };
            end.assert_refused(2, &[remedy, "--overwrite"]);
            assert_eq!(everything_in(directory.path()).len(), 1, "{name}: nothing is added");
        } else {
            assert_eq!(end.code, Some(0), "{name}: {end:?}");
        }
    }
}

/// A requested picture replaces an existing file only with `--overwrite`.
#[test]
fn pictures_do_not_replace_what_is_there() {
    for (name, flag) in
        [("plot.svg", "--plot"), ("view.html", "--html"), ("animation.gif", "--gif")]
    {
        let directory = tempfile::tempdir().unwrap();
        fs::write(directory.path().join(name), "mine").unwrap();
        simulate_in(directory.path(), &[flag]).assert_refused(2, &[name, "--overwrite"]);
        let end = simulate_in(directory.path(), &[flag, "--overwrite"]);
        assert_eq!(end.code, Some(0), "{end:?}");
        assert_ne!(fs::read(directory.path().join(name)).unwrap(), b"mine");
    }
}

#[cfg(unix)]
#[test]
fn links_and_directories_stay() {
    let directory = tempfile::tempdir().unwrap();
    let [other, link] = ["other.csv", "trajectory.csv"].map(|name| directory.path().join(name));
    fs::write(&other, "mine").unwrap();
    std::os::unix::fs::symlink(&other, &link).unwrap();
    simulate_in(directory.path(), &[]).assert_refused(2, &["trajectory.csv", "--overwrite"]);
    assert!(link.is_symlink());
    // The target of the link stays unchanged even if `--overwrite` replaces the link.
    assert_eq!(simulate_in(directory.path(), &["--overwrite"]).code, Some(0));
    assert!(!link.is_symlink());
    assert_eq!(fs::read_to_string(&other).unwrap(), "mine");

    let directory = tempfile::tempdir().unwrap();
    fs::create_dir(directory.path().join("state.bin")).unwrap();
    for flags in [&[][..], &["--overwrite"]] {
        simulate_in(directory.path(), flags).assert_refused(2, &["state.bin is a directory"]);
    }
}

/// A new run removes the listed files of the previous run and keeps all others.
#[test]
fn a_run_replaces_the_run_before() {
    let directory = tempfile::tempdir().unwrap();
    assert_eq!(simulate_in(directory.path(), &["--plot"]).code, Some(0));
    fs::write(directory.path().join("notes.txt"), "mine").unwrap();
    fs::write(directory.path().join("view.html"), "mine").unwrap();
    assert_eq!(simulate_in(directory.path(), &[]).code, Some(0));
    let names = everything_in(directory.path());
    let names: Vec<_> = names.iter().map(|name| name.to_str().unwrap()).collect();
    let mut expected = [&["notes.txt", "view.html"][..], &WRITTEN].concat();
    expected.sort_unstable();
    assert_eq!(names, expected);
}

/// A link with the name of a previous picture stays.
#[cfg(unix)]
#[test]
fn a_link_in_the_place_of_a_picture_stays() {
    let directory = tempfile::tempdir().unwrap();
    assert_eq!(simulate_in(directory.path(), &["--plot"]).code, Some(0));
    let [mine, link] = ["mine.png", "plot.png"].map(|name| directory.path().join(name));
    fs::rename(&link, &mine).unwrap();
    std::os::unix::fs::symlink(&mine, &link).unwrap();
    assert_eq!(simulate_in(directory.path(), &[]).code, Some(0));
    assert!(link.is_symlink() && mine.exists());
    assert!(!directory.path().join("plot.svg").exists());
}

/// A run.json with a wrong checksum lists no files that may be replaced.
#[test]
fn run_json_with_wrong_checksum_does_not_permit_overwriting() {
    let directory = tempfile::tempdir().unwrap();
    assert_eq!(simulate_in(directory.path(), &[]).code, Some(0));
    let path = directory.path().join("run.json");
    let text = fs::read_to_string(&path).unwrap();
    fs::write(directory.path().join("mine.txt"), "mine").unwrap();
    fs::write(&path, text.replace("\"state.bin\"", "\"state.bin\", \"mine.txt\"")).unwrap();
    simulate_in(directory.path(), &[]).assert_refused(2, &["--overwrite"]);
    assert_eq!(simulate_in(directory.path(), &["--overwrite"]).code, Some(0));
    assert_eq!(fs::read_to_string(directory.path().join("mine.txt")).unwrap(), "mine");
}

#[test]
fn exported_problems_do_not_replace_what_is_there() {
    let directory = tempfile::tempdir().unwrap();
    let problems = directory.path().join("problems");
    fs::create_dir(&problems).unwrap();
    let mine = problems.join("step-00000100.dat");
    fs::write(&mine, "mine").unwrap();
    let flags = ["--export-problems", problems.to_str().unwrap()];
    let out = directory.path().join("out");
    simulate_in(&out, &flags).assert_refused(2, &["step-00000100.dat", "--overwrite"]);
    assert_eq!(fs::read_to_string(&mine).unwrap(), "mine");
    let end = simulate_in(&out, &[&flags[..], &["--overwrite"]].concat());
    assert_eq!(end.code, Some(0), "{end:?}");
    assert!(!mine.exists(), "all in the folder is solved as one run's");
}

/// A white pixel, as Pillow writes it.
const PNG: &[u8] = b"\x89PNG\r\n\x1a\n\0\0\0\rIHDR\0\0\0\x01\0\0\0\x01\x08\0\0\0\0:~\x9bU\0\0\0\nIDATx\x9cc\xf8\x0f\
    \0\x01\x01\x01\0\x1b\xb6\xeeV\0\0\0\0IEND\xaeB`\x82";
const GIF: &[u8] =
    b"GIF89a\x01\0\x01\0\x80\0\0\0\0\0\xff\xff\xff,\0\0\0\0\x01\0\x01\0\0\x02\x02L\x01\0;";

/// Commands replace their own pictures and scenarios, and nothing else.
#[test]
fn single_files_replace_only_their_own_kind() {
    let directory = tempfile::tempdir().unwrap();
    let here = directory.path();
    assert_eq!(simulate_in(here, &[]).code, Some(0));
    let [out, toml] =
        [here, &here.join("scene.toml")].map(|path| path.to_str().unwrap().to_owned());
    let slope = Path::new(crate::ROOT).join("scenarios/slope.toml");
    let slope = slope.to_str().unwrap();
    for (args, name, foreign) in [
        (vec!["view", &out], "view.html", &b"<!doctype html>\n<title>mine</title>"[..]),
        (vec!["plot", &out], "plot.svg", b"<?xml version=\"1.0\"?>"),
        (
            vec!["plot", &out],
            "plot-energy.svg",
            b"<svg xmlns=\"http://www.w3.org/2000/svg\" width=\"9\" height=\"9\"/>",
        ),
        (vec!["plot", &out], "plot.png", PNG),
        (vec!["plot", &out], "plot-energy.png", PNG),
        (vec!["gif", &out], "animation.gif", GIF),
        (vec!["convert", slope, &toml], "scene.toml", b"name = \"mine\""),
    ] {
        let file = here.join(name);
        fs::remove_file(&file).ok();
        fs::write(&file, foreign).unwrap();
        run(&args).assert_refused(2, &[name, "not written by tumble", "move it"]);
        assert_eq!(fs::read(&file).unwrap(), foreign, "{name}");
        fs::write(&file, "").unwrap();
        for _ in 0..2 {
            assert_eq!(run(&args).code, Some(0), "{name}");
            assert!(fs::metadata(&file).unwrap().len() > 100, "{name}");
        }
    }
}
