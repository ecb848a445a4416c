//! Comparison of run.json with the run's rows.

use crate::continued::contact_of;
use crate::outcome::Failure;
use crate::recording::Recording;
use crate::results::RunOutcome;
use std::collections::BTreeMap;
use tumble_core::mechanics::State;
use tumble_core::simulation::summary::{RunSummary, StatusCount};
use tumble_core::step::StepStatus;
use tumble_core::world::World;
use tumble_model::shown;
use tumble_scene::joints_summary::{JointsSummary, Taut, TautJoint};
use tumble_scene::output::tables::TableStep;
use tumble_scene::run_file::{RunFile, SolverSettings, SummaryFile};
use tumble_scene::solver_choice::IPOPT_VERSION;

/// Relative tolerance for numbers that are equal doubles except for norms.
const SAME: f64 = 1e-12;

/// Relative tolerance of a stiffness, which is the root of an eigenvalue.
const STIFFNESS_FOUND_TO: f64 = 1e-6;

/// Largest number of distinct start names.
const MOST_STARTS: usize = 100;

/// Statistics of the rows, computed as in the run.
#[derive(Default)]
pub struct StatusCounts {
    rows: u64,
    /// Indices of the first and the last row.
    indices: Option<(u64, u64)>,
    summary: RunSummary,
    /// States X of the first row.
    starts: Vec<State>,
    /// Number of steps by the start point of their solution.
    rungs: BTreeMap<String, u64>,
    overlap: f64,
    joints: JointsSummary,
}

impl StatusCounts {
    /// Adds a row of a run in `world`, including the last one.
    pub fn add(&mut self, world: &World, step: &TableStep) {
        let row = &step.row;
        if self.rows == 0 {
            self.starts.clone_from(&step.states);
        } else {
            self.joints.add_errors(world, &step.states);
        }
        self.rows += 1;
        let (first, _) = self.indices.unwrap_or((row.index, 0));
        self.indices = Some((first, row.index));
        self.summary.count(&StatusCount {
            index: row.index,
            status: row.status,
            iterations: row.iterations,
            residual: row.residual,
            part: "",
            restitution_share: row.restitution_share,
        });
        self.overlap = self.overlap.max(row.overlap);
        self.joints.add_stiffness(row.stiffness);
        for joint in &step.joints {
            self.joints.add_residual(joint.residual.locked, joint.residual.drive);
        }
        for (gear, of) in step.gears.iter().zip(world.gears()) {
            self.joints.add_gear(of, gear.residual);
        }
        let start = &row.start;
        let is_step = row.status != StepStatus::End && !start.is_empty();
        if is_step && (self.rungs.contains_key(start) || self.rungs.len() < MOST_STARTS) {
            *self.rungs.entry(start.clone()).or_default() += 1;
        }
    }

    /// Largest errors of the joints.
    pub fn joints(&self) -> &JointsSummary {
        &self.joints
    }

    /// Differences between the recording's run.json and its rows.
    pub fn differences(&self, recording: &Recording<'_>, taut: &Taut) -> Vec<String> {
        let run = &recording.run;
        let mut found = self.of_start(run);
        found.extend(of_solver(&run.solver, &recording.world));
        if recording.kept().every > 1 {
            found.extend(self.beyond_counts(run));
            found.extend(of_sums(run));
            let accepted = recording.accepted().unwrap_or(f64::INFINITY);
            found.extend(of_promise(run, accepted));
            found.extend(self.of_length(run, self.span()));
            return found;
        }
        found.extend(self.of_counts(run));
        found.extend(self.of_length(run, self.rows));
        found.extend(other_taut(run, &taut.joints(recording.world.time_step())));
        found
    }

    fn of_start(&self, run: &RunFile) -> Vec<String> {
        let mut found = Vec::new();
        let starts = run.model.states();
        let is_same = |(a, b): (&State, &State)| is_same_state(a, b);
        if starts.len() != self.starts.len() || !starts.iter().zip(&self.starts).all(is_same) {
            found.push("the start differs from the first row".to_owned());
        }
        found.extend(run.drawn_otherwise());
        found
    }

    /// Number of rows from the first to the last index, as in a run that keeps all rows.
    fn span(&self) -> u64 {
        self.indices.map_or(0, |(first, last)| last.saturating_sub(first).saturating_add(1))
    }

