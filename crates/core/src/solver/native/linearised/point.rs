//! Linearisation of an island at one solution, with or without compliance.
//!
//! Equation numbers refer to `docs/gradients.md`.

use super::StepChange;
use super::coupling::{ContactOnPiece, ContactPlace, LinearCoupling};
use super::geared::{self, LinearGear, TiedEnds};
use super::moment::{LinearMoment, MomentSolution};
use super::refined::{PointCompliance, RefinedColumns, StiffTerms};
use super::tied::{LinearRows, Slots, SolvedRows};
use crate::contact::Contact;
use crate::derivative::{PlacedFeatures, PredictedStep};
use crate::error::Error;
use crate::mechanics::State;
use crate::solver::native::body_equation::BodyPerturbation;
use crate::solver::native::coupling::Coupling;
use crate::solver::native::effort::SolveEffort;
use crate::solver::native::equations::{Equations, Velocity};
use crate::solver::native::interior_point::InteriorPoint;
use crate::solver::native::island::Island;
use crate::solver::native::island_problem::next_state;
use crate::solver::native::islands::IslandView;
use crate::solver::native::law::{Factored, LocalSolution, MapPiece, NaturalMap};
use crate::solver::native::newton::{Iterate, Newton, NewtonRun, evaluate};
use crate::solver::native::settings::{CENTRES, COMPLIANCE};
use crate::step::Step;
use nalgebra::{Matrix3, Vector3};

/// Island of a step, with its contacts.
#[derive(Debug, Clone, Copy)]
pub(super) struct IslandStep<'a> {
    pub(super) step: &'a Step<'a>,
    /// All contacts of the step.
    pub(super) contacts: &'a [Contact],
    /// Step that its start predicts, for offsets of slips.
    pub(super) predicted: &'a PredictedStep,
    pub(super) view: &'a IslandView<'a>,
}

/// Island at one solution, with or without compliance.
#[derive(Debug, Clone)]
pub(super) struct LinearPoint {
    pub(super) newton: Newton<Island>,
    pub(super) iterate: Iterate<Island>,
    pub(super) held: StiffTerms,
    /// Barriers of a point on the central path.
    interior: InteriorPoint<Island>,
    /// Factored gain of each coupling with a nonzero gain, with its index.
    gains: Vec<(usize, Factored)>,
    /// δp̂ by δμ of each contact on the central path (m/s, world).
    by_friction: Vec<Vector3<f64>>,
    pub(super) couplings: Vec<LinearCoupling>,
    pub(super) moments: Vec<LinearMoment>,
    pub(super) joints: Vec<LinearRows>,
    pub(super) gears: Vec<LinearGear>,
    /// Right-hand sides of a single change, of a body's pose and of a body's velocities.
    pub(super) one: RefinedColumns<1>,
    pub(super) by_pose: RefinedColumns<6>,
    pub(super) by_velocity: RefinedColumns<6>,
}

impl LinearPoint {
    pub(super) fn new() -> Self {
        Self {
            newton: Newton::new(),
            iterate: Iterate::new(),
            held: StiffTerms::default(),
            interior: InteriorPoint::new(),
            gains: Vec::new(),
            by_friction: Vec::new(),
            couplings: Vec::new(),
            moments: Vec::new(),
            joints: Vec::new(),
            gears: Vec::new(),
            one: RefinedColumns::new(),
            by_pose: RefinedColumns::new(),
            by_velocity: RefinedColumns::new(),
        }
    }

    /// Starts at the step's solution.
    pub(super) fn begin(&mut self, island: &Island, step: &Step<'_>, view: &IslandView<'_>) {
        let to_impulse = step.world.time_step() / island.mass();
        let states = &step.previous.states;
        let velocities = view
            .bodies
            .iter()
            .map(|&body| Velocity { linear: states[body].velocity, spin: states[body].spin });
        let Iterate { velocity, impulses, .. } = &mut self.iterate;
        velocity.clear();
        velocity.extend(velocities);
        impulses.clear();
        impulses.extend(view.contacts.iter().map(|&place| view.known.before[place] * to_impulse));
        impulses.extend(island.moment_impulses(&view.known.moments, view.contacts));
        island.extend_previous(step, impulses);
    }

    /// Extrapolates the iterate through `other`, by the same distance again.
    pub(super) fn go_on(&mut self, other: &Self) {
        let (own, to) = (&mut self.iterate, &other.iterate);
        for (own, to) in own.velocity.iter_mut().zip(&to.velocity) {
            own.linear = to.linear * 2.0 - own.linear;
            own.spin = to.spin * 2.0 - own.spin;
        }
        for (own, to) in own.impulses.iter_mut().zip(&to.impulses) {
            *own = to * 2.0 - *own;
        }
    }

    /// Initialises a body without couplings. Returns the inverse of its angular slope, if regular.
    pub(super) fn set_free(
        &mut self,
        island: &Island,
        step: &Step<'_>,
        view: &IslandView<'_>,
    ) -> Option<Matrix3<f64>> {
        self.begin(island, step, view);
        self.couplings.clear();
        self.moments.clear();
        self.joints.clear();
        self.gears.clear();
        let slope = island.members()[0].angular_slope(&self.iterate.velocity[0].spin);
        slope.try_inverse()
    }

