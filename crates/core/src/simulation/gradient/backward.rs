//! Backward pass through a run.
//!
//! A run within the memory budget is recorded once and then traversed backward, where each step is
//! linearised from its record. A longer run is divided into segments: a forward pass saves the start
//! of each, and the segments are recorded and traversed from the last to the first. Segments at rest
//! are not run again, because all their steps are equal.

use super::impact_time::{DualStates, ImpactTimes};
use super::{Run, RunGradient};
use crate::derivative::StateChange;
use crate::error::Error;
use crate::mechanics::{State, Wrench};
use crate::simulation::driving::exchange_drives;
use crate::simulation::inputs::late_share;
use crate::simulation::{Interval, Saved, Simulation, StepRecord};
use crate::solver::native::{StepDerivative, StepGradient};
use crate::world::{Changeable, Constant, World};
use nalgebra::Matrix3;

/// Memory for the records of a segment, if these are more than [`FEW`] steps (bytes).
const MEMORY: usize = 64_000_000;
/// Estimated memory of a recorded step for each body with about eight contacts (bytes).
const BODY_BYTES: usize = 6000;
/// Number of steps of a segment that is always allowed.
const FEW: usize = 16;

/// Recorded step with the changeable parts of its world at its end.
#[derive(Debug, Default)]
struct Recorded {
    record: StepRecord,
    changeable: Changeable,
}

/// Place of an interval in a segment: of its record, and of the interval in it.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
struct Place {
    record: usize,
    interval: usize,
}

/// Interval of a segment.
#[derive(Debug, Default)]
struct Taken {
    /// Steps of the run up to its step.
    steps: u64,
    /// Its record. Equal steps at rest share one.
    place: Place,
    /// Derivatives of load torques with respect to body rotations (N m/rad), body frame, for loads
    /// that act off the centre.
    turned: Vec<(usize, Matrix3<f64>)>,
    /// True for the last interval of a step.
    is_last: bool,
}

/// Start of a segment; `rests` is true if every step in it repeats the previous one.
struct Stretch {
    from: u64,
    start: Saved,
    rests: bool,
}

/// State of the backward pass.
pub(super) struct Backward {
    first: u64,
    /// Number of steps recorded at a time, and number of simulations that may be saved.
    stretch: u64,
    saved: u64,
    /// Derivatives with respect to the states at the present step of the pass.
    dual: Vec<StateChange>,
    found: RunGradient,
    step: StepGradient,
    /// Constants of the run, then its inputs.
    asked: Vec<Constant>,
    /// Reusable memory: the steps of a segment and their records.
    taken: Vec<Taken>,
    records: Vec<Recorded>,
    /// Derivative of the present step. If the step is at rest, `owed` is the sum of the dual states
    /// that passed through it and are not yet multiplied for the constants.
    derivative: StepDerivative,
    owed: Vec<StateChange>,
    /// Derivatives with respect to the velocities before the present interval, from the extrapolation of
    /// those of the instant after it (eq. 37a).
    extrapolated: Vec<StateChange>,
    /// Derivatives with respect to the velocities of the instant after the present interval.
    by_instants: Vec<StateChange>,
    /// Derivatives with respect to the input of the present interval, from the half kick of the next one
    /// and from the velocities of the instant after it.
    later: Vec<Wrench>,
    late: Vec<Wrench>,
    later_inputs: Vec<Vec<f64>>,
    /// True if wrenches belong to the instant.
    at_instant: bool,
    times: ImpactTimes,
    end: Option<Saved>,
}

