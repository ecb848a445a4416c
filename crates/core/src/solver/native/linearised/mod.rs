//! The derivative of a step: by the states at its start, by the wrenches, and by the constants of the world.
//!
//! At a solution every contact is on a piece of its law, where the step's equations are smooth. With V⁺ and
//! the impulses p̂ as unknowns, R(V⁺, p̂; x) = 0 gives
//!
//! ```text
//! R_V δV⁺ + R_p δp̂ + R_x δx = 0                                           (G2)
//! ```
//!
//! of which the matrix is that of Newton's method (N8), and every coupling is eliminated by its gain (N5):
//! one factorisation, and a solution of a triangular system for each change. The transposed
//! system gives products with the transposed derivative. The compliance of the selection rule (N6) stays in
//! the equations, at the solution that *it* has, because the limit's forces alone do not say how the undetermined
//! part turns; from ε and 2ε the limit of the derivative is extrapolated. Where rows are independent, the limit is taken at the step's own
//! solution.
//!
//! Equation numbers G1, G2, … are those of `docs/gradients.md`.

mod constants;
mod coupling;
mod geared;
mod island;
mod point;
mod refined;
mod rest;
mod slopes;
mod tied;

use super::islands::{IslandParts, IslandView, KnownForces, Marked, StepContacts};
use crate::contact::Contact;
use crate::derivative::{EndMap, StateChange, nearest_unseen};
use crate::error::{Error, in_range};
use crate::mechanics::{State, Wrench};
use crate::step::{Step, StepSolution};
use crate::world::Constant;
use constants::{ConstantChanges, ConstantsBase};
use island::LinearIsland;
use nalgebra::{SMatrix, Vector3};
use point::IslandStep;
use rest::{FEW_BODIES, RestingStep};
use tied::Slots;

/// A change of a step's data, lists over the bodies of the world; an empty list is no change.
#[derive(Debug, Clone, Copy, Default)]
pub struct StepChange<'a> {
    /// Of the states at k.
    pub states: &'a [StateChange],
    /// Of the wrenches (N, world; N m, body).
    pub wrenches: &'a [Wrench],
    /// Of constants of the world: of each as many numbers as it [has](Constant::shape).
    pub constants: &'a [(Constant, &'a [f64])],
}

/// Derivatives of one number by a step's data, lists over the bodies of the world.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct StepGradient {
    /// By the states at k.
    pub states: Vec<StateChange>,
    /// By the wrenches (per N, per N m).
    pub wrenches: Vec<Wrench>,
    /// By the constants that were asked for, in their order.
    pub constants: Vec<Vec<f64>>,
}

/// A step that is smoother than the exact one from the same states.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Smoothing {
    /// Every contact and every row of a joint gives way by this compliance ε (N6), û = u + ε p̂ with p̂ the impulse over the
    /// island's mean mass. What sticks creeps, and what presses gives way; kinks stay, and what is open by more than
    /// it gives way is not felt.
    Compliance(f64),
    /// Every contact is on the central path of (N7), of products κ = σ² with this speed σ, m/s: normal impulse over the island's mean
    /// mass times gap speed, and the same of the friction within its cone. What presses by p̂ stays σ²/p̂ off, what is open by a
    /// speed u is pushed by σ²/u, as far as it is a contact of the step: there are no kinks but of joints, and no plateaus. Joints
    /// hold as they do.
    CentralPath(f64),
}

impl std::fmt::Display for Smoothing {
    fn fmt(&self, to: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        match self {
            Self::Compliance(compliance) => write!(to, "a compliance of {compliance}"),
            Self::CentralPath(speed) => write!(to, "the central path at {speed} m/s"),
        }
    }
}

/// The derivative of the last step that it was [made](StepDerivative::linearise) for. Keeps its memory.
#[derive(Debug, Clone, Default)]
pub struct StepDerivative {
    islands: Vec<LinearIsland>,
    /// How many of them are of this step.
    count: usize,
    /// X⁺ by X, V⁺ and h of every body; `None` of one that is held.
    ends: Vec<Option<EndMap>>,
    shapes: Vec<ConstantsBase>,
    slots: Slots,
    /// How many numbers each constant has, in the order of [`Constant::ALL`].
    widths: [usize; Constant::ALL.len()],
    /// Memory of the search for islands.
    found: IslandParts,
    alone: Vec<bool>,
    places: Vec<usize>,
    /// The states at the end with compliance, of the island at hand.
    next: Vec<State>,
    flights: Vec<State>,
    /// Derivatives by V⁺.
    by_velocity: Vec<ByVelocity>,
    gravity: Vector3<f64>,
    margin: f64,
    room: f64,
    unknown: usize,
    kept: bool,
    /// By what the step that is differentiated differs from the exact one.
    smoothing: Option<Smoothing>,
    /// What it is the derivative of, where nothing moved.
    rest: Option<Box<RestingStep>>,
    /// Of such a step what was found of the bodies [asked](StepDerivative::by_state) for.
    at_rest: Vec<Vec<SMatrix<f64, 12, 12>>>,
    /// Of all bodies the transposed slopes of V⁺ in it, once they were asked for.
    pulling: Vec<Vec<SMatrix<f64, 12, 6>>>,
    /// How often it was asked for the product with the transposed one.
    pulls_at_rest: usize,
}

