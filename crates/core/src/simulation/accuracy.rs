//! Substeps that keep an accuracy ([`with_accuracy`](crate::world::World::with_accuracy)), or that
//! only begin at impacts ([`with_impacts`](crate::world::World::with_impacts)).
//!
//! A substep is a step of its own, with its certificate. Its length h follows from the growth of the
//! estimated error (40) of the worst body: at most a h for the accuracy a (m/s). This error is of
//! third order, so that the next length is
//!
//! ```text
//! h⁺ = h √(a h / e)                                                      (eq. 41)
//! ```
//!
//! Bisection finds the longest substep without an [abrupt change](super::abrupt) of velocity. The change
//! happens in a substep of length ε that follows. Its error ½ ε |w⁺ − w| is at most a tenth of the
//! error of a second. The velocities of the middle are converted to another length by their last three
//! values. A body after an abrupt change starts anew (37).

use super::balance::EnergyBalance;
use super::leapfrog::{AddedError, Converted, Instants};
use super::{Simulation, StepRecord};
use crate::contact::Memory;
use crate::contact::certificate::Claim;
use crate::error::Error;
use crate::step::{StepReport, StepSolution};
use crate::world::{Impacts, World};
use std::mem::swap;

/// Share of the error of a second that an abrupt change may add.
const CAUGHT: f64 = 0.1;
/// Shortest substep (s). Gaps are known to about 1e-16 m, and 1e-16 m are 1e-7 m/s in 1e-9 s.
const SHORTEST: f64 = 1e-9;
/// Shortest substep of smooth motion (s).
const SHORTEST_SMOOTH: f64 = 1e-6;
/// Length of a substep, as a share of the usual one, below which contacts keep a depth or a small gap at
/// which they begin. Shorter substeps would remove a depth at high speed, and impacts would find
/// contacts that touch open.
const KEEPS_GAP: f64 = 0.1;
/// Range of lengths that are wanted, in present lengths, in which the present one stays.
const STAYS: [f64; 2] = [0.9, 1.5];
/// Length of the first substeps after a start or an abrupt change, as a share of the usual one. They have
/// no estimate.
const FIRST: f64 = 0.125;
/// Largest growth of a length, and substeps between two growths.
const GROWTH: f64 = 2.0;
const SUBSTEPS_PER_GROWTH: u32 = 4;
/// Halvings of a substep that is not solved.
const MOST_HALVINGS: u32 = 8;
/// Largest number of abrupt changes that are searched in a step. Later ones happen within their
/// substeps.
const MOST_CHANGES: u32 = 32;
/// Largest number of substeps of a step, with rejected ones. Later substeps are taken as they are.
const MOST_SUBSTEPS: u32 = 20_000;

/// Lengths of substeps.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
#[cfg_attr(feature = "save", derive(serde::Serialize, serde::Deserialize))]
pub(super) struct Pace {
    /// Length to whose middle the velocities of the simulation belong (s); 0 for those of the instant.
    length: f64,
    /// Length wanted for the next substep of smooth motion (s); 0 if none is known.
    wanted: f64,
}

/// Substeps of the steps of a simulation.
#[derive(Default)]
pub(super) struct Substeps {
    pub(super) pace: Pace,
    /// Simulation before the last step, and before the present substep.
    step: Mark,
    substep: Mark,
    record: StepRecord,
}

/// State of a simulation to which it can return.
#[derive(Default)]
struct Mark {
    pace: Pace,
    now: StepSolution,
    before: Option<StepSolution>,
    long_before: Option<StepSolution>,
    instants: Option<Instants>,
    memory: Memory,
}

/// Substeps of a step as a whole, in the record of its first substep.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct SubstepsSummary {
    /// Number of substeps; 0 for a step that is not taken in substeps.
    pub count: u32,
    /// Length of the first substep (s), to which states, forces and certificate of the record belong. In
    /// a record without a step, that of the substep before.
    pub length: f64,
    /// Solver iterations of the later substeps.
    pub iterations: u32,
    /// Terms of the energy balance (36) of the later substeps (J).
    pub works: [f64; 6],
    /// Growth of the estimated error (40) in the step, of the body with the largest one (m).
    pub error: f64,
    /// True if a substep had a larger error than the accuracy allows.
    pub is_coarse: bool,
    /// True if impacts of a body follow each other so closely that they may come in the other order
    /// in the exact motion.
    pub is_ambiguous: bool,
}

