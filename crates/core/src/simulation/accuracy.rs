//! Intervals that keep an accuracy ([`with_accuracy`](crate::world::World::with_accuracy)), or that
//! only begin at impacts ([`with_impacts`](crate::world::World::with_impacts)).
//!
//! An interval is a step of its own, with its certificate. Its length h follows from the growth of the
//! estimated error (40) of the worst body: at most a h for the accuracy a (m/s). This error is of
//! third order, so that the next length is
//!
//! ```text
//! h⁺ = h √(a h / e)                                                      (eq. 41)
//! ```
//!
//! Bisection finds the longest interval without an [abrupt change](super::abrupt) of velocity, to within ε. An
//! impact happens in an interval of length ε that follows. Its error ½ ε |w⁺ − w| is at most a tenth of the
//! error of a second. Where friction changes the acceleration, the next usual interval starts at the velocities of
//! the instant, and |w⁺ − w| in ε is at most a tenth of the accuracy. Velocities go on from interval to interval,
//! whatever their lengths (37), but islands with an abrupt change start at the velocities of the instant.
//!
//! Where an [input jumps](Inputs::jumps), an interval ends, and the islands with it start anew.
//!
//! If an interval has a [certificate](super::infeasible_gap) that no solution exists, the rest of the step is one
//! interval that keeps the depths and joint errors of its start.

use super::abrupt::CAUGHT;
use super::energy;
use super::inputs::Inputs;
use super::instants::AddedError;
use super::interval::Interval;
use super::moment::{Moment, Pace};
use super::one_interval;
use super::record::StepRecord;
use super::retry;
use super::workspace::Workspace;
use super::{EnergyBalance, EnergyGain};
use crate::error::Error;
use crate::mechanics::State;
use crate::world::{Impacts, Span, WINDOW, World};

/// Shortest interval (s). Gaps are known to about 1e-16 m, and 1e-16 m are 1e-7 m/s in 1e-9 s.
const SHORTEST: f64 = 1e-9;
/// Shortest interval up to a change of acceleration without an accuracy, as a share of the step. Changes in a heap
/// follow each other within microseconds.
const SHORTEST_TURN: f64 = 1e-3;
/// Shortest interval of smooth motion (s).
const SHORTEST_SMOOTH: f64 = 1e-6;
/// Range of lengths that are wanted, in present lengths, in which the present one stays.
const STAYS: [f64; 2] = [0.9, 1.5];
/// Gains of energy below this share of all energies are rounding errors.
const ROUNDING: f64 = 1e-12;
/// Largest rise of the energy of the instant, beyond loads, drives and moving surfaces, and relative to the
/// kinetic energy, with which extrapolated velocities stay.
const LARGEST_RISE: f64 = 1e-3;
/// Length of the first intervals after a start or an abrupt change, as a share of the usual one. They have
/// no estimate.
const FIRST: f64 = 0.125;
/// Largest growth of a length, and intervals between two growths.
const GROWTH: f64 = 2.0;
const INTERVALS_PER_GROWTH: u32 = 4;
/// Shortest interval after one that is not solved, as a share of the step.
const SHORTEST_RETRY: f64 = 1.0 / 256.0;
/// Largest number of abrupt changes that are searched in a step. Later ones happen within their
/// intervals.
const MOST_CHANGES: u32 = 32;
/// Largest number of intervals of a step, with rejected ones. Later intervals are taken as they are.
const MOST_INTERVALS: u32 = 20_000;

/// Search for an abrupt change.
#[derive(Debug, Clone, Copy)]
struct Search {
    /// Lengths of an interval without it and of one with it, and their largest difference at its end (s).
    low: f64,
    high: f64,
    tolerance: f64,
    /// True if the velocity jumps in the longer interval, and not only the acceleration.
    jumps: bool,
}

/// Equal intervals of the rest of a step.
#[derive(Debug, Clone, Copy)]
struct Plan {
    length: f64,
    count: u32,
    /// True if the length is not just that of a short rest.
    is_usual: bool,
}

