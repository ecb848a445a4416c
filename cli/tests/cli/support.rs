//! Helpers that run the program and read its files.

use assert_cmd::Command;
use serde_json::Value;
use std::fmt::Write as _;
use std::fs;
use std::path::{Path, PathBuf};
use std::process::Output;
use std::sync::OnceLock;
use std::time::Duration;
use tempfile::TempDir;
use tumble_scene::output::tables::{Table as RunTable, TableShape};

pub const PROGRAM: &str = env!("CARGO_BIN_EXE_tumble");

/// Time limit of a program that hangs. Commands take a few seconds, and more on a busy machine.
pub const LIMIT: Duration = Duration::from_secs(600);

/// Command of the program with the time limit [`LIMIT`].
pub fn tumble() -> Command {
    let mut command = Command::new(PROGRAM);
    command.timeout(LIMIT);
    command
}

/// Units of processor time in a second in Linux' `/proc` files.
const TICKS: u32 = 100;

/// Processor time of process `id`, and true if the process has ended. A process that has ended
/// keeps its times until it is reaped.
pub fn processor_time(id: u32) -> (Duration, bool) {
    let stat = fs::read_to_string(format!("/proc/{id}/stat")).unwrap();
    // The name may contain blanks. After it come the state and, in fields 12 and 13, the user and
    // system times.
    let fields: Vec<&str> = stat.rsplit_once(')').unwrap().1.split_whitespace().collect();
    let ticks: u32 = fields[11..13].iter().map(|ticks| ticks.parse::<u32>().unwrap()).sum();
    (Duration::from_secs(1) * ticks / TICKS, fields[0] == "Z")
}

/// Exit code and text streams of a finished command.
#[derive(Debug)]
pub struct End {
    pub code: Option<i32>,
    pub stdout: String,
    pub stderr: String,
}

impl From<Output> for End {
    fn from(output: Output) -> Self {
        Self {
            code: output.status.code(),
            stdout: String::from_utf8(output.stdout).unwrap(),
            stderr: String::from_utf8(output.stderr).unwrap(),
        }
    }
}

impl End {
    /// Asserts a refusal: exit code `code`, empty standard output and one line on standard error.
    /// The line must contain every string of `words`.
    pub fn assert_refused(&self, code: i32, words: &[&str]) {
        assert_eq!(self.code, Some(code), "{self:?}");
        assert_eq!(self.stdout, "", "{self:?}");
        let line = self.stderr.strip_prefix("error: ").expect("an error is named as one");
        assert_eq!(line.matches('\n').count(), 1, "{self:?}");
        assert!(line.ends_with('\n') && line.len() > 2, "{self:?}");
        for word in words {
            assert!(line.contains(word), "{word:?} is missing: {self:?}");
        }
        assert!(!line.contains("panicked"), "{self:?}");
    }
}

pub fn run<S: AsRef<std::ffi::OsStr>>(args: &[S]) -> End {
    tumble().args(args).output().unwrap().into()
}

/// Finished simulation in a temporary directory.
pub struct Simulated {
    pub end: End,
    pub directory: TempDir,
}

/// Runs a simulation with `args`. Its `--out` directory does not exist yet.
pub fn simulate(args: &[&str]) -> Simulated {
    let directory = tempfile::tempdir().unwrap();
    let out = directory.path().join("out");
    let end = tumble().args(args).arg("--out").arg(out).output().unwrap().into();
    Simulated { end, directory }
}

impl Simulated {
    pub fn path(&self, name: &str) -> PathBuf {
        self.directory.path().join("out").join(name)
    }

    /// Export of a run of the tutorial's scene.
    pub fn csv(&self) -> String {
        fs::read_to_string(self.path("trajectory.csv")).unwrap()
    }

    pub fn table(&self) -> Table {
        Table::parse(&self.csv())
    }

    pub fn run_json(&self) -> Value {
        serde_json::from_str(&fs::read_to_string(self.path("run.json")).unwrap()).unwrap()
    }
}

/// Default drop over 240 rows. Contact begins near row 223.
pub const CONTACT_RUN: [&str; 2] = ["--steps", "240"];

/// Run with steps that neither solver can solve. The body has the least inertia that is allowed,
/// turns 350 radians a step and hits the ground at 100 km/s.
pub const FAILING_RUN: [&str; 16] = [
    "--steps",
    "4",
    "--set",
    "start.position=0,0,1.7",
    "--set",
    "start.velocity=1e5,1e5,-1e5",
    "--set",
    "body.mass=1",
    "--set",
    "body.inertia=1e-5",
    "--set",
    "start.spin=1e5,1e5,1e5",
    "--mu",
    "10",
    "--seed",
    "1",
];

/// Text of run.json without its checksums. Tests use it to see which other check detects a change.
pub fn unsealed(run_json: &str) -> String {
    let at = run_json.find(",\n  \"checksums\": {").expect("checksums, the last of a run.json");
    format!("{}\n}}\n", &run_json[..at])
}

/// Removes the checksums from the run.json at `path`.
pub fn unseal(path: &Path) {
    let text = fs::read_to_string(path).unwrap();
    fs::write(path, unsealed(&text)).unwrap();
}

/// Files of a run of the tutorial's scene without pictures, in their order.
pub const WRITTEN: [&str; 6] =
    ["contacts.csv", "run.json", "state.bin", "states.csv", "steps.csv", "trajectory.csv"];

/// Tables and run.json of a run without joints.
pub const READ: [&str; 4] = ["states.csv", "contacts.csv", "steps.csv", "run.json"];

