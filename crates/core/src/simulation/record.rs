//! Record of a step: everything that is written to a file or displayed.

use super::interval::{Interval, acting_times};
use super::rest::RestKey;
use super::{EnergyGain, InfeasibleGap, UnphysicalCause};
use crate::contact::Certificate;
use crate::mechanics::{State, Wrench, largest};
use crate::step::{StepReport, StepStatus};
use crate::world::{World, without};
use nalgebra::Vector3;
use std::rc::Rc;

/// Largest number of intervals whose memory a record keeps for its next step.
const MOST_KEPT: usize = 64;

/// Record of one step k → k+1: one interval, or several that follow each other.
///
/// A step has several with an [accuracy](crate::world::World::with_accuracy), with [located
/// impacts](crate::world::Impacts::Located), or if it was not solved at once. Methods of the record
/// describe the whole step; [`StepRecord::intervals`] has the problems.
#[derive(Debug)]
pub struct StepRecord {
    /// Index k.
    pub index: u64,
    /// Bodies of islands that the native solver did not solve in one interval without making energy; empty
    /// with an accuracy or located impacts.
    pub unsolved: Vec<usize>,
    /// The intervals, at least one, and memory for later ones.
    intervals: Vec<Interval>,
    count: usize,
    /// Rest of which the first interval is a copy.
    rest: Option<RestKey>,
}

impl Default for StepRecord {
    fn default() -> Self {
        Self::new()
    }
}

/// A copy has no memory for later intervals.
impl Clone for StepRecord {
    fn clone(&self) -> Self {
        let intervals = self.intervals().to_vec();
        let unsolved = self.unsolved.clone();
        Self { index: self.index, unsolved, intervals, count: self.count, rest: None }
    }
}

/// Two records are equal if they describe equal steps.
impl PartialEq for StepRecord {
    fn eq(&self, other: &Self) -> bool {
        (self.index, &self.unsolved, self.intervals())
            == (other.index, &other.unsolved, other.intervals())
    }
}

impl From<Interval> for StepRecord {
    /// Record of a step of one interval, with the index 0.
    fn from(interval: Interval) -> Self {
        Self { index: 0, unsolved: Vec::new(), intervals: vec![interval], count: 1, rest: None }
    }
}

/// Share of an interval in its step.
#[derive(Debug, Clone)]
pub struct Share<'a> {
    interval: &'a Interval,
    /// Length of the step (s).
    whole: f64,
    /// Times over which forces act on the bodies (s), in a step of several intervals.
    acting: Option<Rc<[f64]>>,
}

impl Share<'_> {
    /// Share of the length of the step.
    pub fn time(&self) -> f64 {
        if self.whole > 0.0 { self.interval.length / self.whole } else { 1.0 }
    }

    /// Factor of forces at `body`, or between it and `other`, in their mean over the time in which forces act in
    /// the step.
    pub fn forces(&self, body: usize, other: Option<usize>) -> f64 {
        let Some(acting) = &self.acting else { return 1.0 / self.interval.kick(body, other) };
        let acting = |body: usize| acting.get(body).copied().unwrap_or(f64::INFINITY);
        self.interval.length / other.map_or(f64::INFINITY, acting).min(acting(body))
    }
}

impl StepRecord {
    /// Creates an empty record for [`Simulation::step`](super::Simulation::step). It has one interval
    /// without bodies.
    pub fn new() -> Self {
        Self::from(Interval::default())
    }

    /// Begins the record of step `index`. Until [`Self::next_interval`] it has no interval.
    pub(super) fn begin(&mut self, index: u64) {
        self.index = index;
        self.unsolved.clear();
        self.intervals.truncate(MOST_KEPT);
        self.count = 0;
    }

    /// Adds an interval, whose content is that of an earlier one.
    #[inline]
    pub(super) fn next_interval(&mut self) -> &mut Interval {
        if self.count == self.intervals.len() {
            self.intervals.push(Interval::default());
        }
        self.count += 1;
        self.rest = None;
        &mut self.intervals[self.count - 1]
    }