impl Plan {
    /// Intervals of `left` (s) with a length near `wanted`, or the `present` one where it suits.
    fn even(left: f64, wanted: f64, present: f64) -> Self {
        let suits = STAYS[0] * present <= wanted && wanted <= STAYS[1] * present;
        let wanted = if suits { present } else { wanted };
        let count = (left / wanted - 1e-9).ceil().clamp(1.0, f64::from(MOST_INTERVALS));
        let length = left / count;
        // The same length but for rounding.
        let is_same = (length - present).abs() <= 1e-9 * present;
        let length = if is_same { present } else { length };
        // An even division is at least half as long as wanted.
        Self { length, count: count as u32, is_usual: length >= 0.5 * wanted }
    }
}

/// Lengths of the intervals of a step.
#[derive(Debug)]
struct Schedule {
    /// Accuracy of smooth motion, if it is controlled, and of abrupt changes (m/s).
    smooth: Option<f64>,
    accuracy: f64,
    /// Length of the step (s), of its part up to the next jump of an input, and of the intervals taken so far.
    whole: f64,
    part: f64,
    since: f64,
    /// Length of intervals that the last estimate allows (s), and of the last usual one.
    wanted: f64,
    usual: f64,
    plan: Plan,
    search: Option<Search>,
    /// Lengths of the next intervals that are taken as they are (s): up to an abrupt change, and with it.
    fixed: [f64; 2],
    /// True if the acceleration changes at the end of the next fixed interval, and at the start of the next one:
    /// that begins at the velocities of the instant.
    turns: bool,
    has_turned: bool,
    /// True if the intervals are shorter because one was not solved.
    is_halved: bool,
    /// True if the last interval was taken although it is not solved.
    gave_up: bool,
    /// Intervals with rejected ones, abrupt changes found, and intervals of the present length.
    attempts: u32,
    changes: u32,
    streak: u32,
}

/// Judgement of an interval that was taken.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Judgement {
    Taken,
    /// Taken in spite of an error that the accuracy does not allow.
    TakenCoarse,
    Rejected,
}

