//! Backward pass through a run.
//!
//! The run is divided into segments. A forward pass saves the start of each segment. Segments are
//! then processed from the last to the first: forward with the derivatives of their steps, then
//! backward. Segments at rest are not run again, because all their steps are equal.

use super::{Run, RunGradient};
use crate::derivative::StateChange;
use crate::error::Error;
use crate::mechanics::State;
use crate::simulation::{Saved, Simulation, StepRecord};
use crate::solver::native::{StepDerivative, StepGradient};
use crate::step::StepStatus;
use crate::world::{Constant, World};
use nalgebra::Matrix3;

/// Smallest number of derivatives in a segment. Larger numbers are not faster and use more memory.
const FEW: u64 = 16;

/// Data of a step for the backward pass, besides its derivative.
#[derive(Debug, Clone, Default)]
pub(super) struct Taken {
    pub(super) index: u64,
    /// True unless the step failed or is unphysical.
    pub(super) is_solved: bool,
    /// True if the restitution was reduced.
    pub(super) is_limited: bool,
    /// States at the end of the step.
    states: Vec<State>,
    /// Derivatives of load torques with respect to body rotations (N m/rad), body frame, for loads
    /// that act off the centre.
    turned: Vec<(usize, Matrix3<f64>)>,
    /// Index of the step's derivative in the segment; `None` for the resting step.
    derivative: Option<usize>,
}

impl Taken {
    /// Stores the last step of the simulation, described by `record`.
    fn note(&mut self, simulation: &Simulation<'_>, record: &StepRecord) {
        let Self { index, is_solved, is_limited, states, turned, derivative } = self;
        *index = record.index;
        let unsolved = [StepStatus::Failed, StepStatus::Substepped, StepStatus::Wild];
        *is_solved = !unsolved.contains(&record.report.status);
        *is_limited = record.restitution_share < 1.0;
        states.clone_from(&record.solution.states);
        turned.clear();
        turned.extend(simulation.loads_by_turns(record));
        *derivative = None;
    }
}

/// Start of a segment; `rests` is true if every step in it repeats the previous one.
struct Stretch {
    from: u64,
    start: Saved,
    rests: bool,
}

/// Kind of a linearised step.
#[derive(Clone, Copy, PartialEq)]
enum BackwardResult {
    Motion,
    /// The known resting step.
    Rest,
    /// Another resting step.
    NewRest,
}

/// State of the backward pass.
pub(super) struct Backward {
    first: u64,
    /// Number of steps linearised at a time, and number of simulations that may be saved.
    stretch: u64,
    saved: u64,
    /// Derivatives with respect to the states at the present step of the pass.
    dual: Vec<StateChange>,
    found: RunGradient,
    step: StepGradient,
    /// Constants of the run, then its inputs.
    asked: Vec<Constant>,
    /// Reusable memory: the steps of a segment, the record of its last one, and the derivatives of
    /// its moving steps.
    taken: Vec<Taken>,
    record: StepRecord,
    derivatives: Vec<StepDerivative>,
    /// Derivative of the last resting step. `owed` is the sum of the dual states that passed
    /// through it and are not yet multiplied for the constants.
    resting: StepDerivative,
    owed: Vec<StateChange>,
    /// True if the pass is in a resting segment that uses `resting`.
    is_resting: bool,
    end: Option<Saved>,
}

