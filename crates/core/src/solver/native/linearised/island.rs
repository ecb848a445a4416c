//! Linearised island: equations at one or two solutions, solved for derivatives.
//!
//! Equation numbers refer to `docs/gradients.md`.

use super::constants::{ConstantChanges, ConstantsBase, places, unit};
use super::point::{IslandStep, LinearPoint};
use super::refined::PointCompliance;
use super::refined::{RefinedColumns, Rng};
use super::tied::Slots;
use super::{Smoothing, StepChange, StepGradient};
use crate::derivative::{EndMap, PlacedFeatures, StateChange};
use crate::error::Error;
use crate::mechanics::State;
use crate::solver::native::body_equation::BodyPerturbation;
use crate::solver::native::equations::Equations;
use crate::solver::native::island::Island;
use crate::solver::native::islands::IslandView;
use crate::solver::native::settings::COMPLIANCE;
use crate::step::Step;
use crate::world::{Constant, World};
use nalgebra::{Matrix3, SMatrix, Vector3};

/// Linearised island, at one or two points.
///
/// One point suffices if the rows are independent or if the force distribution is kept. Otherwise
/// the two points are the solutions with the compliances ε and 2ε.
#[derive(Debug, Clone)]
pub(super) struct LinearIsland {
    pub(super) bodies: Vec<usize>,
    pub(super) island: Island,
    pub(super) points: [LinearPoint; 2],
    /// True if the rows are independent.
    is_determined: bool,
    /// True if only the first point is used: its own limit is taken, or the compliance is finite.
    is_one: bool,
    given: [PointCompliance; 2],
    /// Impulses of the step's own solution.
    found: Vec<Vector3<f64>>,
    /// (∂(angular part)/∂ω⁺)⁻¹ of a body without couplings: its whole linear system.
    free: Option<Matrix3<f64>>,
    /// Dependence of each contact's features on the bodies, once computed.
    placed: Vec<Option<PlacedFeatures>>,
    /// True if the constraining rows can follow any change of the bodies' poses.
    pub(super) follows_poses: bool,
    pub(super) follows_velocities: bool,
    /// Scratch: random state changes of all bodies of the world.
    moved: Vec<StateChange>,
}

const SINGULAR: Error = Error::Unsupported {
    what: "derivative of a step with a singular linear system",
    why: "its contact forces are not unique, even with compliance",
};

/// The points in use.
fn points(all: &mut [LinearPoint; 2], is_one: bool) -> impl Iterator<Item = &mut LinearPoint> {
    all.iter_mut().take(if is_one { 1 } else { 2 })
}

/// The points in use with their weights. The weights cancel terms linear in ε.
fn weighed(
    all: &mut [LinearPoint; 2],
    is_one: bool,
) -> impl Iterator<Item = (&mut LinearPoint, f64)> {
    points(all, is_one).zip(if is_one { [1.0, 0.0] } else { WEIGHTS })
}

/// ε and 2ε of (G7). Its error is of order ε² over the squares of the responses, which are small in
/// chains of light bodies.
const COMPLIANCES: [f64; 2] = [0.1 * COMPLIANCE, 0.2 * COMPLIANCE];

/// Compliance on changes for the limit at one point. With 1e-8, rounding puts derivatives of long robots
/// off by 5e-5.
const FINE: f64 = 1e-7;

/// Weights of the results at the two compliances (G7).
const WEIGHTS: [f64; 2] = [2.0, -1.0];

impl LinearIsland {
    pub(super) fn new(world: &World) -> Self {
        Self {
            bodies: Vec::new(),
            island: Island::new(world),
            points: [LinearPoint::new(), LinearPoint::new()],
            is_determined: false,
            is_one: false,
            given: [PointCompliance { compliance: COMPLIANCE, is_limit: true }; 2],
            found: Vec::new(),
            free: None,
            placed: Vec::new(),
            follows_poses: true,
            follows_velocities: true,
            moved: Vec::new(),
        }
    }

