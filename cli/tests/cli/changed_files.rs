//! Checksums in run.json detect changes of a run's files that are physically consistent.

use super::scenario::run_scenario;
use super::support::{End, Table, run, simulate, unseal};
use std::fs;
use std::path::Path;

/// Scene with a sliding box and a ball that stays in the air.
const SCENE: &str = r#"
steps = 30
ground = { friction = 0.3 }
[[bodies]]
name = "slider"
mass = 2.0
box = [1.0, 1.0, 1.0]
position = [0.0, 0.0, 0.5]
velocity = [1.0, 0.0, 0.0]
[[bodies]]
name = "thrown"
mass = 1.0
sphere = 0.2
position = [3.0, 0.0, 2.0]
"#;

fn verify(out: &Path) -> End {
    run(&["verify", out.join("steps.csv").to_str().unwrap()])
}

/// Writes `value` into the cell at (`row`, `column`) of the table at `path`.
fn change(path: &Path, column: &str, row: usize, value: &str) {
    let mut table = Table::parse(&fs::read_to_string(path).unwrap());
    let column = table.column(column);
    assert_ne!(table.rows[row][column], value);
    table.rows[row][column] = value.to_owned();
    fs::write(path, table.text()).unwrap();
}

/// `verify` and `--continue` detect changed cells that satisfy every equation of motion.
#[test]
fn checksums_detect_changes_that_satisfy_the_equations() {
    let (end, directory) = run_scenario(SCENE, &[]);
    assert_eq!(end.code, Some(0), "{end:?}");
    let out = directory.path().join("out");
    let whole = verify(&out);
    assert_eq!(whole.code, Some(0), "{whole:?}");
    assert!(!whole.stdout.contains("checksum"), "{whole:?}");

    // The start method of a step whose solution does not depend on it.
    let steps = out.join("steps.csv");
    let before = fs::read_to_string(&steps).unwrap();
    let table = Table::parse(&before);
    let starts = table.texts("start");
    let (row, other) = if starts[20] == "zero" { (20, "previous") } else { (20, "zero") };
    change(&steps, "start", row, other);
    let found = verify(&out);
    assert_eq!((found.code, found.stderr.as_str()), (Some(1), ""), "{found:?}");
    assert!(found.stdout.contains("steps that differ from their rows: 0"), "{found:?}");
    assert!(found.stdout.contains("steps.csv was changed after the run wrote it"), "{found:?}");
    let folder = out.to_str().unwrap();
    let refused = run(&["--continue", folder, "--steps", "40"]);
    refused
        .assert_refused(2, &["--continue", "steps.csv", "checksum", "unchanged files of the run"]);
    fs::write(&steps, &before).unwrap();
    assert_eq!(verify(&out).code, Some(0));

    // Constants without influence on any row.
    let run_json = out.join("run.json");
    let text = fs::read_to_string(&run_json).unwrap();
    for (from, to) in [("\"thrown\"", "\"dropped\""), ("\n}\n", "\n\n}\n")] {
        assert!(text.contains(from));
        fs::write(&run_json, text.replace(from, to)).unwrap();
        let found = verify(&out);
        assert_eq!((found.code, found.stderr.as_str()), (Some(1), ""), "{found:?}");
        assert!(found.stdout.contains("run.json was changed after it was written"), "{found:?}");
    }
    // Removed checksum of run.json, then removed checksums of the tables.
    let at = text.rfind(",\n  \"checksum\": ").unwrap();
    fs::write(&run_json, format!("{}\n}}\n", &text[..at])).unwrap();
    let found = verify(&out);
    assert_eq!(found.code, Some(1), "{found:?}");
    assert!(found.stdout.contains("its checksum is missing"), "{found:?}");
    let sums = text.find(",\n  \"checksums\": {").unwrap();
    fs::write(&run_json, format!("{}{}", &text[..sums], &text[at..])).unwrap();
    let found = verify(&out);
    assert_eq!(found.code, Some(1), "{found:?}");
    assert!(found.stdout.contains("its checksum does not match"), "{found:?}");
    // The solve time differs between runs and has no checksum.
    let clock = text.lines().find(|line| line.contains("\"solve_seconds\"")).unwrap();
    fs::write(&run_json, text.replace(clock, "    \"solve_seconds\": 1.5")).unwrap();
    assert_eq!(verify(&out).code, Some(0));

    fs::write(&run_json, &text).unwrap();
    unseal(&run_json);
    let silent = verify(&out);
    assert_eq!(silent.code, Some(0), "{silent:?}");
    assert!(silent.stdout.contains("note: run.json has no checksums"), "{silent:?}");
}

/// The export of the tutorial's scene has a checksum, too.
#[test]
fn the_export_has_its_checksum() {
    let done = simulate(&["--solver", "native", "--steps", "40"]);
    assert_eq!(done.end.code, Some(0), "{:?}", done.end);
    assert_eq!(verify(&done.path("")).code, Some(0));
    // The same number in another notation.
    let path = done.path("trajectory.csv");
    fs::write(&path, done.csv().replacen("\n0,0", "\n0,-0", 1)).unwrap();
    let found = verify(&done.path(""));
    assert_eq!(found.code, Some(1), "{found:?}");
    assert!(
        found.stdout.contains("trajectory.csv was changed after the run wrote it"),
        "{found:?}"
    );
}
