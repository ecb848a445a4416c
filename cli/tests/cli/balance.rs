//! Energy balance: the terms in steps.csv add up to the change of energy and agree with closed
//! forms.

use super::scenario::run_scenario;
use super::support::{Table, run};
use crate::ROOT;
use std::fs;
use std::path::Path;

/// Largest residual of the balance, relative to its largest term.
const CLOSES: f64 = 1e-10;
/// Energy below which a body counts as resting [J].
const REST: f64 = 1e-20;

const TERMS: [&str; 6] =
    ["loads_J", "drives_J", "reactions_J", "impacts_J", "friction_J", "discretisation_J"];

struct Balance {
    energy: Vec<f64>,
    terms: [Vec<f64>; 6],
    status: Vec<String>,
}

impl Balance {
    fn read(out: &Path) -> Self {
        let table = Table::parse(&fs::read_to_string(out.join("steps.csv")).unwrap());
        let column = table.column("status");
        let status = table.rows.iter().map(|row| row[column].clone()).collect();
        Self {
            energy: table.numbers("energy_J"),
            terms: TERMS.map(|name| table.numbers(name)),
            status,
        }
    }

    /// Sum of a term over the run.
    fn total(&self, name: &str) -> f64 {
        let place = TERMS.iter().position(|term| *term == name).unwrap();
        self.terms[place].iter().sum()
    }

    fn assert_closed(&self, name: &str) {
        for k in 0..self.energy.len() - 1 {
            if self.status[k] == "failed" {
                continue;
            }
            let terms = self.terms.each_ref().map(|term| term[k]);
            let (before, after) = (self.energy[k], self.energy[k + 1]);
            let left = after - before - terms.iter().sum::<f64>();
            let largest = terms.iter().fold(before.abs().max(after.abs()), |a, b| a.max(b.abs()));
            assert!(
                left.abs() <= CLOSES * largest.max(REST),
                "{name}, k = {k}: {left:e} of {largest:e}"
            );
        }
    }
}

/// The balance closes in scenes with falls, sliding, impacts, bounces, motors, driven bodies, loops
/// and gears.
#[test]
fn the_terms_add_up_to_the_change_of_energy() {
    for name in [
        "billiard",
        "card-house",
        "chain",
        "double-pendulum",
        "four-bar",
        "marbles",
        "pusher",
        "quadruped",
        "slider-crank",
    ] {
        let scene = format!("{ROOT}/scenarios/{name}.toml");
        let directory = tempfile::tempdir().unwrap();
        let out = directory.path().to_str().unwrap();
        let end = run(&[&scene, "--steps", "400", "--quiet", "--out", out]);
        assert!(matches!(end.code, Some(0 | 3)), "{name}: {end:?}");
        Balance::read(directory.path()).assert_closed(name);
    }
}

/// The balance closes from interval to interval: with an accuracy, with located impacts, and where steps are
/// taken again in shorter intervals (`cone31`).
#[test]
fn energies_of_intervals_add_up() {
    for (name, flags) in [
        ("billiard", &["--accuracy", "1e-4"][..]),
        ("billiard", &["--impacts", "located"]),
        ("four-bar", &["--accuracy", "1e-4"]),
        ("marbles", &["--impacts", "located"]),
        ("marbles", &["--accuracy", "1e-3", "--every", "5"]),
        ("../cli/tests/cli/hard/cone31", &[]),
    ] {
        let scene = format!("{ROOT}/scenarios/{name}.toml");
        let directory = tempfile::tempdir().unwrap();
        let out = directory.path().to_str().unwrap();
        let args = ["run", &scene, "--steps", "150", "--quiet", "--out", out];
        let end = run(&[&args[..], flags].concat());
        assert!(matches!(end.code, Some(0 | 3)), "{name}: {end:?}");
        let balance = Balance::read(directory.path());
        assert!(balance.energy.len() > if flags.len() > 2 { 30 } else { 151 }, "{name} {flags:?}");
        balance.assert_closed(name);
    }
}

/// An elastic ball under an accuracy keeps its energy m g z in every row: 5.886 J from 0.6 m.
#[test]
fn rows_of_divided_steps_have_the_energy_of_their_time() {
    let text = "steps = 101\ntime_step = 0.01\naccuracy = 1e-6\n[ground]\nfriction = 0.0\n\
                restitution = 1.0\n[[bodies]]\nsphere = 0.1\nmass = 1.0\nposition = [0, 0, 0.6]\n\
                restitution = 1.0\n";
    let (end, directory) = run_scenario(text, &[]);
    assert_eq!(end.code, Some(0), "{end:?}");
    for energy in Balance::read(&directory.path().join("out")).energy {
        assert!((energy - 5.886).abs() < 2e-6, "{energy}");
    }
}

