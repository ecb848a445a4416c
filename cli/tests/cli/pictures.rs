//! Pictures of several bodies are the same from the run and from its tables.

use super::picture::Svg;
use super::scenario::run_scenario;
use super::support::{End, everything_in, run};
use std::fs;
use std::path::{Path, PathBuf};

/// Scene with a resting box, a falling ball, a rounded hull that slides on a fixed plate, and a
/// fixed capsule.
const SCENE: &str = r#"
steps = 21
[ground]
friction = 0.5
[[bodies]]
name = "slab"
box = [0.6, 0.4, 0.2]
mass = 2.0
position = [0.0, 0.0, 0.1]
[[bodies]]
name = "ball"
sphere = 0.1
mass = 1.0
position = [0.0, 1.0, 2.0]
[[bodies]]
name = "0"
hull = [[0, 0, 0], [0.2, 0, 0], [0, 0.2, 0], [0, 0, 0.2]]
radius = 0.02
mass = 1.0
position = [0.5, 1.0, 0.12]
velocity = [1.0, 0.0, 0.0]
[[fixed]]
name = "plate"
box = [2.0, 0.6, 0.1]
position = [0.5, 1.0, 0.05]
[[fixed]]
capsule = { length = 0.4, radius = 0.05 }
position = [-1.0, 0.0, 0.5]
"#;

/// The sheet of a body has panels only for joints of its own. The energy plot begins with a potential
/// energy of zero, so that a heavy body at rest does not flatten it.
#[test]
fn plots_show_joints_of_the_body_alone_and_energies_from_the_start() {
    let scene = "steps = 21\n[ground]\nfriction = 0.5\n[[bodies]]\nname = \"arm\"\nbox = 0.2\nmass = 1.0\n\
                 position = [0, 0, 2]\n[[bodies]]\nname = \"cube\"\nbox = 0.2\nmass = 1000.0\n\
                 position = [2, 0, 0.1]\n[[joints]]\ntype = \"revolute\"\nbodies = [\"arm\"]\n\
                 axis = [0, 1, 0]\nanchor = [0.5, 0, 2]\n";
    let (end, directory) = run_scenario(scene, &[]);
    assert_eq!(end.code, Some(0), "{end:?}");
    let out = directory.path().join("out");
    let own = ["x", "y", "z", "speed", "force", "contacts"];
    // Nothing drives the hinge, and the arm touches nothing.
    let with_hinge = ["x", "y", "z", "speed", "angle", "reaction"];
    for (body, panels) in [("cube", &own[..]), ("arm", &with_hinge)] {
        let table = out.join("states.csv");
        let end = run(&["plot", table.to_str().unwrap(), "--body", body]);
        assert_eq!(end.code, Some(0), "{end:?}");
        let sheet = Svg::read(&out.join("plot.svg"));
        assert_eq!(sheet.panels(), panels, "{body}");
        assert!(sheet.text.contains("time t (s)"));
    }
    let panel = Svg::read(&out.join("plot-energy.svg")).panel("energy");
    assert!(panel.label.contains("potential relative to the start"), "{}", panel.label);
    // Over 40 ms the total of the frictionless hinge is constant: the curves of kinetic and
    // potential energy are opposite, and fill the panel.
    let [kinetic, potential, total] = &panel.curves[..] else { panic!("{}", panel.label) };
    let ends = [kinetic, potential, total].map(|curve| curve.last().unwrap().1 - curve[0].1);
    assert!(ends[0] < -50.0 && (ends[0] + ends[1]).abs() < 2.0, "{ends:?}");
    assert!(ends[2].abs() < 2.0, "{ends:?}");
}

const TABLES: [&str; 5] = ["contacts.csv", "run.json", "state.bin", "states.csv", "steps.csv"];
const PICTURES: [&str; 6] =
    ["animation.gif", "plot-energy.png", "plot-energy.svg", "plot.png", "plot.svg", "view.html"];

/// Finished run in the directory `out` of a temporary directory.
struct Done {
    end: End,
    directory: tempfile::TempDir,
}

impl Done {
    fn run(flags: &[&str]) -> Self {
        let (end, directory) = run_scenario(SCENE, flags);
        Self { end, directory }
    }

    fn path(&self, name: &str) -> PathBuf {
        self.directory.path().join("out").join(name)
    }

    /// Runs `command` with `flags` on the table `states`.
    fn draw(&self, command: &str, flags: &[&str]) -> End {
        let file = self.path("states.csv");
        run(&[&[command, text(&file)], flags].concat())
    }