    /// Solves with `compliance` from the current iterate. Returns true on success.
    pub(super) fn solve(
        &mut self,
        island: &Island,
        step: &Step<'_>,
        compliance: f64,
    ) -> Result<bool, Error> {
        /// Iteration limit. Two or three are typical, since the start is within the compliance.
        const ITERATIONS: u32 = 20;
        let map = NaturalMap::with_compliance(compliance);
        let mut effort = SolveEffort::new(step.interrupt);
        let tolerances = island.tolerances();
        let run = NewtonRun { compliance, iterations: ITERATIONS, residual: tolerances.rounding };
        let Self { newton, iterate, .. } = self;
        let converged = newton.solve(island, &map, run, iterate, &mut effort);
        effort.check()?;
        // Accepts the tolerance for solutions with compliance if rounding level was not reached.
        Ok(converged || evaluate(island, &map, iterate).largest <= tolerances.newton)
    }

    /// Finds the point of the central path where all products are `kappa` (m²/s²). Returns true on
    /// success.
    pub(super) fn centre(
        &mut self,
        island: &Island,
        step: &Step<'_>,
        view: &IslandView<'_>,
        kappa: f64,
    ) -> Result<bool, Error> {
        for scale in CENTRES {
            self.begin(island, step, view);
            let mut effort = SolveEffort::new(step.interrupt);
            let Self { interior, iterate, .. } = self;
            let is_there = interior.centre(island, scale, kappa, iterate, &mut effort);
            effort.check()?;
            if is_there {
                return Ok(true);
            }
        }
        Ok(false)
    }

    /// Stays at the step's solution, with compliance on changes only (N13). Returns the residual of
    /// the laws (m/s).
    pub(super) fn keep(
        &mut self,
        island: &Island,
        step: &Step<'_>,
        view: &IslandView<'_>,
        compliance: f64,
    ) -> f64 {
        self.begin(island, step, view);
        let map = NaturalMap::with_compliance(compliance);
        self.iterate.keep_impulses(island, &map);
        let residual = evaluate(island, &map, &mut self.iterate);
        self.iterate.forget_impulses();
        residual.largest
    }

    /// Lower bound of the number of stiff rows at this point.
    pub(super) fn stiff_rows(&self, island: &Island) -> usize {
        self.iterate.stiff_rows(island)
    }

    /// Factorises the equations at this point, which was evaluated last with ε = `compliance`.
    /// `None` if they are singular.
    pub(super) fn factorise(&mut self, island: &Island, on: PointCompliance) -> Option<()> {
        let compliance = on.compliance;
        let Self { newton, iterate, held, gains, by_friction, .. } = self;
        by_friction.clear();
        let (eliminations, pieces) = newton.linearise(island, compliance, iterate)?;
        let members = island.members().iter().zip(&iterate.velocity);
        held.begin(members.map(|(member, velocity)| member.angular_slope(&velocity.spin)));
        gains.clear();
        for (index, piece) in pieces.iter().enumerate() {
            let gain = iterate.factored(island, index, *piece, compliance);
            // Open contacts have no effect, without adhesion.
            let acts = gain.gains != Vector3::zeros();
            if acts {
                held.add(island, index, eliminations, &gain, on);
            }
            if acts || island.couplings()[index].rows.adhesion > 0.0 {
                gains.push((index, gain));
            }
        }
        Some(())
    }

    /// Factorises the equations on the central path. `None` if they are singular.
    ///
    /// Contacts have the gains of (N7), which are never zero. Joints have the gains of their laws.
    pub(super) fn factorise_centred(&mut self, island: &Island) -> Option<()> {
        let map = NaturalMap::with_compliance(COMPLIANCE);
        let Self { newton, iterate, held, interior, gains, by_friction, .. } = self;
        evaluate(island, &map, iterate);
        let graphs = island.graphs();
        // (N7) in the axes of the rows. Joints have no interior.
        let gain = |index: usize, u: &Vector3<f64>| {
            let barrier = interior.barrier(index);
            let frame = &island.couplings()[index].rows.frame;
            let u = &frame.tr_mul(u);
            let (_, gain, _) = barrier.eliminate(0.0, &barrier.nothing(), u, graphs)?;
            Some((frame, gain, barrier.by_friction()))
        };
        let local_solution = |index: usize, _: &Coupling, u: &Vector3<f64>| {
            let (frame, gain, _) = gain(index, u)?;
            Some(LocalSolution::full(Vector3::zeros(), frame * gain * frame.transpose()))
        };
        let (eliminations, pieces) = newton.linearise_as(island, local_solution, iterate)?;
        let members = island.members().iter().zip(&iterate.velocity);
        held.begin(members.map(|(member, velocity)| member.angular_slope(&velocity.spin)));
        gains.clear();
        by_friction.clear();
        for (index, piece) in pieces.iter().enumerate() {
            let (frame, gain, rubs) = gain(index, &iterate.points()[index])?;
            by_friction.push(frame * rubs.unwrap_or_default());
            let gain = match piece {
                MapPiece::Axes(_) => iterate.factored(island, index, *piece, COMPLIANCE),
                _ => Factored { to: frame * gain, gains: Vector3::repeat(1.0), from: *frame },
            };
            if gain.gains != Vector3::zeros() {
                let on = PointCompliance { compliance: COMPLIANCE, is_limit: false };
                held.add(island, index, eliminations, &gain, on);
                gains.push((index, gain));
            }
        }
        Some(())
    }