/// Search for an abrupt change: lengths of a substep without it and of one with it, and the length
/// within which it is caught (s).
#[derive(Debug, Clone, Copy)]
struct Search {
    low: f64,
    high: f64,
    window: f64,
}

/// Equal substeps of the rest of a step.
#[derive(Debug, Clone, Copy)]
struct Plan {
    length: f64,
    count: u32,
}

impl Plan {
    /// Substeps of `left` (s) with a length near `wanted`, or the `present` one where it suits.
    fn even(left: f64, wanted: f64, present: f64) -> Self {
        let suits = STAYS[0] * present <= wanted && wanted <= STAYS[1] * present;
        let wanted = if suits { present } else { wanted };
        let count = (left / wanted - 1e-9).ceil().clamp(1.0, f64::from(MOST_SUBSTEPS));
        let length = left / count;
        // The same length but for rounding.
        let is_same = (length - present).abs() <= 1e-9 * present;
        Self { length: if is_same { present } else { length }, count: count as u32 }
    }
}

/// Lengths of the substeps of a step.
#[derive(Debug)]
struct Schedule {
    /// Accuracy of smooth motion, if it is controlled, and of abrupt changes (m/s).
    smooth: Option<f64>,
    accuracy: f64,
    /// Length of the step (s), and of the substeps taken so far.
    whole: f64,
    since: f64,
    /// Length of substeps that the last estimate allows (s).
    wanted: f64,
    plan: Plan,
    search: Option<Search>,
    /// Lengths of the next substeps that are taken as they are (s): up to an abrupt change, and with it.
    fixed: [f64; 2],
    /// Substeps with rejected ones, abrupt changes found, halvings of substeps that are not solved,
    /// and substeps of the present length.
    attempts: u32,
    changes: u32,
    halvings: u32,
    streak: u32,
}

/// Judgement of a substep that was taken.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Judgement {
    Taken,
    /// Taken in spite of an error that the accuracy does not allow.
    TakenCoarse,
    Rejected,
}

impl Schedule {
    /// Substeps of a step of `world` after those at `pace`; `starts` is true if a body starts.
    fn new(world: &World, pace: Pace, starts: bool) -> Self {
        let smooth = world.accuracy();
        let whole = world.time_step();
        let wanted = match smooth {
            None => whole,
            Some(_) if pace.wanted > 0.0 => pace.wanted,
            Some(_) => FIRST * whole,
        };
        let first = if starts && smooth.is_some() { FIRST * wanted } else { wanted };
        Self {
            smooth,
            accuracy: world.impact_accuracy().unwrap_or(f64::INFINITY),
            whole,
            since: 0.0,
            wanted,
            plan: Plan::even(whole, first, pace.length),
            search: None,
            fixed: [0.0; 2],
            attempts: 0,
            changes: 0,
            halvings: 0,
            streak: 0,
        }
    }

    /// Length of the next substep (s); `None` at the end of the step.
    fn length(&self) -> Option<f64> {
        let planned = match self.search {
            _ if self.fixed[0] > 0.0 => self.fixed[0],
            Some(Search { low, high, .. }) => 0.5 * (low + high),
            None => self.plan.length,
        };
        (self.plan.count > 0).then_some(planned)
    }

    /// Judges a substep of `length` (s) with these errors, and plans the next one.
    fn judge(&mut self, length: f64, is_solved: bool, errors: &AddedError) -> Judgement {
        let AddedError { smooth, abrupt, velocity, .. } = *errors;
        let caught = CAUGHT * self.accuracy;
        let misses = abrupt > caught && length > SHORTEST;
        let allowed = self.accuracy * length;
        // Eq. 41; an error of the velocity is of third order as well, and remains for seconds.
        let growth = (allowed / smooth).sqrt().min((caught / velocity).cbrt());
        let next = match self.smooth {
            Some(_) => length * (0.9 * growth).clamp(1.0 / GROWTH, GROWTH),
            None => self.whole,
        };
        let is_rough = self.smooth.is_some() && (smooth > allowed || velocity > caught);
        let is_long = is_rough && length > SHORTEST_SMOOTH;
        self.attempts += 1;
        let is_fixed = self.fixed[0] > 0.0;
        if !is_fixed && self.attempts < MOST_SUBSTEPS {
            let closer = self.search.map(|search| Search { low: length, ..search });
            let closer = closer.filter(|closer| closer.high - closer.low > closer.window);
            if !is_solved && self.halvings < MOST_HALVINGS {
                self.halvings += 1;
                self.plan_anew(0.5 * length, 0.0);
            } else if misses && self.changes < MOST_CHANGES {
                self.narrow(length, (caught * length / abrupt).max(SHORTEST));
            } else if is_long {
                self.wanted = next;
                self.plan_anew(next, 0.0);
            } else if closer.is_some() {
                self.search = closer;
            } else {
                self.take(length, next);
                return if misses { Judgement::TakenCoarse } else { Judgement::Taken };
            }
            return Judgement::Rejected;
        }
        self.take(length, next);
        if !is_fixed && (misses || is_long) { Judgement::TakenCoarse } else { Judgement::Taken }
    }