    /// Adds an interval. Its content is a copy of the rest with this key if the second result is true.
    #[inline]
    pub(super) fn next_interval_at(&mut self, rest: &RestKey) -> (&mut Interval, bool) {
        let is_copy = self.rest.as_ref() == Some(rest);
        (self.next_interval(), is_copy)
    }

    /// Notes that the first interval is a copy of the rest with this key.
    pub(super) fn set_rest(&mut self, rest: &RestKey) {
        self.rest = Some(rest.clone());
    }

    /// Removes the first interval.
    pub(super) fn remove_first(&mut self) {
        self.rest = None;
        self.intervals[..self.count].rotate_left(1);
        self.count -= 1;
    }

    /// Removes all intervals but the first `count`.
    pub(super) fn truncate(&mut self, count: usize) {
        self.count = self.count.min(count);
    }

    /// Intervals with their energies and ends, to be completed.
    pub(super) fn intervals_mut(&mut self) -> &mut [Interval] {
        self.rest = None;
        &mut self.intervals[..self.count]
    }

    /// The intervals in their order, at least one.
    pub fn intervals(&self) -> &[Interval] {
        &self.intervals[..self.count]
    }

    /// The first interval, which starts at step k.
    pub fn first(&self) -> &Interval {
        &self.intervals[0]
    }

    /// The first interval, to be changed.
    pub fn first_mut(&mut self) -> &mut Interval {
        self.rest = None;
        &mut self.intervals[0]
    }

    /// The last interval, which ends at step k+1.
    pub fn last(&self) -> &Interval {
        &self.intervals[self.count - 1]
    }

    /// True if the step has several intervals.
    pub fn is_divided(&self) -> bool {
        self.count > 1
    }

    /// The most serious status of the intervals.
    pub fn status(&self) -> StepStatus {
        let statuses = self.intervals().iter().map(|interval| interval.report.status);
        statuses.max().unwrap_or(StepStatus::End)
    }

    /// Iterations of all intervals, the initial point of the first, and the message of the last that
    /// has one.
    pub fn report(&self) -> StepReport {
        let all = self.intervals().iter().map(|interval| interval.report);
        let whole = all.reduce(|whole, later| StepReport {
            status: whole.status.max(later.status),
            iterations: whole.iterations.saturating_add(later.iterations),
            start: whole.start.or(later.start),
            message: later.message.or(whole.message),
        });
        whole.unwrap_or(StepReport::without_problem(StepStatus::End))
    }

    /// Certificate of the interval with the largest residual.
    pub fn certificate(&self) -> &Certificate {
        let worse = |a: &f64, b: &f64| a.is_nan() || a > b;
        let mut worst = &self.first().certificate;
        for Interval { certificate, .. } in &self.intervals()[1..] {
            if worse(&certificate.residual(), &worst.residual()) {
                worst = certificate;
            }
        }
        worst
    }

    /// Largest residual of the intervals (m/s).
    pub fn residual(&self) -> f64 {
        self.certificate().residual()
    }

    /// Largest number over all intervals; NaN if there is one.
    fn largest(&self, number: impl Fn(&Interval) -> f64) -> f64 {
        self.intervals().iter().map(number).fold(0.0, largest)
    }

    /// Deepest overlap at the end of an interval (m); see [`Interval::overlap`].
    pub fn overlap(&self) -> f64 {
        self.largest(|interval| interval.overlap)
    }

    /// Largest error of the placement of contacts (m); see [`Interval::placement`].
    pub fn placement(&self) -> f64 {
        self.largest(|interval| interval.placement)
    }

    /// Largest stability number; see [`Interval::stiffness`].
    pub fn stiffness(&self) -> f64 {
        self.largest(|interval| interval.stiffness)
    }

    /// Smallest share of restitution; see [`Interval::restitution_share`].
    pub fn restitution_share(&self) -> f64 {
        self.intervals().iter().map(|interval| interval.restitution_share).fold(1.0, f64::min)
    }

    /// Largest gain of energy; see [`Interval::gain`].
    pub fn gain(&self) -> Option<EnergyGain> {
        let gains = self.intervals().iter().filter_map(|interval| interval.gain);
        gains.max_by(|a, b| a.energy.total_cmp(&b.energy))
    }

