//! The derivative of a whole run: of a number that its states decide, by the state that it started from, by
//! what acted on it in every step, and by the constants of the world.
//!
//! The run goes forward once and is then gone through backwards, with products of the transposed
//! derivative of each step ([`StepDerivative::pull`]): one pass, however many arguments there are.
//! What the backward pass needs of a step is made again from states that were saved on the way, as many
//! as a [budget](Checkpoints) of memory allows; where it does not hold a stretch of steps at a time, stretches are
//! divided again. What was run is the same to the last bit with derivatives and without.

use super::{Saved, Simulation, StepRecord};
use crate::derivative::StateChange;
use crate::error::Error;
use crate::mechanics::{State, Wrench};
use crate::solver::native::{Smoothing, StepDerivative, StepGradient};
use crate::step::StepStatus;
use crate::world::Constant;
use nalgebra::Matrix3;

/// How much the backward pass may keep at a time.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Checkpoints {
    /// Derivatives of steps, at least one.
    pub steps: usize,
    /// Saved simulations, at least two.
    pub saved: usize,
}

impl Default for Checkpoints {
    /// 300 of each: with one body some megabytes, and one more run for up to 90 000 steps.
    fn default() -> Self {
        Self { steps: 300, saved: 300 }
    }
}

/// Derivatives of so few steps at a time are as fast as any number, and their memory stays near.
const FEW: u64 = 16;

/// Derivatives of a number by the states after so many steps.
pub type ByStates<'f> = dyn FnMut(u64, &[State]) -> Option<Vec<StateChange>> + 'f;

/// A run to be differentiated.
pub struct Run<'f> {
    /// How many steps.
    pub steps: u64,
    /// Before each step: sets what acts in it, as a program does from step to step. It is called again for the same
    /// step, with the simulation in the same state, and must do the same.
    pub before: &'f mut dyn FnMut(&mut Simulation<'_>) -> Result<(), Error>,
    /// Of the states after so many steps (0 are those at the start), the derivatives of the number by them;
    /// nothing where it does not depend on them.
    pub by_states: &'f mut ByStates<'f>,
    /// The constants to differentiate by.
    pub constants: &'f [Constant],
    /// What may be kept.
    pub checkpoints: Checkpoints,
    /// With it the derivatives of the steps are [smoothed](StepDerivative::smoothed): the run is the exact one,
    /// and what is found no derivative of it but a direction where the exact one has none.
    pub smoothing: Option<Smoothing>,
}

/// The derivatives of a number by what a run started from.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct RunGradient {
    /// By the states at the start.
    pub states: Vec<StateChange>,
    /// By the wrenches of every step, one list a step.
    pub wrenches: Vec<Vec<Wrench>>,
    /// By the constants that were asked for, in their order.
    pub constants: Vec<Vec<f64>>,
    /// The smallest [margin](StepDerivative::margin) of a step, m/s, and its index.
    pub margin: (f64, u64),
    /// The same of [features](StepDerivative::feature_margin).
    pub feature_margin: (f64, u64),
    /// Steps that failed or are wild: nothing that follows is a derivative of the equations.
    pub unsolved: u64,
    /// Steps in which contacts pressed whose features are [not known](StepDerivative::unknown) as functions of the
    /// poses.
    pub unknown: u64,
    /// Steps in which shares of forces were [kept](StepDerivative::keeps_shares).
    pub kept: u64,
    /// Steps that took a [part](StepRecord::restitution_share) of their restitution, which is taken for a constant.
    pub limited: u64,
}

impl RunGradient {
    /// Notes what is to be said of a step.
    fn note(&mut self, record: &StepRecord, derivative: &StepDerivative) {
        let smaller = |most: &mut (f64, u64), margin: f64| {
            if margin < most.0 {
                *most = (margin, record.index);
            }
        };
        smaller(&mut self.margin, derivative.margin());
        smaller(&mut self.feature_margin, derivative.feature_margin());
        let is_solved = !matches!(record.report.status, StepStatus::Failed | StepStatus::Wild);
        self.unsolved += u64::from(!is_solved);
        self.unknown += u64::from(derivative.unknown() > 0);
        self.kept += u64::from(derivative.keeps_shares());
        self.limited += u64::from(record.restitution_share < 1.0);
    }
}

