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
    tumble::fit::rollout::rollout(&model, &protocol, &values, &toss, &flag, |state| {
        let row = rows[4 * k];
        let off = (0..3).map(|axis| (row[axis] - state.position[axis]).abs()).fold(0.0, f64::max);
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
