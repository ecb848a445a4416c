//! Files of previous and killed runs in the output directory.

use super::support::{WRITTEN, everything_in, run};
use std::fs;
use std::path::Path;

const TWO: &str = "steps = 3\n[ground]\nfriction = 0.5\n\
                   [[bodies]]\nbox = 0.2\nmass = 1.0\nposition = [0, 0, 0.1]\n\
                   [[bodies]]\nbox = 0.2\nmass = 1.0\nposition = [1, 0, 0.1]\n";

fn names(folder: &Path) -> Vec<String> {
    everything_in(folder).iter().map(|path| path.to_str().unwrap().to_owned()).collect()
}

#[test]
fn tables_that_a_run_does_not_have_are_removed_and_named() {
    let directory = tempfile::tempdir().unwrap();
    let (out, file) = (directory.path().join("out"), directory.path().join("two.toml"));
    fs::write(&file, TWO).unwrap();
    let [out_text, file_text] = [&out, &file].map(|path| path.to_str().unwrap());
    let one = ["--steps", "3", "--out", out_text];
    let two = [file_text, "--out", out_text];
    let tables = ["contacts.csv", "run.json", "state.bin", "states.csv", "steps.csv"];

    assert_eq!(run(&one).code, Some(0));
    fs::write(out.join("notes.csv"), "mine").unwrap();
    let end = run(&two);
    assert_eq!(end.code, Some(0), "{end:?}");
    assert!(end.stdout.contains("removed trajectory.csv from an earlier run"), "{end:?}");
    let with_notes = |files: &[&str]| {
        let mut all: Vec<String> = files.iter().map(|name| (*name).to_owned()).collect();
        all.push("notes.csv".to_owned());
        all.sort();
        all
    };
    assert_eq!(names(&out), with_notes(&tables));
    let end = run(&[&two[..], &["--compact"]].concat());
    assert!(end.stdout.contains("removed contacts.csv, states.csv, steps.csv"), "{end:?}");
    let compressed = ["contacts.csv.gz", "run.json", "state.bin", "states.csv.gz", "steps.csv.gz"];
    assert_eq!(names(&out), with_notes(&compressed));
}

#[test]
fn only_temporary_files_of_killed_runs_are_removed() {
    let directory = tempfile::tempdir().unwrap();
    let out = directory.path();
    let others = [".tumble-notes.tmp", ".tumble-.tmp", "tumble-a1B2c3.tmp", ".tumble-a1B2c3.csv"];
    for name in others.iter().chain(&[".tumble-a1B2c3.tmp", ".tumble-ZZZZZZ.tmp"]) {
        fs::write(out.join(name), "half").unwrap();
    }
    fs::create_dir(out.join(".tumble-folder.tmp")).unwrap();
    let end = run(&["--steps", "3", "--out", out.to_str().unwrap()]);
    assert_eq!(end.code, Some(0), "{end:?}");
    let mut expected: Vec<_> = others.iter().map(|name| (*name).to_owned()).collect();
    expected.push(".tumble-folder.tmp".to_owned());
    expected.extend(WRITTEN.map(str::to_owned));
    expected.sort();
    assert_eq!(names(out), expected);
}
