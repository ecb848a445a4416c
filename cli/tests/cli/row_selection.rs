//! `--every`, `--tables`, `--all-contacts` and `--compact`: selection of rows and tables, and their file format.

use super::support::{run, unseal};
use crate::ROOT;
use flate2::bufread::MultiGzDecoder;
use std::collections::BTreeSet;
use std::fs;
use std::io::Read;
use std::path::{Path, PathBuf};
use tempfile::TempDir;

struct Runs(TempDir);

impl Runs {
    fn new() -> Self {
        Self(tempfile::tempdir().unwrap())
    }

    fn path(&self, run: &str, file: &str) -> PathBuf {
        self.0.path().join(run).join(file)
    }

    fn text(&self, run: &str, file: &str) -> String {
        self.path(run, file).to_str().unwrap().to_owned()
    }

    /// Runs `args` in the directory `name`.
    fn run(&self, name: &str, args: &[&str]) {
        let out = self.text(name, "");
        let end = run(&[args, &["--quiet", "--out", &out]].concat());
        assert!(matches!(end.code, Some(0 | 3)), "{args:?}: {end:?}");
    }

    fn lines(&self, run: &str, file: &str) -> Vec<String> {
        let text = fs::read_to_string(self.path(run, file)).unwrap();
        text.lines().map(str::to_owned).collect()
    }

    fn refused(&self, args: &[&str], words: &[&str]) {
        run(args).assert_refused(2, words);
    }
}

fn scenario(name: &str) -> String {
    format!("{ROOT}/scenarios/{name}.toml")
}

/// Lines of the table steps without its energy terms, which are sums over omitted steps.
fn without_terms(lines: Vec<String>) -> Vec<String> {
    let columns: Vec<_> = lines[0].split(',').collect();
    let place = |name: &str| columns.iter().position(|column| *column == name).unwrap();
    let terms = place("loads_J")..=place("discretisation_J");
    let bare = |line: &String| -> String {
        let cells = line.split(',').enumerate().filter(|(k, _)| !terms.contains(k));
        cells.map(|(_, cell)| cell).collect::<Vec<_>>().join(",")
    };
    lines.iter().map(bare).collect()
}

/// Header, lines with every `every`-th k from `first` on, and lines of the last k.
fn thinned(lines: &[String], every: u64, first: u64) -> Vec<String> {
    let k = |line: &String| line.split(',').next().unwrap().parse::<u64>();
    let last = lines.iter().rev().find_map(|line| k(line).ok());
    let stays = |line: &&String| match k(line) {
        Ok(k) => (k - first).is_multiple_of(every) || Some(k) == last,
        Err(_) => true,
    };
    lines.iter().filter(stays).cloned().collect()
}

#[test]
fn every_nth_step_has_the_rows_of_the_full_run() {
    let runs = Runs::new();
    let drop = ["--solver", "native", "--steps", "342", "--start-index", "5"];
    runs.run("all", &drop);
    runs.run("some", &[&drop[..], &["--every", "10"]].concat());
    let all = runs.lines("all", "trajectory.csv");
    assert_eq!(runs.lines("some", "trajectory.csv"), thinned(&all, 10, 5));

    let scene = scenario("four-bar");
    let scene = [&scene, "--steps", "100"];
    runs.run("all", &scene);
    runs.run("some", &[&scene[..], &["--every", "7"]].concat());
    for (table, is_of_steps) in
        [("states", false), ("steps", false), ("joints", false), ("contacts", true)]
    {
        let file = format!("{table}.csv");
        let all = runs.lines("all", &file);
        let mut expected = thinned(&all, 7, 0);
        if is_of_steps {
            // The last state has no contacts, and the step into it is left out.
            expected.retain(|line| {
                line.starts_with('k')
                    || line.split(',').next().unwrap().parse::<u64>().unwrap() % 7 == 0
            });
        }
        let mut found = runs.lines("some", &file);
        if table == "steps" {
            (found, expected) = (without_terms(found), without_terms(expected));
        }
        assert_eq!(found, expected, "{table}");
    }
    assert!(fs::read_to_string(runs.path("some", "run.json")).unwrap().contains("\"every\": 7"));
}

