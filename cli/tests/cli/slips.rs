//! Slips in names of files, fields and bodies: the error says what to write instead.

use super::support::{End, tumble};
use std::fs;
use std::path::Path;

fn run_in(directory: &Path, args: &[&str]) -> End {
    tumble().args(args).current_dir(directory).output().unwrap().into()
}

const STACK: &str = "steps = 20\n[ground]\nfriction = 0.5\n[[bodies]]\nname = \"low\"\nbox = 0.2\nmass = 1.0\n\
     position = [0.0, 0.0, 0.1]\n[[bodies]]\nname = \"high\"\nbox = 0.2\nmass = 1.0\nposition = [0.0, 0.0, 0.3]\n";

#[test]
fn a_path_that_is_no_table_or_directory_is_answered_with_the_right_one() {
    let directory = tempfile::tempdir().unwrap();
    let here = directory.path();
    fs::write(here.join("stack.toml"), STACK).unwrap();
    assert_eq!(run_in(here, &["run", "stack.toml", "-q", "-o", "out"]).code, Some(0));
    for command in ["verify", "view", "gif", "plot"] {
        run_in(here, &[command, "none.csv"])
            .assert_refused(2, &["none.csv does not exist; give a table of a run"]);
        run_in(here, &[command, "out/state.csv"])
            .assert_refused(2, &["out/state.csv does not exist; give out/states.csv"]);
        run_in(here, &[command, "out"])
            .assert_refused(2, &["out is a directory, not a file; give out/states.csv"]);
    }
    run_in(here, &["run", "--continue", "out/state.bin", "--steps", "30"])
        .assert_refused(2, &["--continue: out/state.bin is a file; give its directory, out"]);
    let end = run_in(here, &["new", "sub/dir/x"]);
    end.assert_refused(2, &["sub/dir/x.toml", "there is no directory sub/dir; create it first"]);
    assert!(!end.stderr.contains(".tmp"), "{end:?}");
}