impl Backward {
    /// Creates the pass at the end of a run from step `first` on.
    pub(super) fn begin(run: &Run<'_>, first: u64, world: &World) -> Result<Self, Error> {
        let bodies = world.bodies().len();
        let infinite = (f64::INFINITY, first);
        let saved = run.checkpoints.saved.max(2) as u64;
        Ok(Self {
            first,
            stretch: run.steps.div_ceil(saved).max(FEW).min(run.checkpoints.steps.max(1) as u64),
            saved,
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
            record: StepRecord::new(),
            derivatives: Vec::new(),
            resting: derivative_of(run)?,
            owed: vec![StateChange::zero(); bodies],
            is_resting: false,
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
        self.settle(run)?;
        self.add(run, 0, start.states())?;
        if let Some(end) = &self.end {
            simulation.restore(end)?;
        }
        let mut found = self.found;
        found.states = self.dual;
        found.wrenches.reverse();
        found.inputs.reverse();
        Ok(found)
    }

    /// Adds the derivatives with respect to the `states` after `steps` steps.
    fn add(&mut self, run: &mut Run<'_>, steps: u64, states: &[State]) -> Result<(), Error> {
        let Some(by_states) = (run.by_states)(steps, states) else { return Ok(()) };
        let (field, count) = ("derivatives by states", by_states.len());
        if count != self.dual.len() {
            return Err(Error::Count { field, count, allowed: "one per body" });
        }
        for (dual, more) in self.dual.iter_mut().zip(&by_states) {
            *dual = dual.plus(1.0, more);
        }
        Ok(())
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
            simulation.advance(run, &mut self.record)?;
            stretch.rests &= simulation.scratch.rest.stays();
        }
        let saved = self.saved;
        self.saved = (saved.saturating_sub(parts)).max(2);
        let mut end = to;
        while let Some(Stretch { from, start, rests }) = stretches.pop() {
            if from < end && !(rests && self.rest(simulation, run, from, end, &start)?) {
                self.is_resting = false;
                self.go(simulation, run, from, end, &start)?;
            }
            end = from;
        }
        self.saved = saved;
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
        let mut taken = std::mem::take(&mut self.taken);
        taken.resize_with(taken.len().max(1), Taken::default);
        // A segment after one with the same steps shares their derivative.
        let mut is_at_rest = self.is_resting;
        if !is_at_rest {
            simulation.restore(start)?;
            simulation.advance(run, &mut self.record)?;
            taken[0].note(simulation, &self.record);
            let found = self.linearise(simulation, run, 0)?;
            is_at_rest = found != BackwardResult::Motion;
            if found == BackwardResult::NewRest {
                self.settle(run)?;
                std::mem::swap(&mut self.derivatives[0], &mut self.resting);
            }
        }
        for k in (from..to).rev().take_while(|_| is_at_rest) {
            taken[0].index = self.first + k;
            self.back(run, &taken[0], &mut [])?;
        }
        self.is_resting = is_at_rest;
        self.taken = taken;
        Ok(is_at_rest)
    }

    /// Processes one segment: forward with derivatives, then backward.
    fn leaf(
        &mut self,
        simulation: &mut Simulation<'_>,
        run: &mut Run<'_>,
        from: u64,
        to: u64,
        start: &Saved,
    ) -> Result<(), Error> {
        simulation.restore(start)?;
        let count = (to - from) as usize;
        let mut taken = std::mem::take(&mut self.taken);
        taken.resize_with(taken.len().max(count), Taken::default);
        let (mut last, mut used) = (BackwardResult::Motion, 0);
        for k in 0..count {
            simulation.advance(run, &mut self.record)?;
            taken[k].note(simulation, &self.record);
            last = match last {
                BackwardResult::Rest | BackwardResult::NewRest
                    if simulation.scratch.rest.stays() =>
                {
                    BackwardResult::Rest
                }
                _ => self.linearise(simulation, run, used)?,
            };
            match last {
                BackwardResult::Motion => {
                    taken[k].derivative = Some(used);
                    used += 1;
                }
                BackwardResult::Rest => {}
                BackwardResult::NewRest => {
                    self.settle(run)?;
                    std::mem::swap(&mut self.derivatives[used], &mut self.resting);
                    // Earlier steps without a derivative used the previous resting step.
                    let earlier = taken[..k].iter_mut().map(|taken| &mut taken.derivative);
                    earlier.filter(|of| of.is_none()).for_each(|of| *of = Some(used));
                    used += 1;
                }
            }
        }
        if self.end.is_none() {
            self.end = Some(simulation.save());
        }
        let mut derivatives = std::mem::take(&mut self.derivatives);
        for step in taken[..count].iter().rev() {
            self.back(run, step, &mut derivatives)?;
        }
        (self.taken, self.derivatives) = (taken, derivatives);
        Ok(())
    }

    /// Linearises the last step, described by `record`, into the derivative at index `place`,
    /// unless it is the known resting step.
    fn linearise(
        &mut self,
        simulation: &Simulation<'_>,
        run: &Run<'_>,
        place: usize,
    ) -> Result<BackwardResult, Error> {
        if self.derivatives.len() == place {
            self.derivatives.push(derivative_of(run)?);
        }
        let Self { record, derivatives, resting, .. } = self;
        let (contacts, solution, derivative) =
            (&record.contacts, &record.solution, &mut derivatives[place]);
        let mut free = derivative.take_flights();
        let found = simulation.with_step(record, &mut free, |step| {
            if resting.is_at_rest_in(step, contacts, solution) {
                return Ok(BackwardResult::Rest);
            }
            derivative.linearise(step, contacts, solution)?;
            Ok(if derivative.is_at_rest() {
                BackwardResult::NewRest
            } else {
                BackwardResult::Motion
            })
        });
        derivative.keep_flights(free);
        found?
    }

    /// Processes one step backward with its derivative, from `derivatives` or of the resting step.
    fn back(
        &mut self,
        run: &mut Run<'_>,
        step: &Taken,
        derivatives: &mut [StepDerivative],
    ) -> Result<(), Error> {
        self.add(run, step.index + 1 - self.first, &step.states)?;
        let derivative = match step.derivative {
            Some(of) => &mut derivatives[of],
            None => &mut self.resting,
        };
        self.found.note(step, derivative);
        // Inputs need the product of every step.
        let is_summed = step.derivative.is_none() && run.inputs.is_empty();
        if is_summed && derivative.pull_at_rest(&self.dual, &mut self.step)? {
            let owed = self.owed.iter_mut().zip(&self.dual);
            owed.for_each(|(owed, dual)| *owed = owed.plus(1.0, dual));
        } else {
            derivative.pull(&self.dual, &self.asked, &mut self.step)?;
            if !run.inputs.is_empty() {
                self.found.inputs.push(self.step.constants[run.constants.len()..].to_vec());
            }
        }
        self.dual.clone_from(&self.step.states);
        // Adds the rotation of loads that act at a point of a body.
        for (body, by) in &step.turned {
            self.dual[*body].turn += by.tr_mul(&self.step.wrenches[*body].torque);
        }
        self.found.wrenches.push(self.step.wrenches.clone());
        self.add_constants();
        Ok(())
    }

    /// Multiplies the sum of all passes through the resting step for the constants, and adds the
    /// result.
    fn settle(&mut self, run: &Run<'_>) -> Result<(), Error> {
        if self.owed.iter().all(|owed| *owed == StateChange::zero()) {
            return Ok(());
        }
        if !run.constants.is_empty() {
            self.resting.pull(&self.owed, run.constants, &mut self.step)?;
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

/// Empty derivative with the smoothing of the run.
fn derivative_of(run: &Run<'_>) -> Result<StepDerivative, Error> {
    run.smoothing.map_or(Ok(StepDerivative::new()), StepDerivative::smoothed)
}

impl Simulation<'_> {
    /// Derivatives of load torques with respect to body rotations (N m/rad), body frame, for loads
    /// that act off the centre.
    fn loads_by_turns(&self, record: &StepRecord) -> impl Iterator<Item = (usize, Matrix3<f64>)> {
        let h = self.world().time_step();
        let each = self.outside.iter().zip(&record.states).enumerate();
        each.filter_map(move |(body, (outside, state))| {
            Some((body, outside.load.torque_by_turn(record.index, h, &state.attitude)?))
        })
    }

    /// Takes one step of `run`.
    fn advance(&mut self, run: &mut Run<'_>, record: &mut StepRecord) -> Result<(), Error> {
        (run.before)(self)?;
        self.step(record)
    }
}