/// Runs with `--every` and `--tables` continue to the same tables and can be drawn. Tables that
/// `verify` lacks are named.
#[test]
fn runs_with_selected_rows_continue_and_are_drawn() {
    let runs = Runs::new();
    let scene = scenario("marbles");
    let scene = [&scene, "--every", "8", "--tables", "contacts"];
    runs.run("whole", &[&scene[..], &["--steps", "90"]].concat());
    runs.run("parts", &[&scene[..], &["--steps", "33"]].concat());
    for rows in ["50", "90"] {
        runs.run("parts", &["--continue", &runs.text("parts", ""), "--steps", rows]);
    }
    for file in ["states.csv", "contacts.csv", "steps.csv", "state.bin"] {
        if file.ends_with("csv") {
            assert_eq!(runs.lines("whole", file), runs.lines("parts", file), "{file}");
        }
    }
    let states = runs.text("whole", "states.csv");
    runs.refused(&["verify", &states], &["cannot be verified", "did not write the table ends"]);
    runs.refused(
        &["--continue", &runs.text("parts", ""), "--every", "2"],
        &["every", "--continue"],
    );
    for command in ["gif", "view", "plot"] {
        let end = run(&[command, &states, "--out", &runs.text("whole", "")]);
        assert_eq!(end.code, Some(0), "{command}: {end:?}");
    }
    // The page has 12 frames that are 8 steps apart, as many as for the run with all rows.
    let page = fs::read_to_string(runs.path("whole", "view.html")).unwrap();
    assert!(page.contains("one of 8"));

    let scene = scenario("double-pendulum");
    runs.run("bare", &[&scene, "--steps", "20", "--tables", "steps"]);
    for file in ["joints.csv", "contacts.csv"] {
        assert!(!runs.path("bare", file).exists(), "{file}");
    }
    runs.run("bare", &["--continue", &runs.text("bare", ""), "--steps", "30"]);
    runs.run("full", &[&scene, "--steps", "30"]);
    for file in ["states.csv", "steps.csv"] {
        assert_eq!(runs.lines("bare", file), runs.lines("full", file), "{file}");
    }
    let states = runs.text("bare", "states.csv");
    runs.refused(&["verify", &states], &["did not write the table contacts"]);
    let end = run(&["view", &states]);
    assert_eq!(end.code, Some(0), "{end:?}");
}

/// Each selected step is verified against its final states in ends.csv. Joint turns are counted
/// from the step's own row.
#[test]
fn selected_rows_verify_alone() {
    let runs = Runs::new();
    for name in ["four-bar", "marbles"] {
        let scene = scenario(name);
        let scene = [&scene, "--exact", "--steps", "120"];
        runs.run("all", &scene);
        runs.run("some", &[&scene[..], &["--every", "7"]].concat());
        let states = runs.text("some", "states.csv");
        let end = run(&["verify", &states]);
        assert_eq!(end.code, Some(0), "{end:?}");
        assert!(end.stdout.contains("17 steps (--every 7) of"), "{end:?}");
        // ends.csv holds the states that the full run has one step later.
        // Their velocities are those of the middle of the step.
        let numbers = |line: &String| {
            let fields: Vec<_> = line.split(',').skip(3).collect();
            // Without the interval.
            let fields = &fields[..fields.len() - 2];
            let middle = if fields.len() > 13 { &fields[13..19] } else { &fields[7..] };
            [&fields[..7], middle].concat().join(",")
        };
        let of = |file: &str, run: &str, wanted: &dyn Fn(u64) -> bool| -> Vec<String> {
            let rows = runs.lines(run, file).into_iter().skip(1);
            let k = |line: &String| line.split(',').next().unwrap().parse().unwrap();
            rows.filter(|line| wanted(k(line))).map(|line| numbers(&line)).collect()
        };
        let later = of("states.csv", "all", &|k| k % 7 == 1 && k < 119);
        assert_eq!(of("ends.csv", "some", &|_| true), later);
        // A changed final state contradicts its step.
        unseal(&runs.path("some", "run.json"));
        let lines = runs.lines("some", "ends.csv");
        let mut fields: Vec<_> = lines[20].split(',').map(str::to_owned).collect();
        fields[10] = "0.25".to_owned();
        let text = lines.join("\n").replace(&lines[20], &fields.join(",")) + "\n";
        fs::write(runs.path("some", "ends.csv"), text).unwrap();
        let end = run(&["verify", &states]);
        assert_eq!(end.code, Some(1), "{end:?}");
    }
    runs.run("table", &["--solver", "native", "--steps", "240", "--every", "3"]);
    let end = run(&["verify", &runs.text("table", "states.csv")]);
    assert_eq!(end.code, Some(0), "{end:?}");
}