impl Schedule {
    /// Intervals of a step of `world` after those at `pace`, up to the end of its first `part` (s); `starts` is true
    /// if a body starts.
    fn new(world: &World, pace: Pace, starts: bool, part: f64) -> Self {
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
            part,
            since: 0.0,
            wanted,
            usual: match smooth {
                Some(_) if pace.usual > 0.0 => pace.usual,
                Some(_) => wanted,
                None => whole,
            },
            plan: Plan::even(part, first, pace.length),
            search: None,
            fixed: [0.0; 2],
            turns: false,
            has_turned: false,
            is_halved: false,
            gave_up: false,
            attempts: 0,
            changes: 0,
            streak: 0,
        }
    }

    /// Length of the next interval (s); `None` at the end of the part.
    fn length(&self) -> Option<f64> {
        let planned = match self.search {
            _ if self.fixed[0] > 0.0 => self.fixed[0],
            Some(Search { low, high, .. }) => 0.5 * (low + high),
            None => self.plan.length,
        };
        (self.plan.count > 0).then_some(planned)
    }

    /// Usual length for the next interval, of `length` (s), over which errors of position are removed. It is
    /// its own length if only the estimate of its error limits it.
    fn usual(&self, length: f64) -> f64 {
        let is_planned = self.fixed[0] == 0.0 && self.search.is_none() && !self.is_halved;
        let is_usual = is_planned && self.plan.is_usual && length > SHORTEST_SMOOTH;
        if self.smooth.is_some() && is_usual { length } else { self.usual.max(length) }
    }

    /// Judges an interval of `length` (s) with these errors, and plans the next one.
    fn judge(&mut self, length: f64, is_solved: bool, errors: &AddedError) -> Judgement {
        let AddedError { smooth, velocity, jumped, turned, late, .. } = *errors;
        let caught = CAUGHT * self.accuracy;
        let jumps = jumped > caught && length > SHORTEST;
        // An error of the velocity remains for seconds.
        let shortest_turn = self.smooth.map_or(SHORTEST_TURN * self.whole, |_| SHORTEST);
        let misses = jumps || turned > caught && length > shortest_turn;
        let allowed = self.accuracy * length;
        // Eq. 41; an error of the velocity is of third order as well, and remains for seconds.
        let growth = (allowed / smooth).sqrt().min(libm::cbrt(caught / velocity));
        let next = match self.smooth {
            Some(_) => length * (0.9 * growth).clamp(1.0 / GROWTH, GROWTH),
            None => self.whole,
        };
        let is_rough = self.smooth.is_some() && (smooth > allowed || velocity > caught);
        let is_long = is_rough && length > SHORTEST_SMOOTH;
        self.attempts += 1;
        let is_fixed = self.fixed[0] > 0.0;
        if !is_fixed && self.attempts < MOST_INTERVALS {
            let closer = self.search.map(|search| Search { low: length, ..search });
            let closer = closer.filter(|closer| closer.high - closer.low > closer.tolerance);
            if !is_solved && !self.gave_up && length > SHORTEST_RETRY * self.whole {
                self.is_halved = true;
                self.plan_anew(0.5 * length, 0.0);
            } else if misses && self.changes < MOST_CHANGES {
                let (change, shortest) =
                    if jumps { (jumped, SHORTEST) } else { (turned, shortest_turn) };
                self.narrow(length, (caught * length / change).max(shortest), jumps);
            } else if is_long {
                self.wanted = next;
                self.plan_anew(next, 0.0);
            } else if closer.is_some() {
                self.search = closer;
            } else {
                self.take(length, next, is_solved);
                let is_coarse = misses || late > caught;
                return if is_coarse { Judgement::TakenCoarse } else { Judgement::Taken };
            }
            return Judgement::Rejected;
        }
        self.take(length, next, is_solved);
        if late > caught || !is_fixed && (misses || is_long) {
            Judgement::TakenCoarse
        } else {
            Judgement::Taken
        }
    }

    /// Narrows the search for an abrupt change, which an interval of `length` (s) has, up to the
    /// `tolerance` (s). `jumps` tells if the velocity jumps.
    fn narrow(&mut self, length: f64, tolerance: f64, jumps: bool) {
        let low = self.search.map_or(0.0, |search| search.low);
        // A gap that just closes shows a small part of its impact.
        let same = self.search.filter(|search| search.jumps == jumps);
        let tolerance = same.map_or(tolerance, |search| search.tolerance.min(tolerance));
        if length - low > tolerance {
            self.search = Some(Search { low, high: length, tolerance, jumps });
            return;
        }
        self.changes += 1;
        let high = self.until_the_end(length);
        self.turns = !jumps;
        let after = if jumps { high - low } else { 0.0 };
        self.fixed = if low > SHORTEST { [low, after] } else { [high, 0.0] };
        self.search = None;
    }

    /// `length` (s), or all that is left of the part if less than an interval would remain.
    fn until_the_end(&self, length: f64) -> f64 {
        let left = self.part - self.since;
        if left - length < SHORTEST { left } else { length }
    }

    /// Goes on after an interval of `length` (s); `next` is the length that its estimate allows.
    fn take(&mut self, length: f64, next: f64, is_solved: bool) {
        self.since += length;
        if self.smooth.is_some() {
            self.usual = self.usual(length);
        }
        let was_halved = std::mem::take(&mut self.is_halved);
        self.has_turned = std::mem::take(&mut self.turns);
        self.gave_up = !is_solved;
        self.streak += 1;
        let share = self.smooth.map_or(1.0, |_| FIRST);
        if self.fixed[0] > 0.0 {
            self.fixed = [self.fixed[1], 0.0];
            self.plan_anew(share * self.wanted, length);
        } else if let Some(Search { high, jumps, .. }) = self.search.take() {
            // The interval ends within the tolerance before the change.
            self.changes += 1;
            if jumps {
                self.fixed = [self.until_the_end(high - length), 0.0];
                self.plan_anew(self.wanted, length);
            } else {
                self.has_turned = true;
                self.plan_anew(share * self.wanted, length);
            }
        } else if !is_solved {
            // Shorter intervals did not help. The step is failed in any case.
            self.plan_anew(self.part - self.since, length);
        } else if was_halved {
            self.plan_anew(next.min(GROWTH * length), length);
        } else {
            (self.wanted, self.plan.count) = (next, self.plan.count - 1);
            let grows = self.streak >= INTERVALS_PER_GROWTH && next >= STAYS[1] * length;
            if self.plan.count > 1 && grows {
                self.plan_anew(next, length);
            }
        }
    }

    /// Goes on to the end of the next `part` of the step (s).
    fn go_on(&mut self, part: f64) {
        (self.part, self.has_turned) = (part, false);
        let share = self.smooth.map_or(1.0, |_| FIRST);
        self.plan_anew(share * self.wanted, 0.0);
    }

    /// Plans one interval to the end of the step, which is taken as it is.
    fn end(&mut self) {
        self.part = self.whole;
        let left = self.whole - self.since;
        self.plan_anew(left, left);
        self.fixed = [left, 0.0];
    }

    /// Divides the rest of the part in intervals near `wanted` (s), or of the `present` length (s).
    fn plan_anew(&mut self, wanted: f64, present: f64) {
        let left = self.part - self.since;
        (self.search, self.streak) = (None, 0);
        self.plan = Plan::even(left, wanted, present);
        if self.fixed[0] == 0.0 && left < SHORTEST {
            self.plan.count = 0;
        }
    }
}

