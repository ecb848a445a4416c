//! The main job: simulate a scene, write the trajectory and the run file, say how it went.

use super::args::{SceneName, SimulateArgs, SolverName};
use super::output::{PendingFile, create_directory, say};
use super::run_file::{RunFile, RunParameters, SolverSettings, StartState, SummaryFile};
use super::{Failure, Outcome};
use indicatif::{ProgressBar, ProgressStyle};
use nalgebra::{Matrix3, Vector3};
use std::fmt::Write as _;
use std::fs::File;
use std::io::{self, BufWriter, IsTerminal, Write};
use std::time::{Duration, Instant};
use tumble::body::RigidBody;
use tumble::detection::Detection;
use tumble::ipopt::{self, Options};
use tumble::model::{ContactModel, Parameters};
use tumble::scene;
use tumble::simulation::{Motion, Simulation, StepRecord};
use tumble::solver::StepStatus;
use tumble::solver::ipopt::{Formulation, IpoptSolver};
use tumble::solver::native::NativeSolver;
use tumble::state::State;
use tumble::summary::RunSummary;
use tumble::trajectory::TrajectoryWriter;

/// Steps between two looks at the clock, so that looking costs nothing.
const CHUNK: usize = 64;

/// What the arguments amount to.
struct Job {
    rows: u64,
    model: ContactModel,
    start: State,
    /// `None` for the floating scene.
    contact: Option<Contact>,
}

/// How contact steps are posed and solved.
struct Contact {
    detection: Detection,
    /// Ipopt's options; `None` for the native solver.
    ipopt: Option<Options>,
}

pub fn run(args: &SimulateArgs) -> Result<Outcome, Failure> {
    let job = Job::new(args)?;
    let mut simulation = job.simulation()?;

    create_directory(&args.out)?;
    let trajectory = PendingFile::create(&args.out, "trajectory.csv")?;
    let run_json = PendingFile::create(&args.out, "run.json")?;
    let (summary, elapsed) = write_trajectory(&job, &mut simulation, &trajectory, args.quiet)?;
    drop(simulation);

    let file = job.run_file(args, &summary, elapsed);
    write_run_file(&run_json, &file)?;
    let trajectory = trajectory.publish()?;
    let run_json = run_json.publish()?;
    if !args.quiet {
        let mut text = describe(&job, args, &summary, elapsed);
        let _ = writeln!(text, "wrote {} and {}", trajectory.display(), run_json.display());
        say(&text)?;
    }
    Ok(if summary.failed > 0 { Outcome::Unconverged } else { Outcome::Done })
}

impl Job {
    fn new(args: &SimulateArgs) -> Result<Self, Failure> {
        let mut scene = args.scene.scene();
        let physics = &args.physics;
        let inertia =
            physics.inertia.unwrap_or_else(|| Matrix3::from_diagonal_element(scene::CUBE_INERTIA));
        let body = RigidBody::with_box_corners(
            physics.mass.unwrap_or(scene::CUBE_MASS),
            inertia,
            Vector3::repeat(scene::CUBE_HALF_SIDE),
        )?;
        let model = ContactModel::new(Parameters {
            body,
            gravity: physics.gravity.unwrap_or(scene.gravity),
            friction: physics.mu.unwrap_or(scene::FRICTION),
            time_step: physics.dt.unwrap_or(scene.time_step),
            smoothing: scene::SMOOTHING,
        })?;
        scene.height = args.height.unwrap_or(scene.height);
        scene.velocity = args.velocity.unwrap_or(scene.velocity);
        scene.spin = args.spin.unwrap_or(scene.spin);
        let start = scene.start(scene.attitude(args.seed));
        start.validate()?;

        let contact = match args.scene {
            SceneName::Floating => {
                refuse_flags("the floating scene, which has no contact", &contact_flags(args))?;
                None
            }
            SceneName::Drop => {
                refuse_start_below_ground(&model, &start)?;
                Some(Contact::new(args)?)
            }
        };
        Ok(Self { rows: args.steps.unwrap_or(scene.rows), model, start, contact })
    }

