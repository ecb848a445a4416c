//! Comparison of run.json with the run's rows.

use crate::outcome::Failure;
use crate::recording::Recording;
use crate::results::RunOutcome;
use std::collections::BTreeMap;
use tumble_core::mechanics::State;
use tumble_core::simulation::{Motion, Simulation};
use tumble_core::world::{Impacts, World};
use tumble_model::shown;
use tumble_scene::joints_summary::{JointsSummary, StiffJoint};
use tumble_scene::output::tables::IntervalRows;
use tumble_scene::row_counts::RowCounts;
use tumble_scene::run_file::{RunFile, SolverSettings, SummaryFile};
use tumble_scene::solver_choice::IPOPT_VERSION;

/// Relative tolerance for numbers that are equal doubles except for norms.
const SAME: f64 = 1e-12;

/// Relative tolerance of a stiffness, which is the root of an eigenvalue.
const STIFFNESS_FOUND_TO: f64 = 1e-6;

/// Difference of two errors of a joint by rounding (m or rad): a frame with a prescribed motion is where it is at
/// the end of an interval, and the rows have the start of the next one.
const ROUNDED_ERROR: f64 = 1e-12;

/// Largest number of distinct start names.
const MOST_STARTS: usize = 100;

/// Statistics of the rows, computed as in the run.
pub struct StatusCounts {
    rows: RowCounts,
    /// Indices of the first and the last row.
    indices: Option<(u64, u64)>,
    /// States X of the first row.
    starts: Vec<State>,
    /// Number of steps by the start point of their solution.
    rungs: BTreeMap<String, u64>,
    /// True if the present step has been counted there.
    has_rung: bool,
}

impl StatusCounts {
    /// Statistics of a recording without rows so far.
    pub fn new(recording: &Recording<'_>) -> Self {
        Self {
            rows: RowCounts::new(recording.world.clone(), recording.courses.clone()),
            indices: None,
            starts: Vec::new(),
            rungs: BTreeMap::new(),
            has_rung: false,
        }
    }

    /// Adds the rows of an interval, including the last one.
    pub fn add(&mut self, rows: &IntervalRows) {
        let row = &rows.row;
        if self.indices.is_none() {
            self.starts = rows.instant_states().to_vec();
        }
        let (first, _) = self.indices.unwrap_or((row.index, 0));
        self.indices = Some((first, row.index));
        self.rows.add(rows);
        self.has_rung &= row.interval > 0;
        let start = &row.start;
        let is_step = !rows.is_end() && !start.is_empty() && !self.has_rung;
        if is_step && (self.rungs.contains_key(start) || self.rungs.len() < MOST_STARTS) {
            *self.rungs.entry(start.clone()).or_default() += 1;
            self.has_rung = true;
        }
    }

    /// Largest errors of the joints.
    pub fn joints(&self) -> &JointsSummary {
        &self.rows.joints
    }

    /// Differences between the recording's run.json and its rows.
    pub fn differences(&self, recording: &Recording<'_>) -> Vec<String> {
        let run = &recording.run;
        let mut found = self.start_differences(recording);
        found.extend(solver_difference(&run.solver, &recording.world));
        if recording.row_selection().has_gaps() {
            found.extend(self.lower_bound_differences(run));
            found.extend(sum_difference(run));
            let accepted = recording.accepted().unwrap_or(f64::INFINITY);
            found.extend(limit_difference(run, &recording.world, accepted));
            found.extend(self.length_difference(run, self.span()));
            return found;
        }
        found.extend(self.count_differences(run));
        found.extend(self.length_difference(run, self.rows.steps));
        found.extend(stiff_joint_difference(
            run,
            &self.rows.stiff_joints.joints(recording.world.time_step()),
        ));
        found
    }

    fn start_differences(&self, recording: &Recording<'_>) -> Vec<String> {
        let run = &recording.run;
        let mut found = Vec::new();
        let starts = run.model.states();
        let is_start = |starts: &[State]| {
            let mut pairs = starts.iter().zip(&self.starts);
            starts.len() == self.starts.len() && pairs.all(|(a, b)| is_close_state(a, b))
        };
        if !is_start(&starts) && !parted(recording, &starts).is_some_and(|of| is_start(&of)) {
            found.push("the start differs from the first row".to_owned());
        }
        found.extend(run.seed_mismatch());
        found
    }

    /// Number of rows from the first to the last index, as in a run that keeps all rows.
    fn span(&self) -> u64 {
        self.indices.map_or(0, |(first, last)| last.saturating_sub(first).saturating_add(1))
    }

