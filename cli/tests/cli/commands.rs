//! The commands `run`, `new`, `check` and `completions`, short flags and suggestions.

use super::support::{End, Table, everything_in, run, tumble};
use std::collections::BTreeSet;
use std::fs;
use std::path::Path;

fn run_in(directory: &Path, args: &[&str]) -> End {
    tumble().args(args).current_dir(directory).output().unwrap().into()
}

#[test]
fn a_new_scene_is_valid_and_runs_without_a_failed_step() {
    let directory = tempfile::tempdir().unwrap();
    let here = directory.path();
    let made = run_in(here, &["new", "tower"]);
    assert_eq!((made.code, made.stderr.as_str()), (Some(0), ""));
    assert!(made.stdout.contains("tumble run tower.toml"), "{}", made.stdout);
    let checked = run_in(here, &["check", "tower.toml"]);
    assert_eq!((checked.code, checked.stderr.as_str()), (Some(0), ""));
    for line in ["tower is valid", "bodies       6, 7", "overlaps     none", "no objection"] {
        assert!(checked.stdout.contains(line), "{line}: {}", checked.stdout);
    }
    assert_eq!(everything_in(here).len(), 1, "check writes nothing");
    let ran = run_in(here, &["run", "tower.toml", "-s", "300", "-o", "far"]);
    assert_eq!((ran.code, ran.stderr.as_str()), (Some(0), ""));
    assert!(ran.stdout.contains("failed       0"), "{}", ran.stdout);
    let quiet = run_in(here, &["tower.toml", "-q", "-s", "300", "-o", "near"]);
    assert_eq!((quiet.code, quiet.stdout.as_str()), (Some(0), ""));
    let [far, near] =
        ["far", "near"].map(|out| fs::read(here.join(out).join("states.csv")).unwrap());
    assert!(far == near, "the verb may be left out");
}

#[test]
fn new_refuses_to_replace_a_file_and_needs_a_name() {
    let directory = tempfile::tempdir().unwrap();
    let here = directory.path();
    fs::write(here.join("mine.toml"), "# mine").unwrap();
    run_in(here, &["new", "mine"]).assert_refused(2, &["mine.toml", "exists", "another name"]);
    assert_eq!(fs::read_to_string(here.join("mine.toml")).unwrap(), "# mine");
    run_in(here, &["new", "robot.urdf"]).assert_refused(2, &["robot.urdf", ".toml"]);
    run_in(here, &["new", "no/such/place"]).assert_refused(2, &["no/such/place.toml"]);
    assert_eq!(everything_in(here).len(), 1);
}

#[test]
fn a_check_reports_overlaps_redundant_joints_and_a_long_time_step() {
    let directory = tempfile::tempdir().unwrap();
    let here = directory.path();
    let scene = |name: &str, text: &str| fs::write(here.join(name), text).unwrap();
    let boxes = "[ground]\nfriction = 0.5\n[[bodies]]\nname = \"low\"\nbox = 0.2\nmass = 1.0\n\
                 position = [0.0, 0.0, 0.1]\n[[bodies]]\nname = \"high\"\nbox = 0.2\nmass = 2.0\n";
    scene("touching.toml", &format!("{boxes}position = [0.0, 0.0, 0.2999]\n"));
    let end = run_in(here, &["check", "touching.toml"]);
    assert_eq!(end.code, Some(0), "{end:?}");
    assert!(end.stdout.contains("deepest 1.0e-4 m between low and high"), "{}", end.stdout);
    scene("deep.toml", &format!("{boxes}position = [0.0, 0.0, 0.25]\n"));
    run_in(here, &["check", "deep.toml"]).assert_refused(2, &["overlap", "low", "high"]);
    scene(
        "spinning.toml",
        &format!("{boxes}position = [0.0, 0.0, 3.0]\nspin = [200.0, 0.0, 0.0]\n"),
    );
    let end = run_in(here, &["check", "spinning.toml"]);
    // 200 rad/s × 2 ms = 0.4 rad; 0.3 rad take 1.5 ms.
    assert!(end.stdout.contains("turns by 0.40 rad in a step; use at most 1.5e-3 s"), "{end:?}");
    let end = run_in(here, &["check", "spinning.toml", "--dt", "5e-4"]);
    assert!(end.stdout.contains("no objection"), "{end:?}");
    // Two hinges with one axis hold five directions twice.
    let hinge = |z: f64| {
        format!(
            "[[joints]]\ntype = \"revolute\"\nbodies = [\"low\"]\naxis = [0, 0, 1]\nanchor = \
             [0.0, 0.0, {z}]\n"
        )
    };
    scene("door.toml", &format!("{boxes}position = [0.0, 0.0, 3.0]\n{}{}", hinge(0.1), hinge(0.2)));
    let end = run_in(here, &["check", "door.toml"]);
    assert!(end.stdout.contains("redundant constraints"), "{end:?}");
}