    fn simulation(&self) -> Result<Simulation<'static>, Failure> {
        let motion = match &self.contact {
            None => Motion::Floating,
            Some(contact) => Motion::Contact {
                detection: contact.detection,
                solver: match &contact.ipopt {
                    Some(options) => Box::new(IpoptSolver::new(
                        &self.model,
                        Formulation::default(),
                        options.clone(),
                    )?),
                    None => Box::new(NativeSolver::new(&self.model)),
                },
            },
        };
        Ok(Simulation::new(self.model.clone(), self.start, motion)?)
    }

    /// The solver's name in run.json.
    fn solver_name(&self) -> &'static str {
        match &self.contact {
            None => "rk4",
            Some(Contact { ipopt: Some(_), .. }) => "ipopt",
            Some(Contact { ipopt: None, .. }) => "native",
        }
    }

    fn run_file(&self, args: &SimulateArgs, summary: &RunSummary, elapsed: Duration) -> RunFile {
        let contact = self.contact.as_ref();
        let ipopt = contact.and_then(|contact| contact.ipopt.as_ref());
        RunFile {
            tumble_version: env!("CARGO_PKG_VERSION").to_owned(),
            ipopt_version: ipopt::VERSION.to_owned(),
            scene: args.scene.scene().name.to_owned(),
            seed: args.seed,
            parameters: RunParameters::of(&self.model, self.rows),
            solver: SolverSettings {
                name: self.solver_name().to_owned(),
                detection: contact.map(|contact| contact.detection.name().to_owned()),
                tol: ipopt.map(|options| options.tolerance),
                max_iter: ipopt.map(|options| options.max_iterations),
            },
            start: StartState {
                height: self.start.position[2],
                attitude: self.start.attitude.into(),
                velocity: self.start.velocity.into(),
                spin: self.start.spin.into(),
            },
            summary: SummaryFile::of(summary, elapsed.as_secs_f64()),
        }
    }
}

impl Contact {
    fn new(args: &SimulateArgs) -> Result<Self, Failure> {
        let detection = args.detection.map(Detection::from).unwrap_or_default();
        if args.solver == Some(SolverName::Native) {
            refuse_flags("the native solver, which works to rounding", &ipopt_flags(args))?;
            return Ok(Self { detection, ipopt: None });
        }
        let options = IpoptSolver::options(
            args.tol.unwrap_or(scene::TOLERANCE),
            args.max_iter.unwrap_or(scene::MOST_ITERATIONS),
        );
        options.validate().map_err(tumble::error::Error::from)?;
        Ok(Self { detection, ipopt: Some(options) })
    }
}

/// Flags with a meaning for Ipopt alone, and whether they are given.
fn ipopt_flags(args: &SimulateArgs) -> Vec<(&'static str, bool)> {
    vec![("--tol", args.tol.is_some()), ("--max-iter", args.max_iter.is_some())]
}

/// Flags with a meaning for contact alone, and whether they are given.
fn contact_flags(args: &SimulateArgs) -> Vec<(&'static str, bool)> {
    let mut flags = vec![
        ("--mu", args.physics.mu.is_some()),
        ("--detection", args.detection.is_some()),
        ("--solver", args.solver.is_some()),
    ];
    flags.extend(ipopt_flags(args));
    flags
}

/// An option that would do nothing is refused rather than ignored.
fn refuse_flags(place: &str, flags: &[(&str, bool)]) -> Result<(), Failure> {
    match flags.iter().find(|(_, given)| *given) {
        Some((flag, _)) => {
            Err(Failure::Input(format!("{flag} has no meaning with {place}; leave it out")))
        }
        None => Ok(()),
    }
}

/// A start inside the ground would be thrown out of it within one step.
fn refuse_start_below_ground(model: &ContactModel, start: &State) -> Result<(), Failure> {
    let lowest = model.lowest_height(start);
    if lowest >= 0.0 {
        return Ok(());
    }
    Err(Failure::Input(format!(
        "--height {}: the lowest corner would start {:.4} m below the ground; {:.4} or more is \
         needed for this attitude",
        start.position[2],
        -lowest,
        ((start.position[2] - lowest) * 1e4).ceil() / 1e4
    )))
}

