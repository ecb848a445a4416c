//! `--export-problems`.

use crate::ROOT;
use crate::support::{End, everything_in, tumble};
use std::fs;
use std::path::Path;
use tempfile::TempDir;
use tumble::problem::{SolveOptions, dat};

fn names_in(directory: &Path) -> Vec<String> {
    everything_in(directory).iter().map(|path| path.to_string_lossy().into_owned()).collect()
}

fn path(directory: &Path) -> &str {
    directory.to_str().unwrap()
}

#[test]
fn the_problems_of_a_run_are_exported_and_solved() {
    let directory = TempDir::new().unwrap();
    let (run_out, problems) = (directory.path().join("run"), directory.path().join("problems"));
    let scene = Path::new(ROOT).join("scenarios/stack.toml");
    let exported = |scene: &str, more: &[&str]| -> End {
        let args = ["--out", path(&run_out), "--export-problems", path(&problems)];
        tumble().args([scene]).args(args).args(more).output().unwrap().into()
    };
    let end = exported(path(&scene), &["--steps", "20"]);
    assert_eq!(end.code, Some(0), "{end:?}");
    assert!(end.stdout.contains("contact problems to"), "{}", end.stdout);
    let files = names_in(&problems);
    assert!(!files.is_empty() && files.iter().all(|name| name.starts_with("step-")), "{files:?}");
    for name in &files {
        let problem = dat::read(&fs::read_to_string(problems.join(name)).unwrap()).unwrap();
        assert!(problem.solve(&SolveOptions::default()).unwrap().is_solved(), "{name}");
    }
    // A shorter run removes the exported problems of the longer one and keeps other files.
    fs::write(problems.join("own.dat"), "mine").unwrap();
    exported(path(&scene), &["--steps", "3"]).assert_refused(2, &["step-", "--overwrite"]);
    let end = exported(path(&scene), &["--steps", "3", "--overwrite"]);
    assert!(end.code == Some(0) && end.stdout.contains(" from an earlier run there"), "{end:?}");
    let left = names_in(&problems);
    assert!(left.len() < files.len() && left.contains(&"own.dat".to_owned()), "{left:?}");
    assert!(left.iter().all(|name| name.as_str() <= "step-00000003.dat"), "{left:?}");
    // A continued run keeps the earlier problems.
    let args = ["--continue", path(&run_out), "--steps", "6", "--export-problems", path(&problems)];
    let end: End = tumble().args(args).output().unwrap().into();
    assert_eq!(end.code, Some(0), "{end:?}");
    let longer = names_in(&problems);
    assert!(
        longer.len() > left.len() && left.iter().all(|name| longer.contains(name)),
        "{longer:?}"
    );
    // Another path to the run's own directory, which may not exist yet.
    for folder in [&run_out, &directory.path().join("later")] {
        let name = folder.file_name().unwrap().to_str().unwrap();
        let other = directory.path().join(format!("./run/../{name}"));
        let args = [path(&scene), "--out", path(folder)];
        let args = args.into_iter().chain(["--export-problems", path(&other)]);
        let end: End = tumble().args(args).output().unwrap().into();
        end.assert_refused(2, &["--export-problems", "the directory of the run itself"]);
    }
    let joints = Path::new(ROOT).join("scenarios/door.toml");
    let none = directory.path().join("none");
    let args = ["--out", path(&none), "--export-problems", path(&none)];
    let end: End = tumble().args([path(&joints)]).args(args).output().unwrap().into();
    end.assert_refused(2, &["--export-problems", "joints"]);
    let end: End = tumble().args(args).output().unwrap().into();
    end.assert_refused(2, &["--export-problems", "--solver native"]);
    assert!(!none.exists());
}
