//! Runs that end early: signals, and the choices of `--on-failure` for a step that Ipopt does not
//! solve.
#![cfg(unix)]

use crate::ROOT;
use crate::support::{
    self, FAILING_RUN, LIMIT, ONE_BODY, PROGRAM, Simulated, WRITTEN, everything_in, processor_time,
    run, simulate,
};
use serde_json::{Value, json};
use std::fs::{self, File};
use std::path::PathBuf;
use std::process::{Child, Command, Stdio};
use std::thread::sleep;
use std::time::{Duration, Instant};
use tempfile::TempDir;
use tumble::solver::ipopt::LADDER_RESIDUAL;
use tumble_core::step::StepStatus;
use tumble_scene::output::tables::{IntervalRows, Streams, TablesReader};

/// Runs that take minutes, so that no test reaches their last row.
const IPOPT: [&str; 4] = ["--steps", "100000", "--seed", "42"];
const NATIVE: [&str; 6] = ["--steps", "5000000", "--seed", "42", "--solver", "native"];
/// File size in bytes that guarantees contact. The rows up to the first contact at k = 223 have
/// some 60 kB.
const INTO_CONTACT: u64 = 100_000;
/// Limit of processor time from a signal to the end. The run stops within one iteration, which
/// takes less than a millisecond, and then writes its files.
const AT_ONCE: Duration = Duration::from_secs(1);

/// Running program.
struct Running {
    child: Child,
    directory: TempDir,
    /// Processor time at the last signal.
    before: Duration,
}

/// Command of the program with the default action for SIGHUP, even if the tests run under nohup.
fn program() -> Command {
    let mut command = Command::new("env");
    command.args(["--default-signal=HUP", PROGRAM]);
    command
}

impl Running {
    fn start(args: &[&str]) -> Self {
        Self::start_in(tempfile::tempdir().unwrap(), args)
    }

    fn start_in(directory: TempDir, args: &[&str]) -> Self {
        let mut command = program();
        command.args(args).arg("--out").arg(directory.path().join("out"));
        let child = command.stdout(Stdio::piped()).stderr(Stdio::piped()).spawn().unwrap();
        Self { child, directory, before: Duration::ZERO }
    }

    /// Polls until `done` returns true and kills the program after [`LIMIT`].
    fn wait(&mut self, done: impl Fn(&mut Child) -> bool) {
        let begin = Instant::now();
        while !done(&mut self.child) {
            if begin.elapsed() > LIMIT {
                self.child.kill().unwrap();
                panic!("still waiting after {LIMIT:?}");
            }
            sleep(Duration::from_millis(1));
        }
    }

    /// Waits until the largest file of the run has `bytes` bytes.
    fn wait_for(&mut self, bytes: u64) {
        let out = self.directory.path().join("out");
        self.wait(|child| {
            assert_eq!(child.try_wait().unwrap(), None, "the run has ended");
            let files = fs::read_dir(&out).into_iter().flatten().flatten();
            files.filter_map(|file| Some(file.metadata().ok()?.len())).any(|size| size >= bytes)
        });
    }

    /// Waits until the program has installed its signal handlers.
    fn wait_for_handlers(&mut self) {
        let status = format!("/proc/{}/status", self.child.id());
        self.wait(|_| {
            let status = fs::read_to_string(&status).unwrap_or_default();
            let caught = status.lines().find_map(|line| line.strip_prefix("SigCgt:"));
            let caught = caught.and_then(|mask| u64::from_str_radix(mask.trim(), 16).ok());
            // HUP, INT and TERM have the numbers 1, 2 and 15.
            let asked = 1 | 1 << 1 | 1 << 14;
            caught.is_some_and(|mask| mask & asked == asked)
        });
    }

    fn send(&mut self, signal: &str) {
        self.before = processor_time(self.child.id()).0;
        let id = self.child.id().to_string();
        assert!(Command::new("kill").args(["-s", signal, &id]).status().unwrap().success());
    }

