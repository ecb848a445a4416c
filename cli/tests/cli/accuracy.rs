//! Runs with an accuracy: files, checks of the files, continued runs and refusals.

use super::scenario::run_scenario;
use super::support::{End, Table, run};
use std::fs;
use std::path::Path;

/// A tilted box that falls, bounces and slides, beside a pendulum with a spring.
const SCENE: &str = r#"
steps = 101
time_step = 0.01
accuracy = 1e-5
[ground]
friction = 0.4
restitution = 0.3
[[bodies]]
name = "box"
box = [0.3, 0.2, 0.1]
mass = 1.0
position = [0, 0, 0.4]
attitude = [0.9, 0.3, 0.2, 0.1]
velocity = [1, 0, 0]
[[bodies]]
name = "rod"
box = [0.02, 0.02, 0.4]
mass = 0.5
position = [1.2, 1, 1.0]
attitude = { axis = [0, 1, 0], degrees = 90 }
[[joints]]
name = "hinge"
type = "revolute"
bodies = "rod"
anchor = [1.0, 1, 1.0]
axis = [0, 1, 0]
stiffness = 2.0
"#;

#[test]
fn a_run_with_an_accuracy_is_verified() {
    let (end, directory) = run_scenario(SCENE, &[]);
    assert_eq!(end.code, Some(0), "{end:?}");
    assert!(end.stdout.contains("  intervals    "), "{end:?}");
    let steps = Table::parse(&fs::read_to_string(directory.path().join("out/steps.csv")).unwrap());
    let errors = steps.numbers("error_m");
    assert!(errors.iter().sum::<f64>() <= 3e-5 && errors.iter().any(|error| *error > 0.0));
    let whole = steps.numbers("interval").iter().filter(|number| **number == 0.0).count();
    assert!(whole == 101 && steps.rows.len() > 150);
    let states = directory.path().join("out/states.csv");
    let verified = run(&["verify", states.to_str().unwrap()]);
    assert_eq!(verified.code, Some(0), "{verified:?}");
}

/// Changes a cell of a row of a table, and returns what `verify` says. The table is restored.
fn verify_with(out: &Path, table: &str, row: usize, column: &str, change: f64) -> End {
    let path = out.join(format!("{table}.csv"));
    let text = fs::read_to_string(&path).unwrap();
    let mut lines: Vec<_> = text.lines().map(str::to_owned).collect();
    let place = lines[0].split(',').position(|name| name == column).unwrap();
    let mut cells: Vec<_> = lines[row + 1].split(',').map(str::to_owned).collect();
    let number: f64 = cells[place].parse().unwrap();
    cells[place] = (number + change).to_string();
    lines[row + 1] = cells.join(",");
    fs::write(&path, lines.join("\n") + "\n").unwrap();
    let end = run(&["verify", out.join("states.csv").to_str().unwrap()]);
    fs::write(&path, text).unwrap();
    end
}

/// Result of `verify` without the rows of an interval. The tables are restored.
fn verify_without(out: &Path, step: f64, interval: f64) -> End {
    let paths =
        ["states", "steps", "contacts", "joints"].map(|name| out.join(name).with_extension("csv"));
    let texts = paths.each_ref().map(|path| fs::read_to_string(path).unwrap());
    for (path, text) in paths.iter().zip(&texts) {
        let table = Table::parse(text);
        let [steps, intervals] = ["k", "interval"].map(|column| table.numbers(column));
        let stays = |row: usize| (steps[row], intervals[row]) != (step, interval);
        let lines = text.lines().enumerate().filter(|(line, _)| *line == 0 || stays(line - 1));
        let kept: Vec<_> = lines.map(|(_, line)| line).collect();
        fs::write(path, kept.join("\n") + "\n").unwrap();
    }
    let end = run(&["verify", out.join("states.csv").to_str().unwrap()]);
    paths.iter().zip(texts).for_each(|(path, text)| fs::write(path, text).unwrap());
    end
}