    /// Writes the right-hand sides of a change of states and wrenches to `one`. `given` returns the
    /// further changes of each body.
    pub(super) fn change(
        &mut self,
        island: &Island,
        bodies: &[usize],
        change: &StepChange<'_>,
        given: impl Fn(usize) -> BodyPerturbation,
        gravity: &Vector3<f64>,
    ) {
        let Self { iterate, couplings, moments, joints, gears, one, .. } = self;
        one.begin(bodies.len(), island.couplings().len());
        for (place, &body) in bodies.iter().enumerate() {
            let mut given = given(body);
            if let Some(state) = change.states.get(body) {
                (given.velocity, given.spin) = (state.velocity, state.spin);
            }
            if let Some(wrench) = change.wrenches.get(body) {
                given.wrench = *wrench;
            }
            let velocity = &iterate.velocity[place];
            one.rhs[place] = island.members()[place].change(velocity, &given, gravity);
        }
        if change.states.is_empty() {
            return;
        }
        for coupling in &*couplings {
            one.add(island, coupling.index, &coupling.slopes.pushed(change.states));
        }
        for moment in &*moments {
            one.add(island, moment.index, &moment.slopes.pushed(change.states));
        }
        for rows in &*joints {
            one.add(island, rows.coupling, &rows.slopes.pushed(change.states));
        }
        for gear in &*gears {
            one.add(island, gear.coupling, &gear.pushed(change.states));
        }
    }

    /// True if the constraining rows are independent, according to the system factorised last.
    pub(super) fn is_determined(&mut self, island: &Island) -> bool {
        let Self { newton, held, one, .. } = self;
        held.is_determined(island, one, newton.system())
    }

    /// Linearises the factorised contacts, joints and gears with respect to their data.
    pub(super) fn linearise(
        &mut self,
        island: &Island,
        at: IslandStep<'_>,
        slots: &Slots,
        next: &mut [State],
        placed: &mut [Option<PlacedFeatures>],
        on: PointCompliance,
    ) {
        let IslandStep { step, contacts, predicted, view } = at;
        let PointCompliance { compliance, is_limit } = on;
        let Self { newton, iterate, couplings, moments, joints, gears, gains, by_friction, .. } =
            self;
        let pieces = newton.pieces();
        let limit = if is_limit { compliance } else { 0.0 };
        // States at the end of the point's step
        for (&body, velocity) in view.bodies.iter().zip(&iterate.velocity) {
            next[body] = next_state(step, body, velocity);
        }
        // Contacts
        couplings.clear();
        for (index, gain) in &*gains {
            let Some(place) = view.contacts.get(*index) else { continue };
            let (contact, known) = (&contacts[*place], &mut placed[*index]);
            let placed =
                known.get_or_insert_with(|| PlacedFeatures::new(step.world, contact, step.states));
            let on = ContactOnPiece {
                piece: pieces[*index],
                by_friction: by_friction.get(*index).copied(),
                from: &gain.from,
                impulse: iterate.impulses[*index],
                adhesion: island.couplings()[*index].rows.adhesion,
            };
            let place = ContactPlace { contact, placed, index: *index, predicted };
            couplings.push(LinearCoupling::new(step, &place, next, on, limit));
        }
        // Moments, each after its contact
        moments.clear();
        for (place, length) in island.moments_with_lengths() {
            let index = place.moment;
            let Some(contact) = couplings.iter().position(|of| of.index == place.contact) else {
                continue;
            };
            let piece = pieces[index];
            let impulse = iterate.impulses[index];
            let from = iterate.factored(island, index, piece, compliance).from;
            let turning = island.moment_turning(index, &iterate.velocity);
            let from = &from;
            let (states, instants) = (step.states, predicted.instants());
            #[rustfmt::skip]
            let at = MomentSolution {
                index, contact, piece, from, impulse, turning, length, states, instants, limit,
            };
            let touching = &contacts[view.contacts[place.contact]];
            moments.push(LinearMoment::new(step.world, touching, &couplings[contact], &at));
        }
        if view.joints.is_empty() {
            joints.clear();
            gears.clear();
            return;
        }
        // Joints and gears
        let Iterate { velocity, impulses, .. } = &*iterate;
        let solved = SolvedRows { pieces, impulses, points: iterate.points(), compliance, limit };
        let of_body = |body: usize| {
            let Velocity { linear, spin } = velocity[view.places[body]];
            (linear, spin)
        };
        let ends = TiedEnds { velocity: of_body, next };
        geared::linearise(step, island, &solved, slots, ends, joints, gears);
    }
}
