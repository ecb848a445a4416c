//! `tumble forces`.

use crate::support::{Simulated, simulate, tumble};

/// Two blocks at rest, of 3 and 1 kg, and a ball that hangs at the world.
const SCENE: &str = "steps = 50\n[ground]\nfriction = 0.5\n[[bodies]]\nname = \"low\"\nbox = [0.6, 0.6, 0.2]\n\
                     mass = 3.0\nposition = [0.0, 0.0, 0.1]\n[[bodies]]\nname = \"high\"\nbox = 0.2\nmass = 1.0\n\
                     position = [0.0, 0.0, 0.3]\n[[bodies]]\nname = \"ball\"\nsphere = 0.1\nmass = 2.0\n\
                     position = [2.0, 0.0, 1.0]\n[[joints]]\nname = \"hook\"\ntype = \"fixed\"\nbodies = \"ball\"\n\
                     anchor = [2.0, 0.0, 1.5]\n";

/// Weights of what stands above, or hangs below.
#[test]
fn forces_at_rest_are_weights() {
    let directory = tempfile::tempdir().unwrap();
    let scene = directory.path().join("scene.toml");
    std::fs::write(&scene, SCENE).unwrap();
    let run: Simulated = simulate(&["run", scene.to_str().unwrap()]);
    let forces =
        |args: &[&str]| tumble().arg("forces").arg(run.path("")).args(args).output().unwrap();
    let table = String::from_utf8(forces(&["--from", "0.01", "--csv"]).stdout).unwrap();
    let mut reader = csv::Reader::from_reader(table.as_bytes());
    let rows: Vec<csv::StringRecord> = reader.records().map(Result::unwrap).collect();
    let weights = [("low", "ground", 4.0), ("low", "high", 1.0), ("hook", "", 2.0)];
    for (first, second, mass) in weights {
        let is_pair = |row: &&csv::StringRecord| {
            [&row[0], &row[1]] == [first, second] || [&row[1], &row[0]] == [first, second]
        };
        let row = rows.iter().find(is_pair).unwrap_or_else(|| panic!("{first}: {table}"));
        let number = |column: usize| row[column].parse::<f64>().unwrap();
        for column in [6, 7] {
            let error = number(column).abs() - 9.81 * mass;
            assert!(error.abs() < 1e-9, "{first} and {second}: {row:?}");
        }
    }
    let text = String::from_utf8(forces(&[]).stdout).unwrap();
    assert!(text.starts_with("forces of 49 steps from 0 to "), "{text}");
    let late = forces(&["--from", "9"]);
    assert_eq!(late.status.code(), Some(2));
    let said = String::from_utf8(late.stderr).unwrap();
    assert!(said.contains("has no step between --from and --to; its last state is at"), "{said}");
}