    fn files(&self) -> Vec<PathBuf> {
        everything_in(&self.path(""))
    }

    /// Replaces text in a table.
    fn change(&self, name: &str, from: &str, to: &str) {
        let text = fs::read_to_string(self.path(name)).unwrap();
        assert!(text.contains(from), "{name} has no {from:?}");
        fs::write(self.path(name), text.replacen(from, to, 1)).unwrap();
    }
}

fn text(path: &Path) -> &str {
    path.to_str().unwrap()
}

fn names(names: &[&str]) -> Vec<PathBuf> {
    let mut names: Vec<_> = names.iter().map(PathBuf::from).collect();
    names.sort();
    names
}

#[test]
fn a_run_draws_what_its_tables_draw() {
    let done = Done::run(&["--plot", "--html", "--gif", "--gif-size", "100"]);
    assert_eq!((done.end.code, done.end.stderr.as_str()), (Some(0), ""), "{:?}", done.end);
    for name in PICTURES {
        assert!(done.end.stdout.contains(name), "{name}: {:?}", done.end);
    }
    assert_eq!(done.files(), names(&[&TABLES[..], &PICTURES].concat()));
    let again = done.directory.path().join("again");
    for (command, table) in [("plot", "states"), ("view", "contacts"), ("gif", "steps")] {
        let file = done.path(&format!("{table}.csv"));
        let size: &[&str] = if command == "gif" { &["--gif-size", "100"] } else { &[] };
        let end = run(&[&[command, text(&file), "--out", text(&again)], size].concat());
        assert_eq!((end.code, end.stderr.as_str()), (Some(0), ""), "{end:?}");
    }
    assert_eq!(everything_in(&again), names(&PICTURES));
    for name in PICTURES {
        let [run, drawn] = [done.path(name), again.join(name)].map(|path| fs::read(path).unwrap());
        assert!(run == drawn, "{name} of the run and of its tables");
    }
    // The page describes the pieces.
    let page = fs::read_to_string(done.path("view.html")).unwrap();
    for words in [
        "box 0.6 × 0.4 × 0.2 m",
        "sphere of radius 0.1 m",
        "hull of 4 corners and 4 faces, rounded by 0.02 m",
        "level, z = 0 m",
    ] {
        assert!(page.contains(words), "{words}");
    }
}

/// Heights of the curve in panel `id` [pixels], downwards from its start.
fn drops(svg: &Svg, id: &str) -> Vec<f64> {
    let curves = svg.panel(id).curves;
    assert_eq!(curves.len(), 1, "{id}");
    curves[0].iter().map(|(_, y)| y - curves[0][0].1).collect()
}

/// `--body` selects the plotted body. The ball falls by z_k = z_0 − g h² k (k+1)/2 and the slab
/// rests.
#[test]
fn plots_show_the_requested_body() {
    let done = Done::run(&["--plot", "--quiet"]);
    assert_eq!((done.end.code, done.end.stdout.as_str()), (Some(0), ""));
    let moving = Svg::read(&done.path("plot.svg"));
    assert!(moving.text.contains("Motion and contact of 0: test"), "the first that moves far");
    assert_eq!(done.draw("plot", &["--body", "slab"]).code, Some(0));
    let slab = Svg::read(&done.path("plot.svg"));
    assert!(drops(&slab, "z").iter().all(|drop| drop.abs() < 0.1), "{:?}", drops(&slab, "z"));
    let energy = fs::read(done.path("plot-energy.svg")).unwrap();

    assert_eq!(done.draw("plot", &["--body", "ball"]).code, Some(0));
    let ball = Svg::read(&done.path("plot.svg"));
    assert!(ball.text.contains("Motion and contact of ball: test"));
    let z = drops(&ball, "z");
    assert_eq!(z.len(), 21);
    // Pixels have one or more decimals.
    let expected = z[20] / 4.0;
    assert!(z[20] > 20.0 && (z[10] - expected).abs() < 0.2, "{z:?}");
    assert!(!ball.panels().contains(&"force"));
    assert_eq!(fs::read(done.path("plot-energy.svg")).unwrap(), energy, "that of all");

    assert_eq!(done.draw("plot", &["--body", "1"]).code, Some(0));
    assert_eq!(Svg::read(&done.path("plot.svg")).text, ball.text, "by its number");
    // A name has precedence over an index.
    assert_eq!(done.draw("plot", &["--body", "0"]).code, Some(0));
    assert!(Svg::read(&done.path("plot.svg")).text.contains("Motion and contact of 0: test"));
}

