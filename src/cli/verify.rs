//! `tumble verify`: recompute the certificate of every step from a trajectory file.

use super::args::{PhysicsArgs, VerifyArgs};
use super::output::say;
use super::run_file::{RunFile, RunParameters};
use super::{Failure, Outcome};
use nalgebra::{Matrix3, Vector3};
use std::fmt::Write as _;
use std::fs::File;
use std::path::Path;
use tumble::body::RigidBody;
use tumble::certificate::{Certificate, certify_contact_step, certify_rk4_step};
use tumble::model::{ContactModel, Parameters};
use tumble::scene::{self, Scene};
use tumble::solver::StepStatus;
use tumble::state::{State, Wrench};
use tumble::trajectory::{TrajectoryReader, TrajectoryRow};

/// A recomputed certificate may differ from the column by rounding: relatively, and by
/// what the last digits of positions (1e-16 times their size) make of 1/h.
const RELATIVE_TOLERANCE: f64 = 1e-9;
const ABSOLUTE_TOLERANCE: f64 = 1e-10;

/// What is known of the file besides its rows.
struct Source {
    model: ContactModel,
    floating: bool,
    note: &'static str,
}

/// One verified step.
struct Verified {
    index: u64,
    status: StepStatus,
    certificate: Certificate,
    column: f64,
}

impl Verified {
    fn agrees(&self) -> bool {
        let (found, column) = (self.certificate.worst(), self.column);
        (found - column).abs() <= ABSOLUTE_TOLERANCE + RELATIVE_TOLERANCE * column.abs()
    }
}

/// What the steps amount to, in memory that does not grow with the file.
#[derive(Default)]
struct Findings {
    steps: u64,
    failed: u64,
    differing: u64,
    /// Disagreeing steps first, then the largest certificates.
    worst: Vec<Verified>,
}

impl Findings {
    /// Counts `step`, and keeps it if it is among the `most` worst.
    fn add(&mut self, step: Verified, most: usize) {
        self.steps += 1;
        self.failed += u64::from(step.status == StepStatus::Failed);
        self.differing += u64::from(!step.agrees());
        // NaN counts as largest.
        let rank = |a: &Verified, b: &Verified| {
            let worst = b.certificate.worst().total_cmp(&a.certificate.worst());
            a.agrees().cmp(&b.agrees()).then(worst)
        };
        let place = self.worst.partition_point(|kept| rank(kept, &step).is_le());
        if place < most {
            self.worst.insert(place, step);
            self.worst.truncate(most);
        }
    }
}

pub fn run(args: &VerifyArgs) -> Result<Outcome, Failure> {
    let path = &args.file;
    let cannot_read = |error: &dyn std::fmt::Display| {
        Failure::Input(format!("{} cannot be read as a trajectory: {error}", path.display()))
    };
    let file = File::open(path).map_err(|error| cannot_read(&error))?;
    let mut reader = TrajectoryReader::new(file).map_err(|error| cannot_read(&error))?;
    let source = source_of(path, &args.physics)?;
    if source.model.contact_count() != reader.contacts() {
        return Err(Failure::Input(format!(
            "{} has columns for {} contact points, run.json names {}",
            path.display(),
            reader.contacts(),
            source.model.contact_count()
        )));
    }

    let mut findings = Findings::default();
    let mut previous: Option<TrajectoryRow> = None;
    while let Some(row) = reader.next_row().map_err(|error| cannot_read(&error))? {
        check_time(path, &row, source.model.time_step())?;
        if let Some(previous) = previous {
            findings.add(verify_step(&source, &previous, &row.state), args.worst);
        }
        previous = Some(row);
    }
    report(args, &source, &findings)
}

/// The parameters: run.json beside the file, then the flags.
fn source_of(path: &Path, flags: &PhysicsArgs) -> Result<Source, Failure> {
    let run_path = path.with_file_name("run.json");
    let (mut parameters, floating, note) = match RunFile::read(&run_path)? {
        Some(run) => (run.parameters, run.scene == "floating", ""),
        None => (
            RunParameters::of(&default_model()?, 0),
            false,
            "no run.json beside the file: the drop scene's parameters, and the flags given",
        ),
    };
    parameters.dt = flags.dt.unwrap_or(parameters.dt);
    parameters.mu = flags.mu.unwrap_or(parameters.mu);
    parameters.mass = flags.mass.unwrap_or(parameters.mass);
    if let Some(inertia) = flags.inertia {
        parameters.inertia = inertia.transpose().into();
    }
    if let Some(gravity) = flags.gravity {
        parameters.gravity = gravity.into();
    }
    Ok(Source { model: parameters.model()?, floating, note })
}

fn default_model() -> Result<ContactModel, Failure> {
    let scene = Scene::drop();
    let body = RigidBody::with_box_corners(
        scene::CUBE_MASS,
        Matrix3::from_diagonal_element(scene::CUBE_INERTIA),
        Vector3::repeat(scene::CUBE_HALF_SIDE),
    )?;
    Ok(ContactModel::new(Parameters {
        body,
        gravity: scene.gravity,
        friction: scene::FRICTION,
        time_step: scene.time_step,
        smoothing: scene::SMOOTHING,
    })?)
}

/// Times that do not fit the time step show that the parameters are another run's.
fn check_time(path: &Path, row: &TrajectoryRow, time_step: f64) -> Result<(), Failure> {
    let expected = row.index as f64 * time_step;
    if (row.time - expected).abs() <= 1e-9 * expected.max(time_step) {
        return Ok(());
    }
    Err(Failure::Input(format!(
        "{}: row {} has t_s = {}, which does not fit a time step of {time_step} s; give the run's \
         own with --dt",
        path.display(),
        row.index,
        row.time
    )))
}

fn verify_step(source: &Source, row: &TrajectoryRow, next: &State) -> Verified {
    let model = &source.model;
    let certificate = if source.floating {
        let weight =
            Wrench { force: model.gravity() * model.body().mass(), torque: Vector3::zeros() };
        certify_rk4_step(model, &row.state, next, &weight)
    } else {
        let forces: Vec<_> = row.forces().collect();
        certify_contact_step(model, &row.state, next, &forces, &Wrench::zero())
    };
    Verified { index: row.index, status: row.status, certificate, column: row.certificate }
}

fn report(args: &VerifyArgs, source: &Source, findings: &Findings) -> Result<Outcome, Failure> {
    let mut text = String::new();
    let _ = writeln!(text, "{}: {} steps", args.file.display(), findings.steps);
    if !source.note.is_empty() {
        let _ = writeln!(text, "  note: {}", source.note);
    }
    let _ = writeln!(text, "  status `failed`: {}", findings.failed);
    let _ = writeln!(text, "  certificates that differ from the column: {}", findings.differing);
    if !findings.worst.is_empty() {
        let _ = writeln!(text, "  worst steps:");
    }
    for step in &findings.worst {
        let _ = writeln!(
            text,
            "    k = {:<7} {:<9}  certificate {:.3e} m/s ({}), column {:.3e}",
            step.index,
            step.status.name(),
            step.certificate.worst(),
            step.certificate.worst_part(),
            step.column
        );
    }
    say(&text)?;
    Ok(if findings.differing > 0 {
        Outcome::Mismatch
    } else if findings.failed > 0 {
        Outcome::Unconverged
    } else {
        Outcome::Done
    })
}