impl Simulation<'_> {
    /// Runs `run` from where the simulation is and finds the derivatives of the number that it decides. The simulation
    /// is left at the end of the run; after an error where it was.
    ///
    /// # Errors
    /// A step that cannot be posed, is interrupted, or [has no derivative](Simulation::linearise); what `run` itself
    /// refuses; derivatives by other states than one a body.
    pub fn gradient(&mut self, run: &mut Run<'_>) -> Result<RunGradient, Error> {
        let start = self.save();
        let found = self.differentiated(run, &start);
        if found.is_err() {
            self.restore(&start)?;
        }
        found
    }

    /// The derivatives of a run from `start`, where the simulation is.
    fn differentiated(&mut self, run: &mut Run<'_>, start: &Saved) -> Result<RunGradient, Error> {
        for constant in run.constants.iter().filter(|c| c.is_of_shapes()) {
            // What cannot vary has no derivative.
            self.world().with_constants(&[(*constant, &constant.of(self.world()))])?;
        }
        let first = self.index();
        let bodies = self.world().bodies().len();
        let infinite = (f64::INFINITY, first);
        let saved = run.checkpoints.saved.max(2) as u64;
        let mut backward = Backward {
            first,
            stretch: run.steps.div_ceil(saved).max(FEW).min(run.checkpoints.steps.max(1) as u64),
            saved,
            dual: vec![StateChange::zero(); bodies],
            found: RunGradient {
                constants: run.constants.iter().map(|c| vec![0.0; c.width(self.world())]).collect(),
                margin: infinite,
                feature_margin: infinite,
                ..RunGradient::default()
            },
            step: StepGradient::default(),
            tape: Vec::new(),
            resting: derivative_of(run)?,
            owed: vec![StateChange::zero(); bodies],
            end: None,
        };
        backward.go(self, run, (0, run.steps), start)?;
        backward.settle(run)?;
        backward.add(run, 0, start.states())?;
        if let Some(end) = &backward.end {
            self.restore(end)?;
        }
        let mut found = backward.found;
        found.states = backward.dual;
        found.wrenches.reverse();
        Ok(found)
    }

    /// [`Simulation::linearise`], or nothing where the step is that at rest which `resting` is of.
    fn linearise_unless(
        &self,
        record: &StepRecord,
        derivative: &mut StepDerivative,
        resting: &StepDerivative,
    ) -> Result<Found, Error> {
        let (contacts, solution) = (&record.contacts, &record.solution);
        let mut free = derivative.take_flights();
        let found = self.with_step(record, &mut free, |step| {
            if resting.is_at_rest_in(step, contacts, solution) {
                return Ok(Found::Rest);
            }
            derivative.linearise(step, contacts, solution)?;
            Ok(if derivative.is_at_rest() { Found::NewRest } else { Found::Motion })
        });
        derivative.keep_flights(free);
        found?
    }

    /// Of the bodies with loads that act beside their centres in a step, how the torques follow their turns, N m/rad, body.
    fn loads_by_turns(&self, record: &StepRecord) -> impl Iterator<Item = (usize, Matrix3<f64>)> {
        let h = self.world().time_step();
        let each = self.outside.iter().zip(&record.states).enumerate();
        each.filter_map(move |(body, (outside, state))| {
            Some((body, outside.load.torque_by_turn(record.index, h, &state.attitude)?))
        })
    }

    /// One step of `run`.
    fn advance(&mut self, run: &mut Run<'_>, record: &mut StepRecord) -> Result<(), Error> {
        (run.before)(self)?;
        self.step(record)
    }
}

/// Of no step yet, smoothed as the run asks for.
fn derivative_of(run: &Run<'_>) -> Result<StepDerivative, Error> {
    run.smoothing.map_or(Ok(StepDerivative::new()), StepDerivative::smoothed)
}

/// What a step that was linearised is.
#[derive(PartialEq)]
enum Found {
    Motion,
    /// The one at rest that was known.
    Rest,
    /// Another one.
    NewRest,
}

/// The backward pass.
struct Backward {
    first: u64,
    /// How many steps are linearised at a time, and how many simulations may be saved.
    stretch: u64,
    saved: u64,
    /// The derivatives by the states that the pass is at.
    dual: Vec<StateChange>,
    found: RunGradient,
    step: StepGradient,
    /// Derivatives of steps, to be used again.
    tape: Vec<(StepDerivative, StepRecord)>,
    /// The derivative of the step at rest that was met last, and the sum of all that went back through it and is still to be
    /// multiplied for the constants.
    resting: StepDerivative,
    owed: Vec<StateChange>,
    end: Option<Saved>,
}