    /// Waits for the end and returns the result with the processor time since the signal.
    fn end(mut self) -> (Simulated, Duration) {
        self.wait(|child| processor_time(child.id()).1);
        let took = processor_time(self.child.id()).0 - self.before;
        let end = self.child.wait_with_output().unwrap().into();
        (Simulated { end, directory: self.directory }, took)
    }
}

/// Rows of a complete run.
fn rows(run: &Simulated) -> Vec<IntervalRows> {
    let open = |name: &str| File::open(run.path(name)).unwrap();
    let streams = Streams {
        states: open("states.csv"),
        contacts: Some(open("contacts.csv")),
        steps: open("steps.csv"),
        joints: None,
        gears: None,
        ends: None,
    };
    let reader = TablesReader::new(streams, ONE_BODY).unwrap();
    let mut reader = reader.without_idle_contacts(true).short(true);
    let mut rows = Vec::new();
    while let Some(row) = reader.next_interval().unwrap() {
        rows.push(row);
    }
    rows
}

/// Asserts that all output files are complete, that run.json counts the rows, and that `verify`
/// accepts them.
fn assert_whole(run: &Simulated, outcome: &str, asked: u64) -> Vec<IntervalRows> {
    assert_eq!(everything_in(&run.path("")), WRITTEN.map(PathBuf::from));
    let (rows, json) = (rows(run), run.run_json());
    let count = |status| rows.iter().filter(|row| row.row.status == status).count();
    let free = count(StepStatus::Free);
    assert_eq!(json["outcome"], outcome);
    assert_eq!(json["steps"], json!(asked));
    for (name, expected) in [
        ("rows", rows.len()),
        ("free_steps", free),
        ("contact_steps", rows.len() - 1 - free),
        ("converged", count(StepStatus::Converged)),
        ("retried", count(StepStatus::Retried)),
        ("fallback", count(StepStatus::Fallback)),
        ("failed", count(StepStatus::Failed)),
    ] {
        assert_eq!(json["summary"][name], json!(expected), "{name}");
    }
    let verified = support::run(&["verify", run.path("states.csv").to_str().unwrap()]);
    let code = if count(StepStatus::Failed) > 0 { 3 } else { 0 };
    assert_eq!(verified.code, Some(code), "{verified:?}");
    rows
}

/// First `count` lines of a run's trajectory.
fn lines(run: &Simulated, count: usize) -> Vec<String> {
    run.csv().lines().take(count).map(str::to_owned).collect()
}

#[test]
fn a_signal_ends_an_ipopt_run_at_once_with_all_its_steps_written() {
    let undisturbed = simulate(&["--steps", "240", "--seed", "42"]);
    for signal in ["INT", "TERM", "HUP"] {
        let mut running = Running::start(&IPOPT);
        running.wait_for(INTO_CONTACT);
        running.send(signal);
        let (run, took) = running.end();
        assert_eq!((run.end.code, run.end.stderr.as_str()), (Some(130), ""), "{signal}");
        assert!(took < AT_ONCE, "{signal}: {took:?}");
        let found = assert_whole(&run, "interrupted", 100_000).len();
        assert!((240..100_000).contains(&found), "{signal}: {found} rows");
        let printed = format!("{found} rows, h = 0.002 s");
        assert!(run.end.stdout.contains(&printed), "{}", run.end.stdout);
        let asked = "interrupted  100000 rows were requested";
        assert!(run.end.stdout.contains(asked), "{}", run.end.stdout);
        // The header and the 239 steps before the signal are the same as without a signal.
        assert_eq!(lines(&run, 240), lines(&undisturbed, 240), "{signal}");
    }
}

