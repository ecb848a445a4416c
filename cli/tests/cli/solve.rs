//! `tumble solve` and `--export-problems`.

use crate::ROOT;
use crate::support::{End, everything_in, run, tumble};
use std::fs;
use std::path::Path;
use tempfile::TempDir;

/// Contact problem of a mass of 2 kg with 1 m/s downwards, 3 m/s tangentially and μ = 0.5.
const SLIDES: &str = "3\n1\n0\n3\n3\n3 3\n0.5 0 0\n0 0.5 0\n0 0 0.5\n-1 3 0\n0.5\n";
/// Contact problem with zero response and a closing velocity, which has no solution.
const STUCK: &str = "3\n1\n1\n3\n3\n0\n-1 0 0\n0.5\n";

fn written(directory: &TempDir, name: &str, text: &str) -> String {
    let path = directory.path().join(name);
    fs::write(&path, text).unwrap();
    path.to_str().unwrap().to_owned()
}

fn names_in(directory: &Path) -> Vec<String> {
    everything_in(directory).iter().map(|path| path.to_string_lossy().into_owned()).collect()
}

fn path(directory: &Path) -> &str {
    directory.to_str().unwrap()
}

#[test]
fn a_problem_is_solved_and_its_solution_written() {
    let directory = TempDir::new().unwrap();
    let file = written(&directory, "slides.dat", SLIDES);
    let end = run(&["solve", &file]);
    assert_eq!((end.code, end.stderr.as_str()), (Some(0), ""));
    assert!(end.stdout.contains("slides") && end.stdout.contains(" solved "), "{}", end.stdout);
    let csv = directory.path().join("own.csv");
    for flag in ["--out", "--output"] {
        let end = run(&["solve", &file, flag, path(&csv)]);
        assert_eq!(end.code, Some(0), "{end:?}");
        let text = fs::read_to_string(&csv).unwrap();
        let rows: Vec<Vec<f64>> = text
            .lines()
            .skip(1)
            .map(|line| line.split(',').map(|cell| cell.parse().unwrap()).collect())
            .collect();
        assert!(text.starts_with("group,row,impulse,velocity\n"));
        let expected = [[0.0, 0.0, 2.0, 0.0], [0.0, 1.0, -1.0, 2.5], [0.0, 2.0, 0.0, 0.0]];
        for (row, expected) in rows.iter().zip(expected) {
            assert!(row.iter().zip(expected).all(|(a, b)| (a - b).abs() < 1e-12), "{text}");
        }
        fs::remove_file(&csv).unwrap();
    }
}

/// `solve` of a directory writes a table and returns exit code 3 if a problem is not solved.
#[test]
fn a_folder_has_a_table_and_what_is_unsolved_the_exit_code_3() {
    let directory = TempDir::new().unwrap();
    written(&directory, "slides.dat", SLIDES);
    written(&directory, "stuck.dat", STUCK);
    written(&directory, "notes.txt", "nothing");
    let out = directory.path().join("solved");
    let end = run(&["solve", path(directory.path()), "--out", path(&out)]);
    assert_eq!((end.code, end.stderr.as_str()), (Some(3), ""));
    assert!(end.stdout.contains("1 of 2 solved"), "{}", end.stdout);
    let names = ["problems.csv", "slides.solution.csv", "stuck.solution.csv"];
    assert_eq!(names_in(&out), names);
    let table = fs::read_to_string(out.join("problems.csv")).unwrap();
    let lines: Vec<&str> = table.lines().collect();
    assert!(lines[0].starts_with("problem,groups,rows,parts,status,residual,"));
    assert!(
        lines[1].starts_with("slides,1,3,1,solved,")
            && lines[2].starts_with("stuck,1,3,1,unsolved,1e0,")
    );
    let quiet = run(&["solve", path(directory.path()), "--quiet"]);
    assert_eq!((quiet.code, quiet.stdout.as_str()), (Some(3), ""));
}

#[test]
fn what_is_no_problem_is_refused() {
    let directory = TempDir::new().unwrap();
    let file = |name: &str, text: &str| written(&directory, name, text);
    let slides = file("slides.dat", SLIDES);
    let out = directory.path().join("none");
    let refused = |args: &[&str], words: &[&str]| {
        let end: End =
            tumble().arg("solve").args(args).args(["--out", path(&out)]).output().unwrap().into();
        end.assert_refused(2, words);
        assert!(!out.exists());
    };
    refused(&[&file("short.dat", "3\n1\n0\n3\n3\n3 3\n1 0 0")], &["short.dat", "dense matrix"]);
    refused(&[&file("word.dat", &SLIDES.replace("-1 3 0", "-1 x 0"))], &["line 10", "\"x\""]);
    refused(&[&file("mu.dat", &SLIDES.replace("\n0.5\n", "\n-0.5\n"))], &["friction", "-0.5"]);
    refused(&[&file("skew.dat", &SLIDES.replace("0.5 0 0\n", "0.5 0.4 0\n"))], &["symmetric"]);
    refused(&[&file("h.hdf5", "\u{7f}HDF")], &["h.hdf5"]);
    let hdf5 = directory.path().join("true.hdf5");
    fs::write(&hdf5, b"\x89HDF\r\n").unwrap();
    refused(&[path(&hdf5)], &["HDF5", "tumble.ContactProblem.read"]);
    refused(&[&slides, "--residual", "0"], &["--residual 0"]);
    refused(&[&slides, &slides], &["two problems", "slides"]);
    let empty = TempDir::new().unwrap();
    refused(&[path(empty.path())], &["no file in it ends in .dat"]);
    refused(&[path(&directory.path().join("missing.dat"))], &["missing.dat"]);
}

#[test]
fn the_problems_of_a_run_are_exported_and_solved() {
    let directory = TempDir::new().unwrap();
    let (run_out, problems) = (directory.path().join("run"), directory.path().join("problems"));
    let scene = Path::new(ROOT).join("scenarios/stack.toml");
    let exported = |scene: &str, more: &[&str]| -> End {
        let args = ["--out", path(&run_out), "--export-problems", path(&problems)];
        tumble().args(["--scenario", scene]).args(args).args(more).output().unwrap().into()
    };
    let end = exported(path(&scene), &["--steps", "20"]);
    assert_eq!(end.code, Some(0), "{end:?}");
    assert!(end.stdout.contains("contact problems to"), "{}", end.stdout);
    let files = names_in(&problems);
    assert!(!files.is_empty() && files.iter().all(|name| name.starts_with("step-")), "{files:?}");
    let end = run(&["solve", path(&problems)]);
    assert_eq!(end.code, Some(0), "{end:?}");
    // A shorter run removes the exported problems of the longer one and keeps other files.
    fs::write(problems.join("own.dat"), SLIDES).unwrap();
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
        let args = ["--scenario", path(&scene), "--out", path(folder)];
        let args = args.into_iter().chain(["--export-problems", path(&other)]);
        let end: End = tumble().args(args).output().unwrap().into();
        end.assert_refused(2, &["--export-problems", "the directory of the run itself"]);
    }
    let joints = Path::new(ROOT).join("scenarios/door.toml");
    let none = directory.path().join("none");
    let args = ["--out", path(&none), "--export-problems", path(&none)];
    let end: End = tumble().args(["--scenario", path(&joints)]).args(args).output().unwrap().into();
    end.assert_refused(2, &["--export-problems", "joints"]);
    let end: End = tumble().args(args).output().unwrap().into();
    end.assert_refused(2, &["--export-problems", "--solver native"]);
    assert!(!none.exists());
}
