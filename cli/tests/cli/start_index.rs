//! Runs with a start index: rows, times, loads, run.json, verification and continuation.

use super::support::{Simulated, Table, run, simulate};
use crate::ROOT;
use std::fs;

const LOAD: [&str; 2] = ["--set", "load.force=[[1, 0, 0, 0], [2, 40, 0, 30]]"];

fn table(done: &Simulated, name: &str) -> Table {
    Table::parse(&fs::read_to_string(done.path(name)).unwrap())
}

fn simulated(args: &[&str]) -> Simulated {
    let done = simulate(args);
    assert_eq!(done.end.code, Some(0), "{args:?}: {:?}", done.end);
    done
}

fn verified(done: &Simulated, name: &str) -> Option<i32> {
    run(&["verify", done.path(name).to_str().unwrap()]).code
}

/// A floating cube under a time-dependent load, started at k = 600, repeats the rows of the full
/// run. Equality holds to the digits of the start in the flags.
#[test]
fn a_run_from_an_index_has_the_rows_and_loads_of_that_time() {
    let scene = ["--scene", "floating"];
    let whole = simulated(&[&scene[..], &LOAD, &["--steps", "1000"]].concat());
    let rows = fs::read_to_string(whole.path("trajectory.csv")).unwrap();
    let at = |k: usize| rows.lines().nth(k + 1).unwrap().split(',').collect::<Vec<_>>();
    let from = at(600);
    let fields = [("position", 2..5), ("attitude", 5..9), ("velocity", 9..12), ("spin", 12..15)];
    let start =
        fields.map(|(field, columns)| format!("--set=start.{field}={}", from[columns].join(",")));
    let start = start.each_ref().map(String::as_str);
    let later = ["--start-index", "600", "--steps", "400"];
    let part = simulated(&[&scene[..], &LOAD, &start, &later].concat());
    let (mine, all) = (table(&part, "trajectory.csv"), table(&whole, "trajectory.csv"));
    for column in ["k", "time_s", "x_m", "z_m", "qw", "vx_m_s", "wy_rad_s"] {
        let (mine, all) = (mine.numbers(column), &all.numbers(column)[600..]);
        assert_eq!(mine.len(), all.len());
        let off = mine.iter().zip(all).map(|(a, b)| (a - b).abs()).fold(0.0, f64::max);
        // The attitude is normalised again.
        assert!(off < 1e-12, "{column}: {off}");
    }
    assert_eq!(part.run_json()["start_index"], 600);
    assert_eq!(verified(&part, "states.csv"), Some(0));
    let changed = part.run_json()["changed"].to_string();
    assert!(changed.contains("start-index"), "{changed}");
    // A run from index 0 omits the field.
    assert!(whole.run_json().get("start_index").is_none());
}

/// Without loads nothing depends on time. Only the columns k and t differ between start indices.
#[test]
fn start_index_of_a_scenario_changes_only_k_and_t() {
    let folder = tempfile::tempdir().unwrap();
    let file = folder.path().join("later.toml");
    let text = fs::read_to_string(format!("{ROOT}/scenarios/door.toml"));
    let text = text.unwrap();
    fs::write(&file, format!("start_index = 9000\n{text}")).unwrap();
    let file = file.to_str().unwrap();
    let later = simulated(&[file, "--steps", "60"]);
    let first = simulated(&[file, "--steps", "60", "--start-index", "0"]);
    for name in ["states.csv", "joints.csv", "contacts.csv", "steps.csv"] {
        let bare = |done: &Simulated| {
            let text = fs::read_to_string(done.path(name)).unwrap();
            // Either `time_s` or `last_k` is the second column.
            let bare = |line: &str| line.splitn(3, ',').last().map(str::to_owned);
            text.lines().map(bare).collect::<Vec<_>>()
        };
        assert_eq!(bare(&later), bare(&first), "{name}");
        let k = table(&later, name).numbers("k");
        assert!(k.iter().all(|k| (9000.0..9060.0).contains(k)), "{name}");
    }
    assert_eq!(verified(&later, "states.csv"), Some(0));
    assert_eq!(later.run_json()["start_index"], 9000);
    // Rows and run.json with different start indices are inconsistent.
    let json = fs::read_to_string(later.path("run.json")).unwrap();
    fs::write(later.path("run.json"), json.replace("9000", "9001")).unwrap();
    let end = run(&["verify", later.path("states.csv").to_str().unwrap()]);
    assert_eq!(end.code, Some(2), "{end:?}");
    assert!(end.stderr.contains("k is 9000; expected 9001"), "{end:?}");
}

/// Start indices outside 0 to 9e15 and other text are refused.
#[test]
fn invalid_start_indices_are_rejected() {
    for invalid in ["-1", "1.5", "9000000000000001", "x"] {
        let end = run(&["--start-index", invalid]);
        assert_eq!(end.code, Some(2), "{end:?}");
        let why = "a whole number from 0 to 9000000000000000 is needed";
        assert!(end.stderr.contains(why), "{end:?}");
    }
    let folder = tempfile::tempdir().unwrap();
    let file = folder.path().join("odd.toml");
    let text = fs::read_to_string(format!("{ROOT}/scenarios/door.toml"));
    fs::write(&file, format!("start_index = 9000000000000001\n{}", text.unwrap())).unwrap();
    let end = run(&[file.to_str().unwrap()]);
    assert_eq!(end.code, Some(2), "{end:?}");
    let why = "start_index: a whole number from 0 to 9000000000000000 is needed";
    assert!(end.stderr.contains(why), "{end:?}");
}