    /// Cause of the first unphysical interval.
    pub fn unphysical(&self) -> Option<UnphysicalCause> {
        self.intervals().iter().find_map(|interval| interval.unphysical)
    }

    /// First infeasible gap.
    pub fn infeasible_gap(&self) -> Option<&InfeasibleGap> {
        self.intervals().iter().find_map(|interval| interval.infeasible_gap.as_ref())
    }

    /// Energies at the start and at the end of the step in `world`, as the rows of a run count them (J).
    pub fn energies(&self, world: &World) -> [f64; 2] {
        let (first, last) = (self.first(), self.last());
        [first.energy(&first.world(world)), last.end_energy(&last.world(world))]
    }

    /// Growth of the estimated error (40) in the step (m): the sum over its intervals of the body with
    /// the largest one.
    pub fn error(&self) -> f64 {
        self.intervals().iter().map(Interval::error).sum()
    }

    /// States from which the step starts; see [`Interval::states`].
    pub fn states(&self) -> &[State] {
        &self.first().states
    }

    /// States X at step k with the velocities of the instant.
    pub fn instant_states(&self) -> &[State] {
        self.first().instant_states()
    }

    /// States at step k+1 as the last problem has them.
    pub fn next_states(&self) -> &[State] {
        &self.last().solution.states
    }

    /// States X at step k+1 with the velocities of the instant (eq. 37).
    pub fn end_states(&self) -> &[State] {
        self.last().end_states()
    }

    /// State X of the first body at step k.
    ///
    /// # Panics
    /// If the record is empty.
    pub fn state(&self) -> &State {
        &self.states()[0]
    }

    /// State X of the first body at step k+1.
    ///
    /// # Panics
    /// If the record is empty.
    pub fn next(&self) -> &State {
        &self.next_states()[0]
    }

    /// The intervals with their shares of the step.
    pub fn shares(&self) -> impl Iterator<Item = (Share<'_>, &Interval)> {
        let intervals = self.intervals();
        let whole = intervals.iter().map(|interval| interval.length).sum();
        let acting: Option<Rc<[f64]>> = self.is_divided().then(|| {
            let lengths = intervals.iter().map(|taken| (&taken.before[..], taken.length));
            acting_times(self.states().len(), lengths).into()
        });
        intervals
            .iter()
            .map(move |interval| (Share { interval, whole, acting: acting.clone() }, interval))
    }

    /// Mean of the sum of all contact forces on body `index` over the step (N), world frame.
    pub fn mean_force(&self, index: usize) -> Vector3<f64> {
        let of_interval = |(share, taken): (Share<'_>, &Interval)| {
            let forces = taken.solution.contacts.iter().map(|force| {
                let share = share.forces(force.key.body, force.key.partner.body());
                force.force_on(index) * share
            });
            forces.sum::<Vector3<f64>>()
        };
        self.shares().map(of_interval).sum()
    }

    /// Removes the body `index` and its contacts, after its removal from the simulation. Bodies
    /// after it move up by one. Joints and gears stay where their flag in `joints` and `gears` is
    /// true.
    pub fn leave_out(&mut self, index: usize, joints: &[bool], gears: &[bool]) {
        let intervals = self.intervals_mut().iter_mut();
        intervals.for_each(|interval| interval.leave_out(index, joints, gears));
        let kept = |body: &usize| without(*body, index);
        self.unsolved = self.unsolved.iter().filter_map(kept).collect();
    }

    /// Adds a body at the end that is at rest in `state`, after its addition to the simulation.
    pub fn add_body(&mut self, state: State) {
        for interval in
            self.intervals_mut().iter_mut().filter(|interval| !interval.states.is_empty())
        {
            interval.states.push(state);
            interval.wrenches.push(Wrench::zero());
            if !interval.instants.is_empty() {
                interval.instants.push(state);
            }
            if !interval.ends.is_empty() {
                interval.ends.push(state);
            }
            interval.before.clear();
            interval.solution.states.push(state);
            interval.part = None;
        }
    }
}