impl Backward {
    /// Creates the pass at the end of a run from step `first` on.
    pub(super) fn begin(
        run: &Run<'_>,
        first: u64,
        world: &World,
        is_divided: bool,
        at_instant: bool,
    ) -> Result<Self, Error> {
        let bodies = world.bodies().len();
        let infinite = (f64::INFINITY, first);
        // A step may have many intervals.
        let most = if is_divided { FEW } else { (MEMORY / (bodies * BODY_BYTES)).max(FEW) };
        Ok(Self {
            first,
            stretch: most.min(run.checkpoints.steps.max(1)) as u64,
            saved: run.checkpoints.saved.max(2) as u64,
            dual: vec![StateChange::zero(); bodies],
            found: RunGradient {
                constants: run.constants.iter().map(|c| vec![0.0; c.width(world)]).collect(),
                margin: infinite,
                feature_margin: infinite,
                ..RunGradient::default()
            },
            step: StepGradient::default(),
            asked: run.constants.iter().chain(run.inputs).copied().collect(),
            taken: Vec::new(),
            records: Vec::new(),
            derivative: run
                .smoothing
                .map_or(Ok(StepDerivative::new()), StepDerivative::smoothed)?,
            owed: vec![StateChange::zero(); bodies],
            extrapolated: vec![StateChange::zero(); bodies],
            by_instants: vec![StateChange::zero(); bodies],
            later: vec![Wrench::zero(); bodies],
            late: vec![Wrench::zero(); bodies],
            later_inputs: Vec::new(),
            at_instant,
            times: ImpactTimes::new(run.has_impact_times || is_divided),
            end: None,
        })
    }

    /// Finishes the pass at `start` and returns the gradient. The simulation is left at the end of
    /// the run.
    pub(super) fn end(
        mut self,
        simulation: &mut Simulation<'_>,
        run: &mut Run<'_>,
        start: &Saved,
    ) -> Result<RunGradient, Error> {
        self.flush_constants(run)?;
        self.times.end(DualStates { states: &mut self.dual, instants: &mut self.by_instants });
        self.add(run, 0, start.states())?;
        self.take_instants(|_| None);
        if let Some(end) = &self.end {
            simulation.restore(end)?;
        }
        let mut found = self.found;
        found.states = self.dual;
        found.wrenches.reverse();
        found.inputs.reverse();
        Ok(found)
    }

    /// Adds the derivatives with respect to the `states` after `steps` steps, with the velocities of the
    /// instant.
    fn add(&mut self, run: &mut Run<'_>, steps: u64, states: &[State]) -> Result<(), Error> {
        let Some(by_states) = (run.by_states)(steps, states) else { return Ok(()) };
        let (field, count) = ("derivatives by states", by_states.len());
        if count != self.dual.len() {
            return Err(Error::Count { field, count, allowed: "one per body" });
        }
        for (body, more) in by_states.iter().enumerate() {
            let by_velocity = more.velocities();
            self.dual[body] = self.dual[body].plus(1.0, more).plus(-1.0, &by_velocity);
            self.by_instants[body] = self.by_instants[body].plus(1.0, &by_velocity);
        }
        Ok(())
    }

    /// Converts the derivatives with respect to the velocities of the instant to those with respect to the
    /// velocities of which they are extrapolated, by this share of their last change (eq. 37a). Returns the
    /// former.
    fn take_instants(&mut self, share: impl Fn(usize) -> Option<f64>) -> Vec<StateChange> {
        let bodies = self.dual.len();
        let taken = std::mem::replace(&mut self.by_instants, vec![StateChange::zero(); bodies]);
        for (body, by) in taken.iter().enumerate() {
            let share = share(body).unwrap_or(0.0);
            self.dual[body] = self.dual[body].plus(1.0 + share, by);
            self.extrapolated[body] = self.extrapolated[body].plus(-share, by);
        }
        taken
    }

    /// Processes the steps `from`…`to` backward; `start` is the state before the first of them.
    pub(super) fn go(
        &mut self,
        simulation: &mut Simulation<'_>,
        run: &mut Run<'_>,
        from: u64,
        to: u64,
        start: &Saved,
    ) -> Result<(), Error> {
        let count = to - from;
        if count <= self.stretch {
            return self.leaf(simulation, run, from, to, start);
        }
        // As few segments as fill the memory, or all.
        let parts = count.div_ceil(self.stretch).min(self.saved);
        let length = count.div_ceil(parts);
        let mut stretches = vec![Stretch { from, start: start.clone(), rests: true }];
        simulation.restore(start)?;
        for k in from..to {
            if k > from && (k - from).is_multiple_of(length) {
                stretches.push(Stretch { from: k, start: simulation.save(), rests: true });
            }
            let Some(stretch) = stretches.last_mut() else { break };
            // The last segment runs when it is differentiated.
            if k >= from + (parts - 1) * length {
                stretch.rests = false;
                break;
            }
            simulation.advance(run, self.record_at(0))?;
            let is_whole = self.records[0].record.first().part.is_none();
            stretch.rests &= is_whole && simulation.workspace.rest.stays();
        }
        let saved = self.saved;
        self.saved = (saved.saturating_sub(parts)).max(2);
        let mut end = to;
        while let Some(Stretch { from, start, rests }) = stretches.pop() {
            if from < end && !(rests && self.rest(simulation, run, from, end, &start)?) {
                self.go(simulation, run, from, end, &start)?;
            }
            end = from;
        }
        self.saved = saved;
        Ok(())
    }