    /// Counts of steps: name, value in run.json, value from the rows.
    fn of_steps(&self, run: &RunFile) -> [(&'static str, u64, u64); 10] {
        let (said, counted) = (&run.summary, &self.summary);
        [
            ("free_steps", said.free_steps, counted.free),
            ("contact_steps", said.contact_steps, counted.contact_steps()),
            ("iterations", said.iterations, counted.iterations),
            ("converged", said.converged, counted.converged),
            ("retried", said.retried, counted.retried),
            ("fallback", said.fallback, counted.fallback),
            ("substepped", said.substepped, counted.substepped),
            ("wild", said.wild, counted.wild),
            ("tempered", said.tempered.unwrap_or(counted.tempered), counted.tempered),
            ("failed", said.failed, counted.failed),
        ]
    }

    /// Largest values over the steps: name, value in run.json, value from the rows.
    fn of_largest(&self, run: &RunFile) -> Vec<(&'static str, Option<f64>, Option<f64>)> {
        let said = &run.summary;
        let residual = (said.certificate_max_m_s, self.summary.largest_residual());
        let mut all = vec![
            ("summary.certificate_max_m_s", residual.0, residual.1),
            ("largest_overlap_m", Some(run.largest_overlap_m), Some(self.overlap)),
        ];
        if let Some(said) = &run.joints {
            let pairs = said.numbers().into_iter().zip(self.joints.numbers());
            all.extend(pairs.map(|((name, said), (_, found))| (name, Some(said), Some(found))));
        }
        all
    }

    /// Checks for a run with omitted rows. run.json counts all steps, so its values must be at
    /// least those of the rows.
    fn beyond_counts(&self, run: &RunFile) -> Vec<String> {
        let mut found = Vec::new();
        let (rows, span) = (run.summary.rows, self.span());
        if rows != span {
            found.push(format!("summary.rows is {rows}; the first to the last row span {span}"));
        }
        let counts = self.of_steps(run).into_iter().filter(|(_, said, found)| found > said);
        found.extend(counts.map(|(name, said, found)| {
            format!("summary.{name} is {said}; the written rows alone have {found}")
        }));
        let is_beyond = |(_, said, found): &(_, Option<f64>, Option<f64>)| match (said, found) {
            (Some(said), Some(found)) => *found > said + SAME * said.abs(),
            (None, found) => found.is_some(),
            _ => false,
        };
        let numbers = self.of_largest(run).into_iter().filter(is_beyond);
        found.extend(numbers.map(|(name, said, found)| {
            format!(
                "{name} is {}; the written rows alone have {}",
                shown_number(said),
                shown_number(found)
            )
        }));
        found
    }

    fn of_counts(&self, run: &RunFile) -> Vec<String> {
        let (said, counted) = (&run.summary, &self.summary);
        let rows = [("rows", said.rows, self.rows)];
        let counts = rows.into_iter().chain(self.of_steps(run));
        let counts = counts.filter(|(_, said, found)| said != found);
        let mut found: Vec<_> = counts
            .map(|(name, said, found)| format!("summary.{name} is {said}; the rows have {found}"))
            .collect();
        let median = counted.median_residual();
        let median = [("summary.certificate_median_m_s", said.certificate_median_m_s, median)];
        let numbers = median.into_iter().chain(self.of_largest(run));
        let numbers = numbers.filter(|(_, said, found)| !is_same_number(*said, *found));
        found.extend(numbers.map(|(name, said, found)| {
            format!("{name} is {}; the rows have {}", shown_number(said), shown_number(found))
        }));
        if !said.rungs.is_empty() && said.rungs != self.rungs {
            found.push("summary.rungs differ from the starts in the rows".to_owned());
        }
        found
    }

    /// Checks the number of rows. A complete run has the requested number, any other has fewer.
    fn of_length(&self, run: &RunFile, rows: u64) -> Option<String> {
        let asked = run.steps;
        let is_complete = run.outcome == RunOutcome::Complete.name();
        let is_cut = [RunOutcome::Interrupted, RunOutcome::Stopped]
            .map(RunOutcome::name)
            .contains(&&*run.outcome);
        let fits = is_complete && rows == asked || is_cut && rows < asked;
        (!fits).then(|| {
            let outcome = shown::line(&run.outcome);
            format!("the outcome is {outcome} with {asked} rows requested; there are {rows}")
        })
    }
}

/// Inconsistencies in the solver settings of a file: settings of another solver, or a larger
/// accepted residual than the solver's own.
fn of_solver(said: &SolverSettings, world: &World) -> Option<String> {
    // Without Ipopt in this build, its settings cannot be checked.
    let is_known = ["native", "rk4"].contains(&&*said.name);
    if !is_known && (said.name != "ipopt" || IPOPT_VERSION.is_empty()) {
        return None;
    }
    let made = contact_of(said).and_then(|choice| SolverSettings::of(choice.as_ref(), world));
    let made = match made {
        Ok(made) => made,
        Err(Failure::Input(why)) => return Some(why),
        Err(other) => return Some(format!("solver: {other}")),
    };
    let same = |said: &Option<String>, made: &Option<String>| said.is_none() || said == made;
    let others = [
        ("name", said.name == made.name),
        ("detection", same(&said.detection, &made.detection)),
        ("on_failure", same(&said.on_failure, &made.on_failure)),
        ("tol", said.tol.is_none() || said.tol == made.tol),
        ("max_iter", said.max_iter.is_none() || said.max_iter == made.max_iter),
    ];
    if let Some((field, _)) = others.into_iter().find(|(_, same)| !same) {
        return Some(format!("solver.{field} contradicts the other settings of the solver"));
    }
    let promised = made.accepted_residual_m_s.unwrap_or_default();
    let most = said.accepted_residual_m_s.filter(|most| *most > promised * (1.0 + SAME))?;
    let [most, promised] = [most, promised].map(shown::number);
    Some(format!("solver.accepted_residual_m_s is {most}; the limit of this solver is {promised}"))
}

fn shown_number(number: Option<f64>) -> String {
    number.map_or("null".to_owned(), shown::number)
}

/// Checks that the counts of a run.json add up to its steps.
fn of_sums(run: &RunFile) -> Option<String> {
    let said = &run.summary;
    let SummaryFile { converged, retried, fallback, substepped, wild, failed, .. } = *said;
    let solved = [converged, retried, fallback, substepped, wild, failed];
    let sum = |counts: &[u64]| counts.iter().fold(0_u64, |sum, count| sum.saturating_add(*count));
    let (steps, ways) = (sum(&[said.free_steps, said.contact_steps]), sum(&solved));
    if steps.saturating_add(1) != said.rows {
        let rows = said.rows;
        return Some(format!(
            "summary.rows is {rows}; free steps and contact steps add up to {steps}"
        ));
    }
    (ways != said.contact_steps).then(|| {
        let steps = said.contact_steps;
        format!("summary.contact_steps is {steps}; the counts by status add up to {ways}")
    })
}

/// Checks that the largest residual is within the limit if all steps are counted as solved.
fn of_promise(run: &RunFile, accepted: f64) -> Option<String> {
    let said = &run.summary;
    let largest = said.certificate_max_m_s.filter(|largest| *largest > accepted)?;
    (said.failed == 0 && said.wild == 0 && said.substepped == 0).then(|| {
        let [largest, accepted] = [Some(largest), Some(accepted)].map(shown_number);
        let promised = format!("the limit of a solved step is {accepted}");
        format!(
            "summary.certificate_max_m_s is {largest}; {promised}, and all steps are counted as \
             solved"
        )
    })
}

/// Checks the joints reported as too stiff against those from the rows, `taut`. Recomputed values
/// have other rounding errors.
fn other_taut(run: &RunFile, taut: &[TautJoint]) -> Option<String> {
    let near = |a: f64, b: f64| (a - b).abs() <= STIFFNESS_FOUND_TO * b;
    let is_same = |(a, b): (&TautJoint, &TautJoint)| {
        a.joint == b.joint && near(a.stiffness, b.stiffness) && near(a.time_step_s, b.time_step_s)
    };
    let said = &run.taut_joints;
    let same = said.len() == taut.len() && said.iter().zip(taut).all(is_same);
    (!same).then(|| format!("taut_joints differ from the rows, which have {}", taut.len()))
}

fn is_same_state(a: &State, b: &State) -> bool {
    let (a, b) = (a.to_vector(), b.to_vector());
    a.iter().zip(&b).all(|(a, b)| (a - b).abs() <= SAME * b.abs())
}

/// True if both are `None`, or equal up to rounding.
fn is_same_number(a: Option<f64>, b: Option<f64>) -> bool {
    match (a, b) {
        (Some(a), Some(b)) => (a - b).abs() <= SAME * b.abs(),
        (a, b) => a.is_none() && b.is_none(),
    }
}
