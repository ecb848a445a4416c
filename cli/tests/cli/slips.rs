//! Slips in names of files, fields and bodies: the error says what to write instead.

use super::support::{End, Table, tumble};
use std::fs;
use std::path::Path;

fn run_in(directory: &Path, args: &[&str]) -> End {
    tumble().args(args).current_dir(directory).output().unwrap().into()
}

const STACK: &str = "steps = 20\n[ground]\nfriction = 0.5\n[[bodies]]\nname = \"low\"\nbox = 0.2\nmass = 1.0\n\
     position = [0.0, 0.0, 0.1]\n[[bodies]]\nname = \"high\"\nbox = 0.2\nmass = 1.0\nposition = [0.0, 0.0, 0.3]\n";

#[test]
fn wrong_paths_are_answered_with_the_right_one() {
    let directory = tempfile::tempdir().unwrap();
    let here = directory.path();
    fs::write(here.join("stack.toml"), STACK).unwrap();
    assert_eq!(run_in(here, &["run", "stack.toml", "-q", "-o", "out"]).code, Some(0));
    for command in ["verify", "view", "gif", "plot"] {
        run_in(here, &[command, "none.csv"])
            .assert_refused(2, &["none.csv does not exist; give a table of a run"]);
        run_in(here, &[command, "out/state.csv"])
            .assert_refused(2, &["out/state.csv does not exist; give out/states.csv"]);
        fs::create_dir_all(here.join("empty")).unwrap();
        run_in(here, &[command, "empty"])
            .assert_refused(2, &["empty is a directory, not a file; give a table of a run"]);
    }
    let page = run_in(here, &["view", "out/states.csv", "-o", "pages/p.html"]);
    assert_eq!(page.code, Some(0), "{page:?}");
    assert!(page.stdout.contains("wrote pages/p.html") && here.join("pages/p.html").is_file());
    run_in(here, &["view", "out/states.csv", "-o", "p.htm"])
        .assert_refused(2, &["--out p.htm: a file name that ends in .html or a directory"]);
    run_in(here, &["run", "--continue", "out/state.bin", "--steps", "30"])
        .assert_refused(2, &["--continue: out/state.bin is a file; give its directory, out"]);
    run_in(here, &["rnu", "stack.toml"]).assert_refused(2, &["did you mean `run`?"]);
    let end = run_in(here, &["new", "sub/dir/x"]);
    end.assert_refused(2, &["sub/dir/x.toml", "there is no directory sub/dir; create it first"]);
    assert!(!end.stderr.contains(".tmp"), "{end:?}");
}

#[test]
fn misspelt_names_of_bodies_and_joints_get_the_nearest_one() {
    let directory = tempfile::tempdir().unwrap();
    let here = directory.path();
    let hinge = "[[joints]]\nname = \"hinge\"\ntype = \"revolute\"\nbodies = [\"high\"]\naxis = [0, 0, 1]\n\
                 anchor = [0, 0, 0.3]\n";
    for (tables, word, name) in [
        ("[[friction]]\nbetween = [\"hihg\", \"low\"]\ncoefficient = 0.1\n", "hihg", "high"),
        ("[[surfaces]]\nof = \"grond\"\nvelocity = [1, 0, 0]\n", "grond", "ground"),
        ("[[motors]]\njoint = \"hnige\"\nspeed = 1.0\nmax_force = 1.0\n", "hnige", "hinge"),
    ] {
        fs::write(here.join("scene.toml"), format!("{STACK}{hinge}{tables}")).unwrap();
        let printed = format!("\"{word}\"; did you mean `{name}`?");
        run_in(here, &["check", "scene.toml"]).assert_refused(2, &[&printed]);
    }
}