    /// Record `place` of the segment, created if it does not exist.
    fn record_at(&mut self, place: usize) -> &mut StepRecord {
        if self.records.len() == place {
            self.records.push(Recorded::default());
        }
        &mut self.records[place].record
    }

    /// Takes one step into record `place` of the segment.
    fn take(
        &mut self,
        simulation: &mut Simulation<'_>,
        run: &mut Run<'_>,
        place: usize,
    ) -> Result<(), Error> {
        simulation.advance(run, self.record_at(place))?;
        self.records[place].changeable = simulation.world().changeable();
        Ok(())
    }

    /// Processes a segment in which every step repeats the previous one, if the first step is at
    /// rest. Returns true if it is.
    fn rest(
        &mut self,
        simulation: &mut Simulation<'_>,
        run: &mut Run<'_>,
        from: u64,
        to: u64,
        start: &Saved,
    ) -> Result<bool, Error> {
        simulation.restore(start)?;
        self.take(simulation, run, 0)?;
        let record = &self.records[0].record;
        let turned = simulation.load_torque_rotation_jacobians(from, record.first()).collect();
        let mut taken = Taken { turned, is_last: true, ..Taken::default() };
        self.linearise(simulation, run, taken.place)?;
        let is_at_rest = self.derivative.is_at_rest();
        for k in (from..to).rev().take_while(|_| is_at_rest) {
            taken.steps = k + 1;
            self.back(simulation.world(), run, &taken)?;
        }
        Ok(is_at_rest)
    }

    /// Processes one segment: records it, then linearises its steps backward.
    fn leaf(
        &mut self,
        simulation: &mut Simulation<'_>,
        run: &mut Run<'_>,
        from: u64,
        to: u64,
        start: &Saved,
    ) -> Result<(), Error> {
        simulation.restore(start)?;
        let mut taken = std::mem::take(&mut self.taken);
        taken.clear();
        let mut used = 0;
        for k in from..to {
            self.take(simulation, run, used)?;
            // A repeated step has the record before it.
            let intervals = self.records[used].record.intervals();
            let is_whole = intervals[0].part.is_none();
            let repeats = used > 0 && is_whole && simulation.workspace.rest.stays();
            let record = if repeats { used - 1 } else { used };
            for (interval, described) in intervals.iter().enumerate() {
                let turned = simulation.load_torque_rotation_jacobians(self.first + k, described);
                taken.push(Taken {
                    steps: k + 1,
                    place: Place { record, interval },
                    turned: turned.collect(),
                    is_last: interval + 1 == intervals.len(),
                });
            }
            used += usize::from(!repeats);
        }
        if self.end.is_none() {
            self.end = Some(simulation.save());
        }
        let mut last = None;
        for step in taken.iter().rev() {
            if last != Some(step.place) {
                self.linearise(simulation, run, step.place)?;
                last = Some(step.place);
            }
            self.back(simulation.world(), run, step)?;
        }
        simulation.world.set_span(None);
        self.taken = taken;
        Ok(())
    }

