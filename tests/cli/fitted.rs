//! `tumble fit` from the outside: its files, its refusals, and a fit that is taken up again.

use crate::synthetic;

use crate::synthetic::model;
use assert_cmd::Command;
use std::fmt::Write as _;
use std::fs;
use std::path::{Path, PathBuf};
use tempfile::TempDir;
use tumble::fit::{Constant, Toss};

const SCENE: &str = "
[ground]
friction = 0.4

[body]
box = 0.1
mass = 0.4
inertia = 7e-4

[start]
position = [0.0, 0.0, 0.2]
";

/// A folder with a scene and ten tosses.
struct Bench {
    folder: TempDir,
}

impl Bench {
    fn new() -> Self {
        let folder = TempDir::new().unwrap();
        fs::write(folder.path().join("cube.toml"), SCENE).unwrap();
        fs::create_dir(folder.path().join("tosses")).unwrap();
        let values = model().values();
        let values = values.with(Constant::Friction, 0.25).with(Constant::Restitution, 0.2);
        let tosses = synthetic::tosses(&values, 6, 1e-4, 1);
        fs::write(folder.path().join("tosses/some.csv"), table(&tosses)).unwrap();
        Self { folder }
    }

    fn path(&self, name: &str) -> PathBuf {
        self.folder.path().join(name)
    }

    fn fit(&self, out: &str, more: &[&str]) -> Command {
        let mut command = Command::cargo_bin("tumble").unwrap();
        command.current_dir(self.folder.path());
        command.args(["fit", "cube.toml", "tosses", "--substeps", "4", "--neighbours", "20"]);
        command.args(["--evaluations", "100", "--out", out]).args(more);
        command
    }

    /// A fit that gets an interrupt once it has made eight evaluations: its exit code, and what it
    /// says.
    fn interrupted(&self, out: &str) -> (Option<i32>, String) {
        let mut running = std::process::Command::new(assert_cmd::cargo::cargo_bin!("tumble"));
        running.current_dir(self.folder.path()).stdout(std::process::Stdio::piped());
        running.args(["fit", "cube.toml", "tosses", "--substeps", "4", "--neighbours", "20"]);
        let running = running.args(["--evaluations", "100", "--out", out]);
        let mut child = running.spawn().unwrap();
        let state = self.path(out).join("fit-state.jsonl");
        let lines = || fs::read_to_string(&state).unwrap_or_default().lines().count();
        while lines() < 9 && child.try_wait().unwrap().is_none() {
            std::thread::sleep(std::time::Duration::from_millis(2));
        }
        let id = child.id().to_string();
        let _ = std::process::Command::new("kill").args(["-s", "INT", &id]).status();
        let output = child.wait_with_output().unwrap();
        (output.status.code(), String::from_utf8(output.stdout).unwrap())
    }

    fn refused(&self, arguments: &[&str], sentence: &str) {
        let mut command = Command::cargo_bin("tumble").unwrap();
        let command = command.current_dir(self.folder.path()).arg("fit").args(arguments);
        let output = command.assert().code(2).get_output().stderr.clone();
        let text = String::from_utf8(output).unwrap();
        assert!(text.contains(sentence) && text.lines().count() == 1, "{text} / {sentence}");
        assert!(!self.path("out").exists(), "{arguments:?} left something behind");
    }
}

fn table(tosses: &[Toss]) -> String {
    let mut text = String::from(
        "toss_id,step,t_s,x_m,y_m,z_m,qw,qx,qy,qz,vx_m_s,vy_m_s,vz_m_s,wx_rad_s,wy_rad_s,wz_rad_s\n",
    );
    for toss in tosses {
        for (step, frame) in toss.frames.iter().enumerate() {
            let _ = write!(text, "{},{step},{}", toss.name, step as f64 / toss.rate);
            for value in &frame.to_vector() {
                let _ = write!(text, ",{value}");
            }
            text.push('\n');
        }
    }
    text
}