    /// Linearises the island at a solution. Returns true if the force distribution is kept.
    ///
    /// The final states of the island's bodies are written to `next`, a list over the world.
    pub(super) fn linearise(
        &mut self,
        at: IslandStep<'_>,
        slots: &Slots,
        next: &mut [State],
        smoothed: Option<Smoothing>,
    ) -> Result<bool, Error> {
        let IslandStep { step, contacts, view, .. } = at;
        view.bodies.clone_into(&mut self.bodies);
        self.island.begin(step, &IslandView { unsettled: 0.0, ..*view });
        self.island.admit_all(step, contacts, view);
        let rolls = !self.island.setting().all_isotropic;
        self.island.setting_mut().make_isotropic();
        self.is_one = true;
        (self.follows_poses, self.follows_velocities) = (true, true);
        self.free = match view.bodies {
            [_] if self.island.is_plain() => {
                let [point, _] = &mut self.points;
                point.set_free(&self.island, step, view)
            }
            _ => None,
        };
        if self.free.is_some() {
            return Ok(false);
        }
        let kept = self.settle(step, view, rolls, smoothed)?;
        self.placed.clear();
        self.placed.resize(view.contacts.len(), None);
        for (point, on) in points(&mut self.points, self.is_one).zip(self.given) {
            point.linearise(&self.island, at, slots, next, &mut self.placed, on);
        }
        if smoothed.is_none() && !self.is_determined {
            self.probe(step);
        }
        Ok(kept)
    }

    /// Tests if the constraining rows can follow random changes of poses and of velocities.
    ///
    /// Independent rows can follow any change. Sticking contacts in a loop may be unable to. With
    /// bounces, velocity changes are tested too.
    fn probe(&mut self, step: &Step<'_>) {
        /// Tolerance of the remaining row motion. Rows that can follow leave one of the order of
        /// the compliance.
        const LEFT: f64 = 1e-3;
        let Self { bodies, island, points: [point, _], moved, .. } = self;
        let bounces = point
            .couplings
            .iter()
            .any(|coupling| coupling.tangent.bounces() || coupling.tangent.follows_spin());
        let mut follows = |is_pose: bool| {
            moved.clear();
            moved.resize(step.states.len(), StateChange::zero());
            let mut draws = Rng::default();
            for &body in &*bodies {
                let of = &step.world.bodies()[body];
                // Scales rotations so that they move the body's material as far as translations.
                let across = libm::sqrt(of.mass() / of.inertia().trace());
                let mut draw = || Vector3::from_fn(|_, _| draws.next());
                let (place, turn) = (draw(), draw() * across);
                let zero = StateChange::zero();
                moved[body] = if is_pose {
                    StateChange { position: place, turn, ..zero }
                } else {
                    StateChange { velocity: place, spin: turn, ..zero }
                };
            }
            let change = StepChange { states: moved, ..StepChange::default() };
            let gravity = step.world.gravity();
            point.change(island, bodies, &change, |_| BodyPerturbation::nothing(), gravity);
            let LinearPoint { newton, held, one, .. } = &mut *point;
            let pushed = one.motions.iter().map(|motion| motion.amax()).fold(0.0, f64::max);
            one.solve(island, held, newton.system());
            one.residual_of_stiff_rows(held) <= LEFT * if is_pose { pushed } else { 1.0 }
        };
        self.follows_poses = follows(true);
        self.follows_velocities = !bounces || follows(false);
    }

    /// Moves the points to where the step is linearised and factorises there. Returns true if the
    /// force distribution is kept.
    fn settle(
        &mut self,
        step: &Step<'_>,
        view: &IslandView<'_>,
        rolls: bool,
        smoothed: Option<Smoothing>,
    ) -> Result<bool, Error> {
        self.is_determined = false;
        match smoothed {
            // Derivative of the step with compliance (G8)
            Some(Smoothing::Compliance(compliance)) => {
                self.soften(step, view, compliance)?;
                self.given[0] = PointCompliance { compliance, is_limit: false };
                return self.factorise().map(|()| false);
            }
            // Derivative of the step on the central path (G16)
            Some(Smoothing::CentralPath(speed)) => {
                self.given[0] = PointCompliance { compliance: COMPLIANCE, is_limit: false };
                return self.centre(step, view, speed * speed).map(|()| false);
            }
            None => {}
        }
        let Self { island, points: [near, _], .. } = self;
        // Independent rows: compliance acts on changes only (G14).
        let residual = near.keep(island, step, view, COMPLIANCE);
        let is_solved = rolls || residual <= island.tolerances().newton;
        // More rows than degrees of freedom are dependent.
        if is_solved && near.stiff_rows(island) <= 6 * view.bodies.len() {
            let on = PointCompliance { compliance: FINE, is_limit: true };
            near.keep(island, step, view, FINE);
            if near.factorise(island, on).is_some() && near.is_determined(island) {
                (self.is_determined, self.given[0]) = (true, on);
                return Ok(false);
            }
        }
        // Dependent rows: the limit by two compliances (G7), if the solution is that limit.
        self.given[0] = PointCompliance { compliance: COMPLIANCE, is_limit: true };
        if self.selects(step, view)? {
            self.is_one = self.island.is_plain();
            self.given =
                COMPLIANCES.map(|compliance| PointCompliance { compliance, is_limit: false });
            return self.factorise().map(|()| false);
        }
        // The forces are kept: compliance acts on changes only.
        self.points[0].keep(&self.island, step, view, COMPLIANCE);
        self.factorise().map(|()| true)
    }