    /// Linearises the interval at `place`, unless it equals the linearised step at rest.
    fn linearise(
        &mut self,
        simulation: &mut Simulation<'_>,
        run: &Run<'_>,
        place: Place,
    ) -> Result<(), Error> {
        let records = std::mem::take(&mut self.records);
        let Recorded { record, changeable } = &records[place.record];
        let taken = &record.intervals()[place.interval];
        let changeable = taken.part.as_ref().map_or(changeable, |part| &part.changeable);
        simulation.world.set_changeable(changeable);
        simulation.world.set_span(taken.span);
        if !taken.before.is_empty() {
            simulation.world.set_before(taken.before.iter().copied());
        }
        let mut drives = taken.drives.clone();
        exchange_drives(&mut simulation.world, &mut drives);
        let held = simulation.world.hold_back(&taken.states, &taken.solution.joints);
        let mut free = self.derivative.take_flights();
        let has_instants = simulation.world.has_half_kicks();
        self.derivative.set_instants(if has_instants { taken.instant_states() } else { &[] });
        let step = simulation.recorded_interval(taken, &mut free);
        let Interval { contacts, solution, .. } = taken;
        let mut found = Ok(());
        // Parts of steps have different lengths.
        let is_other = !taken.before.is_empty() || !taken.drives.is_empty();
        let is_rest = || self.derivative.is_at_rest_in(&step, contacts, solution);
        if taken.part.is_some() || is_other || !is_rest() {
            found = self.flush_constants(run);
            found = found.and_then(|()| self.derivative.linearise(&step, contacts, solution));
        }
        self.derivative.keep_flights(free);
        simulation.world.release(held);
        exchange_drives(&mut simulation.world, &mut drives);
        self.records = records;
        found
    }

    /// Processes an interval backward with its derivative.
    fn back(&mut self, world: &World, run: &mut Run<'_>, step: &Taken) -> Result<(), Error> {
        let records = std::mem::take(&mut self.records);
        let taken = &records[step.place.record].record.intervals()[step.place.interval];
        let ends = DualStates { states: &mut self.dual, instants: &mut self.by_instants };
        self.found.untimed += u64::from(self.times.begin(world, taken, ends));
        let is_extrapolated = |body: usize| taken.extrapolated.get(body) == Some(&true);
        let share = |body| is_extrapolated(body).then(|| 0.5 / world.kick(body));
        let added =
            if step.is_last { self.add(run, step.steps, taken.end_states()) } else { Ok(()) };
        for (body, by) in self.take_instants(share).iter().enumerate() {
            if is_extrapolated(body) && !self.at_instant && !world.is_held(body) {
                let of = &world.bodies()[body];
                let share = late_share(world, body);
                let torque = of.inertia_inverse() * by.spin;
                self.late[body] = Wrench { force: by.velocity / of.mass(), torque }.scaled(share);
            }
        }
        self.found.note(self.first + step.steps - 1, taken, &self.derivative);
        let is_whole = taken.part.is_none() && taken.before.is_empty();
        let starts = taken.states.clone();
        let before = taken.before.clone();
        self.records = records;
        added?;
        let Self { derivative, dual, owed, step: gradient, .. } = self;
        // Inputs need the product of every step.
        let is_summed = is_whole && derivative.is_at_rest() && run.inputs.is_empty();
        if is_summed && derivative.pull_at_rest(dual, gradient)? {
            let owed = owed.iter_mut().zip(&*dual);
            owed.for_each(|(owed, dual)| *owed = owed.plus(1.0, dual));
        } else {
            derivative.vjp(dual, &self.asked, gradient)?;
            self.add_inputs(world, run, step.is_last);
        }
        let Self { dual, extrapolated, by_instants, records, step: gradient, .. } = self;
        let after = std::mem::replace(dual, gradient.states.clone());
        by_instants.clone_from(&gradient.instants);
        let taken = &records[step.place.record].record.intervals()[step.place.interval];
        self.times.add(world, taken, &after, DualStates { states: dual, instants: by_instants });
        for (dual, more) in dual.iter_mut().zip(extrapolated.iter_mut()) {
            *dual = dual.plus(1.0, more);
            *more = StateChange::zero();
        }
        // Adds the rotation of loads that act at a point of a body.
        for (body, by) in &step.turned {
            let share = if world.has_half_kicks() { world.kick(*body) } else { 1.0 };
            dual[*body].turn += by.tr_mul(&gradient.wrenches[*body].torque) * share;
        }
        if !world.before().is_empty() {
            for (body, state) in starts.iter().enumerate() {
                let by = &gradient.wrenches[body];
                let slope = world.missing_torque_by_spin(body, &state.spin);
                dual[body].spin += slope.tr_mul(&by.torque);
                for (constant, sums) in self.asked.iter().zip(&mut gradient.constants) {
                    world.missing_kick_vjp(body, state, by, *constant, sums);
                }
            }
        }
        // Bodies that start have the velocities of the instant.
        for (body, _) in before.iter().enumerate().filter(|(_, before)| **before == 0.0) {
            let by_velocity = self.dual[body].velocities();
            self.dual[body] = self.dual[body].plus(-1.0, &by_velocity);
            self.by_instants[body] = self.by_instants[body].plus(1.0, &by_velocity);
        }
        self.add_wrenches(world, step.is_last);
        self.add_constants();
        Ok(())
    }

