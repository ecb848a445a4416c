//! `tumble verify`: recomputes the residual of every step from the files of a run, and verifies
//! every interval of it.

mod judge;
mod run_file_check;

use super::args::VerifyArgs;
use super::outcome::{Failure, Outcome};
use super::output::StderrReporter;
use super::recording::Recording;
use judge::{StepJudge, Verified};
use run_file_check::StatusCounts;
use std::fmt::Write as _;
use std::panic::resume_unwind;
use std::sync::mpsc::sync_channel;
use std::thread;
use tumble_core::mechanics::State;
use tumble_core::step::StepStatus;
use tumble_core::world::Impacts;
use tumble_scene::output::tables::{IntervalRows, Table};
use tumble_scene::run_file::Seal;

/// Number of steps that are read before they are verified.
const READ_AHEAD: usize = 16;

/// Statistics of the intervals, in memory that does not grow with the files.
#[derive(Default)]
struct VerifyFindings {
    steps: u64,
    intervals: u64,
    failed: u64,
    substepped: u64,
    wild: u64,
    inexact: u64,
    differing: u64,
    /// True if the last row, which has no step, differs.
    end_differs: bool,
    largest_overlap: f64,
    /// Worst steps: first those that differ from the files, then by residual.
    worst: Vec<Verified>,
}

impl VerifyFindings {
    /// Adds `step` to the statistics, and stores it if it is among the `most` worst.
    fn add(&mut self, step: Verified, most: usize) {
        self.steps += u64::from(step.is_first);
        self.intervals += 1;
        self.failed += u64::from(step.status == StepStatus::Failed);
        self.substepped += u64::from(step.status == StepStatus::Substepped);
        self.wild += u64::from(step.status == StepStatus::Wild);
        self.inexact += u64::from(step.inexact);
        self.differing += u64::from(step.differs.is_some());
        self.largest_overlap = self.largest_overlap.max(step.overlap);
        self.keep(step, most);
    }

    fn keep(&mut self, step: Verified, most: usize) {
        // NaN of either sign counts as largest.
        let size = |of: &Verified| if of.residual.is_nan() { f64::INFINITY } else { of.residual };
        let rank = |a: &Verified, b: &Verified| {
            let worst = size(b).total_cmp(&size(a));
            b.differs.is_some().cmp(&a.differs.is_some()).then(worst)
        };
        let place = self.worst.partition_point(|worse| rank(worse, &step).is_le());
        if place < most {
            self.worst.insert(place, step);
            self.worst.truncate(most);
        }
    }
}

/// Reads the rows of a run in order and verifies every step. A step ends at the state of the next
/// row, so it is verified when that row has been read.
pub fn run(args: &VerifyArgs) -> Result<Outcome, Failure> {
    let mut recording = Recording::open(&args.file)?;
    refuse_partial(&recording)?;
    let mut judge = StepJudge::new(&recording)?;
    let (mut findings, mut previous) = (VerifyFindings::default(), None::<IntervalRows>);
    // True if the velocities of the instant in the row `previous` follow from the interval before it.
    let mut follows = true;
    let mut counts = StatusCounts::new(&recording);
    let world = recording.world.clone();
    let mut add = |rows: IntervalRows| {
        counts.add(&rows);
        if let Some(previous) = &previous {
            let mut verified = judge.interval(previous, &rows);
            let is_next = rows.row.interval > 0 || rows.row.index == previous.row.index + 1;
            if verified.differs.is_none() && !follows {
                verified.differs = Some(judge::OTHER_INSTANTS.to_owned());
            }
            let is_located = world.impacts() == Impacts::Located;
            follows = !is_next || is_located || instants_follow(&judge, previous, &rows);
            if verified.differs.is_none() && is_next && !starts_at_end(&judge, previous, &rows) {
                let what = "the states after it differ from the next row";
                verified.differs = Some(what.to_owned());
            }
            findings.add(verified, args.worst);
        }
        previous = Some(rows);
    };
    // Steps are read on another thread while they are verified.
    thread::scope(|scope| {
        let (sender, steps) = sync_channel(READ_AHEAD);
        let recording = &mut recording;
        let reader = scope.spawn(move || {
            while let Some(step) = recording.next_interval()? {
                // The receiver ends after the sender.
                let _ = sender.send(step);
            }
            Ok::<_, Failure>(())
        });
        steps.into_iter().for_each(&mut add);
        reader.join().unwrap_or_else(|panic| resume_unwind(panic))
    })?;
    if let Some(end) = previous.and_then(|end| judge.end(&end, follows)) {
        findings.end_differs = true;
        findings.keep(end, args.worst);
    }
    report(&recording, &judge, &findings, &counts, StderrReporter::new(args.quiet))
}

