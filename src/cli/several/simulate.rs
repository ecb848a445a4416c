//! A run of several bodies: three tables and a run file.

use super::describe::describe;
use super::job::{self, Job};
use super::tables::RunTables;
use crate::cli::args::SimulateArgs;
use crate::cli::choices::OnFailure;
use crate::cli::directory::OutputDirectory;
use crate::cli::outcome::{Failure, Outcome};
use crate::cli::output::{PendingFile, Voice, progress_bar};
use crate::cli::pictures::{self, Pictures};
use crate::cli::recording::Recording;
use crate::cli::run::{End, Run};
use crate::cli::shown;
use crate::cli::signals::raise_on_signals;
use std::fmt::Write as _;
use std::fs::File;
use std::io::{self, BufWriter, Write};
use std::path::Path;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::{Duration, Instant};
use tumble::error::Error;
use tumble::simulation::summary::RunSummary;
use tumble::simulation::tables::{Streams, Table, TablesWriter};
use tumble::simulation::{Simulation, StepRecord};
use tumble::step::StepStatus;

/// Simulates the scenario `path`, whose text is `text`.
pub fn run(args: &SimulateArgs, path: &Path, text: &str) -> Result<Outcome, Failure> {
    let job = job::new(args, path, text)?;
    pictures::check(args, job.rows, job.world.time_step())?;
    let interrupt = Arc::new(AtomicBool::new(false));
    let mut simulation = job.simulation(&interrupt)?;

    // Before the first file: a signal that comes earlier would leave it behind.
    raise_on_signals(&interrupt)?;
    let out = OutputDirectory::for_run(&args.out)?;
    let file = |table: Table| PendingFile::create(&out, &format!("{table}.csv"));
    let [states, contacts, steps] = Table::ALL.map(file);
    let tables = Streams { states: states?, contacts: contacts?, steps: steps? };
    let run_json = PendingFile::create(&out, "run.json")?;
    let pictures = Pictures::create(args, &out)?;
    let (run, overlap) = write_tables(&job, &mut simulation, &interrupt, &tables, args.quiet)?;

    let largest = overlap.map_or(0.0, |(_, overlap)| overlap);
    let run_file = job::run_file(&job, &run, largest);
    run_json.write(run_file.write()?.as_bytes())?;
    let Streams { states, contacts, steps } = tables;
    let mut written = Vec::new();
    let states = states.publish()?;
    written.push(shown::path(&states));
    for file in [contacts, steps, run_json] {
        written.push(shown::path(&file.publish()?));
    }
    let removed = out.remove_pictures()?;
    let mut voice = Voice::new(args.quiet);
    let mut text = describe(&job, &run, overlap);
    let _ = writeln!(text, "wrote {}", written.join(", "));
    if !removed.is_empty() {
        let _ = writeln!(text, "removed {} of an earlier run", removed.join(", "));
    }
    voice.say(&text);
    // What ended the run does not end the pictures of it, but what comes after does.
    interrupt.store(false, Ordering::Relaxed);
    let gif = (args.gif && run.end != End::Interrupted).then_some((args, &out));
    let open = || {
        let tables = RunTables::of_run(&states, run_file)?;
        Ok(Recording::Several(Box::new(tables)))
    };
    let drawn = pictures.draw(open, gif, &mut voice, &interrupt)?;
    voice.end(match run.end {
        End::Interrupted => Outcome::Interrupted,
        _ if !drawn => Outcome::Interrupted,
        End::Stopped => Outcome::Unconverged,
        End::Complete if run.summary.failed > 0 => Outcome::Unconverged,
        End::Complete => Outcome::Done,
    })
}

/// Runs the simulation and writes every row. Returns the largest overlap too, and after which step
/// it was.
fn write_tables(
    job: &Job,
    simulation: &mut Simulation<'_>,
    interrupt: &AtomicBool,
    files: &Streams<PendingFile>,
    quiet: bool,
) -> Result<(Run, Option<(u64, f64)>), Failure> {
    let csv_failed = |error: csv::Error| match error.into_kind() {
        csv::ErrorKind::Io(error) => files.states.failed(&error),
        other => Failure::Other(format!("the tables cannot be written: {other:?}")),
    };
    let streams = Streams {
        states: files.states.stream()?,
        contacts: files.contacts.stream()?,
        steps: files.steps.stream()?,
    };
    let mut writer = TablesWriter::new(streams, &job.world).map_err(csv_failed)?;
    let mut record = StepRecord::new();
    let (mut summary, mut elapsed) = (RunSummary::default(), Duration::ZERO);
    let (mut end, mut overlap) = (End::Complete, None::<(u64, f64)>);
    let bar = progress_bar(job.rows - 1, "steps", quiet);
    for _ in 1..job.rows {
        let clock = Instant::now();
        end = advance(job, simulation, interrupt, &mut record)?;
        elapsed += clock.elapsed();
        if end != End::Complete {
            break;
        }
        summary.add(&record);
        if overlap.is_none_or(|(_, largest)| record.overlap > largest) {
            overlap = Some((record.index, record.overlap));
        }
        writer.write(&record).map_err(csv_failed)?;
        bar.inc(1);
    }
    simulation.end(&mut record);
    writer.write(&record).map_err(csv_failed)?;
    finish(writer).map_err(|error| files.states.failed(&error))?;
    bar.finish_and_clear();
    Ok((Run { end, summary, elapsed }, overlap))
}

/// Everything down to the disk: a full one must be noticed before the files get their names.
fn finish(writer: TablesWriter<BufWriter<File>>) -> io::Result<()> {
    let Streams { states, contacts, steps } = writer.finish()?;
    for mut stream in [states, contacts, steps] {
        stream.flush()?;
        stream.get_ref().sync_all()?;
    }
    Ok(())
}

/// One step, unless the run ends before it.
fn advance(
    job: &Job,
    simulation: &mut Simulation<'_>,
    interrupt: &AtomicBool,
    record: &mut StepRecord,
) -> Result<End, Failure> {
    if interrupt.load(Ordering::Relaxed) {
        return Ok(End::Interrupted);
    }
    match simulation.step(record) {
        Ok(()) => {}
        Err(Error::Interrupted) => return Ok(End::Interrupted),
        Err(error) => return Err(error.into()),
    }
    let stops = job.contact.on_failure == OnFailure::Stop;
    if stops && record.report.status == StepStatus::Failed {
        simulation.take_back(record);
        return Ok(End::Stopped);
    }
    Ok(End::Complete)
}
