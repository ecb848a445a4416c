//! Derivatives of a step with respect to its initial states, wrenches and world constants.
//!
//! At a solution every contact is on a piece of its law, where the step's equations are smooth.
//! With V⁺ and the impulses p̂ as unknowns, R(V⁺, p̂; x) = 0 implies
//!
//! ```text
//! R_V δV⁺ + R_p δp̂ + R_x δx = 0                                           (G2)
//! ```
//!
//! The matrix is the one of Newton's method (N8), with every coupling eliminated by its gain (N5).
//! It is factorised once, and each change costs one triangular solve. The transposed system yields
//! products with the transposed derivative.
//!
//! The compliance of the selection rule (N6) stays in the equations, at the solution with
//! compliance. The forces of the limit alone do not determine how their undetermined part changes.
//! The derivative of the limit is extrapolated from ε and 2ε. If rows are independent, the limit is
//! taken at the step's own solution.
//!
//! Equation numbers G1, G2, … refer to `docs/gradients.md`.

mod constants;
mod coupling;
mod friction_tensor;
mod geared;
mod island;
mod moment;
mod point;
mod refined;
mod rest;
mod slopes;
mod tied;

use super::islands::{IslandPartition, IslandView, KnownForces, Marked, StepContacts};
use crate::contact::Contact;
use crate::derivative::{EndMap, PredictedStep, StateChange, nearest_untracked};
use crate::error::{Error, in_range};
use crate::mechanics::{State, Wrench};
use crate::step::{Step, StepSolution};
use crate::world::Constant;
use constants::{ConstantChanges, ConstantsBase};
use island::LinearIsland;
use nalgebra::{SMatrix, Vector3};
use point::IslandStep;
use rest::{FEW_BODIES, RestingStep};
use tied::{LinearRows, Slots};

/// Change of a step's data. Lists have one entry per body of the world. An empty list means no
/// change.
#[derive(Debug, Clone, Copy, Default)]
pub struct StepChange<'a> {
    /// Changes of the states at k.
    pub states: &'a [StateChange],
    /// Changes of the wrenches (N, world; N m, body).
    pub wrenches: &'a [Wrench],
    /// Changes of world constants, each with as many numbers as its [shape](Constant::shape).
    pub constants: &'a [(Constant, &'a [f64])],
}

/// Derivatives of a scalar with respect to a step's data. Lists have one entry per body of the
/// world.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct StepGradient {
    /// Derivatives with respect to the states at k.
    pub states: Vec<StateChange>,
    /// Derivatives with respect to the velocities of the instant at k, through the offsets of slips
    /// (eq. 38); zero without [instants](StepDerivative::set_instants).
    pub instants: Vec<StateChange>,
    /// Derivatives with respect to the wrenches (per N, per N m).
    pub wrenches: Vec<Wrench>,
    /// Derivatives with respect to the requested constants, in the order of the request.
    pub constants: Vec<Vec<f64>>,
}

/// Smoothed variant of the step, from the same states.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Smoothing {
    /// Compliance ε (N6) of every contact and every joint row: û = u + ε p̂, with p̂ the impulse
    /// over the island's mean mass.
    ///
    /// Sticking contacts creep and loaded contacts yield. Kinks remain. A contact whose gap exceeds
    /// its deflection has no effect.
    Compliance(f64),
    /// Central path of (N7) for every contact, with products κ = σ² of this speed σ (m/s).
    ///
    /// The products are normal impulse over mean mass times gap speed, and the same for the
    /// friction inside its cone. A contact with impulse p̂ keeps a gap speed σ²/p̂. A contact of
    /// the step that opens at the speed u is pushed by σ²/u. There are no kinks except those of
    /// joints, and no plateaus. Joints are exact. Rolling and
    /// torsional resistance are left out.
    CentralPath(f64),
}