    /// Factorises the equations at the points in use.
    fn factorise(&mut self) -> Result<(), Error> {
        let found = points(&mut self.points, self.is_one)
            .zip(self.given)
            .try_for_each(|(point, on)| point.factorise(&self.island, on));
        found.ok_or(SINGULAR)
    }

    /// Moves the first point to the central path, with all products `kappa` (m²/s²), and factorises
    /// there.
    fn centre(&mut self, step: &Step<'_>, view: &IslandView<'_>, kappa: f64) -> Result<(), Error> {
        let Self { island, points: [point, _], .. } = self;
        if !point.centre(island, step, view, kappa)? {
            let what = "derivative at this point of the central path";
            let why = "the point was not found; choose another speed";
            return Err(Error::Unsupported { what, why });
        }
        point.factorise_centred(island).ok_or(SINGULAR)
    }

    /// Moves both points to the solutions with compliance.
    ///
    /// Returns true if the step's solution is their limit, as the selection rule demands. The
    /// solutions then depart from it in proportion to the compliance.
    fn selects(&mut self, step: &Step<'_>, view: &IslandView<'_>) -> Result<bool, Error> {
        /// Relative difference below which impulses count as equal.
        const SAME: f64 = 1e-8;
        let Self { island, points: [near, far], found, .. } = self;
        near.begin(island, step, view);
        found.clone_from(&near.iterate.impulses);
        if !near.solve(island, step, COMPLIANCES[0])? {
            return Ok(false);
        }
        if island.is_plain() {
            return Ok(true);
        }
        // Extrapolates by the same distance again, which is correct to second order.
        far.begin(island, step, view);
        far.go_on(near);
        if !far.solve(island, step, COMPLIANCES[1])? {
            return Ok(false);
        }
        let [near, far] = self.points.each_ref().map(|point| &point.iterate.impulses);
        let apart = |a: &[Vector3<f64>], b: &[Vector3<f64>]| {
            a.iter().zip(b).map(|(a, b)| (a - b).amax()).fold(0.0, f64::max)
        };
        let found = &self.found;
        let largest = found.iter().map(|impulse| impulse.amax()).fold(0.0, f64::max);
        Ok(apart(found, near) <= 2.0 * apart(near, far) + SAME * largest)
    }

    /// Moves the first point to the solution with this compliance, through smaller compliances.
    fn soften(
        &mut self,
        step: &Step<'_>,
        view: &IslandView<'_>,
        compliance: f64,
    ) -> Result<(), Error> {
        /// Fractions of the compliance to start from. The first that leads to a solution is used.
        const WAYS: [f64; 4] = [1.0, 1e-1, 1e-2, 1e-4];
        let Self { island, points: [point, _], .. } = self;
        for begun in WAYS {
            point.begin(island, step, view);
            let mut at = begun;
            loop {
                if !point.solve(island, step, at * compliance)? {
                    break;
                }
                if at >= 1.0 {
                    return Ok(());
                }
                at = (at * 4.0).min(1.0);
            }
        }
        let why = "no solution was found; choose a smaller compliance";
        Err(Error::Unsupported { what: "derivative with this compliance", why })
    }