/// Derivatives by v⁺ and ω⁺ of a body.
type ByVelocity = (Vector3<f64>, Vector3<f64>);

/// Things that are farther apart than this part of the world's reach are no matter.
const FARTHEST: f64 = 0.1;

impl StepDerivative {
    /// Of no step yet.
    #[must_use]
    pub fn new() -> Self {
        Self::default()
    }

    /// Of steps from the same states that are smoother than the exact ones, so that there are derivatives where those of the exact
    /// ones are zero: a direction for a search, and derivatives of another step.
    ///
    /// # Errors
    /// A compliance outside 1e-9…1, a speed outside 1e-6…10 m/s.
    pub fn smoothed(smoothing: Smoothing) -> Result<Self, Error> {
        match smoothing {
            Smoothing::Compliance(compliance) => {
                in_range("compliance of a derivative", compliance, 1e-9, 1.0, "1e-9 to 1")?;
            }
            Smoothing::CentralPath(speed) => {
                let range = "1e-6 to 10 m/s";
                in_range("central path of a derivative", speed, 1e-6, 10.0, range)?;
            }
        }
        Ok(Self { smoothing: Some(smoothing), ..Self::default() })
    }

    /// Memory for the free flights of a step.
    pub(crate) fn take_flights(&mut self) -> Vec<State> {
        std::mem::take(&mut self.flights)
    }

    /// Takes it back.
    pub(crate) fn keep_flights(&mut self, memory: Vec<State>) {
        self.flights = memory;
    }

    /// By what the step that is differentiated differs from the exact one; `None` of that itself.
    #[must_use]
    pub fn smoothing(&self) -> Option<Smoothing> {
        self.smoothing
    }

    /// Makes this the derivative of `step`, whose `solution` was found, by whichever solver, with these
    /// `contacts`: those of the record of the step. Where all of it is the same as the last time, as of bodies at rest, it
    /// is already.
    ///
    /// # Errors
    /// Lists that do not belong together; an island whose linear system is singular, or that has no solution with the
    /// [smoothing](StepDerivative::smoothed) asked for; an interrupt.
    pub fn linearise(
        &mut self,
        step: &Step<'_>,
        contacts: &[Contact],
        solution: &StepSolution,
    ) -> Result<(), Error> {
        if self.is_at_rest_in(step, contacts, solution) {
            return Ok(());
        }
        self.linearise_anew(step, contacts, solution)?;
        self.rest = RestingStep::of(step, contacts, solution);
        Ok(())
    }

    /// The same without a look at the last time.
    fn linearise_anew(
        &mut self,
        step: &Step<'_>,
        contacts: &[Contact],
        solution: &StepSolution,
    ) -> Result<(), Error> {
        self.rest = None;
        self.at_rest.clear();
        self.pulling.clear();
        self.pulls_at_rest = 0;
        step.check(contacts)?;
        let (world, bodies) = (step.world, step.states.len());
        let sizes = [solution.states.len(), solution.contacts.len()];
        if sizes != [bodies, contacts.len()] {
            let (field, allowed) = ("entries of a solution", "one per body, one per contact");
            return Err(Error::Count { field, count: sizes[1], allowed });
        }
        self.gravity = *world.gravity();
        self.ends.clear();
        self.ends.extend(solution.states.iter().enumerate().map(|(body, end)| {
            let map = EndMap::new(&end.velocity, &end.spin, world.time_step());
            (!world.is_held(body)).then_some(map)
        }));
        self.shapes.clear();
        self.shapes.extend(world.bodies().iter().map(ConstantsBase::of));
        self.slots.set(world);
        self.widths = Constant::ALL.map(|constant| match constant {
            of if of.is_of_drives() || of.is_of_gears() => self.slots.width(of),
            of => of.width(world),
        });
        (self.count, self.unknown, self.kept) = (0, 0, false);
        (self.margin, self.room) = (f64::INFINITY, f64::INFINITY);
        // Where iterations start: at the solution.
        let at = Step { previous: solution, earlier: None, ..*step };
        let mut islands = std::mem::take(&mut self.found);
        islands.find(&at, StepContacts { contacts, known: 0 }, true, Marked::NONE);
        self.next.clone_from(&solution.states);
        self.alone.clear();
        self.alone.resize(bodies, true);
        let found = islands.all().try_for_each(|(_, view)| {
            view.bodies.iter().for_each(|&body| self.alone[body] = false);
            self.add(&at, contacts, &view)
        });
        self.found = islands;
        found?;
        let mut places = std::mem::take(&mut self.places);
        places.clear();
        places.resize(bodies, 0);
        let known = KnownForces::default();
        let found = (0..bodies).try_for_each(|body| {
            if !self.alone[body] || world.is_held(body) {
                return Ok(());
            }
            let view = IslandView {
                bodies: &[body],
                contacts: &[],
                joints: &[],
                gears: &[],
                places: &places,
                known: &known,
                unsettled: 0.0,
            };
            self.add(&at, contacts, &view)
        });
        self.places = places;
        found?;
        for contact in contacts {
            self.margin = self.margin.min(contact.bounce_margin(world, step.states, step.free));
        }
        let h = world.time_step();
        let beyond = (self.margin * h).min(FARTHEST * world.reach());
        let unseen = nearest_unseen(world, &solution.states, contacts, beyond);
        if unseen < beyond {
            self.margin = unseen / h;
        }
        Ok(())
    }