    /// Adds the derivatives with respect to the inputs of joints in the present interval.
    fn add_inputs(&mut self, world: &World, run: &Run<'_>, is_last: bool) {
        let first = run.constants.len();
        let mut own = self.step.constants[first..].to_vec();
        if world.has_half_kicks() && !self.at_instant {
            self.later_inputs.resize_with(own.len(), Vec::new);
            let each = own.iter_mut().zip(&mut self.later_inputs).zip(run.inputs);
            for ((own, later), input) in each {
                later.resize(own.len(), 0.0);
                let shares = world.held_shares(*input);
                for ((own, later), share) in own.iter_mut().zip(later).zip(shares) {
                    let by = *own;
                    *own = by * share + std::mem::replace(later, by * (1.0 - share));
                }
            }
        }
        if !run.inputs.is_empty() && is_last {
            self.found.inputs.push(own);
        } else {
            self.found.add_last_inputs(&own);
        }
    }

    /// Adds the derivatives with respect to the inputs of the present interval. Held inputs act in its
    /// second half and in the first half of the next one.
    fn add_wrenches(&mut self, world: &World, is_last: bool) {
        let Self { step: gradient, later, late, found, at_instant, .. } = self;
        let mut own = gradient.wrenches.clone();
        if world.has_half_kicks() {
            for (body, own) in own.iter_mut().enumerate() {
                let by = *own;
                let kick = world.kick(body);
                if *at_instant {
                    *own = by.scaled(kick);
                    continue;
                }
                *own = by.scaled(0.5).plus(&later[body]).plus(&late[body]);
                later[body] = by.scaled(kick - 0.5).plus(&late[body].scaled(-1.0));
                late[body] = Wrench::zero();
            }
        }
        if is_last {
            found.wrenches.push(own);
        } else {
            found.add_last_wrenches(&own);
        }
    }

    /// Multiplies the sum of all passes through the resting step for the constants, and adds the
    /// result.
    fn flush_constants(&mut self, run: &Run<'_>) -> Result<(), Error> {
        if self.owed.iter().all(|owed| *owed == StateChange::zero()) {
            return Ok(());
        }
        if !run.constants.is_empty() {
            self.derivative.vjp(&self.owed, run.constants, &mut self.step)?;
            self.add_constants();
        }
        self.owed.fill(StateChange::zero());
        Ok(())
    }

    /// Adds the derivatives with respect to the constants of the last product.
    fn add_constants(&mut self) {
        let sums = self.found.constants.iter_mut().zip(&self.step.constants);
        for (sum, more) in sums.flat_map(|(sums, more)| sums.iter_mut().zip(more)) {
            *sum += more;
        }
    }
}

impl Simulation<'_> {
    /// Derivatives of load torques with respect to body rotations (N m/rad), body frame, for loads
    /// that act off the centre, in the interval `taken` of step `index`.
    fn load_torque_rotation_jacobians(
        &self,
        index: u64,
        taken: &Interval,
    ) -> impl Iterator<Item = (usize, Matrix3<f64>)> {
        let world = taken.world(&self.world);
        let each = self.inputs.outside.iter().zip(&taken.states).enumerate();
        each.filter_map(move |(body, (outside, state))| {
            let interval = world.load_interval(index, body);
            Some((body, outside.load.torque_by_turn(interval, &state.attitude)?))
        })
    }

    /// Takes one step of `run`.
    fn advance(&mut self, run: &mut Run<'_>, record: &mut StepRecord) -> Result<(), Error> {
        (run.before)(self)?;
        self.step(record)
    }
}