/// The files of a finished fit.
fn files(out: &Path) -> Vec<Vec<u8>> {
    let mut names: Vec<_> = fs::read_dir(out).unwrap().map(|e| e.unwrap().file_name()).collect();
    names.sort();
    assert_eq!(names, ["fit.html", "fit.json", "fitted.toml", "tosses.csv"]);
    names.iter().map(|name| fs::read(out.join(name)).unwrap()).collect()
}

#[test]
fn a_fit_is_the_same_on_any_threads_and_after_an_interruption() {
    let bench = Bench::new();
    let one = bench.fit("one", &["--threads", "1"]).assert().success();
    let said = String::from_utf8(one.get_output().stdout.clone()).unwrap();
    for part in ["friction", "restitution", "found", "smoothed", "failed 0"] {
        assert!(said.contains(part), "{said}");
    }
    let one = files(&bench.path("one"));
    bench.fit("two", &["--threads", "2"]).assert().success();
    assert_eq!(one, files(&bench.path("two")), "threads");

    // Ctrl-C, then as if the program had been ended in the middle of a line.
    let (code, said) = bench.interrupted("three");
    let state = bench.path("three/fit-state.jsonl");
    if code == Some(130) {
        assert!(said.contains("the same command goes on"), "{said}");
        let text = fs::read(&state).unwrap();
        fs::write(&state, &text[..text.len() - 7]).unwrap();
        let again = bench.fit("three", &[]).assert().success();
        let said = String::from_utf8(again.get_output().stdout.clone()).unwrap();
        assert!(said.contains("going on after"), "{said}");
    } else {
        // It was done before the signal came.
        assert_eq!(code, Some(0));
    }
    assert_eq!(one, files(&bench.path("three")), "resumed");
}

#[test]
fn a_state_of_another_fit_is_refused() {
    let bench = Bench::new();
    fs::create_dir(bench.path("other")).unwrap();
    fs::write(bench.path("other/fit-state.jsonl"), "{\"fit\":\"another\"}\n").unwrap();
    let output = bench.fit("other", &[]).assert().code(2);
    let text = String::from_utf8(output.get_output().stderr.clone()).unwrap();
    assert!(text.contains("is the state of another fit"), "{text}");
    let left = fs::read_to_string(bench.path("other/fit-state.jsonl")).unwrap();
    assert_eq!(left, "{\"fit\":\"another\"}\n");
}

/// The scenario that a fit writes, run by the program, goes where the library's roll-out goes.
#[test]
fn the_found_scenario_simulates_what_was_scored() {
    let bench = Bench::new();
    let set = ["--parameters", "none", "--set", "radius=0.004", "--set", "friction=0.25"];
    bench.fit("scored", &set).args(["--set", "restitution=0.2"]).assert().success();
    let mut run = Command::cargo_bin("tumble").unwrap();
    run.current_dir(bench.folder.path());
    run.args(["--scenario", "scored/fitted.toml", "--out", "run", "--quiet"]).assert().success();
    let states = fs::read_to_string(bench.path("run/states.csv")).unwrap();
    let mut reader = csv::Reader::from_reader(states.as_bytes());
    let headers = reader.headers().unwrap().clone();
    let column = |name: &str| headers.iter().position(|header| header == name).unwrap();
    let at = ["x_m", "y_m", "z_m"].map(column);
    let rows: Vec<[f64; 3]> = reader
        .records()
        .map(|row| row.map(|row| at.map(|column| row[column].parse().unwrap())).unwrap())
        .collect();
    let model = model();
    let values = model.values().with(Constant::Radius, 0.004);
    let values = values.with(Constant::Friction, 0.25).with(Constant::Restitution, 0.2);
    let bytes = fs::read(bench.path("tosses/some.csv")).unwrap();
    let toss = tumble::fit::recording::read_csv(&bytes).unwrap().remove(0);
    let protocol = tumble::fit::Protocol::new(&model, 4);
    let mut k = 0;
    let flag = Default::default();
    tumble::fit::rollout::rollout(&model, &protocol, &values, &toss, &flag, |states| {
        let row = rows[4 * k];
        let off = (0..3).map(|axis| (row[axis] - states[0].position[axis]).abs());
        let off = off.fold(0.0, f64::max);
        // The same steps; the file has all digits.
        assert!(off < 1e-9, "frame {k}: {off}");
        k += 1;
    })
    .unwrap();
    assert_eq!(rows.len(), 4 * (k - 1) + 1);
}

