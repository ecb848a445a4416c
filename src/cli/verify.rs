//! `tumble verify`: recompute the residual of every step from a trajectory file, and judge every
//! row by it.

use super::args::VerifyArgs;
use super::outcome::{Failure, Outcome};
use super::output::say;
use super::several::{self, RunTables};
use super::shown;
use super::source::{Source, TrajectoryFile};
use std::fmt::Write as _;
use tumble::contact::certificate::{Certifier, Claim, certify_rk4_step};
use tumble::contact::detection::all_contacts;
use tumble::contact::restitution::set_rebounds;
use tumble::contact::{Certificate, Contact, rounding};
use tumble::mechanics::State;
use tumble::simulation::trajectory::TrajectoryRow;
use tumble::step::StepStatus;

/// A recomputed residual may differ from the column by this part of it, and by what rounding
/// makes of an exact step.
const RELATIVE_TOLERANCE: f64 = 1e-9;

/// One verified step.
struct Verified {
    index: u64,
    status: StepStatus,
    certificate: Certificate,
    column: f64,
    /// What rounding alone may make of it, m/s.
    rounding: f64,
    /// What a step that counts as solved may have, m/s.
    accepted: f64,
}

impl Verified {
    /// Whether the file says of the step what comes out again.
    fn agrees(&self) -> bool {
        let tolerance = self.rounding + RELATIVE_TOLERANCE * self.column.abs();
        (self.certificate.residual() - self.column).abs() <= tolerance
    }

    /// Whether the step is as exact as one that counts as solved, whatever its status says.
    fn is_exact(&self) -> bool {
        self.certificate.residual() <= self.accepted.max(self.rounding)
    }
}

/// What the steps amount to, in memory that does not grow with the file.
#[derive(Default)]
struct Findings {
    steps: u64,
    failed: u64,
    inexact: u64,
    differing: u64,
    /// Disagreeing steps first, then the largest residuals.
    worst: Vec<Verified>,
}

impl Findings {
    /// Counts `step`, and keeps it if it is among the `most` worst.
    fn add(&mut self, step: Verified, most: usize) {
        self.steps += 1;
        self.failed += u64::from(step.status == StepStatus::Failed);
        self.inexact += u64::from(!step.is_exact());
        self.differing += u64::from(!step.agrees());
        // NaN counts as largest.
        let rank = |a: &Verified, b: &Verified| {
            let worst = b.certificate.residual().total_cmp(&a.certificate.residual());
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
    if let Some(tables) = RunTables::open(&args.file, &args.physics)? {
        return several::verify(args, tables);
    }
    let mut file = TrajectoryFile::open(&args.file, &args.physics)?;
    let mut findings = Findings::default();
    let mut judge = Judge { certifier: Certifier::new(), accepted: file.source.accepted() };
    let mut previous: Option<TrajectoryRow> = None;
    while let Some(row) = file.next_row()? {
        if let Some(previous) = previous {
            findings.add(judge.step(&file.source, &previous, &row.state), args.worst);
        }
        previous = Some(row);
    }
    report(args, &file.source, judge.accepted, &findings)
}

struct Judge {
    certifier: Certifier,
    /// What a contact step that counts as solved may have, m/s.
    accepted: f64,
}

impl Judge {
    fn step(&mut self, source: &Source, row: &TrajectoryRow, next: &State) -> Verified {
        let world = &source.physics.world;
        let (states, next) = ([row.state], [*next]);
        let wrench = source.physics.load.wrench(row.index, world.time_step(), &row.state.attitude);
        let mut contacts = Vec::new();
        if !source.floating {
            all_contacts(world, &states, &mut contacts);
        }
        let wrenches = [wrench];
        if world.has_restitution() {
            let free = [world.free_flight(0, &row.state, &wrench)];
            let share = [row.restitution_share];
            set_rebounds(world, &states, &free, &share, &mut contacts);
            if contacts.iter().any(Contact::bounces) {
                for (contact, force) in contacts.iter_mut().zip(row.forces()) {
                    let presses = contact.normal().dot(&force) > 0.0;
                    let closes = contact.could_close(world, &states, &next);
                    contact.struck = presses && closes && contact.may_be_struck();
                }
                set_rebounds(world, &states, &free, &share, &mut contacts);
            }
        }
        let claim =
            Claim { states: &states, next: &next, wrenches: &wrenches, contacts: &contacts };
        let certificate = if source.floating {
            certify_rk4_step(world, &claim)
        } else {
            self.certifier.contact_step(world, &claim, row.forces())
        };
        // Free flight is exact, whoever solves the contacts.
        let flies = row.status == StepStatus::Free && row.forces().all(|f| f.amax() == 0.0);
        Verified {
            index: row.index,
            status: row.status,
            certificate,
            column: row.residual,
            rounding: rounding::residual(world, &states, &next),
            accepted: if flies { 0.0 } else { self.accepted },
        }
    }
}

fn report(
    args: &VerifyArgs,
    source: &Source,
    accepted: f64,
    findings: &Findings,
) -> Result<Outcome, Failure> {
    let mut text = String::new();
    let _ = writeln!(text, "{}: {} steps", shown::path(&args.file), findings.steps);
    if !source.note().is_empty() {
        let _ = writeln!(text, "  note: {}", source.note());
    }
    let _ = writeln!(text, "  status `failed`: {}", findings.failed);
    let _ = writeln!(
        text,
        "  residuals above what a solved step may have, {accepted:.1e} m/s: {}",
        findings.inexact
    );
    let _ = writeln!(text, "  residuals that differ from the column: {}", findings.differing);
    if !findings.worst.is_empty() {
        let _ = writeln!(text, "  worst steps:");
    }
    for step in &findings.worst {
        let _ = writeln!(
            text,
            "    k = {:<7} {:<9}  residual {:.3e} m/s ({}), column {:.3e}",
            step.index,
            step.status.name(),
            step.certificate.residual(),
            step.certificate.worst_part(),
            step.column
        );
    }
    say(&text)?;
    Ok(if findings.differing > 0 {
        Outcome::Mismatch
    } else if findings.failed + findings.inexact > 0 {
        Outcome::Unconverged
    } else {
        Outcome::Done
    })
}