#[test]
fn misspelt_words_are_answered_with_the_nearest_one() {
    for (args, hint) in [
        (&["verfy", "out/states.csv"][..], "`verify`"),
        (&["vew"], "`view`"),
        (&["run", "--stps", "5"], "`--steps`"),
        (&["--solvr", "native"], "`--solver`"),
        (&["run", "--solver", "nativ"], "`native`"),
        (&["verify", "a.csv", "--wrst", "3"], "`--worst`"),
    ] {
        run(args).assert_refused(2, &["did you mean", hint]);
    }
    run(&["xyzzy"]).assert_refused(2, &["xyzzy", "neither a command nor a file"]);
    run(&["audit"])
        .assert_refused(2, &["tumble audit", "Python package", "python -m tumble audit"]);
    run(&["run", "--gravity", "0", "0", "1"]).assert_refused(2, &["write --gravity 0,0,1"]);
    run(&["--gravity", "0", "0", "-5"]).assert_refused(2, &["write --gravity 0,0,-5"]);
    run(&["--gravity", "0,", "0,", "-5"]).assert_refused(2, &["write --gravity 0,0,-5"]);
}

/// A misspelt field of a scene gets the nearest name. A name in another simulator gets tumble's.
#[test]
fn unknown_fields_of_a_scene_are_answered_with_the_nearest_name() {
    let directory = tempfile::tempdir().unwrap();
    let valid = "steps = 10\ntime_step = 0.002\n[ground]\nfriction = 0.5\n[[bodies]]\nname = \"a\"\nbox = 0.2\n\
                 mass = 1.0\nposition = [0, 0, 1]\nattitude = [1, 0, 0, 0]\nvelocity = [0, 0, 0]\n\
                 spin = [0, 0, 0]\ncolour = \"red\"\n[[joints]]\ntype = \"revolute\"\nbodies = [\"a\"]\n\
                 axis = [0, 0, 1]\nanchor = [0, 0, 1]\n";
    let check = |text: &str| {
        fs::write(directory.path().join("scene.toml"), text).unwrap();
        run_in(directory.path(), &["check", "scene.toml"])
    };
    let end = check(valid);
    assert_eq!(end.code, Some(0), "{end:?}");
    for (ours, other) in [
        ("friction", "frction"),
        ("friction", "mu"),
        ("steps", "stpes"),
        ("time_step", "dt"),
        ("bodies", "bodis"),
        ("box", "size"),
        ("mass", "weight"),
        ("position", "pos"),
        ("attitude", "quat"),
        ("velocity", "vel"),
        ("spin", "angvel"),
        ("colour", "color"),
        ("revolute", "hinge"),
        ("anchor", "ancor"),
    ] {
        let printed = [format!("`{other}`; did you mean `{ours}`? Expected one of")];
        check(&valid.replacen(ours, other, 1))
            .assert_refused(2, &printed.each_ref().map(String::as_str));
    }
    // No name is similar to this one.
    let end = check(&valid.replace("friction", "qqq"));
    end.assert_refused(2, &["unknown field `qqq`, expected one of `friction`"]);
    assert!(!end.stderr.contains("did you mean"), "{end:?}");
}

#[test]
fn the_bare_program_prints_its_help() {
    let directory = tempfile::tempdir().unwrap();
    let end = run_in(directory.path(), &[]);
    assert_eq!((end.code, end.stderr.as_str()), (Some(0), ""));
    assert!(end.stdout.contains("Usage:") && end.stdout.contains("Examples:"), "{}", end.stdout);
    assert!(everything_in(directory.path()).is_empty());
    assert!(!end.stdout.contains('\u{1b}'), "colours are for terminals");
}

#[test]
fn completion_scripts_name_every_command() {
    for shell in ["bash", "zsh", "fish"] {
        let end = run(&["completions", shell]);
        assert_eq!((end.code, end.stderr.as_str()), (Some(0), ""), "{shell}");
        for word in ["run", "verify", "completions", "overwrite"] {
            assert!(end.stdout.contains(word), "{shell}: {word}");
        }
    }
    run(&["completions", "cmd"]).assert_refused(2, &["cmd", "bash"]);
}

