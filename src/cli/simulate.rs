//! The main job: simulate a scene, write the trajectory and the run file, say how it went.

use super::args::SimulateArgs;
use super::choices::OnFailure;
use super::describe::describe;
use super::directory::OutputDirectory;
use super::job::{self, Job};
use super::outcome::{Failure, Outcome};
use super::output::{PendingFile, Voice, progress_bar};
use super::pictures::{self, Pictures};
use super::recording::Recording;
use super::run::{End, Run};
use super::run_file::RunFile;
use super::scenario;
use super::several;
use super::shown;
use super::signals::raise_on_signals;
use std::fmt::Write as _;
use std::fs::File;
use std::io::{self, BufWriter, Write};
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::{Duration, Instant};
use tumble::error::Error;
use tumble::simulation::summary::RunSummary;
use tumble::simulation::trajectory::TrajectoryWriter;
use tumble::simulation::{Simulation, StepRecord};
use tumble::step::StepStatus;

/// Steps between two looks at the clock, so that looking costs nothing.
const CHUNK: usize = 64;

pub fn run(args: &SimulateArgs) -> Result<Outcome, Failure> {
    if let Some(path) = &args.scenario {
        let text = scenario::read_text(path)?;
        if several::is_scenario(&text) {
            return several::simulate(args, path, &text);
        }
    }
    let job = job::new(args)?;
    pictures::check(args, job.rows, job.physics.time_step())?;
    let interrupt = Arc::new(AtomicBool::new(false));
    let mut simulation = job.simulation(&interrupt)?;

    // Before the first file: a signal that comes earlier would leave it behind.
    raise_on_signals(&interrupt)?;
    let out = OutputDirectory::for_run(&args.out)?;
    let mut voice = Voice::new(args.quiet);
    if let Some(note) = job::note(&job) {
        voice.say(&note);
    }
    let trajectory = PendingFile::create(&out, "trajectory.csv")?;
    let run_json = PendingFile::create(&out, "run.json")?;
    let pictures = Pictures::create(args, &out)?;
    let run = write_trajectory(&job, &mut simulation, &interrupt, &trajectory, args.quiet)?;

    write_run_file(&run_json, &job::run_file(&job, &run))?;
    let trajectory = trajectory.publish()?;
    let run_json = run_json.publish()?;
    let removed = out.remove_pictures()?;
    let mut text = describe(&job, &run);
    let names = [&trajectory, &run_json].map(|path| shown::path(path));
    let _ = writeln!(text, "wrote {}", names.join(" and "));
    if !removed.is_empty() {
        let _ = writeln!(text, "removed {} of an earlier run", removed.join(", "));
    }
    voice.say(&text);
    // What ended the run does not end the pictures of it, but what comes after does.
    interrupt.store(false, Ordering::Relaxed);
    let gif = (args.gif && run.end != End::Interrupted).then_some((args, &out));
    let open = || Recording::open(&trajectory, &args.physics);
    let drawn = pictures.draw(open, gif, &mut voice, &interrupt)?;
    voice.end(match run.end {
        End::Interrupted => Outcome::Interrupted,
        _ if !drawn => Outcome::Interrupted,
        End::Stopped => Outcome::Unconverged,
        End::Complete if run.summary.failed > 0 => Outcome::Unconverged,
        End::Complete => Outcome::Done,
    })
}

/// Runs the simulation and writes every row.
fn write_trajectory(
    job: &Job,
    simulation: &mut Simulation<'_>,
    interrupt: &AtomicBool,
    file: &PendingFile,
    quiet: bool,
) -> Result<Run, Failure> {
    let csv_failed = |error: csv::Error| match error.into_kind() {
        csv::ErrorKind::Io(error) => file.failed(&error),
        other => Failure::Other(format!("the trajectory cannot be written: {other:?}")),
    };
    let mut writer =
        TrajectoryWriter::new(file.stream()?, &job.physics.world).map_err(csv_failed)?;
    let mut records = vec![StepRecord::new(); CHUNK];
    let (mut summary, mut elapsed) = (RunSummary::default(), Duration::ZERO);
    let mut end = End::Complete;
    let bar = progress_bar(job.rows - 1, "steps", quiet);

    let mut left = job.rows - 1;
    while left > 0 && end == End::Complete {
        let wanted = usize::try_from(left).map_or(CHUNK, |left| left.min(CHUNK));
        let clock = Instant::now();
        let mut count = 0;
        while count < wanted && end == End::Complete {
            end = advance(job, simulation, interrupt, &mut records[count])?;
            count += usize::from(end == End::Complete);
        }
        elapsed += clock.elapsed();
        for record in &records[..count] {
            summary.add(record);
            writer.write(record).map_err(csv_failed)?;
        }
        bar.inc(count as u64);
        left -= count as u64;
    }
    simulation.end(&mut records[0]);
    writer.write(&records[0]).map_err(csv_failed)?;
    finish(writer).map_err(|error| file.failed(&error))?;
    bar.finish_and_clear();
    Ok(Run { end, summary, elapsed })
}

/// Everything down to the disk: a full one must be noticed before the file gets its name.
fn finish(writer: TrajectoryWriter<BufWriter<File>>) -> io::Result<()> {
    let mut stream = writer.finish()?;
    stream.flush()?;
    stream.get_ref().sync_all()
}

fn write_run_file(pending: &PendingFile, file: &RunFile) -> Result<(), Failure> {
    let json = serde_json::to_string_pretty(file)
        .map_err(|error| Failure::Other(format!("run.json cannot be made: {error}")))?;
    pending.write((json + "\n").as_bytes())
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
    let stops = matches!(&job.contact, Some(contact) if contact.on_failure == OnFailure::Stop);
    if stops && record.report.status == StepStatus::Failed {
        simulation.take_back(record);
        return Ok(End::Stopped);
    }
    Ok(End::Complete)
}
