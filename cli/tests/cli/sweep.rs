//! Ranges in `--set`: runs in directories of their own, and a table of their ends.

use super::scenario::run_scenario;
use super::support::run;
use std::fs;

/// A block slides on a slope of 20° with tan 20° = 0.364.
const SLOPE: &str = "\
gravity = [3.3552, 0.0, -9.2183]
steps = 201
[ground]
friction = 0.3
[[bodies]]
name = \"block\"
box = 0.2
mass = 1.0
position = [0.0, 0.0, 0.1]
";

#[test]
fn a_range_makes_a_run_for_each_value() {
    let flags = ["--set", "ground.friction=0.2:0.4:0.1", "--set", "bodies.block.mass=1:2:1"];
    let (end, directory) = run_scenario(SLOPE, &flags);
    assert_eq!((end.code, end.stderr.as_str()), (Some(0), ""), "{end:?}");
    let out = directory.path().join("out");
    let table = fs::read_to_string(out.join("sweep.csv")).unwrap();
    let mut rows = csv::Reader::from_reader(table.as_bytes());
    let columns = "directory ground.friction bodies.block.mass outcome unsolved block.x block.y block.z \
                   block.qw block.qx block.qy block.qz";
    assert_eq!(rows.headers().unwrap(), columns.split(' ').collect::<Vec<_>>());
    let rows: Vec<_> = rows.records().map(Result::unwrap).collect();
    assert_eq!(rows.len(), 6);
    for row in &rows {
        let friction: f64 = row[1].parse().unwrap();
        let place: f64 = row[5].parse().unwrap();
        // a = g (sin 20° − μ cos 20°) over 0.4 s.
        let way = 0.5 * (3.3552 - friction * 9.2183_f64).max(0.0) * 0.16;
        assert!((place - way).abs() < 1e-9, "{row:?}: {way}");
        let end = run(&["verify", "--quiet", out.join(&row[0]).to_str().unwrap()]);
        assert_eq!((row[3].to_owned(), end.code), ("complete".to_owned(), Some(0)), "{end:?}");
    }
    assert_eq!(&rows[1][0], "ground.friction=0.2,bodies.block.mass=2");
}

#[test]
fn a_wrong_value_of_a_range_is_refused_before_the_first_run() {
    let refused = |flags: &[&str], words: &[&str]| {
        let (end, directory) = run_scenario(SLOPE, flags);
        end.assert_refused(2, words);
        assert!(!directory.path().join("out").exists(), "{flags:?}");
    };
    refused(&["--set", "ground.friction=5:15:5"], &["--set ground.friction", "15", "0 to 10"]);
    let sweep = ["--set", "ground.friction=0.1:0.2:0.1"];
    refused(&[&sweep[..], &["--json"]].concat(), &["--json: it has no meaning with a range"]);
    refused(&["--set", "ground.friction=1:0:1"], &["FIRST:LAST:STEP"]);
    refused(&["--gif-speed", "2"], &["--gif-speed: it has no meaning"]);
    let (_, directory) = run_scenario(SLOPE, &["--quiet"]);
    let scene = directory.path().join("test.toml");
    run(&[&["check", scene.to_str().unwrap()], &sweep[..]].concat())
        .assert_refused(2, &["ground.friction", "only for tumble run"]);
}