#[test]
fn upward_gravity_is_reported() {
    let directory = tempfile::tempdir().unwrap();
    let here = directory.path();
    let end = run_in(here, &["--solver", "native", "-s", "5", "--gravity=-9.81", "-o", "up"]);
    assert!(end.stdout.contains("gravity points away from the ground"), "{end:?}");
    let end = run_in(here, &["--solver", "native", "-s", "5", "-o", "down"]);
    assert!(!end.stdout.contains("gravity points"), "{end:?}");
}

#[test]
fn a_directory_of_a_run_stands_for_its_states() {
    let directory = tempfile::tempdir().unwrap();
    let here = directory.path();
    let end = run_in(here, &["--solver", "native", "-s", "5", "-o", "down"]);
    assert_eq!(end.code, Some(0), "{end:?}");
    for command in ["verify", "view", "plot", "gif"] {
        let end = run_in(here, &[command, "down"]);
        assert_eq!(end.code, Some(0), "{command}: {end:?}");
    }
    run_in(here, &["verify", "."]).assert_refused(2, &["is a directory", "table of a run"]);
}

/// A pendulum without contacts and a box that lands: the summary counts the steps with a force in
/// contacts.csv.
#[test]
fn steps_in_contact_are_those_with_a_contact_force() {
    let directory = tempfile::tempdir().unwrap();
    let here = directory.path();
    let scene = "steps = 101\n[ground]\nfriction = 0.5\n[[bodies]]\nname = \"arm\"\nbox = 0.2\nmass = 1.0\n\
                 position = [0, 0, 2]\n[[joints]]\ntype = \"revolute\"\nbodies = [\"arm\"]\naxis = [0, 1, 0]\n\
                 anchor = [0.5, 0, 2]\n";
    let end = |text: &str| {
        fs::write(here.join("scene.toml"), text).unwrap();
        run_in(here, &["run", "scene.toml"])
    };
    let swings = end(scene);
    let line = "100 (0 in contact, 100 solved without a contact force, 0 in free flight)";
    assert!(swings.stdout.contains(line), "{}", swings.stdout);
    let falls = end(&format!(
        "{scene}[[bodies]]\nbox = 0.2\nmass = 1.0\nposition = [2, 0, 0.2]\nattitude = [1, 0.1, 0.2, 0]\n"
    ));
    let contacts = Table::parse(&fs::read_to_string(here.join("out/contacts.csv")).unwrap());
    let contacts = contacts.of_each_step();
    let [k, x, y, z] =
        ["k", "force_x_N", "force_y_N", "force_z_N"].map(|name| contacts.numbers(name));
    let carries = |row: &usize| [&x, &y, &z].iter().any(|force| force[*row] != 0.0);
    let steps: BTreeSet<_> = (0..k.len()).filter(carries).map(|row| k[row] as u64).collect();
    assert!(steps.len() > 10 && steps.len() < 90, "{}", steps.len());
    assert!(
        falls.stdout.contains(&format!("100 ({} in contact,", steps.len())),
        "{}",
        falls.stdout
    );
}

/// A baton of 120 rad/s turns by 2.4 rad in a step of 20 ms.
#[test]
fn cause_of_an_unphysical_step_is_reported() {
    let directory = tempfile::tempdir().unwrap();
    let text = "steps = 20\ntime_step = 0.02\n[ground]\nfriction = 0.6\n[[bodies]]\nname = \"baton\"\n\
                capsule = { length = 0.5, radius = 0.01 }\nmass = 0.2\nposition = [0, 0, 0.4]\n\
                spin = [0, 120, 0]\n";
    fs::write(directory.path().join("scene.toml"), text).unwrap();
    for command in ["run", "check"] {
        let end = run_in(directory.path(), &[command, "scene.toml"]);
        assert!(end.stdout.contains("baton turns by"), "{end:?}");
        assert!(end.stdout.contains("rad, more than 1 rad"), "{end:?}");
    }
    // The step with the largest gain and the number of these steps come from the table.
    let ran = run_in(directory.path(), &["run", "scene.toml"]);
    let count = |text: &str| -> u32 {
        let (_, rest) = text.split_once("wild").unwrap();
        rest.trim_start_matches(|c: char| !c.is_ascii_digit())
            .split(|c: char| !c.is_ascii_digit())
            .next()
            .unwrap()
            .parse()
            .unwrap()
    };
    let steps = Table::parse(&fs::read_to_string(directory.path().join("out/steps.csv")).unwrap());
    let status = steps.column("status");
    let wild = steps.rows.iter().filter(|row| row[status] == "wild").count() as u32;
    assert!(wild > 1 && count(&ran.stdout) == wild, "{ran:?}");
    let verified = run_in(directory.path(), &["verify", "out/states.csv"]);
    assert!(
        verified.stdout.contains(&format!("status `wild`, solved but unphysical: {wild}\n")),
        "{verified:?}"
    );
}