/// True if the bodies in the `next` row start at the end of the interval `previous`, or at the velocities of
/// the instant there, to which a start may add the change by external forces that they lack. Without half kicks,
/// velocities are converted before and after the shorter intervals of a step. The `judge` has verified `previous`.
fn starts_at_end(judge: &StepJudge, previous: &IntervalRows, next: &IntervalRows) -> bool {
    let is_retry = previous.row.status == StepStatus::Substepped && next.row.interval == 0;
    let is_converted = is_retry || previous.row.length != next.row.length;
    let ends = if previous.ends.is_empty() { &next.states } else { &previous.ends };
    let restarts = |body: usize, state: &State| {
        let instant = &next.instants[body];
        let [velocity, spin] = judge.late_halves(previous)[body];
        let off = [state.velocity - instant.velocity - velocity, state.spin - instant.spin - spin];
        let largest = state.velocity.amax().max(state.spin.amax());
        let rounding = 8.0 * f64::EPSILON * largest + judge.rounding_of_velocities();
        state == instant || off.iter().all(|off| off.amax() <= rounding)
    };
    let mut bodies = ends.iter().zip(&next.states).enumerate();
    bodies.all(|(body, (end, state))| match next.before.get(body) {
        Some(0.0) => restarts(body, state) && end.pose() == state.pose(),
        Some(before) => *before == previous.row.length && end == state,
        None => end == state || is_converted && end.pose() == state.pose(),
    })
}

/// True if the velocities of the instant in `next` follow from the interval before (eq. 37a): extrapolated,
/// or those of the middle.
fn instants_follow(judge: &StepJudge, previous: &IntervalRows, next: &IntervalRows) -> bool {
    let bodies = previous.states.iter().zip(&next.states).zip(&next.instants).enumerate();
    bodies.into_iter().all(|(body, ((before, after), instant))| {
        let share = 0.5 / previous.kick(body, None);
        let differs = |share: f64| {
            let linear = after.velocity + share * (after.velocity - before.velocity);
            let angular = after.spin + share * (after.spin - before.spin);
            (linear - instant.velocity).amax().max((angular - instant.spin).amax())
        };
        let largest = after.velocity.amax().max(before.velocity.amax());
        let largest = largest.max(after.spin.amax()).max(before.spin.amax());
        let rounding = 8.0 * f64::EPSILON * largest + judge.rounding_of_velocities();
        let is_moved = after.pose() == instant.pose();
        is_moved && (differs(share) <= rounding || differs(0.0) <= rounding)
    })
}

/// Refuses runs that lack data for the verification. A step needs its inputs, the states before and
/// after it, and all its forces. Runs with omitted tables are refused. With omitted rows, the table
/// `ends` has the states after each stored step.
fn refuse_partial(recording: &Recording<'_>) -> Result<(), Failure> {
    let (selection, place) = (recording.row_selection(), recording.place());
    if recording.run.pushed {
        return Err(Failure::Input(format!(
            "{place} cannot be verified: wrenches, motors or states were set during the run \
             (`pushed` in run.json); put loads and motors into the scene"
        )));
    }
    let world = &recording.world;
    let counts = [1, 1, 1, world.joints().len(), world.gears().len(), 1];
    let mut needed = Table::ALL.into_iter().zip(counts).filter(|(_, count)| *count > 0);
    match needed.find(|(table, _)| !selection.has(*table)) {
        None => Ok(()),
        Some((table, _)) => Err(Failure::Input(format!(
            "{place} cannot be verified: the run did not write the table {table}; run it without \
             --tables"
        ))),
    }
}