/// Runs the simulation and writes every row. Returns the time of the stepping alone.
fn write_trajectory(
    job: &Job,
    simulation: &mut Simulation<'_>,
    file: &PendingFile,
    quiet: bool,
) -> Result<(RunSummary, Duration), Failure> {
    let contacts = job.model.contact_count();
    let csv_failed = |error: csv::Error| match error.into_kind() {
        csv::ErrorKind::Io(error) => file.failed(&error),
        other => Failure::Other(format!("the trajectory cannot be written: {other:?}")),
    };
    let mut writer = TrajectoryWriter::new(file.stream()?, contacts, job.model.time_step())
        .map_err(csv_failed)?;
    let mut records = vec![StepRecord::new(&job.start, contacts); CHUNK];
    let (mut summary, mut elapsed) = (RunSummary::default(), Duration::ZERO);
    let bar = progress_bar(job.rows - 1, quiet);

    let mut left = job.rows - 1;
    while left > 0 {
        let count = usize::try_from(left).map_or(CHUNK, |left| left.min(CHUNK));
        let clock = Instant::now();
        for record in &mut records[..count] {
            simulation.step(record)?;
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
    Ok((summary, elapsed))
}

/// Everything down to the disk: a full one must be noticed before the file gets its name.
fn finish(writer: TrajectoryWriter<BufWriter<File>>) -> io::Result<()> {
    let mut stream = writer.finish()?;
    stream.flush()?;
    stream.get_ref().sync_all()
}

fn write_run_file(pending: &PendingFile, file: &RunFile) -> Result<(), Failure> {
    let mut stream = pending.stream()?;
    serde_json::to_writer_pretty(&mut stream, file)
        .map_err(io::Error::from)
        .and_then(|()| stream.write_all(b"\n"))
        .and_then(|()| stream.flush())
        .and_then(|()| stream.get_ref().sync_all())
        .map_err(|error| pending.failed(&error))
}

fn progress_bar(steps: u64, quiet: bool) -> ProgressBar {
    if quiet || !io::stderr().is_terminal() {
        return ProgressBar::hidden();
    }
    let bar = ProgressBar::new(steps);
    if let Ok(style) = ProgressStyle::with_template("{bar:40} {pos}/{len} steps, {eta} left") {
        bar.set_style(style);
    }
    bar
}

/// The summary for people.
fn describe(job: &Job, args: &SimulateArgs, summary: &RunSummary, elapsed: Duration) -> String {
    let mut text = String::new();
    let h = job.model.time_step();
    let simulated = (job.rows - 1) as f64 * h;
    let scene = args.scene.scene().name;
    let _ = writeln!(
        text,
        "{scene} scene, seed {}, {} rows, h = {h} s: {simulated:.3} s of motion",
        args.seed, job.rows
    );
    if args.scene == SceneName::Floating {
        let _ =
            writeln!(text, "  note         this scene draws nothing: the seed is only recorded");
    }
    let _ = writeln!(
        text,
        "  steps        {} ({} in contact, {} in free flight)",
        summary.steps(),
        summary.contact_steps(),
        summary.free
    );
    if summary.contact_steps() > 0 {
        let _ = writeln!(
            text,
            "  {:<12} {} iterations, {:.1} a contact step",
            job.solver_name(),
            summary.iterations,
            summary.iterations as f64 / summary.contact_steps() as f64
        );
        let mut counts = format!("{}", summary.converged);
        for (status, count) in
            [(StepStatus::Retried, summary.retried), (StepStatus::Fallback, summary.fallback)]
        {
            if count > 0 {
                let _ = write!(counts, ", {status} {count}");
            }
        }
        let _ = writeln!(text, "  converged    {counts}");
        let _ = writeln!(text, "  failed       {}", summary.failed);
        for failure in &summary.first_failures {
            let status = failure.ipopt_status.map_or("no status", |status| status.name());
            let _ = writeln!(
                text,
                "    k = {:<6}   {status}, certificate {:.1e} m/s ({})",
                failure.index, failure.certificate, failure.part
            );
        }
        if summary.failed > summary.first_failures.len() as u64 {
            let _ = writeln!(text, "    …            see the column `status`");
        }
    }
    if let Some((index, certificate, part)) = summary.worst {
        let median = summary
            .median_certificate()
            .map_or(String::new(), |median| format!("median {median:.1e} m/s in contact, "));
        let _ = writeln!(
            text,
            "  certificate  {median}largest {certificate:.1e} m/s at k = {index} ({part})"
        );
    }
    let seconds = elapsed.as_secs_f64();
    let _ = write!(text, "  time         {seconds:.3} s stepping");
    if seconds > 0.0 {
        let _ = write!(text, ", {:.2} × real time", simulated / seconds);
    }
    text.push('\n');
    text
}