#[test]
fn a_signal_ends_a_native_run_at_once_with_all_its_steps_written() {
    let undisturbed = simulate(&["--steps", "1000", "--seed", "42", "--solver", "native"]);
    for signal in ["INT", "TERM", "HUP"] {
        let mut running = Running::start(&NATIVE);
        // Row 1000 ends near 450 kB.
        running.wait_for(1_000_000);
        running.send(signal);
        let (run, took) = running.end();
        assert_eq!((run.end.code, run.end.stderr.as_str()), (Some(130), ""), "{signal}");
        assert!(took < AT_ONCE, "{signal}: {took:?}");
        let found = assert_whole(&run, "interrupted", 5_000_000).len();
        assert!((1000..5_000_000).contains(&found), "{signal}: {found} rows");
        assert_eq!(lines(&run, 1000), lines(&undisturbed, 1000), "{signal}");
    }
}

/// An interrupted run continues to the same tables as an uninterrupted run.
#[test]
fn interrupted_run_continues_to_the_same_tables() {
    let pile = &format!("{ROOT}/scenarios/pile.toml");
    for (args, bytes) in
        [(&["--scene", "drop"][..], INTO_CONTACT), (&[pile.as_str()][..], 20 * INTO_CONTACT)]
    {
        let mut running = Running::start(&[args, &["--steps", "100000"]].concat());
        running.wait_for(bytes);
        running.send("INT");
        let (run, _) = running.end();
        assert_eq!(run.end.code, Some(130), "{:?}", run.end);
        let rows = run.run_json()["summary"]["rows"].as_u64().unwrap() + 30;
        let asked = ["--steps", &rows.to_string()];
        let out = run.path("");
        let end = support::run(&[&["--continue", out.to_str().unwrap()], &asked[..]].concat());
        assert_eq!(end.code, Some(0), "{end:?}");
        let whole = simulate(&[args, &asked].concat());
        for name in everything_in(&out) {
            let [one, other] = [&run, &whole].map(|run| fs::read(run.path(name.to_str().unwrap())));
            if name.extension().is_some_and(|extension| extension == "csv") {
                assert!(one.unwrap() == other.unwrap(), "{} of {rows} rows", name.display());
            }
        }
    }
}

#[test]
fn interrupted_quiet_run_prints_nothing_and_exits_with_130() {
    let hasty = ["--max-iter", "3", "--on-failure", "record", "--quiet"];
    let mut running = Running::start(&[IPOPT.as_slice(), &hasty].concat());
    running.wait_for(INTO_CONTACT);
    running.send("INT");
    let (run, _) = running.end();
    let printed = (run.end.code, run.end.stdout.as_str(), run.end.stderr.as_str());
    assert_eq!(printed, (Some(130), "", ""));
    let found = assert_whole(&run, "interrupted", 100_000);
    assert!(found.iter().any(|row| row.row.status == StepStatus::Failed));
}

/// The output directory is either empty or complete, even if the signal arrives during startup.
#[test]
fn a_signal_at_the_start_leaves_nothing_half_done() {
    for delay in 0..24 {
        let mut running = Running::start(&IPOPT);
        sleep(Duration::from_micros(250 * delay));
        running.send("TERM");
        let (run, _) = running.end();
        match run.end.code {
            Some(code) => {
                assert_eq!(code, 130, "{:?}", run.end);
                assert_whole(&run, "interrupted", 100_000);
            }
            // The signal killed the program before it installed its handlers.
            None => {
                let left = everything_in(run.directory.path());
                assert!(left.is_empty() || left == [PathBuf::from("out")], "{left:?}");
            }
        }
    }
}

/// SIGHUP does not end a run under nohup.
#[cfg(target_os = "linux")]
#[test]
fn under_nohup_a_hangup_changes_nothing() {
    let directory = tempfile::tempdir().unwrap();
    let out = directory.path().join("out");
    let mut command = Command::new("sh");
    command.args(["-c", "trap '' HUP; exec \"$0\" \"$@\"", PROGRAM]).args(NATIVE);
    command.arg("--out").arg(&out).stdout(Stdio::piped()).stderr(Stdio::piped());
    let mut running =
        Running { child: command.spawn().unwrap(), directory, before: Duration::ZERO };
    running.wait_for(INTO_CONTACT);
    running.send("HUP");
    sleep(Duration::from_millis(300));
    assert_eq!(running.child.try_wait().unwrap(), None, "the run has ended");
    running.send("TERM");
    let (run, _) = running.end();
    assert_eq!(run.end.code, Some(130));
}