/// Derivative of the last step passed to [`linearise`](StepDerivative::linearise). Its memory is
/// reused.
#[derive(Debug, Clone, Default)]
pub struct StepDerivative {
    islands: Vec<LinearIsland>,
    /// Number of islands of this step, the first ones in the list.
    count: usize,
    /// Map from X, V⁺ and h to X⁺ for every body. `None` for a held body.
    ends: Vec<Option<EndMap>>,
    shapes: Vec<ConstantsBase>,
    slots: Slots,
    /// Number of values of each constant, in the order of [`Constant::ALL`].
    widths: Vec<usize>,
    /// Scratch of the island search.
    found: IslandPartition,
    alone: Vec<bool>,
    places: Vec<usize>,
    /// Final states of the current island, with compliance.
    next: Vec<State>,
    flights: Vec<State>,
    /// States of the instant at the start of the next step, and the step that they predict.
    starts: Vec<State>,
    predicted: PredictedStep,
    /// Derivatives with respect to V⁺.
    by_velocity: Vec<ByVelocity>,
    gravity: Vector3<f64>,
    margin: f64,
    room: f64,
    unknown: usize,
    kept: bool,
    /// Difference between the differentiated step and the exact one.
    smoothing: Option<Smoothing>,
    /// The differentiated step, if nothing moved in it.
    rest: Option<Box<RestingStep>>,
    /// Cached [`jacobian_wrt_state`](StepDerivative::jacobian_wrt_state) results of a step at rest, by body.
    at_rest: Vec<Vec<SMatrix<f64, 12, 12>>>,
    /// Transposed derivatives of V⁺ in a step at rest, for all bodies, once requested.
    pulling: Vec<Vec<SMatrix<f64, 12, 6>>>,
    /// Number of transposed products requested so far.
    pulls_at_rest: usize,
}

/// Derivatives with respect to v⁺ and ω⁺ of a body.
type ByVelocity = (Vector3<f64>, Vector3<f64>);

/// Largest gap that enters the margin, relative to the world's reach.
const FARTHEST: f64 = 0.1;

impl StepDerivative {
    /// Derivative without a step.
    pub fn new() -> Self {
        Self::default()
    }

    /// Derivative of smoothed steps from the same states.
    ///
    /// It is nonzero where the exact derivative vanishes, for example at sticking contacts. It
    /// serves as a search direction and belongs to a different step.
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

    /// Takes the memory for the free flights of a step.
    pub(crate) fn take_flights(&mut self) -> Vec<State> {
        std::mem::take(&mut self.flights)
    }

    /// Returns the memory for free flights.
    pub(crate) fn keep_flights(&mut self, memory: Vec<State>) {
        self.flights = memory;
    }

    /// Takes the states with the velocities of the instant from which the next step starts. They determine the
    /// offsets of its slips (eq. 38). Without states, the offsets count as constants.
    pub fn set_instants(&mut self, instants: &[State]) {
        instants.clone_into(&mut self.starts);
    }

    /// Difference between the differentiated step and the exact one. `None` for the exact step.
    pub fn smoothing(&self) -> Option<Smoothing> {
        self.smoothing
    }