/// Errors planted in the second and in the last interval of steps: states, velocities, forces, coefficients
/// and lengths.
#[test]
fn planted_errors_in_later_intervals_are_rejected() {
    let (end, directory) = run_scenario(SCENE, &[]);
    assert_eq!(end.code, Some(0), "{end:?}");
    let out = directory.path().join("out");
    super::support::unseal(&out.join("run.json"));
    let table =
        |name: &str| Table::parse(&fs::read_to_string(out.join(format!("{name}.csv"))).unwrap());
    let mut planted = 0;
    for (name, columns) in [
        ("states", &["x_m", "qw", "mid_vz_m_s", "vx_m_s", "interval_s"][..]),
        ("contacts", &["force_z_N", "friction", "gap_m", "interval_s"]),
        ("steps", &["interval_s", "energy_J", "friction_J", "residual_m_s"]),
        ("joints", &["force_x_N", "wz_rad_s"]),
    ] {
        let rows = table(name);
        let [steps, numbers] = ["k", "interval"].map(|column| rows.numbers(column));
        let second = |row: &usize| numbers[*row] == 1.0;
        let last = |row: &usize| {
            numbers[*row] > 1.0 && steps.get(row + 1).is_some_and(|next| *next > steps[*row])
        };
        let all = 0..rows.rows.len();
        let second = all.clone().filter(second).step_by(7).take(7);
        for row in second.chain(all.filter(last).step_by(5).take(7)) {
            for column in columns {
                let length = rows.numbers("interval_s")[row];
                let change = match *column {
                    // Velocities of the instant are judged by their energy.
                    "vx_m_s" => 0.01,
                    // A force of short intervals shows in its impulse.
                    "force_x_N" | "force_z_N" => 1e-6 / length,
                    _ => 1e-4,
                };
                let end = verify_with(&out, name, row, column, change);
                assert!(matches!(end.code, Some(1 | 2)), "{name} {column} {row}: {end:?}");
                planted += 1;
            }
        }
    }
    let steps = table("steps");
    let [numbers, intervals] = ["k", "interval"].map(|column| steps.numbers(column));
    let later = (0..steps.rows.len()).filter(|row| intervals[*row] > 0.0).step_by(11).take(8);
    for row in later {
        let end = verify_without(&out, numbers[row], intervals[row]);
        assert!(matches!(end.code, Some(1 | 2)), "{row}: {end:?}");
        planted += 1;
    }
    assert!(planted >= 200, "{planted}");
}

/// Sixteen balls with friction, whose steps often have one interval and the next one another length.
#[test]
fn steps_of_one_interval_are_verified() {
    let path = format!("{}/scenarios/billiard.toml", crate::ROOT);
    let directory = tempfile::tempdir().unwrap();
    let out = directory.path().join("out").to_str().unwrap().to_owned();
    let end = run(&["run", &path, "--steps", "200", "--accuracy", "1e-6", "--out", &out]);
    assert_eq!(end.code, Some(0), "{end:?}");
    let verified = run(&["verify", &out]);
    assert_eq!(verified.code, Some(0), "{verified:?}");
}

/// Steps that begin with a short interval, in which contacts keep their gap, are verified too. Balls in
/// the rack meet at nearly the same time, and the summary says so.
#[test]
fn a_run_with_located_impacts_is_verified() {
    let path = format!("{}/scenarios/billiard.toml", crate::ROOT);
    let directory = tempfile::tempdir().unwrap();
    let out = directory.path().join("out").to_str().unwrap().to_owned();
    let end = run(&["run", &path, "--steps", "150", "--impacts", "located", "--out", &out]);
    assert_eq!(end.code, Some(0), "{end:?}");
    assert!(end.stdout.contains("impacts are closer than the error"), "{end:?}");
    let file = fs::read_to_string(directory.path().join("out/run.json")).unwrap();
    assert!(file.contains("\"ambiguous\": ") && !file.contains("\"coarse\""), "{file}");
    let verified = run(&["verify", &out]);
    assert_eq!(verified.code, Some(0), "{verified:?}");
    let both = run(&["run", &path, "--impacts", "stepped", "--accuracy", "1e-5", "--out", &out]);
    assert_eq!(both.code, Some(2), "{both:?}");
    assert!(both.stderr.contains("leave out impacts, or the accuracy"), "{both:?}");
}

#[test]
fn a_run_with_an_accuracy_goes_on() {
    let (whole, directory) = run_scenario(SCENE, &[]);
    assert_eq!(whole.code, Some(0), "{whole:?}");
    let path = |name: &str| directory.path().join(name).to_str().unwrap().to_owned();
    let half = run(&["run", &path("test.toml"), "--steps", "50", "--out", &path("half")]);
    assert_eq!(half.code, Some(0), "{half:?}");
    let more = run(&["--continue", &path("half"), "--steps", "101"]);
    assert_eq!(more.code, Some(0), "{more:?}");
    let states = |name: &str| fs::read_to_string(path(&format!("{name}/states.csv"))).unwrap();
    assert_eq!(states("out"), states("half"));
}

#[test]
fn an_accuracy_needs_the_leapfrog_integrator() {
    let (end, directory) = run_scenario(SCENE, &["--integrator", "euler"]);
    end.assert_refused(2, &["accuracy", "leapfrog"]);
    assert!(!directory.path().join("out").exists());
    let (end, _directory) = run_scenario(SCENE, &["--accuracy", "0"]);
    end.assert_refused(2, &["accuracy", "1e-10 to 1"]);
}
