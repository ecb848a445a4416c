//! `tumble plan`: searches controls with which a scene meets its targets, and writes their run.
//!
//! `controls` reads and writes controls.csv, `report` the results as JSON and text, `page` the HTML
//! page.

mod controls;
mod page;
mod report;

use super::args::PlanArgs;
use super::checkpoint::{ContinuedNotes, state_bytes};
use super::directory::{OutputClaims, OutputDirectory};
use super::file_names::{self, PLAN_FILES, RUN_JSON, STATE};
use super::outcome::{Failure, Outcome};
use super::output::{PendingFile, StderrReporter, spinner};
use super::results::RunResults;
use super::run::{self, RunOutputs};
use super::signals::raise_on_signals;
use super::writer::{RunWriter, WrittenFiles, publish};
use super::{input, scenario};
use controls::Read;
use rayon::ThreadPoolBuilder;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::Instant;
use tumble_model::shown;
use tumble_plan::file::{ProblemFile, SearchStart};
use tumble_plan::{Plan, PlanError, PlanStatus, SearchProgress, SearchWatch, Stage};
use tumble_scene::row_selection::{RowSelection, TableForm};
use tumble_scene::run_file::RunFile;
use tumble_scene::written;

/// Runs the command: search from the initial controls, simulation of the result, output files.
///
/// With `--replay` the initial controls are simulated without a search.
pub fn run(args: &PlanArgs) -> Result<Outcome, Failure> {
    let text = scenario::read_text(&args.file)?;
    let file = ProblemFile::from_text(&text, &args.file, &input::bytes)?;
    let problem = &file.problem;
    if args.start.is_none() && !args.replay {
        file.check_stages().map_err(|why| refused(args, &PlanError::Problem(why)))?;
    }
    let (start, note) = match (&args.start, &file.start) {
        (Some(path), _) | (None, SearchStart::File(path)) => {
            let Read { controls, changed } = controls::read(problem, path)?;
            let note = format!("{}: {}", shown::path(path), changed.join("; "));
            if args.replay && !changed.is_empty() {
                return Err(Failure::Input(format!(
                    "{note}: --replay needs a table without adjustments"
                )));
            }
            (controls, Some(note).filter(|_| !changed.is_empty()))
        }
        (None, SearchStart::Zero) => (problem.zero(), None),
    };
    let stages = if args.replay { Vec::new() } else { file.built_stages() };
    stages.iter().try_for_each(|stage| stage.check(problem)).map_err(|why| refused(args, &why))?;
    let interrupt = Arc::new(AtomicBool::new(false));
    raise_on_signals(&interrupt)?;
    let mut usual = RowSelection::new(1, None, true, TableForm::Csv);
    usual.short = true;
    let mut names = RunWriter::names(problem.scene(), &usual);
    names.extend([RUN_JSON, STATE].into_iter().chain(PLAN_FILES).map(str::to_owned));
    let claims = OutputClaims {
        files: names.clone(),
        alike: file_names::row_files().collect(),
        overwrite: args.overwrite,
        continues: false,
    };
    let out = OutputDirectory::for_run(&args.out, claims)?;
    let mut reporter = StderrReporter::new(args.quiet);
    if let Some(note) = note {
        reporter.note(&note);
    }
    let Some((plan, costs)) = search(args, &file, &stages, &start, &interrupt)? else {
        reporter.say("interrupted before the first run was complete; nothing is written\n");
        return reporter.end(Outcome::Interrupted);
    };
    // An interrupt ends the search. The simulation that writes the plan ignores interrupts.
    let interrupted = interrupt.load(Ordering::Relaxed);
    let never = Arc::new(AtomicBool::new(false));
    let scene = problem.scene_of(&plan.replay)?;
    let mut simulation = scene.simulation(&never)?;
    let mut writer = RunWriter::create(&scene, &usual, &out, None)?;
    let outputs = RunOutputs { writer: &mut writer, exported: None, checkpoints: None };
    let run =
        run::run(&scene, &mut simulation, RunResults::new(&scene), &never, outputs, args.quiet)?;
    if plan.replay.states.last().map(Vec::as_slice) != Some(simulation.states()) {
        let why = "the run of the plan differs from its replay; this is a bug in tumble";
        return Err(Failure::Other(why.to_owned()));
    }
    let WrittenFiles { mut files, checksums, omitted, before_end } = writer.finish()?;
    let mut file = |name: &str, bytes: &[u8]| {
        let file = PendingFile::create(&out, name)?;
        file.write(bytes)?;
        files.push(file);
        Ok::<_, Failure>(())
    };
    let mut run_file = RunFile::new(&scene, &run.ended())?;
    // Some scenes cannot be written as a scenario. The problem file and controls.csv still describe
    // their plan.
    let [csv, json, html, toml] = PLAN_FILES;
    let scenario = written::text(&scene).ok();
    names.retain(|name| name != toml || scenario.is_some());
    names.retain(|name| omitted.as_ref() != Some(name));
    (run_file.files, run_file.checksums, run_file.kept) = (names, checksums, usual);
    file(RUN_JSON, run_file.text()?.as_bytes())?;
    let notes = ContinuedNotes { rows: before_end, run };
    file(STATE, &state_bytes(simulation.save(), &notes)?)?;
    file(csv, &controls::table(problem, &plan.replay.controls)?)?;
    file(json, report::json(problem, &plan, interrupted)?.as_bytes())?;
    file(html, page::page(problem, &plan, costs).as_bytes())?;
    if let Some(text) = scenario {
        file(toml, text.as_bytes())?;
    }
    let (_, lines) = publish(files, &out)?;
    reporter.say(&(report::described(problem, &plan) + &lines));
    reporter.end(match plan.status {
        _ if interrupted => Outcome::Interrupted,
        PlanStatus::Replayed => Outcome::Done,
        PlanStatus::Missed | PlanStatus::Failed => Outcome::Unconverged,
    })
}

/// Searches the plan on the requested threads within the time limit. Also returns the cost after
/// every iteration.
///
/// `None` if the search was interrupted before its first run was complete.
fn search(
    args: &PlanArgs,
    file: &ProblemFile,
    stages: &[Box<dyn Stage>],
    start: &[f64],
    interrupt: &Arc<AtomicBool>,
) -> Result<Option<(Plan, Vec<f64>)>, Failure> {
    let mut pool = ThreadPoolBuilder::new();
    if let Some(threads) = args.threads {
        pool = pool.num_threads(threads.get());
    }
    let pool = pool
        .build()
        .map_err(|error| Failure::Other(format!("the threads cannot be started: {error}")))?;
    let (clock, time) = (Instant::now(), args.time.or(file.time));
    let (bar, mut costs) = (spinner(args.quiet), Vec::new());
    let mut progress = |progress: &SearchProgress<'_>| {
        let SearchProgress { stage, iteration, cost, .. } = progress;
        bar.set_message(format!("{stage} {iteration}: J {cost:.6}"));
        bar.tick();
        costs.push(*cost);
        time.is_none_or(|time| clock.elapsed().as_secs_f64() < time)
    };
    let mut watch = SearchWatch { interrupt, progress: &mut progress };
    let plan = pool.install(|| file.problem.plan(start, stages, &mut watch));
    bar.finish_and_clear();
    match plan {
        Ok(plan) => Ok(Some((plan, costs))),
        Err(PlanError::Interrupted) => Ok(None),
        Err(why) => Err(refused(args, &why)),
    }
}

/// Error about the planning problem, with the name of its file.
fn refused(args: &PlanArgs, why: &PlanError) -> Failure {
    Failure::Input(format!("{}: {why}", shown::path(&args.file)))
}