/// Texts of [`READ`] of [`CONTACT_RUN`], simulated once. The run.json has no checksums.
pub fn contact_run() -> &'static [String; 4] {
    static RUN: OnceLock<[String; 4]> = OnceLock::new();
    RUN.get_or_init(|| {
        let run = simulate(&CONTACT_RUN);
        assert_eq!(run.end.code, Some(0), "{:?}", run.end);
        unseal(&run.path("run.json"));
        READ.map(|name| fs::read_to_string(run.path(name)).unwrap())
    })
}

/// Shape of the tables of the tutorial's cube.
pub const ONE_BODY: TableShape = TableShape {
    bodies: 1,
    joints: 0,
    gears: 0,
    has_middles: false,
    has_errors: false,
    has_moments: false,
};

/// Temporary directory with the files of [`contact_run`].
pub fn contact_files() -> TempDir {
    let directory = tempfile::tempdir().unwrap();
    for (name, text) in READ.iter().zip(contact_run()) {
        fs::write(directory.path().join(name), text).unwrap();
    }
    directory
}

/// Files of a run of `rows` rows of a resting cube, except for two impacts of one step each. The
/// first impact has status `failed`, the other steps have `status`.
pub fn two_impacts(rows: u64, status: &str) -> TempDir {
    let directory = contact_files();
    let header = |table: RunTable| table.columns(&ONE_BODY).join(",") + "\n";
    let [mut states, mut contacts, mut steps] = RunTable::ALWAYS.map(header);
    for k in 0..rows {
        let (z, force, status) = match k {
            77_777 => (9.0, 20_000.0, "failed"),
            123_456 => (-3.0, 25.0, status),
            _ if k == rows - 1 => (1.0, 0.0, "end"),
            _ => (1.0, 25.0, status),
        };
        let (time, energy) = (k as f64 * 0.002, 98.1 * z);
        let length = if status == "end" { 0.0 } else { 0.002 };
        let _ = writeln!(states, "{k},{time},0,0,0,{z},1,0,0,0,0,0,0,0,0,0,0,{length}");
        let forces = if status == "end" { &[][..] } else { &[force, 25.0] };
        for (contact, force) in forces.iter().enumerate() {
            let point = if contact == 0 { "-1,-1,0" } else { "1,-1,0" };
            let _ = writeln!(
                contacts,
                "{k},{k},{contact},0,ground,0,{point},0,0,1,0,0,{force},0,0,0,0,0,0,{contact},0.3,0,{length}"
            );
        }
        let count = forces.len();
        let _ = writeln!(
            steps,
            "{k},{time},{status},3,previous,{count},1e-9,0,0,0,0,0,0,0,1,{energy},0,0,0,0,0,0,0,{length}"
        );
    }
    for (name, text) in READ.iter().zip([states, contacts, steps]) {
        fs::write(directory.path().join(name), text).unwrap();
    }
    directory
}

/// CSV file split into fields.
#[derive(Clone)]
pub struct Table {
    pub header: Vec<String>,
    pub rows: Vec<Vec<String>>,
}

impl Table {
    pub fn parse(text: &str) -> Self {
        let mut lines =
            text.lines().map(|line| line.split(',').map(str::to_owned).collect::<Vec<_>>());
        let header = lines.next().unwrap();
        Self { header, rows: lines.collect() }
    }

    /// The table `contacts` with a row for each step, in the order of steps and contacts.
    pub fn of_each_step(self) -> Self {
        let [first, last, number] = ["k", "last_k", "contact"].map(|name| self.column(name));
        let whole = |row: &[String], column: usize| row[column].parse::<u64>().unwrap();
        let mut rows = Vec::new();
        for row in &self.rows {
            for k in whole(row, first)..=whole(row, last) {
                let mut row = row.clone();
                row[first] = k.to_string();
                row[last] = k.to_string();
                rows.push(row);
            }
        }
        let interval = self.column("interval");
        let order = [first, interval, number];
        rows.sort_by_key(|row| order.map(|column| whole(row, column)));
        Self { rows, ..self }
    }

    /// The table `states` with a row for each body and step, also of unchanged states.
    pub fn of_each_body(self, bodies: usize) -> Self {
        let whole = |row: &[String], column: usize| row[column].parse::<usize>().unwrap();
        let interval = self.column("interval");
        let mut rows: Vec<Vec<String>> = Vec::new();
        for row in &self.rows {
            // Only whole steps lack rows.
            while whole(row, interval) == 0 && rows.len() >= bodies {
                let mut next = rows[rows.len() - bodies].clone();
                next[0] = (whole(&next, 0) + 1).to_string();
                if [0, 2].map(|column| whole(row, column) == whole(&next, column)) == [true; 2] {
                    break;
                }
                rows.push(next);
            }
            rows.push(row.clone());
        }
        Self { rows, ..self }
    }

    pub fn text(&self) -> String {
        let lines = std::iter::once(&self.header).chain(&self.rows);
        lines.map(|fields| fields.join(",") + "\n").collect()
    }

    pub fn column(&self, name: &str) -> usize {
        self.header.iter().position(|column| column == name).unwrap()
    }

    /// Fields of one column.
    pub fn texts(&self, name: &str) -> Vec<&str> {
        let column = self.column(name);
        self.rows.iter().map(|row| row[column].as_str()).collect()
    }

    pub fn numbers(&self, name: &str) -> Vec<f64> {
        self.texts(name).iter().map(|text| text.parse().unwrap()).collect()
    }
}

/// Sorted relative paths of all files and directories below `directory`.
pub fn everything_in(directory: &Path) -> Vec<PathBuf> {
    let mut found = Vec::new();
    let mut open = vec![directory.to_owned()];
    while let Some(next) = open.pop() {
        for entry in fs::read_dir(&next).unwrap() {
            let path = entry.unwrap().path();
            if path.is_dir() {
                open.push(path.clone());
            }
            found.push(path.strip_prefix(directory).unwrap().to_owned());
        }
    }
    found.sort();
    found
}