#[test]
fn folds_keep_every_toss_back_once() {
    let bench = Bench::new();
    bench.fit("out", &["--folds", "3", "--parameters", "friction"]).assert().success();
    let text = fs::read_to_string(bench.path("out/fit.json")).unwrap();
    let json: serde_json::Value = serde_json::from_str(&text).unwrap();
    let folds = json["folds"].as_array().unwrap();
    let mut kept: Vec<&str> = folds
        .iter()
        .flat_map(|fold| fold["kept_back"].as_array().unwrap())
        .map(|name| name.as_str().unwrap())
        .collect();
    kept.sort_unstable();
    assert_eq!(kept, ["0", "1", "2", "3", "4", "5"]);
    assert!(json["cross_validated"]["position_percent"].as_f64().unwrap() > 0.0);
    assert_eq!(json["failed_steps"], 0);
}

#[test]
fn wrong_input_gets_a_sentence() {
    let bench = Bench::new();
    let ok = ["cube.toml", "tosses"];
    let with = |more: &[&'static str]| [&ok, more].concat();
    bench.refused(&["none.toml", "tosses"], "none.toml: cannot be read as a scenario");
    bench.refused(&["cube.toml", "nothing"], "nothing cannot be read");
    bench.refused(&["cube.toml", "cube.toml"], "cube.toml is no recording by its name");
    bench.refused(&with(&["--parameters", "mass"]), "\"mass\" is no parameter; there are friction");
    bench.refused(&with(&["--parameters", "mass"]), "as their ratio alone, so look for inertia");
    bench.refused(&with(&["--parameters", "friction,friction"]), "friction is named twice");
    bench.refused(&with(&["--set", "friction"]), "NAME=VALUE is needed");
    bench.refused(&with(&["--set", "friction=nan"]), "--set");
    bench.refused(&with(&["--set", "friction=3"]), "friction starts at 3, outside of its bounds");
    bench.refused(&with(&["--bounds", "friction=2:1"]), "2 is not below 1");
    bench.refused(&with(&["--bounds", "radius=0:0.01"]), "radius is not looked for");
    bench.refused(&with(&["--parameters", "none", "--set", "friction=-1"]), "friction");
    bench.refused(&with(&["--folds", "5"]), "5 folds of 6 different recordings");
    bench.refused(&with(&["--evaluations", "3"]), "too few");
    bench.refused(&with(&["--substeps", "0"]), "--substeps");
    bench.refused(&with(&["--evaluations", "-1"]), "--evaluations");
    bench.refused(&with(&["--rate", "-1"]), "--rate");
    bench.refused(&with(&["--threads", "0"]), "--threads");
    bench.refused(&with(&["--neighbours", "3"]), "neighbours are too few");
    fs::create_dir(bench.path("empty")).unwrap();
    bench.refused(&["cube.toml", "empty"], "empty has no recordings");
    let floating = SCENE.replace("[ground]\nfriction = 0.4\n", "");
    fs::write(bench.path("floating.toml"), floating).unwrap();
    bench.refused(&["floating.toml", "tosses"], "floating.toml: a table [ground] is needed");
    let bodies = "[ground]\nfriction = 0.4\nnone = true\n\n[[bodies]]\nbox = 0.1\nmass = 0.4\n\
                  position = [0, 0, 1]\n";
    fs::write(bench.path("bodies.toml"), bodies).unwrap();
    bench.refused(&["bodies.toml", "tosses"], "bodies.toml: a fit needs a ground");
    let large = SCENE.replace("box = 0.1", "box = 1.0");
    fs::write(bench.path("large.toml"), &large).unwrap();
    bench.refused(&["large.toml", "tosses"], "large.toml: start.position: with z = 0.2 the lowest");
    let large = large.replace("[0.0, 0.0, 0.2]", "[0.0, 0.0, 0.6]");
    fs::write(bench.path("large.toml"), large).unwrap();
    let sentence = "some.csv: toss 0: the body's lowest point comes to";
    bench.refused(&["large.toml", "tosses"], sentence);
    let good = fs::read_to_string(bench.path("tosses/some.csv")).unwrap();
    fs::write(bench.path("tosses/twice.csv"), good).unwrap();
    bench.refused(&ok, "twice.csv: toss 0 is in another file too");
}

const PENDULUM: &str = "
steps = 201
time_step = 0.005

[ground]
none = true
friction = 0.5

[[bodies]]
name = \"upper\"
box = [0.5, 0.05, 0.05]
mass = 1.0
position = [0.25, 0, 1]
touches = false

[[bodies]]
name = \"lower\"
box = [0.5, 0.05, 0.05]
mass = 0.6
position = [0.75, 0, 1]
touches = false

[[joints]]
name = \"shoulder\"
type = \"revolute\"
bodies = [\"upper\"]
anchor = [0, 0, 1]
axis = [0, 1, 0]
damping = 0.02

[[joints]]
name = \"elbow\"
type = \"revolute\"
bodies = [\"lower\", \"upper\"]
anchor = [0.5, 0, 1]
axis = [0, 1, 0]
damping = 0.05
friction = 0.1
";

/// A folder with a pendulum and the run of one with other constants.
fn recorded_pendulum() -> TempDir {
    let folder = TempDir::new().unwrap();
    fs::write(folder.path().join("pendulum.toml"), PENDULUM).unwrap();
    let hidden = PENDULUM
        .replace("damping = 0.02", "damping = 0.07")
        .replace("damping = 0.05", "damping = 0.03")
        .replace("friction = 0.1", "friction = 0.18")
        .replace("mass = 0.6", "mass = 0.75");
    fs::write(folder.path().join("hidden.toml"), hidden).unwrap();
    tumble(&folder, &["--scenario", "hidden.toml", "--out", "run", "--every", "4", "--quiet"])
        .assert()
        .success();
    folder
}

fn tumble(folder: &TempDir, arguments: &[&str]) -> Command {
    let mut command = Command::cargo_bin("tumble").unwrap();
    command.current_dir(folder.path()).args(arguments);
    command
}

/// The fit of a run of several bodies finds what it was made with, and writes a scenario that goes like the run.
#[test]
fn the_constants_of_joints_and_bodies_are_found() {
    let folder = recorded_pendulum();
    let names = "joint_damping:shoulder,joint_damping:elbow, joint_friction:elbow,mass:lower";
    let fit = ["fit", "pendulum.toml", "run", "--parameters", names, "--substeps", "4"];
    let mut command = tumble(&folder, &fit);
    command.args(["--bounds", "joint_damping:shoulder=0:0.2", "--polish", "30", "--out", "fit"]);
    let said = command.args(["--evaluations", "100"]).assert().success();
    let said = String::from_utf8(said.get_output().stdout.clone()).unwrap();
    assert!(said.starts_with("1 recording, 51 frames") && said.contains("mass:lower"), "{said}");
    assert!(!said.contains("bootstrap") && !said.contains("face"), "{said}");
    let text = fs::read_to_string(folder.path().join("fit/fit.json")).unwrap();
    let json: serde_json::Value = serde_json::from_str(&text).unwrap();
    let hidden = [
        ("joint_damping:shoulder", 0.07, "N s/m or N m s/rad"),
        ("joint_damping:elbow", 0.03, "N s/m or N m s/rad"),
        ("joint_friction:elbow", 0.18, "N or N m"),
        ("mass:lower", 0.75, "kg"),
    ];
    for (found, (name, value, unit)) in json["parameters"].as_array().unwrap().iter().zip(hidden) {
        assert_eq!((found["name"].as_str(), found["unit"].as_str()), (Some(name), Some(unit)));
        let off = (found["value"].as_f64().unwrap() - value).abs();
        assert!(off < 1e-9 && found["standard_error"].is_null(), "{found}");
    }
    // Like the run, row by row.
    let again = ["--scenario", "fit/fitted.toml", "--out", "again", "--every", "4", "--quiet"];
    tumble(&folder, &again).assert().success();
    let states = |run: &str| -> Vec<f64> {
        let text = fs::read_to_string(folder.path().join(run).join("states.csv")).unwrap();
        let cells = text.lines().skip(1).flat_map(|line| line.split(',').skip(3));
        cells.map(|cell| cell.parse().unwrap()).collect()
    };
    let (run, again) = (states("run"), states("again"));
    assert_eq!(run.len(), again.len());
    let off = run.iter().zip(&again).map(|(a, b)| (a - b).abs()).fold(0.0, f64::max);
    assert!(off < 1e-8, "{off}");
    let page = fs::read_to_string(folder.path().join("fit/fit.html")).unwrap();
    assert!(page.contains("run, ") && page.contains("joint_friction:elbow"));
}

#[test]
fn a_fit_of_several_bodies_refuses_by_name() {
    let folder = recorded_pendulum();
    let refused = |more: &[&str], sentence: &str| {
        let mut command = tumble(&folder, &["fit", "pendulum.toml"]);
        let output = command.args(more).assert().code(2).get_output().stderr.clone();
        let text = String::from_utf8(output).unwrap();
        assert!(text.contains(sentence) && text.lines().count() == 1, "{text} / {sentence}");
        assert!(!folder.path().join("out").exists());
    };
    let by = |name: &'static str| ["run", "--parameters", name];
    refused(
        &by("joint_damping:wrist"),
        "\"wrist\" is none of its numbers; there are shoulder; elbow",
    );
    refused(&by("gravity:up"), "there are x; y; z");
    refused(&by("friction:upper"), "friction: the world has one alone; leave `:upper` out");
    refused(&by("dampness"), "\"dampness\" is no parameter; there are friction, restitution");
    refused(&by("gear_ratio"), "gear_ratio: the scene has none that could vary");
    refused(&by("joint_stiffness:elbow"), "--bounds joint_stiffness:elbow=LOW:HIGH is needed");
    refused(&by("mass,mass:upper"), "mass is given as a whole and by one of its numbers");
    refused(
        &["run", "--parameters", "mass:upper", "--set", "mass=1.1"],
        "mass is given as a whole and by one of its numbers",
    );
    refused(&by("mass:upper,mass:upper"), "mass[0] is named twice");
    refused(&by("size"), "size: shapes stay");
    refused(&by("time_step"), "time_step: the time step is that of the recordings");
    refused(
        &["run", "--parameters", "mass", "--ensemble", "5"],
        "an ensemble is of the starts of tosses",
    );
    refused(
        &["run", "--parameters", "mass", "--bounds", "mass:upper=1:2"],
        "mass:upper is not looked for",
    );
    refused(&["run", "--parameters", "mass", "--set", "mass:upper=-1"], "mass");
    refused(&["run/contacts.csv", "--parameters", "mass"], "the table has no column");
    refused(
        &["run/run.json", "--parameters", "mass"],
        "is no recording by its name; .csv or .csv.gz",
    );
}
