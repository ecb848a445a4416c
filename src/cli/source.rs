//! What a trajectory file is a trajectory of: run.json beside it, and the flags.

use super::args::PhysicsArgs;
use super::names::FileKind;
use super::outcome::Failure;
use super::physics::{self, Physics};
use super::run_file::RunFile;
use super::{input, shown};
use std::fs::File;
use std::path::Path;
use tumble::simulation::trajectory::{TrajectoryReader, TrajectoryRow};
use tumble::solver::ipopt;

/// What is known of the file besides its rows.
pub struct Source {
    pub physics: Physics,
    /// Whether there is no ground.
    pub floating: bool,
    /// run.json, where there is one.
    pub run: Option<RunFile>,
}

/// A trajectory file that is being read.
pub struct TrajectoryFile<'a> {
    path: &'a Path,
    reader: TrajectoryReader<File>,
    pub source: Source,
}

impl<'a> TrajectoryFile<'a> {
    /// Opens the file and finds its parameters.
    pub fn open(path: &'a Path, flags: &PhysicsArgs) -> Result<Self, Failure> {
        let file = input::open(path).map_err(|error| cannot_read(path, &error))?;
        let reader = TrajectoryReader::new(file).map_err(|error| cannot_read(path, &error))?;
        let source = source_of(path, flags)?;
        let points = source.physics.body().contact_points().len();
        if points != reader.contacts() {
            return Err(Failure::Input(format!(
                "{} has columns for {} contact points; {} {points}",
                shown::path(path),
                reader.contacts(),
                if source.run.is_some() {
                    "run.json names"
                } else {
                    "without a run.json there are"
                },
            )));
        }
        Ok(Self { path, reader, source })
    }

    /// The next row, its time checked; `None` after the last.
    pub fn next_row(&mut self) -> Result<Option<TrajectoryRow>, Failure> {
        let row = self.reader.next_row().map_err(|error| cannot_read(self.path, &error))?;
        if let Some(row) = &row {
            check_time(self.path, row, self.source.physics.time_step())?;
        }
        Ok(row)
    }

    pub fn path(&self) -> &'a Path {
        self.path
    }
}

impl Source {
    /// The residual that a solved contact step may have, m/s: what its solver holds its steps to,
    /// or the laxest of them where the solver is not known.
    pub fn accepted(&self) -> f64 {
        let world = &self.physics.world;
        match &self.run {
            Some(run) => run.solver.accepted_residual(world),
            None => ipopt::ACCEPTED_RESIDUAL * world.speed_scale(),
        }
    }

    /// What must be said of parameters that no run.json has; empty where one has them.
    pub fn note(&self) -> &'static str {
        match self.run {
            Some(_) => "",
            None => "no run.json beside the file: the drop scene's parameters, and the flags given",
        }
    }
}

fn cannot_read(path: &Path, error: &dyn std::fmt::Display) -> Failure {
    Failure::Input(format!("{} cannot be read as a trajectory: {error}", shown::path(path)))
}

/// The parameters: run.json beside the file, then the flags.
fn source_of(path: &Path, flags: &PhysicsArgs) -> Result<Source, Failure> {
    let run_path = path.with_file_name("run.json");
    let run = RunFile::read(&run_path)?;
    let parameters = match &run {
        Some(run) => run.parameters.clone(),
        None => physics::parameters(&physics::of_tutorial()?, 0),
    };
    // Without a ground there is but one way to move.
    let floating = run.as_ref().is_some_and(|run| run.solver.name == "rk4");
    let physics = physics::of_run(&parameters, flags).map_err(|failure| match run {
        Some(_) => failure.in_file(&run_path, FileKind::Run, &flags.given()),
        None => failure,
    })?;
    Ok(Source { physics, floating, run })
}

/// Times that do not fit the time step show that the parameters are another run's.
fn check_time(path: &Path, row: &TrajectoryRow, time_step: f64) -> Result<(), Failure> {
    let expected = row.index as f64 * time_step;
    if (row.time - expected).abs() <= 1e-9 * expected.max(time_step) {
        return Ok(());
    }
    Err(Failure::Input(format!(
        "{}: row {} has t_s = {}, which does not fit a time step of {} s; give the run's own with \
         --dt",
        shown::path(path),
        row.index,
        shown::number(row.time),
        shown::number(time_step)
    )))
}
