//! Drawn scenes in which shapes, laws, joints, driven bodies, terrain, surfaces and modes meet.

use super::pairs::{Draws, SHAPES, shape};
use super::support::run;
use rand_mt::Mt;
use std::fmt::Write;
use std::fs;

/// Scene with up to five bodies over a ground or terrain, and its number of rows.
fn scene(draws: &mut Draws) -> (String, String) {
    fn one<'a>(draws: &mut Draws, of: &[&'a str]) -> &'a str {
        of[(draws.between(0.0, 0.999) * of.len() as f64) as usize]
    }
    let steps = one(draws, &["40", "60"]).to_owned();
    let mut text =
        format!("steps = {steps}\ntime_step = {}\n", one(draws, &["0.002", "0.005", "0.01"]));
    text += one(
        draws,
        &[
            "integrator = \"euler\"\n",
            "",
            "",
            "impacts = \"located\"\n",
            "accuracy = 1e-3\n",
            "accuracy = 1e-5\n",
        ],
    );
    let _ = write!(text, "[ground]\nfriction = {}\n", one(draws, &["0", "0.2", "1.0"]));
    for laws in [
        ["static_friction = 1.2", ""],
        ["rolling_friction = 0.01", ""],
        ["torsional_friction = 0.01", ""],
        ["adhesion = 5", ""],
        ["restitution = 0.8", "restitution = 1.0"],
        ["slope = 15", "slope = 30"],
    ] {
        let _ = writeln!(text, "{}", one(draws, &[laws[0], laws[1], "", ""]));
    }
    let bodies = 1 + (draws.between(0.0, 4.999) as usize);
    for body in 0..bodies {
        let shape = shape(one(draws, &SHAPES), draws);
        let place = [0.6 * (body % 3) as f64, 0.6 * (body / 3) as f64, draws.between(0.3, 0.5)];
        let (attitude, spin) = (draws.list(4, 1.0), draws.list(3, 8.0));
        let velocity =
            [draws.between(-2.0, 2.0), draws.between(-2.0, 2.0), draws.between(-2.0, 0.0)];
        let mass = one(draws, &["0.1", "1.0", "10.0"]);
        let _ = write!(
            text,
            "[[bodies]]\nname = \"b{body}\"\n{shape}\nmass = {mass}\nframe = \"ground\"\nposition = {place:?}\n\
             attitude = {attitude:?}\nvelocity = {velocity:?}\nspin = {spin:?}\n"
        );
    }
    if bodies > 1 {
        let kinds = ["revolute", "prismatic", "spherical", "ball", "fixed", "", "", ""];
        let kind = one(draws, &kinds);
        let more = match kind {
            "ball" => "axis = [0, 1, 0]\ncone = 0.4\n",
            "revolute" => "axis = [0, 1, 0]\nlimits = [-0.1, 0.1]\nfriction = 0.05\n",
            "prismatic" => {
                "axis = [0, 1, 0]\n[[motors]]\njoint = \"j\"\nspeed = 2.0\nmax_force = 3.0\n"
            }
            _ => "",
        };
        if !kind.is_empty() {
            let _ = write!(
                text,
                "[[joints]]\nname = \"j\"\ntype = \"{kind}\"\nbodies = [\"b1\", \"b0\"]\nanchor = [0.3, 0, 0.4]\n{more}"
            );
        }
    }
    text += one(
        draws,
        &[
            "[[fixed]]\nbox = [0.4, 0.4, 0.1]\nposition = [0.3, 0.2, 0.05]\nframe = \"ground\"\n",
            "[[terrain]]\nheights = [[0.02, 0, 0.03], [0, 0.03, 0], [0.01, 0, 0.02]]\nspacing = 0.8\n",
            "",
            "",
        ],
    );
    text += one(
        draws,
        &[
            "[[surfaces]]\nof = \"ground\"\nvelocity = [0.8, 0, 0]\n",
            "[[surfaces]]\nof = \"ground\"\nspin = [0, 0, 2]\ncentre = [0.5, 0, 0]\n",
            "[[surfaces]]\nof = \"ground\"\naxis = [1, 0, 0]\nfactor = 0.1\n",
            "",
            "",
            "",
        ],
    );
    let motion = one(
        draws,
        &[
            "velocity = [0.5, 0, 0]",
            "spin = [0, 0, 3]",
            "times = [0, 0.05, 0.1]\npositions = [[3, 0, 1], [3.02, 0, 1], [3, 0, 1.02]]",
            "",
            "",
            "",
        ],
    );
    if !motion.is_empty() {
        let _ = write!(
            text,
            "[[bodies]]\nname = \"tray\"\nbox = [0.5, 0.5, 0.05]\nmass = 1\nposition = [3, 0, 1]\n[[bodies]]\nname = \
             \"cup\"\nbox = 0.1\nmass = 0.3\nposition = [3, 0.05, 1.075]\n[[driven]]\nbody = \"tray\"\n{motion}\n"
        );
    }
    (text, steps)
}

/// Checks drawn scenes: `verify` accepts what `run` solved, a run in two parts has the bytes of the whole one, and
/// few runs have a step that is failed or wild: 5 of these 142 had one on 2026-12-01.
#[test]
#[ignore = "minutes"]
fn laws_and_modes_meet() {
    const RUNS: u32 = 150;
    let mut draws = Draws(Mt::new(2026));
    let (mut unsolved, mut refused, mut other) = (Vec::new(), 0, Vec::new());
    for number in 0..RUNS {
        let (text, steps) = scene(&mut draws);
        let folder = tempfile::tempdir().unwrap();
        let path = |name: &str| folder.path().join(name).to_str().unwrap().to_owned();
        fs::write(path("scene.toml"), &text).unwrap();
        let end = run(&["run", &path("scene.toml"), "--out", &path("whole"), "--quiet"]);
        match end.code {
            // Bodies overlap at the start.
            Some(2) if end.stderr.contains("overlap") || end.stderr.contains("below") => {
                refused += 1
            }
            Some(0) => {
                let end = run(&["verify", &path("whole")]);
                assert_eq!(end.code, Some(0), "{number}: {end:?}\n{text}");
            }
            Some(3) => unsolved.push(number),
            _ => panic!("{number}: {end:?}\n{text}"),
        }
        if end.code == Some(2) {
            continue;
        }
        let half =
            ["run", &path("scene.toml"), "--out", &path("parts"), "--quiet", "--steps", "25"];
        run(&half);
        run(&["run", "--continue", &path("parts"), "--quiet", "--steps", &steps]);
        let same = |file: &str| {
            fs::read(path(&format!("whole/{file}"))).ok()
                == fs::read(path(&format!("parts/{file}"))).ok()
        };
        if !["states.csv", "contacts.csv", "steps.csv"].into_iter().all(same) {
            other.push(number);
        }
    }
    println!("{unsolved:?} {refused} {other:?}");
    assert!(
        refused < RUNS / 5 && unsolved.len() <= 10 && other.is_empty(),
        "{unsolved:?} {refused} {other:?}"
    );
}