#[test]
fn a_check_ends_with_3_if_a_first_step_does_not_converge() {
    // A cube that lands with one iteration of Ipopt, whose failure is only recorded.
    let ipopt = ["--solver", "ipopt", "--max-iter", "1", "--on-failure", "record"];
    let start = ["--set", "start.position=0,0,1.0", "--set", "start.attitude=1,0,0,0"];
    let end = run(&[&["check"][..], &ipopt, &start].concat());
    assert_eq!(end.code, Some(3), "{end:?}");
    assert!(end.stdout.contains("10 not solved"), "{end:?}");
    let end = run(&[&["check", "--solver", "native"][..], &start].concat());
    assert_eq!(end.code, Some(0), "{end:?}");
}

#[test]
fn a_check_shows_masses_of_any_size() {
    let directory = tempfile::tempdir().unwrap();
    let text = "[ground]\nfriction = 0.5\n[[bodies]]\nsphere = 1e-4\nmass = 1e-7\nposition = [0, 0, 1e-4]\n";
    fs::write(directory.path().join("grain.toml"), text).unwrap();
    let end = run_in(directory.path(), &["check", "grain.toml"]);
    assert!(end.stdout.contains("bodies       1, 1e-7 kg in all"), "{end:?}");
}

#[test]
fn only_commands_are_reported_as_misplaced() {
    let late = ["is before the command verify", "tumble verify"];
    run(&["--quiet", "verify", "states.csv"]).assert_refused(2, &late);
    // Here the words are values.
    for args in [
        &["--out", "plan", "--scene", "drop", "x.toml"][..],
        &["--out", "run", "--solvr", "native"],
    ] {
        let end = run(args);
        end.assert_refused(2, &["--s"]);
        assert!(!end.stderr.contains("stands before"), "{end:?}");
    }
}

#[test]
fn an_inline_table_written_as_a_list_is_refused() {
    let directory = tempfile::tempdir().unwrap();
    let scene = |field: &str| {
        let shape = if field.starts_with("capsule") { "" } else { "box = 0.2\n" };
        format!(
            "[ground]\nfriction = 0.5\n[[bodies]]\n{shape}mass = 1.0\nposition = [0, 0, 1]\n{field}\n"
        )
    };
    for field in ["copies = [[2, 1, 1], [0.5, 0, 0]]", "ring = [3, 30]", "load = [[0, 0, 3]]"] {
        fs::write(directory.path().join("list.toml"), scene(field)).unwrap();
        let name = field.split(' ').next().unwrap();
        run_in(directory.path(), &["check", "list.toml"]).assert_refused(2, &[name, "table"]);
    }
    fs::write(
        directory.path().join("table.toml"),
        scene("capsule = { length = 0.3, radius = 0.05 }"),
    )
    .unwrap();
    assert_eq!(run_in(directory.path(), &["check", "table.toml"]).code, Some(0));
}