#[test]
fn pictures_that_cannot_be_drawn_are_rejected_before_writing() {
    let done = Done::run(&[]);
    for body in ["3", "-1", "bal", ""] {
        done.draw("plot", &["--body", body]).assert_refused(2, &["--body", "slab", "0 to 2"]);
    }
    for command in ["plot", "gif", "view"] {
        let other = done.path("trajectory.csv");
        let end = run(&[command, text(&other)]);
        end.assert_refused(2, &["trajectory.csv", "does not exist", "states.csv"]);
    }
    run(&["verify", text(&done.path("trajectory.csv"))])
        .assert_refused(2, &["trajectory.csv", "does not exist", "states.csv"]);
    done.change("contacts.csv", ",fixed,0,", ",fixed,7,");
    for command in ["plot", "gif", "view"] {
        done.draw(command, &[]).assert_refused(2, &["contact", "step 0", "run.json does not have"]);
    }
    done.change("states.csv", "\n0,0.0,0,", "\n0,0.5,0,");
    done.draw("gif", &[]).assert_refused(2, &["states, line 2", "time_s"]);
    assert_eq!(done.files(), names(&TABLES));
    // Too many frames are refused at the start.
    let slow = Done::run(&["--gif", "--gif-speed", "0.001", "--steps", "400"]);
    slow.end.assert_refused(2, &["frames", "--gif-speed"]);
    assert!(!slow.path("").exists());
}

/// A still picture shows the row nearest to its time, and replaces only pictures of tumble.
#[test]
fn a_still_picture_has_a_time() {
    let done = Done::run(&[]);
    let still = |flags: &[&str]| {
        let end = done.draw("view", &[&["--png", "--size", "120"], flags].concat());
        assert_eq!((end.code, end.stderr.as_str()), (Some(0), ""), "{end:?}");
        fs::read(done.path("view.png")).unwrap()
    };
    let (start, later) = (still(&[]), still(&["--at", "0.0321"]));
    assert_ne!(start, later);
    assert_eq!(start, still(&["--at", "0.0001"]));
    assert_ne!(later, still(&["--at", "0.0321", "--camera", "10,40"]));
    done.draw("view", &["--png", "--at", "9"]).assert_refused(2, &["--at", "9 s", "0 to"]);
    done.draw("view", &["--at", "0"]).assert_refused(2, &["--png"]);
    let own = fs::read(done.path("view.png")).unwrap();
    fs::write(done.path("view.png"), &own[..20]).unwrap();
    done.draw("view", &["--png"]).assert_refused(2, &["view.png", "was not written by tumble"]);
}

#[test]
fn a_failed_step_is_seen_in_the_exit_code() {
    let done = Done::run(&[]);
    done.change("steps.csv", ",converged,", ",failed,");
    assert_eq!(done.draw("gif", &["--gif-size", "100", "--quiet"]).code, Some(3));
    assert_eq!(done.draw("view", &["--quiet"]).code, Some(3));
    assert_eq!(done.draw("plot", &[]).code, Some(0));
    let energy = Svg::read(&done.path("plot-energy.svg"));
    assert!(energy.panel("residual").legend.contains(&"failed (1)".to_owned()));
}