/// Rise of the energy of the instant in an interval beyond loads, drives and moving surfaces. Errors of the
/// velocities of the instant are in it.
struct InstantRise {
    /// Rise (J), and its rounding error.
    energy: f64,
    rounding: f64,
    /// Kinetic energy at the end (J).
    kinetic: f64,
    /// Body with the largest rise.
    body: usize,
}

impl InstantRise {
    /// Rise in the interval `taken`, with the states `free` of free flight at its end.
    ///
    /// After an abrupt change V is the velocity w of the middle (37a), without the second half of the change that
    /// external forces make. This half is missing at the start and no gain at the end.
    fn new(world: &World, free: &[State], taken: &Interval, balance: &EnergyBalance) -> Self {
        let (mut sum, mut size, mut kinetic) = (0.0, 0.0, 0.0);
        let mut largest = (0, f64::NEG_INFINITY);
        let pairs = taken.instant_states().iter().zip(taken.end_states());
        for (index, (body, (start, end))) in world.bodies().iter().zip(pairs).enumerate() {
            let mut energies =
                [start, end].map(|state| energy::body_at_instant(world, body, state));
            let middle = &taken.states[index];
            let starts = world.before().get(index) == Some(&0.0)
                || start.velocity == middle.velocity && start.spin == middle.spin;
            // A motion without contacts may leave no states of free flight.
            if let Some(free) = free.get(index).filter(|_| starts) {
                let share = 1.0 - 0.5 / world.kick(index);
                let whole = State {
                    velocity: middle.velocity + share * (free.velocity - middle.velocity),
                    spin: middle.spin + share * (free.spin - middle.spin),
                    ..*start
                };
                energies[0] = energies[0].max(energy::body_at_instant(world, body, &whole));
            }
            let rise = energies[1] - energies[0];
            sum += rise;
            size += energies[0].abs().max(energies[1].abs());
            kinetic += energies[1] - energy::potential(world, body, end);
            if rise > largest.1 {
                largest = (index, rise);
            }
        }
        let carried = if world.has_surfaces() { balance.friction.max(0.0) } else { 0.0 };
        Self {
            energy: sum - balance.loads - balance.drives - carried,
            rounding: ROUNDING * size,
            kinetic,
            body: largest.0,
        }
    }