/// The counts in run.json include the steps that are left out. They cannot be smaller than the
/// counts of the rows. The state after the last step equals the last row.
#[test]
fn counts_in_run_json_are_checked_against_selected_rows() {
    let runs = Runs::new();
    let scene = scenario("marbles");
    runs.run("some", &[&scene, "--steps", "16", "--every", "7"]);
    let states = runs.text("some", "states.csv");
    let verify = || run(&["verify", &states]);
    assert_eq!(verify().code, Some(0));
    let file = runs.path("some", "run.json");
    unseal(&file);
    let whole = fs::read_to_string(&file).unwrap();
    let original: serde_json::Value = serde_json::from_str(&whole).unwrap();
    let [free, touching] =
        ["free_steps", "contact_steps"].map(|field| original["summary"][field].as_f64().unwrap());
    let wrong: [(&[_], _, _); 8] = [
        (&[("rows", 17.0)], 1, "summary.rows is 17; the first to the last row span 16"),
        (
            &[("failed", 1.0), ("free_steps", free - 1.0), ("contact_steps", touching + 1.0)],
            3,
            "of all steps, by run.json: 1",
        ),
        (&[("converged", touching + 1.0)], 1, "the counts by status add up to"),
        (&[("wild", 1.0)], 1, "the counts by status add up to"),
        (
            &[("contact_steps", 16.0)],
            1,
            "summary.rows is 16; free steps and contact steps add up to",
        ),
        (&[("free_steps", 0.0)], 1, "summary.free_steps is 0; the written rows alone have"),
        (&[("certificate_max_m_s", 0.0)], 1, "the written rows alone have"),
        (&[("certificate_max_m_s", 1e-3)], 1, "and all steps are counted as solved"),
    ];
    for (changes, code, words) in wrong {
        let (mut json, pointer) = (original.clone(), changes[0].0);
        for (field, value) in changes {
            let whole = value.fract() == 0.0;
            json["summary"][field] = if whole { (*value as i64).into() } else { (*value).into() };
        }
        fs::write(&file, json.to_string()).unwrap();
        let end = verify();
        assert_eq!(end.code, Some(code), "{pointer}: {end:?}");
        assert!(end.stdout.contains(words), "{pointer}: {end:?}");
    }
    fs::write(&file, &whole).unwrap();
    // Row 15 equals the state after step 14 to the last bit.
    let lines = runs.lines("some", "states.csv");
    let mut fields: Vec<_> = lines.last().unwrap().split(',').map(str::to_owned).collect();
    let x: f64 = fields[3].parse().unwrap();
    fields[3] = (x + 1e-9).to_string();
    let text = lines.join("\n").replace(lines.last().unwrap(), &fields.join(",")) + "\n";
    fs::write(runs.path("some", "states.csv"), text).unwrap();
    let end = verify();
    assert_eq!(end.code, Some(1), "{end:?}");
    assert!(end.stdout.contains("steps that differ from their rows: 1"), "{end:?}");
}