/// A distant ground is not drawn, because the picture would otherwise show only the ground.
#[test]
fn a_ground_out_of_reach_is_not_drawn() {
    let scene = SCENE.replace("friction = 0.5\n", "friction = 0.5\noffset = -100.0\n");
    let (end, directory) = run_scenario(&scene, &["--html", "--quiet"]);
    assert_eq!(end.code, Some(0), "{end:?}");
    let page = fs::read_to_string(directory.path().join("out/view.html")).unwrap();
    assert!(page.contains(r#"{"name":"ground","value":"none"}"#), "the page has a ground");
}

#[test]
fn page_compares_runs_with_several_and_one_body() {
    let done = Done::run(&[]);
    let one = super::support::simulate(&["--steps", "21", "--solver", "native"]);
    let files = [done.path("states.csv"), one.path("states.csv")];
    let end = run(&["view", text(&files[0]), text(&files[1])]);
    assert_eq!((end.code, end.stderr.as_str()), (Some(0), ""), "{end:?}");
}

/// Colours and labels of the scene are in run.json and in every picture.
#[test]
fn colours_and_labels_are_in_every_picture() {
    let told = SCENE
        .replace("sphere = 0.1", "sphere = 0.1\ncolour = \"#e010f0\"\nlabel = \"Würfel & <b>\"");
    let flags = ["--html", "--gif", "--plot", "--gif-size", "100"];
    let (end, directory) = run_scenario(&told, &flags);
    assert_eq!((end.code, end.stderr.as_str()), (Some(0), ""), "{end:?}");
    let done = Done { end, directory };
    let run_json = fs::read_to_string(done.path("run.json")).unwrap();
    assert_eq!(run_json.matches("\"colour\": \"#e010f0\"").count(), 1);
    assert_eq!(run_json.matches("\"label\"").count(), 1);
    let page = fs::read_to_string(done.path("view.html")).unwrap();
    assert!(page.contains("#e010f0") && page.contains("Würfel \\u0026 \\u003cb\\u003e"));
    assert!(!page.contains("Würfel & <b>"));
    let gif = fs::read(done.path("animation.gif")).unwrap();
    assert!(gif != fs::read(Done::run(&flags).path("animation.gif")).unwrap());
    let again = done.directory.path().join("again");
    let end = done.draw("gif", &["--gif-size", "100", "--out", text(&again)]);
    assert_eq!(end.code, Some(0), "{end:?}");
    assert!(gif == fs::read(again.join("animation.gif")).unwrap());
    let end = done.draw("plot", &["--body", "ball", "--out", text(&again)]);
    assert_eq!(end.code, Some(0), "{end:?}");
    let plot = fs::read_to_string(again.join("plot.svg")).unwrap();
    assert!(plot.contains("contact of Würfel &amp; &lt;b&gt;"));
    assert_eq!(done.draw("verify", &[]).code, Some(0));
    done.change("run.json", "#e010f0", "purplish");
    done.draw("gif", &[]).assert_refused(2, &["run.json", "colour", "purplish"]);
}

/// A video is encoded by ffmpeg: the frames go to its standard input. Here a script takes its place.
#[cfg(unix)]
#[test]
fn videos_are_the_frames_passed_to_ffmpeg() {
    use std::os::unix::fs::PermissionsExt as _;

    let done = Done::run(&[]);
    let programs = done.directory.path().join("programs");
    fs::create_dir(&programs).unwrap();
    let draw = |name: &str, script: Option<&str>| {
        let ffmpeg = programs.join("ffmpeg");
        if let Some(script) = script {
            fs::write(&ffmpeg, format!("#!/bin/sh\n{script}\n")).unwrap();
            fs::set_permissions(&ffmpeg, fs::Permissions::from_mode(0o755)).unwrap();
        }
        let mut command = super::support::tumble();
        command.args(["gif", text(&done.path("states.csv")), "--gif-size", "101", "--out"]);
        command.arg(done.path(name)).env("PATH", &programs);
        End::from(command.output().unwrap())
    };
    let before = done.files();
    draw("clip.mp4", None).assert_refused(2, &["clip.mp4 needs", "ffmpeg", "install", ".gif"]);
    let fails = "echo no such encoder >&2; exit 3";
    draw("clip.webm", Some(fails))
        .assert_refused(1, &["no such encoder", "clip.webm", "ended early"]);
    draw("clip.avi", None).assert_refused(2, &["clip.avi", ".gif or .mp4 or .webm"]);
    assert_eq!(done.files(), before, "no file is left");
    // The last argument is the file.
    let counts = "for file; do :; done; /usr/bin/wc -c > \"${file#file:}\"; echo \"$@\" >> \"${file#file:}\"";
    for ending in ["mp4", "webm"] {
        let name = format!("clip.{ending}");
        let end = draw(&name, Some(counts));
        assert_eq!((end.code, end.stderr.as_str()), (Some(0), ""), "{end:?}");
        assert!(end.stdout.contains(&name), "{end:?}");
        let written = fs::read_to_string(done.path(&name)).unwrap();
        let (bytes, arguments) = written.split_once('\n').unwrap();
        // 40 ms at 30 frames per second: at the start, after 33 ms and at the end.
        assert_eq!(bytes.trim(), (3 * 101 * 101 * 3).to_string());
        for option in ["-s 101x101 -r 30 -i -".to_owned(), format!("-f {ending} ")] {
            assert!(arguments.contains(&option), "{arguments}");
        }
        assert!(arguments.contains("-metadata title=Written by tumble"), "{arguments}");
        // A video of another program is not replaced.
        fs::write(done.path(&name), b"\0\0\0\x20ftypisom\0\0\x02\0isomiso2mp41").unwrap();
        draw(&name, None).assert_refused(2, &[&name, "was not written by tumble"]);
    }
}