/// A signal stops the drawing of a picture, and no file remains.
#[test]
#[ignore = "slow"]
fn a_signal_ends_a_picture_at_once_and_leaves_nothing() {
    let simulated = simulate(&["--steps", "20000", "--solver", "native"]);
    let csv = simulated.path("states.csv");
    let before = everything_in(simulated.directory.path());
    let commands: [&[&str]; 3] =
        [&["gif", "--gif-speed", "0.5", "--gif-size", "1000"], &["plot"], &["view"]];
    for args in commands {
        for signal in ["INT", "TERM", "HUP"] {
            let mut command = program();
            command.args(args).arg(&csv).stdout(Stdio::piped()).stderr(Stdio::piped());
            let directory = tempfile::tempdir().unwrap();
            let child = command.spawn().unwrap();
            let mut running = Running { child, directory, before: Duration::ZERO };
            running.wait_for_handlers();
            // The time lets the program get into reading, and for the GIF into drawing.
            sleep(Duration::from_millis(if args[0] == "gif" { 2000 } else { 30 }));
            running.send(signal);
            let (run, took) = running.end();
            let printed = (run.end.code, run.end.stdout.as_str(), run.end.stderr.as_str());
            assert_eq!(printed, (Some(130), "", ""), "{args:?} {signal}");
            assert!(took < AT_ONCE, "{args:?} {signal}: {took:?}");
            assert_eq!(everything_in(simulated.directory.path()), before, "{args:?} {signal}");
        }
    }
}

#[test]
fn a_run_that_is_killed_leaves_the_files_of_the_run_before() {
    for args in [IPOPT.as_slice(), &NATIVE] {
        let before = simulate(&["--steps", "5"]);
        let (csv, json) = (before.csv(), before.run_json());
        let mut running = Running::start_in(before.directory, args);
        running.wait_for(INTO_CONTACT);
        running.send("KILL");
        let (run, _) = running.end();
        assert_eq!(run.end.code, None);
        assert_eq!((run.csv(), run.run_json()), (csv, json));
    }
}

/// Iteration limit at which Ipopt solves only some steps.
const HASTY: [&str; 4] = ["--steps", "260", "--max-iter", "3"];

fn hasty(on_failure: &str) -> Simulated {
    simulate(&[HASTY.as_slice(), &["--on-failure", on_failure]].concat())
}

#[test]
fn record_writes_every_step_and_ends_with_code_3() {
    let run = hasty("record");
    assert_eq!((run.end.code, run.end.stderr.as_str()), (Some(3), ""));
    let rows = assert_whole(&run, "complete", 260);
    assert_eq!(rows.len(), 260);
    assert!(rows.iter().any(|row| row.row.status == StepStatus::Failed));
    let json = run.run_json();
    assert_eq!(json["solver"]["on_failure"], "record");
    // Without a ladder there are no rungs.
    assert_eq!(json["summary"]["rungs"], json!({}));
    assert!(rows.iter().all(|row| row.row.iterations <= 3), "the limit is for every step");
}

#[test]
fn stop_ends_the_file_before_the_first_step_that_failed() {
    // The first step of the failing run may fail. The start is then the only row.
    for args in [HASTY.as_slice(), &FAILING_RUN] {
        let with = |choice| simulate(&[args, &["--exact", "--on-failure", choice]].concat());
        let (recorded, stopped) = (with("record"), with("stop"));
        let failed = rows(&recorded).iter().position(|row| row.row.status == StepStatus::Failed);
        let first = failed.expect("a step that fails");
        assert_eq!((stopped.end.code, stopped.end.stderr.as_str()), (Some(3), ""));
        let found = assert_whole(&stopped, "stopped", args[1].parse().unwrap());
        assert_eq!(found.len(), first + 1, "the last row is the state before that step");
        assert_eq!(found[first].states, rows(&recorded)[first].states);
        assert_eq!(lines(&stopped, first + 1), lines(&recorded, first + 1));
        let printed = format!("stopped      step k = {first} was not solved");
        assert!(stopped.end.stdout.contains(&printed), "{}", stopped.end.stdout);
    }
}