    /// Linearises one island.
    fn add(
        &mut self,
        step: &Step<'_>,
        contacts: &[Contact],
        view: &IslandView<'_>,
    ) -> Result<(), Error> {
        if self.count == self.islands.len() {
            self.islands.push(LinearIsland::new(step.world));
        }
        let linear = &mut self.islands[self.count];
        self.count += 1;
        let at = IslandStep { step, contacts, view };
        let kept = linear.linearise(at, &self.slots, &mut self.next, self.smoothing)?;
        self.kept |= kept;
        let (point, h) = (&linear.points[0], step.world.time_step());
        if self.smoothing.is_some() {
            for (&body, end) in view.bodies.iter().zip(&point.iterate.velocity) {
                self.ends[body] = Some(EndMap::new(&end.linear, &end.spin, h));
            }
        }
        // On the central path no contact has a kink.
        let is_central = matches!(self.smoothing, Some(Smoothing::CentralPath(_)));
        let smooth = if is_central { view.contacts.len() } else { 0 };
        self.margin = self.margin.min(linear.margin(smooth));
        let pressing = point.couplings.iter().filter(|coupling| coupling.presses());
        self.room = pressing.map(|c| c.tangent.room() / h).fold(self.room, f64::min);
        // However small such changes are, some of what sticks slips.
        if !linear.follows_poses {
            self.room = 0.0;
        }
        if !linear.follows_velocities {
            self.margin = 0.0;
        }
        self.unknown +=
            point.couplings.iter().filter(|c| c.presses() && !c.tangent.is_known()).count();
        Ok(())
    }

    /// How far the step is from its next kink, m/s: of every contact how far the next piece of its law is, in the
    /// contact's own scale, and from beginning or ceasing to bounce; of what was no contact how far it is apart at the end, over h. Infinite where
    /// nothing is near. Where it is small against what a change of the data moves, the derivative
    /// is that of one side.
    #[must_use]
    pub fn margin(&self) -> f64 {
        self.margin
    }

    /// The same of the features of the contacts that press, m/s: how far the points are inside their faces, and from
    /// the ends of their edges, over h. A kink of what moves or stretches the bodies at the start of the step; 0
    /// where boxes of the same width stand flush on each other, and where bodies stick in a loop of contacts that cannot follow every such change:
    /// however small it is, some of them slip.
    #[must_use]
    pub fn feature_margin(&self) -> f64 {
        self.room
    }

    /// How many contacts press of which it is not known how their points and planes follow the bodies: they are taken
    /// for fixed in them.
    #[must_use]
    pub fn unknown(&self) -> usize {
        self.unknown
    }

    /// Whether somewhere the shares of forces are not those of the selection rule, but were kept from the steps
    /// before: they then depend on the history, and the derivative has them change as little as it takes.
    #[must_use]
    pub fn keeps_shares(&self) -> bool {
        self.kept
    }

    /// δX⁺ of every body for a change of the step's data: the product with the derivative.
    ///
    /// # Errors
    /// Lists of other lengths than the world's.
    pub fn push(
        &mut self,
        change: &StepChange<'_>,
        end: &mut Vec<StateChange>,
    ) -> Result<(), Error> {
        let bodies = self.ends.len();
        self.check(change)?;
        let numbers = |constant: Constant, place: usize| -> f64 {
            let given = change.constants.iter().filter(|(given, _)| *given == constant);
            given.map(|(_, numbers)| numbers[place]).sum()
        };
        let time_step = numbers(Constant::TimeStep, 0);
        end.clear();
        let state = |body: usize| change.states.get(body).copied().unwrap_or(StateChange::zero());
        end.resize(bodies, StateChange::zero());
        for (body, (end, map)) in end.iter_mut().zip(&self.ends).enumerate() {
            let zero = Vector3::zeros();
            *end = match map {
                Some(map) => map.push(&state(body), &zero, &zero, time_step),
                None => state(body),
            };
        }
        for linear in &mut self.islands[..self.count] {
            let constants = (!change.constants.is_empty()).then_some(&numbers);
            let constants =
                constants.map(|numbers| ConstantChanges { shapes: &self.shapes, numbers });
            linear.push(change, constants, &self.gravity, &self.ends, end);
        }
        Ok(())
    }