    fn is_small(&self) -> bool {
        self.energy <= LARGEST_RISE * self.kinetic + self.rounding
    }
}

/// Replaces velocities of the instant that make energy, at the end of the interval `taken`, of bodies with
/// forces of contacts or joints. The second half of the change that external forces make follows the
/// velocity of the middle then, or nothing. The least rise counts as the gain of the interval if it is larger
/// than the gain of its problem.
fn settle_instants(
    world: &World,
    moment: &mut Moment,
    workspace: &Workspace<'_>,
    taken: &mut Interval,
) {
    let loads = taken.solution.loads();
    let balance =
        EnergyBalance::between_instants(world, &taken.claim(), loads, &workspace.abrupt.bodies);
    let mut rise = InstantRise::new(world, &workspace.free, taken, &balance);
    let held = taken.held_bodies(world);
    for has_kick in [true, false] {
        if rise.is_small() {
            break;
        }
        let found = (taken.ends.clone(), taken.extrapolated.clone());
        for (body, _) in held.iter().enumerate().filter(|(_, held)| **held) {
            let end = &taken.solution.states[body];
            let share = if has_kick { 0.5 / world.kick(body) } else { 0.0 };
            let Some(free) = workspace.free.get(body) else { continue };
            let start = &taken.states[body];
            taken.extrapolated[body] = false;
            taken.ends[body].velocity = end.velocity + share * (free.velocity - start.velocity);
            taken.ends[body].spin = end.spin + share * (free.spin - start.spin);
        }
        let other = InstantRise::new(world, &workspace.free, taken, &balance);
        if other.energy < rise.energy {
            rise = other;
        } else {
            (taken.ends, taken.extrapolated) = found;
        }
    }
    if let Some(instants) = &mut moment.instants {
        instants.states.clone_from(&taken.ends);
    }
    if rise.energy > taken.gain.map_or(rise.rounding, |gain| gain.energy) {
        taken.gain = Some(EnergyGain { body: rise.body, energy: rise.energy });
    }
}

/// True if steps of `world` are divided in intervals whose lengths follow from the motion.
pub(super) fn divides_steps(world: &World, moment: &Moment) -> bool {
    moment.instants.is_some() && world.impacts() == Impacts::Located
}

/// Takes one step from `moment` in intervals whose lengths follow from the motion.
///
/// # Errors
/// Those of an interval; the moment is then unchanged.
pub(super) fn step(
    world: &mut World,
    moment: &mut Moment,
    inputs: &Inputs,
    workspace: &mut Workspace<'_>,
    record: &mut StepRecord,
) -> Result<(), Error> {
    let before = moment.clone();
    let taken = intervals(world, moment, inputs, workspace, record);
    if taken.is_err() {
        *moment = before;
        workspace.forget();
    }
    taken
}

/// Flags of the bodies in islands with an input that jumps at `time` (s); empty without any.
fn jumping_islands(
    world: &World,
    moment: &Moment,
    inputs: &Inputs,
    workspace: &mut Workspace<'_>,
    time: f64,
) -> Vec<bool> {
    let mut jumps = inputs.jumps(world, [time - SHORTEST, time + SHORTEST]).peekable();
    if jumps.peek().is_none() {
        return Vec::new();
    }
    let bodies = moment.arrivals.len();
    let loaded = moment.now.contacts.iter().filter(|force| force.carries_force());
    let islands = &mut workspace.abrupt.islands;
    islands.find(bodies, loaded.map(|force| &force.key), world);
    let mut flags = vec![false; bodies];
    jumps.for_each(|(body, _)| flags[islands.label(body)] = true);
    (0..bodies).map(|body| flags[islands.label(body)]).collect()
}