/// Sum of the counts of the rungs `names`.
fn rungs(json: &Value, names: &[&str]) -> u64 {
    let rungs = json["summary"]["rungs"].as_object().unwrap();
    names.iter().filter_map(|&name| rungs.get(name)?.as_u64()).sum()
}

#[test]
fn ladder_solves_every_step_and_reports_the_rung() {
    for args in [&HASTY, &["--steps", "400", "--seed", "0"], &["--steps", "400", "--seed", "2"]] {
        let run = simulate(args);
        assert_eq!((run.end.code, run.end.stderr.as_str()), (Some(0), ""), "{args:?}");
        let rows = assert_whole(&run, "complete", args[1].parse().unwrap());
        let json = run.run_json();
        assert_eq!(json["solver"]["on_failure"], "ladder");
        let summary = &json["summary"];
        let all = summary["rungs"].as_object().unwrap().values();
        let all: u64 = all.map(|count| count.as_u64().unwrap()).sum();
        assert_eq!(summary["contact_steps"], all, "{args:?}");
        assert_eq!(summary["failed"], 0, "{args:?}");
        for (status, names) in [
            ("converged", ["warm", "previous"].as_slice()),
            ("retried", &["native_start", "free_flight", "shared_weight"]),
            ("fallback", &["native"]),
        ] {
            assert_eq!(summary[status], rungs(&json, names), "{args:?}: {status}");
        }
        for row in rows {
            assert!(row.row.residual <= LADDER_RESIDUAL, "{args:?}: k = {}", row.row.index);
        }
        if args[2] == "--max-iter" {
            assert!(summary["fallback"].as_u64().unwrap() > 0, "three iterations solve it all");
        }
    }
}

/// Choices of `--on-failure` that the solver or scene does not support are refused.
#[test]
fn unsupported_failure_choices_are_rejected() {
    for (args, words) in [
        (["--solver", "native", "--on-failure", "ladder"], ["--on-failure", "native"]),
        (["--scene", "floating", "--on-failure", "record"], ["--on-failure", "floating"]),
        (["--solver", "ipopt", "--on-failure", "ignore"], ["--on-failure", "ladder, record, stop"]),
    ] {
        run(&args).assert_refused(2, &words);
    }
}

/// A signal ends planning without a plan only before the first complete run. Later a signal cannot
/// prevent the output of the plan found so far.
#[test]
fn a_plan_is_written_or_not_begun() {
    let directory = tempfile::tempdir().unwrap();
    let scene = PathBuf::from(ROOT).join("scenarios/plans/box.toml");
    let problem = directory.path().join("long.toml");
    let text = format!(
        "scene = {:?}\nsteps = 100000\n[[controls]]\nkind = \"force\"\nx = [-20, 20]\nknots = 1\n\
         [target]\nx = 1\n",
        scene.to_str().unwrap()
    );
    fs::write(&problem, text).unwrap();
    let problem = problem.to_str().unwrap();
    let args = ["plan", problem, "--replay"];
    let mut early = Running::start(&args);
    let out = early.directory.path().join("out");
    early.wait(|_| out.exists());
    early.send("INT");
    let (early, took) = early.end();
    assert!(early.end.code == Some(130) && took < AT_ONCE, "{:?} {took:?}", early.end);
    assert!(early.end.stdout.contains("before the first run was complete"), "{:?}", early.end);
    assert_eq!(everything_in(early.directory.path()), ["out"].map(PathBuf::from));

    // Rows are written to temporary files during the run.
    let mut late = Running::start(&args);
    late.wait_for(1);
    late.send("INT");
    let (late, _) = late.end();
    assert_eq!((late.end.code, late.end.stderr.as_str()), (Some(3), ""));
    assert!(late.path("plan.json").exists() && late.path("states.csv").exists());
}
