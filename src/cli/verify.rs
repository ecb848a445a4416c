//! `tumble verify`: recompute the certificate of every step from a trajectory file.

use super::args::VerifyArgs;
use super::outcome::{Failure, Outcome};
use super::output::say;
use super::physics::Physics;
use super::source::{Source, TrajectoryFile};
use std::fmt::Write as _;
use tumble::certificate::{Certificate, certify_contact_step, certify_rk4_step};
use tumble::solver::StepStatus;
use tumble::state::State;
use tumble::trajectory::TrajectoryRow;

/// A recomputed certificate may differ from the column by rounding: relatively, and by
/// what the last digits of positions (1e-16 times their size) make of 1/h.
const RELATIVE_TOLERANCE: f64 = 1e-9;
const ABSOLUTE_TOLERANCE: f64 = 1e-10;

/// One verified step.
struct Verified {
    index: u64,
    status: StepStatus,
    certificate: Certificate,
    column: f64,
    /// What turning the states from the world to the ground's frame may make of it, m/s.
    rounding: f64,
}

impl Verified {
    fn agrees(&self) -> bool {
        let (found, column) = (self.certificate.worst(), self.column);
        let tolerance = ABSOLUTE_TOLERANCE + RELATIVE_TOLERANCE * column.abs() + self.rounding;
        (found - column).abs() <= tolerance
    }
}

/// A turn of the frame changes the last digits of lengths, a few of them, and 1/h makes
/// speeds of that: 64 ε (ℓ/h + v), with the distance ℓ from the plane's origin. The level
/// ground's frame is the world's, and its states are those of the file to the last bit.
fn rounding(physics: &Physics, state: &State, next: &State) -> f64 {
    let model = &physics.model;
    if model.plane().is_level() {
        return 0.0;
    }
    let reach = model.body().reach();
    let length = state.position.amax().max(next.position.amax()) + reach;
    let length = length + model.plane().offset().abs();
    let speed = next.velocity.amax() + next.spin.amax() * reach;
    64.0 * f64::EPSILON * (length / model.time_step() + speed)
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
    let mut file = TrajectoryFile::open(&args.file, &args.physics)?;
    let mut findings = Findings::default();
    let mut previous: Option<TrajectoryRow> = None;
    while let Some(row) = file.next_row()? {
        if let Some(previous) = previous {
            findings.add(verify_step(&file.source, &previous, &row.state), args.worst);
        }
        previous = Some(row);
    }
    report(args, &file.source, &findings)
}

fn verify_step(source: &Source, row: &TrajectoryRow, next: &State) -> Verified {
    let Physics { model, load } = &source.physics;
    let plane = model.plane();
    let mut wrench = load.wrench(row.index, model.time_step(), &row.state.attitude);
    wrench.force = plane.vector_to_ground(&wrench.force);
    let rounding = rounding(&source.physics, &row.state, next);
    let (state, next) = (plane.state_to_ground(&row.state), plane.state_to_ground(next));
    let certificate = if source.floating {
        wrench.force += model.gravity() * model.body().mass();
        certify_rk4_step(model, &state, &next, &wrench)
    } else {
        let forces: Vec<_> = row.forces().map(|force| plane.vector_to_ground(&force)).collect();
        certify_contact_step(model, &state, &next, &forces, &wrench)
    };
    let column = row.certificate;
    Verified { index: row.index, status: row.status, certificate, column, rounding }
}

fn report(args: &VerifyArgs, source: &Source, findings: &Findings) -> Result<Outcome, Failure> {
    let mut text = String::new();
    let _ = writeln!(text, "{}: {} steps", args.file.display(), findings.steps);
    if !source.note().is_empty() {
        let _ = writeln!(text, "  note: {}", source.note());
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