/// A run with 4 substeps writes the same bytes as a run with a quarter of the time step and
/// `--every 4`.
#[test]
fn substeps_are_short_steps_with_selected_rows() {
    let runs = Runs::new();
    let drop = ["--solver", "native", "--start-index", "0"];
    runs.run("substeps", &[&drop[..], &["--steps", "50", "--substeps", "4"]].concat());
    let short = ["--steps", "197", "--dt", "0.0005", "--every", "4"];
    runs.run("short", &[&drop[..], &short].concat());
    assert_eq!(runs.lines("substeps", "trajectory.csv"), runs.lines("short", "trajectory.csv"));
    let scene = scenario("double-pendulum");
    let scene = [&scene, "--steps", "40", "--substeps", "5", "--every", "2"];
    runs.run("pendulum", &scene);
    let json = fs::read_to_string(runs.path("pendulum", "run.json")).unwrap();
    assert!(json.contains("\"every\": 10"), "{json}");
    let end = run(&["verify", &runs.text("pendulum", "states.csv")]);
    assert_eq!(end.code, Some(0), "{end:?}");
    runs.run(
        "parts",
        &[&scene[..1], &["--steps", "20", "--substeps", "5", "--every", "2"]].concat(),
    );
    runs.run("parts", &["--continue", &runs.text("parts", ""), "--steps", "40"]);
    for file in ["states.csv", "ends.csv", "joints.csv"] {
        assert_eq!(runs.lines("parts", file), runs.lines("pendulum", file), "{file}");
    }
}

/// Invalid values of `--every`, `--substeps`, `--tables` and `--format` are refused.
#[test]
fn invalid_row_selections_are_rejected() {
    let runs = Runs::new();
    let out = runs.text("out", "");
    let refused = |args: &[&str], words: &[&str]| {
        runs.refused(&[args, &["--out", &out]].concat(), words);
        assert!(!Path::new(&out).exists());
    };
    refused(&["--every", "0"], &["--every", "1 to 1000000"]);
    refused(&["--every", "-3"], &["--every", "1 to 1000000"]);
    refused(&["--every", "1.5"], &["--every"]);
    refused(&["--substeps", "0"], &["--substeps", "1 to 1000"]);
    refused(&["--substeps", "1000", "--steps", "20000"], &["substeps", "10000000"]);
    refused(&["--substeps", "1000", "--dt", "1e-6"], &["substeps", "time step"]);
    let late = ["--substeps", "1000", "--start-index", "9000000000000000", "--steps", "5"];
    refused(&late, &["substeps", "index", "9000000000000000"]);
    let bodies = scenario("four-bar");
    refused(&[&bodies, "--tables", "ends"], &["ends", "--every"]);
    refused(&["--tables", "stairs"], &["stairs", "states"]);
    runs.run("compressed", &["--solver", "native", "--steps", "20", "--compact"]);
    let file = runs.text("compressed", "states.csv.gz");
    fs::write(&file, b"no member of gzip").unwrap();
    runs.refused(&["verify", &file], &["states", "cannot be read"]);
    let old = runs.text("compressed", "states.csv.zst");
    fs::write(&old, "").unwrap();
    runs.refused(&["verify", &old], &["states.csv.zst", "Zstandard", "zstd -d"]);
    // A later run in CSV format removes the compressed file.
    runs.run("compressed", &["--solver", "native", "--steps", "20"]);
    assert!(!Path::new(&file).exists());
    let run_file = runs.path("compressed", "run.json");
    let text = fs::read_to_string(&run_file).unwrap();
    let broken = text.replacen("\"every\": 1", "\"every\": 0", 1);
    fs::write(&run_file, broken).unwrap();
    runs.refused(&["verify", &runs.text("compressed", "states.csv")], &["kept.every"]);
}

/// Compressed tables contain the plain text, and every command reads them.
#[test]
fn compressed_tables_equal_plain_ones() {
    let runs = Runs::new();
    let marbles = scenario("marbles");
    let bar = scenario("four-bar");
    let cases: [(&[&str], &str, &[&str]); 3] = [
        (
            &["--solver", "native", "--restitution", "0.3"],
            "300",
            &["states", "contacts", "steps", "trajectory"],
        ),
        (&[&marbles], "120", &["states", "contacts", "steps"]),
        (&[&bar], "60", &["states", "contacts", "steps", "joints"]),
    ];
    let bytes = |run: &str, file: &str| fs::read(runs.path(run, file)).unwrap();
    for (args, steps, tables) in cases {
        runs.run("plain", &[args, &["--steps", steps]].concat());
        runs.run("whole", &[args, &["--steps", steps, "--compact"]].concat());
        runs.run("parts", &[args, &["--steps", "40", "--compact"]].concat());
        runs.run("parts", &["--continue", &runs.text("parts", ""), "--steps", steps]);
        for table in tables {
            let compressed = format!("{table}.csv.gz");
            let mut text = Vec::new();
            let file = bytes("whole", &compressed);
            MultiGzDecoder::new(&file[..]).read_to_end(&mut text).unwrap();
            assert!(text == bytes("plain", &format!("{table}.csv")), "{table}");
            assert!(bytes("parts", &compressed) == bytes("whole", &compressed), "{table}");
        }
        let file = runs.text("whole", &format!("{}.csv.gz", tables[0]));
        for command in [&["verify"][..], &["view"], &["plot"], &["gif", "--gif-size", "100"]] {
            let end = run(&[command, &[&file]].concat());
            assert_eq!(end.code, Some(0), "{command:?}: {end:?}");
        }
    }
}