    /// Smallest distance of a row to the next piece of its law (m/s).
    ///
    /// Ignores the first `smooth` couplings. Includes the distance between the two rows of a
    /// bouncing contact.
    pub(super) fn margin(&self, smooth: usize) -> f64 {
        match self.free {
            Some(_) => f64::INFINITY,
            None => {
                let point = &self.points[0];
                let pieces = point.iterate.margins(&self.island).skip(smooth);
                let pressing = point.couplings.iter().filter(|coupling| coupling.presses());
                let rows = pressing.map(|coupling| coupling.tangent.between);
                pieces.chain(rows).fold(f64::INFINITY, f64::min)
            }
        }
    }

    pub(super) fn jvp<F: Fn(Constant, usize) -> f64>(
        &mut self,
        change: &StepChange<'_>,
        constants: Option<ConstantChanges<'_, F>>,
        gravity: &Vector3<f64>,
        ends: &[Option<EndMap>],
        end: &mut [StateChange],
    ) {
        let Self { bodies, island, points: all, is_one, free, .. } = self;
        // 2 D_ε − D_2ε of (G7), or one point.
        for (point, weight) in weighed(all, *is_one) {
            let given = |body: usize| {
                let of = constants.as_ref();
                of.map_or(BodyPerturbation::nothing(), |constants| constants.body(body))
            };
            point.change(island, bodies, change, given, gravity);
            let LinearPoint { newton, held, couplings, moments, joints, gears, one, .. } = point;
            // Right-hand side by the constants of contacts, joints and gears
            if let Some(constants) = &constants {
                for moment in &*moments {
                    let contact = &couplings[moment.contact];
                    one.add(island, moment.index, &moment.jvp_wrt_constants(contact, constants));
                }
                for coupling in &*couplings {
                    one.add(island, coupling.index, &coupling.jvp_wrt_constants(constants));
                }
                for rows in &*joints {
                    one.add(island, rows.coupling, &rows.jvp_wrt_constants(constants.numbers));
                }
                for gear in &*gears {
                    for (coupling, change) in gear.jvp_wrt_constants(constants.numbers) {
                        one.add(island, coupling, &change);
                    }
                }
            }
            match free {
                Some(inverse) => one.solve_uncoupled(inverse),
                None => one.solve(island, held, newton.system()),
            }
            // δX⁺ by δV⁺ (G1)
            for (&body, solved) in bodies.iter().zip(&one.solved) {
                let (linear, spin) =
                    (solved.fixed_rows::<3>(0).into(), solved.fixed_rows::<3>(3).into());
                if let Some(map) = &ends[body] {
                    let moved = map.jvp(&StateChange::zero(), &linear, &spin, 0.0);
                    end[body] = end[body].plus(weight, &moved);
                }
            }
        }
    }

    /// Adds the contribution of V⁺ to ∂X⁺/∂X with respect to the state of `body`. Returns false if
    /// the body is in another island.
    pub(super) fn jacobian_wrt_state(
        &mut self,
        body: usize,
        ends: &[Option<EndMap>],
        end: &mut [SMatrix<f64, 12, 12>],
    ) -> bool {
        let Self { bodies, island, points: all, is_one, free, .. } = self;
        let Some(own) = bodies.iter().position(|of| *of == body) else { return false };
        for point in points(all, *is_one) {
            let LinearPoint {
                newton,
                held,
                couplings,
                moments,
                joints,
                gears,
                by_pose,
                by_velocity,
                ..
            } = point;
            by_pose.begin(bodies.len(), island.couplings().len());
            by_velocity.begin(bodies.len(), island.couplings().len());
            // Momentum at k of the body itself
            by_velocity.rhs[own] = island.members()[own].change_by_velocity();
            // Columns of all couplings by the pose and the velocity of the body
            let of_contacts = couplings.iter().map(|coupling| (coupling.index, &coupling.slopes));
            let of_moments = moments.iter().map(|moment| (moment.index, &moment.slopes));
            let of_joints = joints.iter().map(|rows| (rows.coupling, &rows.slopes));
            for (index, slopes) in of_contacts.chain(of_moments).chain(of_joints) {
                let Some((pose, velocity)) = slopes.jacobian_wrt_state(body) else { continue };
                by_pose.add(island, index, &pose);
                if let Some(velocity) = velocity {
                    by_velocity.add(island, index, &velocity);
                }
            }
            for gear in &*gears {
                if let Some(pose) = gear.jacobian_wrt_state(body) {
                    by_pose.add(island, gear.coupling, &pose);
                }
            }
            match free {
                Some(inverse) => {
                    by_pose.solve_uncoupled(inverse);
                    by_velocity.solve_uncoupled(inverse);
                }
                None => {
                    by_pose.solve(island, held, newton.system());
                    by_velocity.solve(island, held, newton.system());
                }
            }
        }
        // 2 D_ε − D_2ε of (G7), or one point.
        let [near, far] = all;
        let far = (!*is_one).then_some(far);
        let solved = |place: usize, of: fn(&LinearPoint) -> &RefinedColumns<6>| match &far {
            Some(far) => of(near).solved[place] * WEIGHTS[0] + of(far).solved[place] * WEIGHTS[1],
            None => of(near).solved[place],
        };
        for (place, of) in bodies.iter().enumerate() {
            let Some(map) = &ends[*of] else { continue };
            map.add_velocities(&solved(place, |point| &point.by_pose), 0, &mut end[*of]);
            map.add_velocities(&solved(place, |point| &point.by_velocity), 6, &mut end[*of]);
        }
        true
    }