    /// Linearises `step` at its `solution`, found by any solver with these `contacts`.
    ///
    /// The contacts are those in the record of the step. Does nothing if the arguments equal the
    /// last ones, as for bodies at rest.
    ///
    /// # Errors
    /// Lists of inconsistent lengths; an island whose linear system is singular or that has no
    /// solution with the [smoothing](StepDerivative::smoothed); an interrupt.
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
        self.rest = RestingStep::from_step(step, contacts, solution);
        Ok(())
    }

    /// Linearises without comparing with the last step.
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
        let is_central = matches!(self.smoothing, Some(Smoothing::CentralPath(_)));
        if is_central && step.world.has_turning_friction() {
            let why = "rolling and torsional friction are not part of it; use compliance";
            return Err(Error::Unsupported { what: "derivative on the central path", why });
        }
        let (world, bodies) = (step.world, step.states.len());
        let sizes = [solution.states.len(), solution.contacts.len()];
        if sizes != [bodies, contacts.len()] {
            let field = "entries of a solution";
            let allowed = "one per body, one per contact";
            return Err(Error::Count { field, count: sizes[1], allowed });
        }
        // Maps of the ends (G1), and constants that the derivatives refer to
        self.predicted.set(world, step.states, step.free, &self.starts);
        self.gravity = *world.gravity();
        self.ends.clear();
        self.ends.extend(solution.states.iter().enumerate().map(|(body, end)| {
            let map = EndMap::new(&end.velocity, &end.spin, &world.step_map());
            (!world.is_held(body)).then_some(map)
        }));
        self.shapes.clear();
        self.shapes.extend(world.bodies().iter().map(ConstantsBase::from_body));
        self.slots.set(world);
        let width = |constant: &Constant| match *constant {
            of if of.is_of_drives() || of.is_of_gears() => self.slots.width(of),
            of => of.width(world),
        };
        self.widths.clear();
        self.widths.extend(Constant::ALL.iter().map(width));
        (self.count, self.unknown, self.kept) = (0, 0, false);
        (self.margin, self.room) = (f64::INFINITY, f64::INFINITY);
        // Iterations start at the solution.
        let at = Step { previous: solution, earlier: None, ..*step };
        let mut islands = std::mem::take(&mut self.found);
        // Islands with contacts or joints
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
        // Bodies without both are islands of their own.
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
                is_hopeless: false,
            };
            self.add(&at, contacts, &view)
        });
        self.places = places;
        found?;
        // Margins: onset of bounces and of adhesion, and pairs without contact
        for contact in contacts {
            self.margin = self.margin.min(contact.bounce_margin(world, step.states, step.free));
            self.room = self.room.min(contact.adhesion_margin(world));
        }
        let h = world.time_step();
        let beyond = (self.margin * h).min(FARTHEST * world.reach());
        let untracked = nearest_untracked(world, &solution.states, contacts, beyond);
        if untracked < beyond {
            self.margin = untracked / h;
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
        let predicted = &self.predicted;
        let at = IslandStep { step, contacts, predicted, view };
        let kept = linear.linearise(at, &self.slots, &mut self.next, self.smoothing)?;
        self.kept |= kept;
        let (point, map) = (&linear.points[0], step.world.step_map());
        if self.smoothing.is_some() {
            for (&body, end) in view.bodies.iter().zip(&point.iterate.velocity) {
                self.ends[body] = Some(EndMap::new(&end.linear, &end.spin, &map));
            }
        }
        // Contacts on the central path have no kinks.
        let is_central = matches!(self.smoothing, Some(Smoothing::CentralPath(_)));
        let smooth = if is_central { view.contacts.len() } else { 0 };
        let bounces = point.joints.iter().map(LinearRows::bounce_margin);
        self.margin = bounces.fold(self.margin.min(linear.margin(smooth)), f64::min);
        let pressing = point.couplings.iter().filter(|coupling| coupling.presses());
        let rooms = pressing.map(|c| c.tangent.room() / map.time_step);
        let stops = point.joints.iter().map(LinearRows::stop_margin);
        self.room = rooms.chain(stops).fold(self.room, f64::min);
        // Some sticking contacts slip under arbitrarily small changes.
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

    /// Distance of the step to its next kink (m/s). Infinite if no kink is near.
    ///
    /// It is the smallest of
    ///
    /// - the distance of a contact to the next piece of its law, in the contact's own scale,
    /// - the distance of a contact to the start or end of bouncing,
    /// - the final distance over h between bodies that are not in contact.
    ///
    /// If a change of the data moves the step by more than this, the derivative is one-sided.
    pub fn margin(&self) -> f64 {
        self.margin
    }

    /// Smallest distance over h of a loaded contact point to the boundary of its feature (m/s).
    ///
    /// The boundary is the edge of a face or the end of an edge. It is a kink for changes that move
    /// or stretch the bodies at the start of the step. The margin is 0 for flush boxes of equal
    /// width. With [adhesion](crate::contact::adhesion) it is also the distance of a point from
    /// touching at the start, or from not touching. It is also 0 for bodies that stick in a loop of contacts which cannot follow every
    /// such change, and for a joint that dry friction or a velocity motor holds exactly at its
    /// stop.
    pub fn feature_margin(&self) -> f64 {
        self.room
    }

    /// Number of loaded contacts with unknown dependence on the bodies' poses. Their points and
    /// planes are treated as fixed in the bodies.
    pub fn unknown(&self) -> usize {
        self.unknown
    }

    /// True if some force distribution was kept from earlier steps and not chosen by the selection
    /// rule.
    ///
    /// It then depends on the history. The derivative assumes the smallest possible change of the
    /// distribution.
    pub fn keeps_shares(&self) -> bool {
        self.kept
    }

    /// Computes the Jacobian-vector product: δX⁺ of every body for a change of the step's data.
    ///
    /// # Errors
    /// Lists whose lengths differ from the world's.
    pub fn jvp(
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
                Some(map) => map.jvp(&state(body), &zero, &zero, time_step),
                None => state(body),
            };
        }
        for linear in &mut self.islands[..self.count] {
            let constants = (!change.constants.is_empty()).then_some(&numbers);
            let constants =
                constants.map(|numbers| ConstantChanges { shapes: &self.shapes, numbers });
            linear.jvp(change, constants, &self.gravity, &self.ends, end);
        }
        Ok(())
    }

    /// Computes ∂X⁺/∂X of every body with respect to the state of `body`, in the order of
    /// [`StateChange::to_array`].
    ///
    /// Equals [`jvp`](Self::jvp) of twelve unit changes, with one solve for all. Bodies of other
    /// islands have zero blocks.
    ///
    /// # Errors
    /// A body index outside the world.
    pub fn jacobian_wrt_state(
        &mut self,
        body: usize,
        end: &mut Vec<SMatrix<f64, 12, 12>>,
    ) -> Result<(), Error> {
        let bodies = self.ends.len();
        if body >= bodies {
            let field = "body of a derivative";
            let allowed = "an index of a body";
            return Err(Error::Count { field, count: body, allowed });
        }
        end.clear();
        if let Some(known) = self.at_rest.get(body).filter(|known| !known.is_empty()) {
            end.extend_from_slice(known);
            return Ok(());
        }
        end.resize(bodies, SMatrix::zeros());
        end[body] =
            self.ends[body].as_ref().map_or_else(SMatrix::identity, EndMap::jacobian_wrt_state);
        let islands = &mut self.islands[..self.count];
        islands.iter_mut().any(|linear| linear.jacobian_wrt_state(body, &self.ends, end));
        if self.rest.is_some() && bodies <= FEW_BODIES {
            self.at_rest.resize(bodies, Vec::new());
            self.at_rest[body].extend_from_slice(end);
        }
        Ok(())
    }

    /// Propagates a vector–Jacobian product back through the position update of every body. Returns
    /// the derivatives with respect to each V⁺ and to h.
    fn begin_vjp(
        &mut self,
        end: &[StateChange],
        gradient: &mut StepGradient,
    ) -> Result<(Vec<ByVelocity>, f64), Error> {
        let bodies = self.ends.len();
        count("derivatives by the states at the end", end.len(), bodies)?;
        let StepGradient { states, instants, wrenches, constants } = gradient;
        states.clear();
        instants.clear();
        instants.resize(bodies, StateChange::zero());
        constants.clear();
        wrenches.clear();
        wrenches.resize(bodies, Wrench::zero());
        let mut by_velocity = std::mem::take(&mut self.by_velocity);
        by_velocity.clear();
        let mut by_time_step = 0.0;
        for (end, map) in end.iter().zip(&self.ends) {
            let zero = (Vector3::zeros(), Vector3::zeros());
            let (start, velocity, longer) =
                map.as_ref().map_or((*end, zero, 0.0), |map| map.vjp(end));
            states.push(start);
            by_velocity.push(velocity);
            by_time_step += longer;
        }
        Ok((by_velocity, by_time_step))
    }

    /// Computes the vector–Jacobian product: derivatives of a scalar with respect to the step's
    /// data.
    ///
    /// `end` are its derivatives with respect to X⁺. `constants` are the requested constants.
    ///
    /// # Errors
    /// A list whose length differs from the world's.
    pub fn vjp(
        &mut self,
        end: &[StateChange],
        constants: &[Constant],
        gradient: &mut StepGradient,
    ) -> Result<(), Error> {
        let (by_velocity, by_time_step) = self.begin_vjp(end, gradient)?;
        let widths = constants.iter().map(|constant| vec![0.0; self.width(*constant)]);
        gradient.constants.extend(widths);
        for (constant, numbers) in constants.iter().zip(&mut gradient.constants) {
            if *constant == Constant::TimeStep {
                numbers[0] += by_time_step;
            }
        }
        for linear in &mut self.islands[..self.count] {
            linear.vjp(&by_velocity, &self.gravity, &self.shapes, constants, gradient);
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