/// Each of these scenes is valid, and has something that is probably meant otherwise.
#[test]
fn probable_mistakes_are_noted() {
    let directory = tempfile::tempdir().unwrap();
    let here = directory.path();
    let body = "steps = 3\n[ground]\nfriction = 0.5\n[[bodies]]\nname = \"plate\"\nbox = [0.2, 0.2, 0.02]\nmass = 1.0\n\
                position = [0, 0, 2]\n";
    let hinge = "[[joints]]\nname = \"elbow\"\ntype = \"revolute\"\nbodies = [\"plate\"]\naxis = [0, 1, 0]\nanchor = [0, 0, 2]\n";
    let ball = "[[bodies]]\nname = \"truck\"\nsphere = 0.2\nposition = [3, 0, 2]\n";
    let cases = [
        (format!("gravity = [0, 0, 9.81]\n{body}"), "gravity points away from the ground"),
        (format!("{body}{hinge}limits = [-90, 45.5]\n"), "angles of elbow look like degrees"),
        (
            format!(
                "{body}{hinge}[[motors]]\njoint = \"elbow\"\nposition = 30\nstiffness = 1.0\nmax_force = 1.0\n"
            ),
            "angles of elbow look like degrees",
        ),
        (
            format!("{body}velocity = [0, 0, -20]\n"),
            "the motion of plate in a step exceeds the body's thickness; use a time step of at most 1.0e-3 s",
        ),
        (
            format!("{body}inertia = [1e-3, 1e-3, 3e-3]\n"),
            "inertia of plate: a principal moment exceeds",
        ),
        (
            format!("{body}attitude = [0, 0, 0, 1]\n"),
            "the attitude of plate is a half turn; quaternions are w, x, y, z",
        ),
        (
            format!("{body}{ball}mass = 2e6\n"),
            "truck of 2000000 kg is 2.0e6 times as heavy as plate of 1 kg",
        ),
    ];
    for (text, note) in cases {
        fs::write(here.join("scene.toml"), text).unwrap();
        for (command, prefix) in [("check", "  note         "), ("run", "note: ")] {
            let end = run_in(here, &[command, "scene.toml"]);
            let notes = end.stdout.matches("note").count();
            assert!(
                end.stdout.contains(&format!("{prefix}{note}")) && notes == 1,
                "{note}: {end:?}"
            );
        }
    }
    // Two turns of a wheel in rad, a half turn by an axis, a plate, and a slower speed.
    let plain = format!(
        "{body}velocity = [0, 0, -9]\ninertia = [1e-3, 1e-3, 2e-3]\n\
         attitude = {{ axis = [0, 0, 1], degrees = 180 }}\n{hinge}limits = [-12.566, 3.0]\n{ball}mass = 1e6\n"
    );
    fs::write(here.join("scene.toml"), plain).unwrap();
    let end = run_in(here, &["run", "scene.toml"]);
    assert!(end.code == Some(0) && !end.stdout.contains("note"), "{end:?}");
}

/// The summary of `--json` is run.json without its model, and has the notes.
#[test]
fn a_summary_can_be_json() {
    let directory = tempfile::tempdir().unwrap();
    let here = directory.path();
    let end =
        run_in(here, &["--solver", "native", "-s", "5", "--gravity=-9.81", "--html", "--json"]);
    assert_eq!(end.code, Some(0), "{end:?}");
    let summary: serde_json::Value = serde_json::from_str(&end.stdout).unwrap();
    let text = fs::read_to_string(here.join("out/run.json")).unwrap();
    let file: serde_json::Value = serde_json::from_str(&text).unwrap();
    for field in ["outcome", "summary", "files", "largest_overlap_m"] {
        assert_eq!(summary[field], file[field], "{field}");
    }
    assert!(summary["model"].is_null() && summary["checksums"].is_null());
    assert!(summary["notes"][0].as_str().unwrap().contains("gravity points away"));
    assert!(here.join("out/view.html").is_file());
}

#[test]
fn files_of_other_programs_are_answered_with_a_remedy() {
    let directory = tempfile::tempdir().unwrap();
    let here = directory.path();
    for (name, remedy) in [
        ("part.STEP", "export the part as .stl"),
        ("part.ply", "assimp export FILE PART.stl"),
        ("part.glb", "assimp export FILE PART.stl"),
        ("part.stl", "`tumble convert` makes a scene of it"),
    ] {
        fs::write(here.join(name), [0xff, 0xfe, 0]).unwrap();
        run_in(here, &["run", name]).assert_refused(2, &[name, remedy]);
        let text = format!(
            "[ground]\nfriction = 0.5\n[[bodies]]\nmesh = \"{name}\"\nmass = 1.0\nposition = [0, 0, 1]\n"
        );
        fs::write(here.join("scene.toml"), text).unwrap();
        if !name.ends_with("stl") {
            run_in(here, &["convert", name, "out.toml"]).assert_refused(2, &[name, remedy]);
            run_in(here, &["run", "scene.toml"]).assert_refused(2, &[name, remedy]);
        }
    }
    fs::write(here.join("robot.urdf"), b"<robot name=\"gr\xfcn\"/>").unwrap();
    run_in(here, &["run", "robot.urdf"])
        .assert_refused(2, &["robot.urdf", "not UTF-8", "save it as UTF-8"]);
}
