//! The main job: simulate a scene, write the trajectory and the run file, say how it went.

use super::args::SimulateArgs;
use super::choices::OnFailure;
use super::describe::describe;
use super::film::film;
use super::gif;
use super::job::Job;
use super::outcome::{Failure, Outcome};
use super::output::{PendingFile, create_directory, progress_bar, say};
use super::plot::{self, PendingPlots};
use super::run::{End, Run};
use super::run_file::RunFile;
use super::signals::raise_on_signals;
use super::source::TrajectoryFile;
use super::view;
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
    let job = Job::new(args)?;
    gif::check(args, &job)?;
    plot::check(args, &job)?;
    view::check(args, &job)?;
    let interrupt = Arc::new(AtomicBool::new(false));
    let mut simulation = job.simulation(&interrupt)?;

    // Before the first file: a signal that comes earlier would leave it behind.
    raise_on_signals(&interrupt)?;
    create_directory(&args.out)?;
    let trajectory = PendingFile::create(&args.out, "trajectory.csv")?;
    let run_json = PendingFile::create(&args.out, "run.json")?;
    let plots = args.plot.then(|| PendingPlots::create(&args.out)).transpose()?;
    let page = args.html.then(|| view::pending(&args.out)).transpose()?;
    let run = write_trajectory(&job, &mut simulation, &interrupt, &trajectory, args.quiet)?;

    write_run_file(&run_json, &job.run_file(&run))?;
    let trajectory = trajectory.publish()?;
    let run_json = run_json.publish()?;
    if !args.quiet {
        let mut text = describe(&job, &run);
        let _ = writeln!(text, "wrote {} and {}", trajectory.display(), run_json.display());
        say(&text)?;
    }
    let gif = args.gif && run.end != End::Interrupted;
    if plots.is_some() || page.is_some() || gif {
        // Each kind of picture has checked its own number of rows before the run.
        let film = film(TrajectoryFile::open(&trajectory, &args.physics)?, usize::MAX)?;
        if let Some(plots) = plots {
            let written = plots.write(&film)?;
            if !args.quiet {
                say(&plot::describe(&written))?;
            }
        }
        if let Some(page) = page {
            let written = view::write(page, &[&film])?;
            if !args.quiet {
                say(&written)?;
            }
        }
        if gif {
            let made = gif::make(&film, args, &interrupt)?;
            if matches!(made, Outcome::Interrupted) {
                return Ok(made);
            }
        }
    }
    Ok(match run.end {
        End::Interrupted => Outcome::Interrupted,
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