/// Rows of a run that omits steps have the energy terms of all steps up to the next row, and the most
/// serious mark of these steps.
#[test]
fn energy_balance_includes_omitted_rows() {
    for (name, flags) in [
        ("four-bar", ["--every", "7"]),
        ("marbles", ["--every", "8"]),
        ("double-pendulum", ["--substeps", "3"]),
    ] {
        let scene = format!("{ROOT}/scenarios/{name}.toml");
        let directory = tempfile::tempdir().unwrap();
        let out = directory.path().to_str().unwrap();
        let args = [&scene, "--steps", "200", "--quiet", "--out", out];
        let end = run(&[&args[..], &flags[..]].concat());
        assert!(matches!(end.code, Some(0 | 3)), "{name}: {end:?}");
        Balance::read(directory.path()).assert_closed(name);
    }
}

/// A baton that turns by 1.2 rad in a step of 10 ms. Of its steps, those on the ground are marked.
#[test]
fn marks_of_substeps_reach_their_row() {
    let text = |steps: u32, h: f64| {
        format!(
            "steps = {steps}\ntime_step = {h}\n[ground]\nfriction = 0.6\n[[bodies]]\n\
             capsule = {{ length = 0.5, radius = 0.01 }}\nmass = 0.2\nposition = [0, 0, 0.45]\n\
             spin = [0, 160, 0]\n"
        )
    };
    let status = |text: &str, flags: &[&str]| {
        let (end, directory) = run_scenario(text, flags);
        assert!(matches!(end.code, Some(0 | 3)), "{end:?}");
        Balance::read(&directory.path().join("out")).status
    };
    let all = status(&text(101, 0.01), &[]);
    let rows = status(&text(51, 0.02), &["--substeps", "2"]);
    let is_marked = |status: &String| ["wild", "substepped", "failed"].contains(&status.as_str());
    let mut hidden = 0;
    for (row, pair) in rows.iter().zip(all.chunks(2)) {
        assert_eq!(is_marked(row), pair.iter().any(is_marked), "{row} {pair:?}");
        hidden += u32::from(is_marked(row) && !is_marked(&pair[0]));
    }
    assert!(hidden > 0, "{rows:?}");
}

fn balance(text: &str) -> Balance {
    let (end, directory) = run_scenario(text, &[]);
    assert_eq!(end.code, Some(0), "{end:?}");
    let balance = Balance::read(&directory.path().join("out"));
    balance.assert_closed("scene");
    balance
}

/// Friction (μ = 0.4) takes ½ m v² = 9 J from a sliding block of 2 kg with 3 m/s. No other term
/// contributes.
#[test]
fn friction_takes_the_energy_of_what_slides() {
    let of = balance(
        "steps = 800\ntime_step = 0.001\ngravity = 10\n[ground]\nfriction = 0.4\n[[bodies]]\nbox = 0.2\nmass = 2.0\n\
         position = [0, 0, 0.1]\nvelocity = [3, 0, 0]\n",
    );
    assert!((of.total("friction_J") + 9.0).abs() < 1e-9, "{}", of.total("friction_J"));
    assert!(of.total("impacts_J").abs() < 1e-9, "{}", of.total("impacts_J"));
}

/// A ball of 1 kg lands at 2 m/s without bouncing. The impact takes ½ m v² = 2 J.
#[test]
fn an_impact_takes_the_energy_of_what_lands() {
    let of = balance(
        "steps = 400\ntime_step = 0.001\ngravity = 0\n[ground]\nfriction = 0.0\n[[bodies]]\nsphere = 0.1\nmass = 1.0\n\
         position = [0, 0, 0.3]\nvelocity = [0, 0, -2]\n",
    );
    assert!((of.total("impacts_J") + 2.0).abs() < 1e-9, "{}", of.total("impacts_J"));
}

/// A motor torque of 0.8 N m on a weightless hinge does 0.8 J of work a radian. The first step from
/// rest must not get the status `wild`.
#[test]
fn a_motor_does_the_work_of_its_torque() {
    let rod = "steps = 101\ntime_step = 0.01\ngravity = 0\n[ground]\nnone = true\nfriction = 0.5\n[[bodies]]\nname = \"rod\"\n\
               box = [0.04, 0.04, 0.5]\nmass = 1.0\nposition = [0, 0, 0.75]\n[[joints]]\nname = \"pivot\"\n\
               type = \"revolute\"\nbodies = \"rod\"\nanchor = [0, 0, 1]\naxis = [0, 1, 0]\nforce = 0.8\n";
    let of = balance(rod);
    assert!(!of.status.contains(&"wild".to_owned()), "{:?}", of.status);
    let of = balance(&rod.replace("time_step = 0.01", "time_step = 0.001").replace("101", "301"));
    // Work ½ τ² t²/I with the moment of inertia about the hinge, 1/12 (0.5² + 0.04²) + 0.25².
    let inertia = (0.25 + 0.0016) / 12.0 + 0.0625;
    let work = 0.5 * 0.64 * 0.09 / inertia;
    let found = of.total("drives_J");
    assert!((found - work).abs() < 5e-3 * work, "{found} of {work}");
}