impl Backward {
    /// Adds the derivatives by the `states` after so many steps.
    fn add(&mut self, run: &mut Run<'_>, steps: u64, states: &[State]) -> Result<(), Error> {
        let Some(by_states) = (run.by_states)(steps, states) else { return Ok(()) };
        let (field, count) = ("derivatives by states", by_states.len());
        if count != self.dual.len() {
            return Err(Error::Count { field, count, allowed: "one a body" });
        }
        for (dual, more) in self.dual.iter_mut().zip(&by_states) {
            *dual = dual.plus(1.0, more);
        }
        Ok(())
    }

    /// Goes through the steps `from`…`to` backwards; `start` is where the first of them begins.
    fn go(
        &mut self,
        simulation: &mut Simulation<'_>,
        run: &mut Run<'_>,
        (from, to): (u64, u64),
        start: &Saved,
    ) -> Result<(), Error> {
        let count = to - from;
        if count <= self.stretch {
            return self.leaf(simulation, run, (from, to), start);
        }
        // As few stretches as fill the memory, or all that there are.
        let parts = count.div_ceil(self.stretch).min(self.saved);
        let length = count.div_ceil(parts);
        let mut record = StepRecord::new();
        let mut starts = vec![(from, start.clone())];
        simulation.restore(start)?;
        for k in from..to {
            if k > from && (k - from).is_multiple_of(length) {
                starts.push((k, simulation.save()));
            }
            // The last part runs when it is differentiated.
            if k >= from + (parts - 1) * length {
                break;
            }
            simulation.advance(run, &mut record)?;
        }
        let saved = self.saved;
        self.saved = (saved.saturating_sub(parts)).max(2);
        let mut end = to;
        while let Some((k, start)) = starts.pop() {
            if k < end {
                self.go(simulation, run, (k, end), &start)?;
            }
            end = k;
        }
        self.saved = saved;
        Ok(())
    }

    /// The steps of one stretch: forwards with their derivatives, then backwards.
    fn leaf(
        &mut self,
        simulation: &mut Simulation<'_>,
        run: &mut Run<'_>,
        (from, to): (u64, u64),
        start: &Saved,
    ) -> Result<(), Error> {
        simulation.restore(start)?;
        let count = (to - from) as usize;
        while self.tape.len() < count {
            self.tape.push((derivative_of(run)?, StepRecord::new()));
        }
        let mut tape = std::mem::take(&mut self.tape);
        // Whose derivative each step has: those in which nothing moves that of the first of them.
        let mut uses: Vec<Option<usize>> = Vec::with_capacity(count);
        let mut turned = Vec::new();
        for (k, (derivative, record)) in tape[..count].iter_mut().enumerate() {
            simulation.advance(run, record)?;
            let found = simulation.linearise_unless(record, derivative, &self.resting)?;
            turned.extend(simulation.loads_by_turns(record).map(|(body, by)| (k, body, by)));
            if found == Found::NewRest {
                self.settle(run)?;
                std::mem::swap(derivative, &mut self.resting);
                uses.iter_mut().filter(|of| of.is_none()).for_each(|of| *of = Some(k));
            }
            uses.push((found == Found::Motion).then_some(k));
        }
        if self.end.is_none() {
            self.end = Some(simulation.save());
        }
        for (k, of) in uses.into_iter().enumerate().rev() {
            let record = &tape[k].1;
            self.add(run, record.index + 1 - self.first, &record.solution.states)?;
            let derivative = match of {
                Some(of) => &mut tape[of].0,
                None => &mut self.resting,
            };
            if of.is_none() && derivative.pull_at_rest(&self.dual, &mut self.step)? {
                let owed = self.owed.iter_mut().zip(&self.dual);
                owed.for_each(|(owed, dual)| *owed = owed.plus(1.0, dual));
            } else {
                derivative.pull(&self.dual, run.constants, &mut self.step)?;
            }
            self.dual.clone_from(&self.step.states);
            // Loads that act at a point of a body turn it otherwise where it is turned.
            while let Some((_, body, by)) = turned.pop_if(|(step, ..)| *step == k) {
                self.dual[body].turn += by.tr_mul(&self.step.wrenches[body].torque);
            }
            self.found.wrenches.push(self.step.wrenches.clone());
            self.add_constants();
            let derivative = of.map_or(&self.resting, |of| &tape[of].0);
            self.found.note(&tape[k].1, derivative);
        }
        self.tape = tape;
        Ok(())
    }

    /// Adds the derivatives by the constants of what went back through the step at rest: a product with the sum.
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

    /// Adds the derivatives by the constants of the last product.
    fn add_constants(&mut self) {
        let sums = self.found.constants.iter_mut().zip(&self.step.constants);
        for (sum, more) in sums.flat_map(|(sums, more)| sums.iter_mut().zip(more)) {
            *sum += more;
        }
    }
}