    /// Narrows the search for an abrupt change, which a substep of `length` (s) has, to the `window` (s).
    fn narrow(&mut self, length: f64, window: f64) {
        let low = self.search.map_or(0.0, |search| search.low);
        if length - low > window {
            self.search = Some(Search { low, high: length, window });
            return;
        }
        self.changes += 1;
        let high = self.until_the_end(length);
        self.fixed = if low > SHORTEST { [low, high - low] } else { [high, 0.0] };
        self.search = None;
    }

    /// `length` (s), or all that is left of the step if less than a substep would remain.
    fn until_the_end(&self, length: f64) -> f64 {
        let left = self.whole - self.since;
        if left - length < SHORTEST { left } else { length }
    }

    /// Goes on after a substep of `length` (s); `next` is the length that its estimate allows.
    fn take(&mut self, length: f64, next: f64) {
        self.since += length;
        (self.halvings, self.streak) = (0, self.streak + 1);
        if self.fixed[0] > 0.0 {
            self.fixed = [self.fixed[1], 0.0];
            let share = self.smooth.map_or(1.0, |_| FIRST);
            self.plan_anew(share * self.wanted, length);
        } else if let Some(Search { high, .. }) = self.search.take() {
            // The substep ends within the window before the change.
            self.fixed = [self.until_the_end(high - length), 0.0];
            self.plan_anew(self.wanted, length);
        } else {
            (self.wanted, self.plan.count) = (next, self.plan.count - 1);
            let grows = self.streak >= SUBSTEPS_PER_GROWTH && next >= STAYS[1] * length;
            if self.plan.count > 1 && grows {
                self.plan_anew(next, length);
            }
        }
    }

    /// Divides the rest of the step in substeps near `wanted` (s), or of the `present` length (s).
    fn plan_anew(&mut self, wanted: f64, present: f64) {
        let left = self.whole - self.since;
        (self.search, self.streak) = (None, 0);
        self.plan = Plan::even(left, wanted, present);
        if self.fixed[0] == 0.0 && left < SHORTEST {
            self.plan.count = 0;
        }
    }
}

impl Substeps {
    /// Substeps that go on at `pace`.
    #[cfg(feature = "save")]
    pub(super) fn with_pace(pace: Pace) -> Self {
        Self { pace, ..Self::default() }
    }
}

impl Substeps {
    /// Summary of a state without a step.
    pub(super) fn at_the_end(&self) -> SubstepsSummary {
        SubstepsSummary { length: self.pace.length, ..SubstepsSummary::default() }
    }
}

impl Mark {
    fn set(&mut self, simulation: &Simulation<'_>, pace: Pace) {
        self.pace = pace;
        self.now.copy_from(&simulation.now);
        self.before.clone_from(&simulation.before);
        self.long_before.clone_from(&simulation.long_before);
        self.instants.clone_from(&simulation.instants);
        self.memory.copy_from(simulation.scratch.candidates.memory());
    }
}