fn report(
    recording: &Recording<'_>,
    judge: &StepJudge,
    findings: &VerifyFindings,
    counts: &StatusCounts,
    mut reporter: StderrReporter,
) -> Result<Outcome, Failure> {
    let differences = counts.differences(recording);
    let changed = recording.changed_files()?;
    let mut text = format!("{}: {} steps", recording.place(), findings.steps);
    if findings.intervals > findings.steps {
        let _ = write!(text, " in {} intervals", findings.intervals);
    }
    let every = recording.row_selection().every;
    if every > 1 {
        let _ = write!(text, " (--every {every})");
    }
    let _ = match recording.world.bodies().len() {
        1 => writeln!(text, " of 1 body"),
        count => writeln!(text, " of {count} bodies"),
    };
    let run = &recording.run;
    if run.checksums.is_empty() && run.seal == Seal::None {
        let _ = writeln!(
            text,
            "  note: run.json has no checksums: changes that obey the physics are not detected"
        );
    }
    let _ = writeln!(text, "  status `failed`: {}", findings.failed);
    let hides_failed = every > 1 && run.summary.failed > findings.failed;
    let between = if hides_failed { run.summary.failed } else { 0 };
    if between > 0 {
        let _ = writeln!(text, "  of all steps, by run.json: {between}");
    }
    let _ = writeln!(
        text,
        "  residuals above the limit of a solved step, {:.1e} m/s: {}",
        judge.accepted, findings.inexact
    );
    if findings.wild > 0 {
        let count = findings.wild;
        let _ = writeln!(text, "  status `wild`, solved but unphysical: {count}");
    }
    if findings.substepped > 0 {
        let count = findings.substepped;
        let _ = writeln!(text, "  status `substepped`: {count}");
    }
    let VerifyFindings { differing, end_differs, .. } = *findings;
    let and_end = if end_differs { ", and the last row" } else { "" };
    let _ = writeln!(text, "  steps that differ from their rows: {differing}{and_end}");
    let _ = writeln!(text, "  largest overlap: {:.1e} m", findings.largest_overlap);
    if !recording.world.joints().is_empty() {
        let _ = writeln!(text, "  joints, as recorded: {}", counts.joints());
    }
    if !differences.is_empty() {
        let _ = writeln!(text, "  run.json differs from the rows:");
    }
    for difference in &differences {
        let _ = writeln!(text, "    {difference}");
    }
    if !changed.is_empty() {
        let _ = writeln!(text, "  files changed after the run:");
    }
    for change in &changed {
        let _ = writeln!(text, "    {change}");
    }
    if !findings.worst.is_empty() {
        let _ = writeln!(text, "  worst steps:");
    }
    for step in &findings.worst {
        let _ = write!(
            text,
            "    k = {:<7} {:<9}  residual {:.3e} m/s ({})",
            step.index,
            step.status.name(),
            step.residual,
            step.part
        );
        let _ = match &step.differs {
            Some(what) => writeln!(text, ": {what}"),
            None => writeln!(text),
        };
    }
    reporter.say(&text);
    reporter.end(
        if differing > 0 || end_differs || !differences.is_empty() || !changed.is_empty() {
            Outcome::Mismatch
        } else if findings.failed + findings.wild + findings.inexact + between > 0 {
            Outcome::Unconverged
        } else {
            Outcome::Done
        },
    )
}

#[cfg(test)]
mod tests;