    /// ∂X⁺/∂X of every body by the state of `body`, in the order of [`StateChange::to_array`]: what [`push`](Self::push)
    /// makes of twelve changes, with one solution for all of them. Of bodies that its island does not have it is
    /// zero.
    ///
    /// # Errors
    /// A body that the world does not have.
    pub fn by_state(
        &mut self,
        body: usize,
        end: &mut Vec<SMatrix<f64, 12, 12>>,
    ) -> Result<(), Error> {
        let bodies = self.ends.len();
        if body >= bodies {
            let (field, allowed) = ("body of a derivative", "an index of a body");
            return Err(Error::Count { field, count: body, allowed });
        }
        end.clear();
        if let Some(known) = self.at_rest.get(body).filter(|known| !known.is_empty()) {
            end.extend_from_slice(known);
            return Ok(());
        }
        end.resize(bodies, SMatrix::zeros());
        end[body] = self.ends[body].as_ref().map_or_else(SMatrix::identity, EndMap::by_state);
        let islands = &mut self.islands[..self.count];
        islands.iter_mut().any(|linear| linear.by_state(body, &self.ends, end));
        if self.rest.is_some() && bodies <= FEW_BODIES {
            self.at_rest.resize(bodies, Vec::new());
            self.at_rest[body].extend_from_slice(end);
        }
        Ok(())
    }

    /// What of a product with the transposed derivative goes through the ends of the bodies' own flights: by V⁺ of each, and by h.
    fn begin_pull(
        &mut self,
        end: &[StateChange],
        gradient: &mut StepGradient,
    ) -> Result<(Vec<ByVelocity>, f64), Error> {
        let bodies = self.ends.len();
        count("derivatives by the states at the end", end.len(), bodies)?;
        let StepGradient { states, wrenches, constants } = gradient;
        states.clear();
        constants.clear();
        wrenches.clear();
        wrenches.resize(bodies, Wrench::zero());
        let mut by_velocity = std::mem::take(&mut self.by_velocity);
        by_velocity.clear();
        let mut by_time_step = 0.0;
        for (end, map) in end.iter().zip(&self.ends) {
            let zero = (Vector3::zeros(), Vector3::zeros());
            let (start, velocity, longer) =
                map.as_ref().map_or((*end, zero, 0.0), |map| map.pull(end));
            states.push(start);
            by_velocity.push(velocity);
            by_time_step += longer;
        }
        Ok((by_velocity, by_time_step))
    }

    /// The derivatives of a number by the step's data where `end` are those by X⁺: the product with the
    /// transposed derivative. `constants` are those asked for.
    ///
    /// # Errors
    /// A list of another length than the world's.
    pub fn pull(
        &mut self,
        end: &[StateChange],
        constants: &[Constant],
        gradient: &mut StepGradient,
    ) -> Result<(), Error> {
        let (by_velocity, by_time_step) = self.begin_pull(end, gradient)?;
        let widths = constants.iter().map(|constant| vec![0.0; self.width(*constant)]);
        gradient.constants.extend(widths);
        for (constant, numbers) in constants.iter().zip(&mut gradient.constants) {
            if *constant == Constant::TimeStep {
                numbers[0] += by_time_step;
            }
        }
        for linear in &mut self.islands[..self.count] {
            linear.pull(&by_velocity, &self.gravity, &self.shapes, constants, gradient);
        }
        self.by_velocity = by_velocity;
        Ok(())
    }

    fn width(&self, constant: Constant) -> usize {
        let mut known = Constant::ALL.iter().zip(&self.widths);
        known.find(|(known, _)| **known == constant).map_or(0, |(_, width)| *width)
    }

    fn check(&self, change: &StepChange<'_>) -> Result<(), Error> {
        let bodies = self.ends.len();
        for (what, found) in [
            ("changes of states", change.states.len()),
            ("changes of wrenches", change.wrenches.len()),
        ] {
            if found != 0 {
                count(what, found, bodies)?;
            }
        }
        for (constant, numbers) in change.constants {
            count(constant.name(), numbers.len(), self.width(*constant))?;
        }
        Ok(())
    }
}

fn count(field: &'static str, found: usize, wanted: usize) -> Result<(), Error> {
    let allowed = "as many as in the world of the step";
    if found == wanted { Ok(()) } else { Err(Error::Count { field, count: found, allowed }) }
}