/// Rows of contacts without force are written on request. Without them every command reads the same
/// run.
#[test]
fn contacts_without_force_have_rows_on_request() {
    let (runs, mut omitted) = (Runs::new(), 0);
    for (name, more) in [("bricks", "--every=1"), ("marbles", "--seed=1"), ("stack", "--every=7")] {
        let args = [&scenario(name), "--steps", "230", more];
        runs.run("some", &args);
        runs.run("all", &[&args[..], &["--all-contacts"]].concat());
        let [some, all] = ["some", "all"].map(|run| runs.lines(run, "contacts.csv"));
        omitted += all.len() - some.len();
        let place = all[0].split(',').position(|column| column == "force_x_N").unwrap();
        let is_loaded =
            |line: &&String| line.split(',').skip(place).take(3).any(|cell| cell != "0.0");
        let [some, all] = [&some, &all].map(|lines| lines.iter().collect::<BTreeSet<_>>());
        assert!(some.is_subset(&all), "{name}");
        assert!(!all.difference(&some).any(is_loaded), "{name}");
        for table in ["states.csv", "steps.csv"] {
            assert!(runs.lines("some", table) == runs.lines("all", table), "{name}: {table}");
        }
        let args: [(&[&str], &str); 3] =
            [(&["verify"], ""), (&["view"], "view.html"), (&["plot"], "plot.svg")];
        for (command, file) in args {
            let done = ["some", "all"].map(|of| {
                let end = run(&[command, &[&runs.text(of, "states.csv")]].concat());
                assert_eq!(end.code, Some(0), "{name}, {command:?}: {end:?}");
                (!file.is_empty()).then(|| fs::read(runs.path(of, file)).unwrap())
            });
            assert!(done[0] == done[1], "{name}: {file}");
        }
    }
    assert!(omitted > 100, "{omitted}");
}

/// Contacts without rows are searched again, so that pieces without a contact cannot pass through
/// each other.
#[test]
fn verify_finds_pieces_that_meet_without_a_contact() {
    let runs = Runs::new();
    let scene = runs.text("", "scene.toml");
    // The ball is in front of the plate at one step and behind it at the next.
    let text = "steps = 3\ngravity = [0, 0, 0]\ntime_step = 0.01\n[[bodies]]\nname = \"ball\"\n\
                sphere = 0.05\nmass = 1.0\nposition = [0.1, 0, 0]\nvelocity = [-30, 0, 0]\n\
                [ground]\nnone = true\nfriction = 0.5\n[[fixed]]\nname = \"plate\"\nbox = [0.02, 1, 1]\n";
    fs::write(&scene, format!("{text}[[apart]]\nbetween = [\"ball\", \"plate\"]\n")).unwrap();
    runs.run("run", &[&scene]);
    let (file, json) = (runs.text("run", "states.csv"), runs.path("run", "run.json"));
    assert_eq!(run(&["verify", &file]).code, Some(0));
    unseal(&json);
    let mut content: serde_json::Value =
        serde_json::from_str(&fs::read_to_string(&json).unwrap()).unwrap();
    let apart = content["model"].as_object_mut().unwrap().remove("apart");
    assert!(apart.is_some(), "{content}");
    fs::write(&json, content.to_string()).unwrap();
    let end = run(&["verify", &file]);
    assert_eq!(end.code, Some(1), "{end:?}");
    assert!(end.stdout.contains("a contact of body 0 that ends"), "{end:?}");
}