    pub(super) fn vjp(
        &mut self,
        by_velocity: &[(Vector3<f64>, Vector3<f64>)],
        gravity: &Vector3<f64>,
        shapes: &[ConstantsBase],
        constants: &[Constant],
        gradient: &mut StepGradient,
    ) {
        let Self { bodies, island, points: all, is_one, free, .. } = self;
        for (point, weight) in weighed(all, *is_one) {
            let LinearPoint {
                newton, iterate, held, couplings, moments, joints, gears, one, ..
            } = point;
            // Transposed system: y for ∂ℓ/∂V⁺
            one.begin(bodies.len(), island.couplings().len());
            for (rhs, &body) in one.rhs.iter_mut().zip(&*bodies) {
                let (linear, spin) = by_velocity[body];
                rhs.fixed_rows_mut::<3>(0).copy_from(&(linear * weight));
                rhs.fixed_rows_mut::<3>(3).copy_from(&(spin * weight));
            }
            match free {
                Some(inverse) => one.solve_uncoupled(&inverse.transpose()),
                None => one.solve_transposed(island, held, newton.system()),
            }
            // Equations of motion of the bodies (G3)
            for (place, &body) in bodies.iter().enumerate() {
                let (member, rhs) = (&island.members()[place], &one.solved[place]);
                let (velocity, spin, wrench) = member.change_vjp(rhs);
                let state = &mut gradient.states[body];
                state.velocity += velocity;
                state.spin += spin;
                gradient.wrenches[body] = gradient.wrenches[body].plus(&wrench);
                let new = &iterate.velocity[place];
                for (&constant, sums) in constants.iter().zip(&mut gradient.constants) {
                    for place in places(constant, body) {
                        let numbers = unit(constant, place);
                        let given = ConstantChanges { shapes, numbers: &numbers }.body(body);
                        sums[place] += rhs.dot(&member.change(new, &given, gravity));
                    }
                }
            }
            // Rows of joints, gears, moments and contacts
            for rows in &*joints {
                let by = one.rows_vjp(island, rows.coupling);
                rows.slopes.vjp(&by, gradient);
                rows.pull_constants(&by, constants, &mut gradient.constants);
            }
            for gear in &*gears {
                let by = one.rows_vjp(island, gear.coupling);
                gear.vjp(&by, &mut gradient.states);
                let pulled = |coupling: usize| one.rows_vjp(island, coupling);
                gear.pull_constants(pulled, constants, &mut gradient.constants);
            }
            for moment in &*moments {
                let by = one.rows_vjp(island, moment.index);
                moment.slopes.vjp(&by, gradient);
                let contact = &couplings[moment.contact];
                let sums = &mut gradient.constants;
                moment.pull_constants(contact, &by, shapes, constants, sums);
            }
            for coupling in &*couplings {
                let by = one.rows_vjp(island, coupling.index);
                coupling.slopes.vjp(&by, gradient);
                coupling.pull_constants(&by, shapes, constants, &mut gradient.constants);
            }
        }
    }
}