fn intervals(
    world: &mut World,
    moment: &mut Moment,
    inputs: &Inputs,
    workspace: &mut Workspace<'_>,
    record: &mut StepRecord,
) -> Result<(), Error> {
    let whole = world.time_step();
    let begin = moment.index as f64 * whole;
    // End of the part of the step that begins at this time.
    let part = |world: &World, since: f64| {
        let rest = [begin + since + SHORTEST, begin + whole - SHORTEST];
        let jumps = inputs.jumps(world, rest).map(|(_, time)| time - begin);
        jumps.reduce(f64::min).unwrap_or(whole)
    };
    let first = part(world, 0.0);
    let mut schedule = Schedule::new(world, moment.pace, moment.has_starts(), first);
    // Bodies of islands in which an input jumps at the start of the next interval.
    let mut jumping = jumping_islands(world, moment, inputs, workspace, begin);
    // Bodies of islands in which friction ends or turns a motion in the last interval that was rejected.
    let mut turning = Vec::new();
    let mut infeasible_gap = None;
    loop {
        let Some(length) = schedule.length() else {
            if schedule.part == whole {
                break;
            }
            jumping = jumping_islands(world, moment, inputs, workspace, begin + schedule.part);
            schedule.go_on(part(world, schedule.part));
            continue;
        };
        let before = moment.clone();
        let usual = if infeasible_gap.is_some() { f64::INFINITY } else { schedule.usual(length) };
        let span = Span { since: schedule.since, length, usual, is_retry: false };
        if length != moment.pace.length {
            workspace.rest.end();
        }
        let is_window = length < WINDOW * usual.min(moment.pace.length);
        let start = is_window || schedule.has_turned;
        let jumps = |body: usize| jumping.get(body) == Some(&true);
        let starts = moment.arrivals.iter().enumerate();
        let starts = starts.map(|(body, arrival)| start || arrival.length == 0.0 || jumps(body));
        let mut starts: Vec<bool> = starts.collect();
        workspace.abrupt.turning.clear();
        if schedule.has_turned {
            workspace.abrupt.turning.extend_from_slice(&turning);
        } else {
            workspace.abrupt.turning.extend_from_slice(&jumping);
        }
        loop {
            moment.start_where(&starts);
            moment.pace.length = length;
            let taken = record.next_interval();
            one_interval::interval(world, moment, inputs, workspace, Some(span), taken, false)?;
            // Forces before an abrupt change would act in it by half of the length before.
            if taken.errors.abrupt == 0.0 || !workspace.abrupt.add_to(&mut starts) {
                break;
            }
            record.truncate(record.intervals().len() - 1);
            moment.clone_from(&before);
            workspace.forget();
        }
        let [.., taken] = record.intervals_mut() else { break };
        if infeasible_gap.is_none() && taken.infeasible_gap.is_some() {
            infeasible_gap = taken.infeasible_gap.take();
            schedule.end();
            record.truncate(record.intervals().len() - 1);
            *moment = before;
            workspace.forget();
            continue;
        }
        if infeasible_gap.is_some() {
            let span = Span { usual: length, ..span };
            (taken.infeasible_gap, taken.span) = (infeasible_gap.clone(), Some(span));
            world.set_span(taken.span);
            retry::end_infeasible(world, before.clone(), moment, inputs, workspace, taken);
        }
        let is_solved = taken.report.status.is_solved();
        let judgement = schedule.judge(length, is_solved, &taken.errors);
        if judgement == Judgement::Rejected {
            if taken.errors.turned > 0.0 {
                turning.clone_from(&workspace.abrupt.bodies);
            }
            record.truncate(record.intervals().len() - 1);
            *moment = before;
            workspace.forget();
            continue;
        }
        jumping.clear();
        taken.is_coarse = judgement == Judgement::TakenCoarse;
        let Some(part) = &mut taken.part else { continue };
        part.changeable = world.changeable();
        settle_instants(world, moment, workspace, taken);
        let ends = [&taken.instants, &taken.ends];
        let energies = ends.map(|states| Some(energy::at_instant(world, states)));
        taken.part.iter_mut().for_each(|part| part.energies = energies);
    }
    workspace.abrupt.turning.clear();
    (moment.pace.wanted, moment.pace.usual) = (schedule.wanted, schedule.usual);
    Ok(())
}