    /// Counts of steps: name, value in run.json, value from the rows.
    fn step_counts(&self, run: &RunFile) -> [(&'static str, u64, u64); 10] {
        let (reported, counted) = (&run.summary, &self.rows.summary);
        [
            ("free_steps", reported.free_steps, counted.free),
            ("contact_steps", reported.contact_steps, counted.contact_steps()),
            ("iterations", reported.iterations, counted.iterations),
            ("converged", reported.converged, counted.converged),
            ("retried", reported.retried, counted.retried),
            ("fallback", reported.fallback, counted.fallback),
            ("substepped", reported.substepped, counted.substepped),
            ("wild", reported.wild, counted.wild),
            ("tempered", reported.tempered.unwrap_or(counted.tempered), counted.tempered),
            ("failed", reported.failed, counted.failed),
        ]
    }

    /// Largest values over the steps: name, value in run.json, value from the rows.
    fn largest_values(&self, run: &RunFile) -> Vec<(&'static str, Option<f64>, Option<f64>)> {
        let reported = &run.summary;
        let residual = (reported.certificate_max_m_s, self.rows.summary.largest_residual());
        let mut all = vec![
            ("summary.certificate_max_m_s", residual.0, residual.1),
            ("largest_overlap_m", Some(run.largest_overlap_m), Some(self.rows.largest_overlap)),
        ];
        if let Some(reported) = &run.joints {
            let pairs = reported.numbers().into_iter().zip(self.rows.joints.numbers());
            all.extend(pairs.map(|((name, reported), (_, found))| {
                let is_error = name.starts_with("largest_error");
                let is_rounded = is_error && (reported - found).abs() <= ROUNDED_ERROR;
                (name, Some(reported), Some(if is_rounded { reported } else { found }))
            }));
        }
        all
    }

    /// Checks for a run with omitted rows. run.json counts all steps, so its values must be at
    /// least those of the rows.
    fn lower_bound_differences(&self, run: &RunFile) -> Vec<String> {
        let mut found = Vec::new();
        let (rows, span) = (run.summary.rows, self.span());
        if rows != span {
            found.push(format!("summary.rows is {rows}; the first to the last row span {span}"));
        }
        let counts =
            self.step_counts(run).into_iter().filter(|(_, reported, found)| found > reported);
        found.extend(counts.map(|(name, reported, found)| {
            format!("summary.{name} is {reported}; the written rows alone have {found}")
        }));
        let exceeds_reported =
            |(_, reported, found): &(_, Option<f64>, Option<f64>)| match (reported, found) {
                (Some(reported), Some(found)) => *found > reported + SAME * reported.abs(),
                (None, found) => found.is_some(),
                _ => false,
            };
        let numbers = self.largest_values(run).into_iter().filter(exceeds_reported);
        found.extend(numbers.map(|(name, reported, found)| {
            format!(
                "{name} is {}; the written rows alone have {}",
                shown_number(reported),
                shown_number(found)
            )
        }));
        found
    }

    fn count_differences(&self, run: &RunFile) -> Vec<String> {
        let (reported, counted) = (&run.summary, &self.rows.summary);
        let rows = [("rows", reported.rows, self.rows.steps)];
        let counts = rows.into_iter().chain(self.step_counts(run));
        let counts = counts.filter(|(_, reported, found)| reported != found);
        let mut found: Vec<_> = counts
            .map(|(name, reported, found)| {
                format!("summary.{name} is {reported}; the rows have {found}")
            })
            .collect();
        let median = counted.median_residual();
        let median = [("summary.certificate_median_m_s", reported.certificate_median_m_s, median)];
        let numbers = median.into_iter().chain(self.largest_values(run));
        let numbers = numbers.filter(|(_, reported, found)| !is_close(*reported, *found));
        found.extend(numbers.map(|(name, reported, found)| {
            format!("{name} is {}; the rows have {}", shown_number(reported), shown_number(found))
        }));
        if !reported.rungs.is_empty() && reported.rungs != self.rungs {
            found.push("summary.rungs differ from the starts in the rows".to_owned());
        }
        found
    }

    /// Checks the number of rows. A complete run has the requested number, any other has fewer.
    fn length_difference(&self, run: &RunFile, rows: u64) -> Option<String> {
        let requested = run.steps;
        let is_complete = run.outcome == RunOutcome::Complete.name();
        let is_cut = [RunOutcome::Interrupted, RunOutcome::Stopped]
            .map(RunOutcome::name)
            .contains(&&*run.outcome);
        let fits = is_complete && rows == requested || is_cut && rows < requested;
        (!fits).then(|| {
            let outcome = shown::line(&run.outcome);
            format!("the outcome is {outcome} with {requested} rows requested; there are {rows}")
        })
    }
}

/// Inconsistencies in the solver settings of a file: settings of another solver, or a larger
/// accepted residual than the solver's own.
fn solver_difference(reported: &SolverSettings, world: &World) -> Option<String> {
    // Without Ipopt in this build, its settings cannot be checked.
    let is_known = ["native", "rk4"].contains(&&*reported.name);
    if !is_known && (reported.name != "ipopt" || IPOPT_VERSION.is_empty()) {
        return None;
    }
    let made = reported.choice().and_then(|choice| SolverSettings::new(choice.as_ref(), world));
    let made = match made {
        Ok(made) => made,
        Err(Failure::Input(why)) => return Some(why),
        Err(other) => return Some(format!("solver: {other}")),
    };
    let same =
        |reported: &Option<String>, made: &Option<String>| reported.is_none() || reported == made;
    let others = [
        ("name", reported.name == made.name),
        ("detection", same(&reported.detection, &made.detection)),
        ("on_failure", same(&reported.on_failure, &made.on_failure)),
        ("tol", reported.tol.is_none() || reported.tol == made.tol),
        ("max_iter", reported.max_iter.is_none() || reported.max_iter == made.max_iter),
    ];
    if let Some((field, _)) = others.into_iter().find(|(_, same)| !same) {
        return Some(format!("solver.{field} contradicts the other settings of the solver"));
    }
    let promised = made.accepted_residual_m_s.unwrap_or_default();
    let most = reported.accepted_residual_m_s.filter(|most| *most > promised * (1.0 + SAME))?;
    let [most, promised] = [most, promised].map(shown::number);
    Some(format!("solver.accepted_residual_m_s is {most}; the limit of this solver is {promised}"))
}

fn shown_number(number: Option<f64>) -> String {
    number.map_or("null".to_owned(), shown::number)
}

/// Checks that the counts of a run.json add up to its steps.
fn sum_difference(run: &RunFile) -> Option<String> {
    let reported = &run.summary;
    let SummaryFile { converged, retried, fallback, substepped, wild, failed, .. } = *reported;
    let solved = [converged, retried, fallback, substepped, wild, failed];
    let sum = |counts: &[u64]| counts.iter().fold(0_u64, |sum, count| sum.saturating_add(*count));
    let (steps, by_status) = (sum(&[reported.free_steps, reported.contact_steps]), sum(&solved));
    if steps.saturating_add(1) != reported.rows {
        let rows = reported.rows;
        return Some(format!(
            "summary.rows is {rows}; free steps and contact steps add up to {steps}"
        ));
    }
    (by_status != reported.contact_steps).then(|| {
        let steps = reported.contact_steps;
        format!("summary.contact_steps is {steps}; the counts by status add up to {by_status}")
    })
}

/// Checks that the largest residual is within the limit if all steps are counted as solved.
/// Short intervals are solved within rounding, which the rows would show.
fn limit_difference(run: &RunFile, world: &World, accepted: f64) -> Option<String> {
    if world.impacts() == Impacts::Located {
        return None;
    }
    let reported = &run.summary;
    let largest = reported.certificate_max_m_s.filter(|largest| *largest > accepted)?;
    (reported.failed == 0 && reported.wild == 0 && reported.substepped == 0).then(|| {
        let [largest, accepted] = [Some(largest), Some(accepted)].map(shown_number);
        let promised = format!("the limit of a solved step is {accepted}");
        format!(
            "summary.certificate_max_m_s is {largest}; {promised}, and all steps are counted as \
             solved"
        )
    })
}

/// Checks the joints reported as too stiff against those from the rows, `stiff_joints`. Recomputed values
/// have other rounding errors.
fn stiff_joint_difference(run: &RunFile, stiff_joints: &[StiffJoint]) -> Option<String> {
    let near = |a: f64, b: f64| (a - b).abs() <= STIFFNESS_FOUND_TO * b;
    let is_same = |(a, b): (&StiffJoint, &StiffJoint)| {
        a.joint == b.joint && near(a.stiffness, b.stiffness) && near(a.time_step_s, b.time_step_s)
    };
    let reported = &run.taut_joints;
    let same =
        reported.len() == stiff_joints.len() && reported.iter().zip(stiff_joints).all(is_same);
    (!same).then(|| format!("taut_joints differ from the rows, which have {}", stiff_joints.len()))
}

/// States in which the overlaps of `starts` are removed, as at the start of a run with the native solver.
fn parted(recording: &Recording<'_>, starts: &[State]) -> Option<Vec<State>> {
    let world = &recording.world;
    let is_native = recording.run.solver.name == "native" && !recording.floating();
    let simulation = is_native
        .then(|| Simulation::new(world.clone(), starts.iter().copied(), Motion::native(world)))?;
    Some(simulation.ok()?.states().to_vec())
}

fn is_close_state(a: &State, b: &State) -> bool {
    let (a, b) = (a.to_vector(), b.to_vector());
    a.iter().zip(&b).all(|(a, b)| (a - b).abs() <= SAME * b.abs())
}

/// True if both are `None`, or equal up to rounding.
fn is_close(a: Option<f64>, b: Option<f64>) -> bool {
    match (a, b) {
        (Some(a), Some(b)) => (a - b).abs() <= SAME * b.abs(),
        (a, b) => a.is_none() && b.is_none(),
    }
}