impl Simulation<'_> {
    /// True if steps are divided in substeps.
    pub(super) fn takes_substeps(&self) -> bool {
        self.instants.is_some() && self.world.impacts() == Impacts::Located
    }

    fn return_to(&mut self, mark: &Mark) -> Pace {
        self.now.copy_from(&mark.now);
        self.before.clone_from(&mark.before);
        self.long_before.clone_from(&mark.long_before);
        self.instants.clone_from(&mark.instants);
        self.scratch.candidates.recall(&self.world, &mark.memory);
        self.scratch.rest.end();
        mark.pace
    }

    /// Returns to the state before the last step in substeps.
    pub(super) fn take_substeps_back(&mut self) {
        if let Some(mut substeps) = self.substeps.take() {
            substeps.pace = self.return_to(&substeps.step);
            self.substeps = Some(substeps);
        }
    }

    /// Advances by one step in substeps. The `record` describes the first one, and has the worst
    /// status and the sums of all.
    ///
    /// # Errors
    /// Those of a step; the simulation is then unchanged.
    pub(super) fn step_in_substeps(&mut self, record: &mut StepRecord) -> Result<(), Error> {
        let mut substeps = self.substeps.take().unwrap_or_default();
        let index = self.index;
        substeps.step.set(self, substeps.pace);
        let taken = self.take_substeps(&mut substeps, record);
        self.world.set_substep(None);
        self.scratch.candidates.set_kept_gap(None);
        if taken.is_err() {
            substeps.pace = self.return_to(&substeps.step);
        }
        self.index = index + u64::from(taken.is_ok());
        self.substeps = Some(substeps);
        taken
    }

    fn take_substeps(
        &mut self,
        substeps: &mut Substeps,
        record: &mut StepRecord,
    ) -> Result<(), Error> {
        let index = self.index;
        let starts = self.instants.as_ref().is_some_and(|of| of.starts.contains(&true));
        let mut schedule = Schedule::new(&self.world, substeps.pace, starts);
        let mut sum = SubstepsSummary::default();
        while let Some(length) = schedule.length() {
            substeps.substep.set(self, substeps.pace);
            let usual = schedule.plan.length;
            self.begin_substep(substeps, schedule.since, length, usual);
            self.single_step(&mut substeps.record)?;
            self.index = index;
            let is_solved = substeps.record.report.status.is_solved();
            let judgement = schedule.judge(length, is_solved, &self.scratch.added_error);
            if judgement == Judgement::Rejected {
                let rejected = self.instants.take();
                substeps.pace = self.return_to(&substeps.substep);
                if let (Some(instants), Some(rejected), true) =
                    (&mut self.instants, rejected, is_solved)
                {
                    instants.learn(&rejected);
                }
                continue;
            }
            sum.is_coarse |= judgement == Judgement::TakenCoarse;
            sum.is_ambiguous |= self.scratch.added_error.is_ambiguous;
            #[cfg(feature = "save")]
            self.record_substep(&substeps.record, [schedule.since - length, length]);
            self.add_substep(substeps, &mut sum, record);
        }
        substeps.pace.wanted = schedule.wanted;
        let starts = substeps.step.instants.as_ref().map_or(&[][..], |instants| &instants.errors);
        let grown = self.time_errors().iter().zip(starts).map(|(end, start)| end - start);
        record.substeps = SubstepsSummary { error: grown.fold(0.0, f64::max), ..sum };
        Ok(())
    }

    /// Prepares a substep of `length` (s) that begins `since` the start of the step (s); `usual` is the
    /// length of substeps in smooth motion.
    fn begin_substep(&mut self, substeps: &mut Substeps, since: f64, length: f64, usual: f64) {
        self.world.set_substep(Some([since, length]));
        let is_short = length < KEEPS_GAP * usual;
        self.scratch.candidates.set_kept_gap(self.world.kept_gap().filter(|_| is_short));
        self.scratch.added_error = AddedError::default();
        self.scratch.converted.clear();
        self.scratch.converted.resize(self.now.states.len(), Converted::Kept);
        if length != substeps.pace.length {
            self.change_length(substeps.pace.length, length);
            substeps.pace.length = length;
        }
    }

    /// Adds the substep in `substeps` to the `sum` of the step, and to its `record`.
    fn add_substep(
        &self,
        substeps: &mut Substeps,
        sum: &mut SubstepsSummary,
        record: &mut StepRecord,
    ) {
        let substep = &mut substeps.record;
        sum.count += 1;
        if sum.count == 1 {
            sum.length = substeps.pace.length;
            swap(record, substep);
            return;
        }
        let StepRecord { states, wrenches, contacts, solution, .. } = &*substep;
        let (next, joints, gears) = (&solution.states, &solution.joints, &solution.gears);
        let claim = Claim { states, next, wrenches, contacts, joints, gears };
        let works = EnergyBalance::new(&self.world, &claim, solution.loads()).terms();
        sum.works.iter_mut().zip(works).for_each(|(sum, work)| *sum += work);
        let StepReport { status, iterations, .. } = substep.report;
        sum.iterations = sum.iterations.saturating_add(iterations);
        record.report.status = record.report.status.with_later(status);
        record.restitution_share = record.restitution_share.min(substep.restitution_share);
        record.infeasible_gap = record.infeasible_gap.or(substep.infeasible_gap);
        record.unphysical = record.unphysical.or(substep.unphysical);
        record.gain = record.gain.or(substep.gain);
        record.unsolved.append(&mut substep.unsolved);
    }
}