#[test]
fn a_shape_of_the_wrong_form_is_answered_with_its_form() {
    let directory = tempfile::tempdir().unwrap();
    let here = directory.path();
    let capsule = "bodies[1].capsule: a capsule is { length = …, radius = … }, m";
    for (shape, printed) in [
        ("capsule = [0.05, 0.3]", capsule),
        ("capsule = 0.1", capsule),
        ("cylinder = [0.05, 0.3]", "cylinder: a cylinder is { length = …, radius = … }, m"),
        ("cone = [0.05, 0.3]", "cone: a cone is { height = …, radius = … }, m"),
        ("ellipsoid = 0.1", "ellipsoid: three half axes [x, y, z], m, are needed"),
        ("ellipsoid = [0.1, 0.2]", "ellipsoid: three half axes [x, y, z], m, are needed"),
    ] {
        let text = format!("{STACK}[[bodies]]\n{shape}\nmass = 1.0\nposition = [0, 0, 1]\n");
        let text = text.replacen(
            "[[bodies]]\nname = \"high\"\nbox = 0.2\nmass = 1.0\nposition = [0.0, 0.0, 0.3]\n",
            "",
            1,
        );
        fs::write(here.join("scene.toml"), text).unwrap();
        run_in(here, &["check", "scene.toml"]).assert_refused(2, &[printed]);
    }
    let bare = STACK.replace("[ground]\nfriction = 0.5\n", "ground = false\n");
    fs::write(here.join("scene.toml"), bare).unwrap();
    run_in(here, &["check", "scene.toml"])
        .assert_refused(2, &["ground: no ground is `[ground]` with `none = true`"]);
}

/// The reactions of a fast pendulum of two rods make energy in steps of 20 ms, up to 2.2 J. Such
/// steps are taken in shorter ones. The summary has the largest gain of all steps, which no energy in
/// the table exceeds, and its place.
#[test]
fn largest_energy_gain_is_reported() {
    let rod = |name: &str, y: f64, spin: f64| {
        format!(
            "[[bodies]]\nname = \"{name}\"\nbox = [0.1, 0.5, 0.1]\nmass = 1.0\nposition = [0, {y}, 2]\n\
             spin = [{spin}, 0, 0]\n"
        )
    };
    let hinge = |bodies: &str, y: f64| {
        format!(
            "[[joints]]\ntype = \"revolute\"\nbodies = [{bodies}]\naxis = [1, 0, 0]\nanchor = [0, {y}, 2]\n"
        )
    };
    let text = [
        "steps = 120\ntime_step = 0.02\n[ground]\nnone = true\nfriction = 0.5\n".to_owned(),
        rod("a", 0.0, 0.0) + &rod("b", 0.5, 25.0),
        hinge("\"a\"", -0.25) + &hinge("\"a\", \"b\"", 0.25),
    ];
    let directory = tempfile::tempdir().unwrap();
    let here = directory.path();
    fs::write(here.join("scene.toml"), text.concat()).unwrap();
    let end = run_in(here, &["run", "scene.toml"]);
    let line = end.stdout.lines().find(|line| line.contains("energy gain")).unwrap_or_default();
    let number = |before: &str| -> f64 {
        let (_, rest) = line.split_once(before).unwrap_or_else(|| panic!("{end:?}"));
        rest.split_whitespace().next().unwrap().parse().unwrap()
    };
    assert!(line.ends_with("(a and what it touches)"), "{line}");
    let (gain, place) = (number("largest "), number("J at k = "));
    let steps = Table::parse(&fs::read_to_string(here.join("out/steps.csv")).unwrap());
    // Rows of whole steps: within a step, the length of intervals changes energies.
    let interval = steps.numbers("interval");
    let starts: Vec<_> = (0..steps.rows.len()).filter(|row| interval[*row] == 0.0).collect();
    let status = |k: usize| steps.rows[starts[k]][steps.column("status")].as_str();
    let energies = steps.numbers("energy_J");
    let energy: Vec<_> = starts.iter().map(|row| energies[*row]).collect();
    let rises = energy.windows(2).map(|ends| ends[1] - ends[0]);
    let most = rises.fold(0.0, f64::max);
    // Two digits are printed.
    assert!(gain > 1e-3 && gain < 0.1 && most <= 1.1 * gain, "{line} {most:e}");
    assert!(["converged", "substepped"].contains(&status(place as usize)), "{line}");
    let counted = (0..energy.len()).filter(|k| status(*k) == "substepped").count();
    assert!(counted > 10 && end.stdout.contains(&format!("substepped {counted}")), "{end:?}");
}
