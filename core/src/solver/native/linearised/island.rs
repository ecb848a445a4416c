//! An island, linearised at its solutions with two compliances.
//!
//! Equation numbers are those of `docs/gradients.md`.

use super::super::effort::Effort;
use super::super::equations::{Equations, Velocity};
use super::super::island::{CouplingChange, Island, gain_of};
use super::super::islands::IslandView;
use super::super::law::NaturalMap;
use super::super::member::BodyGiven;
use super::super::newton::{Iterate, Newton, Until, evaluate};
use super::super::part::next_state;
use super::super::tolerances::COMPLIANCE;
use super::constants::{Constants, Shape, places, unit};
use super::coupling::LinearCoupling;
use super::tied::{self, LinearGear, LinearRows, Matrix6x12, Slots, Solved};
use super::{StepChange, StepGradient};
use crate::contact::Contact;
use crate::derivative::{EndMap, Placed, StateChange};
use crate::error::Error;
use crate::mechanics::State;
use crate::step::Step;
use crate::world::{Constant, World};
use nalgebra::{Matrix3, SMatrix, SVector, Vector3, Vector6};

/// One island at the solutions with the compliances ε and 2ε.
#[derive(Debug, Clone)]
pub(super) struct LinearIsland {
    pub(super) bodies: Vec<usize>,
    pub(super) island: Island,
    pub(super) points: [LinearPoint; 2],
    /// Whether the first point is all: it has no row, or the compliance is no limit.
    is_one: bool,
    /// The impulses of the solution that was found.
    found: Vec<Vector3<f64>>,
    /// (∂(angular part)/∂ω⁺)⁻¹ of a body by itself, which is all that its system has.
    free: Option<Matrix3<f64>>,
    /// How the features of its contacts follow the bodies, where it was asked.
    placed: Vec<Option<Placed>>,
}

/// The points that count.
fn points(all: &mut [LinearPoint; 2], is_one: bool) -> impl Iterator<Item = &mut LinearPoint> {
    all.iter_mut().take(if is_one { 1 } else { 2 })
}

/// ε and 2ε.
const COMPLIANCES: [f64; 2] = [COMPLIANCE, 2.0 * COMPLIANCE];

/// What the results at the two compliances are multiplied with: what is linear in ε vanishes.
pub(super) const WEIGHTS: [f64; 2] = [2.0, -1.0];

/// One island at a solution with compliance.
#[derive(Debug, Clone)]
pub(super) struct LinearPoint {
    pub(super) newton: Newton<Island>,
    pub(super) iterate: Iterate<Island>,
    pub(super) couplings: Vec<LinearCoupling>,
    joints: Vec<LinearRows>,
    gears: Vec<LinearGear>,
    pub(super) rhs: Vec<Vector6<f64>>,
    /// Right-hand sides by the state of a body, and scratch of as many.
    columns: (Vec<Matrix6x12>, Vec<Matrix6x12>),
}

impl LinearIsland {
    pub(super) fn new(world: &World) -> Self {
        let point = || LinearPoint {
            newton: Newton::new(),
            iterate: Iterate::new(),
            couplings: Vec::new(),
            joints: Vec::new(),
            gears: Vec::new(),
            rhs: Vec::new(),
            columns: (Vec::new(), Vec::new()),
        };
        Self {
            bodies: Vec::new(),
            island: Island::new(world),
            points: [point(), point()],
            is_one: false,
            found: Vec::new(),
            free: None,
            placed: Vec::new(),
        }
    }

    /// Linearises it; whether it keeps its shares. `next` are states of the world, of which those of its bodies are
    /// changed.
    pub(super) fn linearise(
        &mut self,
        (step, contacts, view): (&Step<'_>, &[Contact], &IslandView<'_>),
        (next, slots): (&mut [State], &Slots),
        smoothed: Option<f64>,
    ) -> Result<bool, Error> {
        self.bodies.clear();
        self.bodies.extend_from_slice(view.bodies);
        self.island.begin(step, view.bodies, 0.0);
        let carries = step.world.has_surfaces();
        for &place in view.contacts {
            self.island.admit(&contacts[place], |body| view.places[body]);
            if carries {
                self.island.carry(contacts[place].carried(step.world, step.states));
            }
        }
        for &joint in view.joints {
            self.island.admit_joint(step, joint, |body| view.places[body]);
        }
        for &gear in view.gears {
            self.island.admit_gear(step, gear);
        }
        self.island.tie();
        // What rolls is selected by the law's own limit, in which one solution is left of each share.
        let rolls = !self.island.setting().all_give_alike;
        self.island.setting_mut().give_alike();
        // Without a row no compliance is in it, and one point is enough.
        self.is_one = smoothed.is_some() || self.island.is_plain();
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
        let kept = match smoothed {
            Some(compliance) => self.soften(step, view, compliance).map(|()| false)?,
            None => rolls || !self.selects(step, view)?,
        };
        self.placed.clear();
        self.placed.resize(view.contacts.len(), None);
        let compliances = smoothed.map_or(COMPLIANCES, |compliance| [compliance, 0.0]);
        for (point, compliance) in points(&mut self.points, self.is_one).zip(compliances) {
            if kept {
                point.keep(&self.island, step, view, compliance);
            }
            let singular = || Error::Unsupported {
                what: "the derivative of a step whose linear system is singular",
                why: "contacts hold each other in a way that compliance does not resolve",
            };
            let at = (step, contacts, view);
            let found = point.linearise(
                &self.island,
                at,
                (&mut *next, &mut self.placed, slots),
                compliance,
            );
            found.ok_or_else(singular)?;
        }
        Ok(kept && !rolls)
    }

    /// Moves both points to the solutions with compliance; whether the solution that was found is their limit, and so
    /// that of the selection rule: then they leave it as the compliance grows.
    fn selects(&mut self, step: &Step<'_>, view: &IslandView<'_>) -> Result<bool, Error> {
        /// Impulses that differ by less than this part of the largest are the same.
        const SAME: f64 = 1e-8;
        for (point, compliance) in points(&mut self.points, self.is_one).zip(COMPLIANCES) {
            point.begin(&self.island, step, view);
            self.found.clone_from(&point.iterate.impulses);
            if !point.solve(&self.island, step, view, compliance)? {
                return Ok(false);
            }
        }
        if self.is_one {
            return Ok(true);
        }
        let [near, far] = self.points.each_ref().map(|point| &point.iterate.impulses);
        let apart = |a: &[Vector3<f64>], b: &[Vector3<f64>]| {
            a.iter().zip(b).map(|(a, b)| (a - b).amax()).fold(0.0, f64::max)
        };
        let found = &self.found;
        let largest = found.iter().map(|impulse| impulse.amax()).fold(0.0, f64::max);
        Ok(apart(found, near) <= 2.0 * apart(near, far) + SAME * largest)
    }

    /// Moves the first point to the solution with this compliance, from the one that was found by way of smaller ones.
    fn soften(
        &mut self,
        step: &Step<'_>,
        view: &IslandView<'_>,
        compliance: f64,
    ) -> Result<(), Error> {
        /// Of these parts of the compliance, the first from which the rest of the way is found.
        const WAYS: [f64; 4] = [1.0, 1e-1, 1e-2, 1e-4];
        let Self { island, points: [point, _], .. } = self;
        for begun in WAYS {
            point.begin(island, step, view);
            let mut at = begun;
            loop {
                if !point.solve(island, step, view, at * compliance)? {
                    break;
                }
                if at >= 1.0 {
                    return Ok(());
                }
                at = (at * 4.0).min(1.0);
            }
        }
        let why = "no solution with it was found; a smaller one is nearer to the step";
        Err(Error::Unsupported { what: "the derivative with this compliance", why })
    }

    /// How far its rows are from the next pieces of their laws, m/s: the least.
    pub(super) fn margin(&self) -> f64 {
        match self.free {
            Some(_) => f64::INFINITY,
            None => {
                let margins = self.points[0].iterate.margins(&self.island);
                margins.fold(f64::INFINITY, f64::min)
            }
        }
    }

    pub(super) fn push<F: Fn(Constant, usize) -> f64>(
        &mut self,
        change: &StepChange<'_>,
        constants: Option<Constants<'_, F>>,
        (gravity, ends): (&Vector3<f64>, &[Option<EndMap>]),
        end: &mut [StateChange],
    ) {
        let weights = if self.is_one { [1.0, 0.0] } else { WEIGHTS };
        for (point, weight) in points(&mut self.points, self.is_one).zip(weights) {
            point.rhs.clear();
            for (place, &body) in self.bodies.iter().enumerate() {
                let mut given = constants
                    .as_ref()
                    .map_or(BodyGiven::nothing(), |constants| constants.body(body));
                if let Some(state) = change.states.get(body) {
                    (given.velocity, given.spin) = (state.velocity, state.spin);
                }
                if let Some(wrench) = change.wrenches.get(body) {
                    given.wrench = *wrench;
                }
                let velocity = &point.iterate.velocity[place];
                point.rhs.push(self.island.members()[place].change(velocity, &given, gravity));
            }
            for coupling in &point.couplings {
                let mut found = SVector::<f64, 9>::zeros();
                if !change.states.is_empty() {
                    found += coupling.slopes.pushed(change.states);
                }
                if let Some(constants) = &constants {
                    found += coupling.by_constants(constants);
                }
                let change = coupling_change(&found);
                self.island.add_change(coupling.index, &change, &mut point.rhs);
            }
            if !change.states.is_empty() {
                let (island, states, rhs) = (&self.island, change.states, &mut point.rhs);
                point.joints.iter().for_each(|rows| rows.push(island, states, rhs));
                point.gears.iter().for_each(|gear| gear.push(island, states, rhs));
            }
            if let Some(Constants { numbers, .. }) = &constants {
                let (island, rhs) = (&self.island, &mut point.rhs);
                let longer = numbers(Constant::TimeStep, 0);
                point.joints.iter().for_each(|rows| rows.push_constants(island, numbers, rhs));
                point.gears.iter().for_each(|gear| gear.push_time_step(island, longer, rhs));
            }
            match &self.free {
                Some(inverse) => turn(inverse, &mut point.rhs),
                None => self.island.solve::<false>(point.newton.system(), &mut point.rhs),
            }
            for (&body, solved) in self.bodies.iter().zip(&point.rhs) {
                let (linear, spin) =
                    (solved.fixed_rows::<3>(0).into(), solved.fixed_rows::<3>(3).into());
                if let Some(map) = &ends[body] {
                    let moved = map.push(&StateChange::zero(), (&linear, &spin), 0.0);
                    end[body] = end[body].plus(weight, &moved);
                }
            }
        }
    }

    /// Adds to ∂X⁺/∂X of the bodies of the world, by the state of `body`, what V⁺ has a part in; whether it is of this
    /// island.
    pub(super) fn by_state(
        &mut self,
        body: usize,
        ends: &[Option<EndMap>],
        end: &mut [SMatrix<f64, 12, 12>],
    ) -> bool {
        let Some(own) = self.bodies.iter().position(|of| *of == body) else { return false };
        let weights = if self.is_one { [1.0, 0.0] } else { WEIGHTS };
        for (point, weight) in points(&mut self.points, self.is_one).zip(weights) {
            let LinearPoint { newton, couplings, joints, gears, columns: (rhs, values), .. } =
                point;
            rhs.clear();
            rhs.resize(self.bodies.len(), Matrix6x12::zeros());
            rhs[own] = self.island.members()[own].change_by_state();
            for coupling in couplings.iter() {
                if let Some(columns) = coupling.slopes.by_state(body) {
                    self.island.add_changes(coupling.index, &columns, rhs);
                }
            }
            joints.iter().for_each(|rows| rows.add_state(&self.island, body, rhs));
            gears.iter().for_each(|gear| gear.add_state(&self.island, body, rhs));
            match &self.free {
                Some(inverse) => turn(inverse, rhs),
                None => self.island.solve_all(newton.system(), (rhs, values)),
            }
            for (&of, solved) in self.bodies.iter().zip(&*rhs) {
                if let Some(map) = &ends[of] {
                    map.add_velocities(&(solved * weight), &mut end[of]);
                }
            }
        }
        true
    }

    pub(super) fn pull(
        &mut self,
        by_velocity: &[(Vector3<f64>, Vector3<f64>)],
        (gravity, shapes): (&Vector3<f64>, &[Shape]),
        constants: &[Constant],
        gradient: &mut StepGradient,
    ) {
        let weights = if self.is_one { [1.0, 0.0] } else { WEIGHTS };
        for (point, weight) in points(&mut self.points, self.is_one).zip(weights) {
            point.rhs.clear();
            point.rhs.extend(self.bodies.iter().map(|&body| {
                let (linear, spin) = by_velocity[body];
                let mut rhs = Vector6::zeros();
                rhs.fixed_rows_mut::<3>(0).copy_from(&(linear * weight));
                rhs.fixed_rows_mut::<3>(3).copy_from(&(spin * weight));
                rhs
            }));
            match &self.free {
                Some(inverse) => turn(&inverse.transpose(), &mut point.rhs),
                None => self.island.solve::<true>(point.newton.system(), &mut point.rhs),
            }
            for (place, &body) in self.bodies.iter().enumerate() {
                let (member, rhs) = (&self.island.members()[place], &point.rhs[place]);
                let (velocity, spin, wrench) = member.change_pulled(rhs);
                let state = &mut gradient.states[body];
                state.velocity += velocity;
                state.spin += spin;
                gradient.wrenches[body] = gradient.wrenches[body].plus(&wrench);
                let new = &point.iterate.velocity[place];
                for (&constant, sums) in constants.iter().zip(&mut gradient.constants) {
                    for place in places(constant, body) {
                        let numbers = unit(constant, place);
                        let given = Constants { shapes, numbers: &numbers }.body(body);
                        sums[place] += rhs.dot(&member.change(new, &given, gravity));
                    }
                }
            }
            for rows in &point.joints {
                let sums = (constants, &mut gradient.constants[..]);
                rows.pull(&self.island, &point.rhs, &mut gradient.states, sums);
            }
            for gear in &point.gears {
                let by_time_step = gear.pull(&self.island, &point.rhs, &mut gradient.states);
                for (constant, sums) in constants.iter().zip(&mut gradient.constants) {
                    if *constant == Constant::TimeStep {
                        sums[0] += by_time_step;
                    }
                }
            }
            for coupling in &point.couplings {
                let by = numbers(&self.island.change_pulled(coupling.index, &point.rhs));
                coupling.slopes.pull(&by, &mut gradient.states);
                for (&constant, sums) in constants.iter().zip(&mut gradient.constants) {
                    let mut done = 0..0;
                    for body in coupling.slopes.bodies.into_iter().flatten() {
                        let own = places(constant, body);
                        if own == done {
                            continue;
                        }
                        for place in own.clone() {
                            let numbers = unit(constant, place);
                            let constants = Constants { shapes, numbers: &numbers };
                            sums[place] += by.dot(&coupling.by_constants(&constants));
                        }
                        done = own;
                    }
                }
            }
        }
    }
}

/// Solves the equations of bodies by themselves for the spins.
fn turn<const C: usize>(inverse: &Matrix3<f64>, rhs: &mut [SMatrix<f64, 6, C>]) {
    for rhs in rhs {
        let turned = inverse * rhs.fixed_rows::<3>(3);
        rhs.fixed_rows_mut::<3>(3).copy_from(&turned);
    }
}

pub(super) fn coupling_change(numbers: &SVector<f64, 9>) -> CouplingChange {
    let part = |k: usize| Vector3::from_column_slice(&numbers.as_slice()[k..k + 3]);
    CouplingChange { impulse: part(0), torques: [part(3), part(6)] }
}

pub(super) fn numbers(change: &CouplingChange) -> SVector<f64, 9> {
    let mut all = SVector::<f64, 9>::zeros();
    for (k, part) in [&change.impulse, &change.torques[0], &change.torques[1]].iter().enumerate() {
        all.fixed_rows_mut::<3>(3 * k).copy_from(part);
    }
    all
}

impl LinearPoint {
    /// Starts at the solution.
    fn begin(&mut self, island: &Island, step: &Step<'_>, view: &IslandView<'_>) {
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
        impulses.extend(view.contacts.iter().map(|&place| view.before[place] * to_impulse));
        island.extend_previous(step, impulses);
    }

    /// Makes it that of a body by itself, of which the solution is that which was found.
    fn set_free(
        &mut self,
        island: &Island,
        step: &Step<'_>,
        view: &IslandView<'_>,
    ) -> Option<Matrix3<f64>> {
        self.begin(island, step, view);
        self.couplings.clear();
        self.joints.clear();
        self.gears.clear();
        let slope = island.members()[0].angular_slope(&self.iterate.velocity[0].spin);
        slope.try_inverse()
    }

    /// Finds the solution with `compliance` from here; whether it did.
    fn solve(
        &mut self,
        island: &Island,
        step: &Step<'_>,
        view: &IslandView<'_>,
        compliance: f64,
    ) -> Result<bool, Error> {
        /// Iterations: as the start is as near as the compliance, two or three are enough.
        const ITERATIONS: u32 = 20;
        let map = NaturalMap::with_compliance(compliance);
        let mut effort = Effort::new(step, view.bodies.len(), view.contacts.len());
        effort.begin_start(u32::MAX);
        let tolerances = island.tolerances();
        let until = Until { iterations: ITERATIONS, residual: tolerances.rounding };
        let Self { newton, iterate, .. } = self;
        let converged = newton.solve(island, &map, (compliance, until), iterate, &mut effort);
        effort.check()?;
        // What did not converge to rounding may have to what is asked of a solution with compliance.
        Ok(converged || evaluate(island, &map, iterate).largest <= tolerances.newton)
    }

    /// Stays at the solution that was found: compliance acts on changes alone (N13).
    fn keep(&mut self, island: &Island, step: &Step<'_>, view: &IslandView<'_>, compliance: f64) {
        self.begin(island, step, view);
        let map = NaturalMap::with_compliance(compliance);
        self.iterate.keep_impulses(island, &map);
        let _ = evaluate(island, &map, &mut self.iterate);
        self.iterate.forget_impulses();
    }

    /// Linearises the equations here, and all contacts by what they depend on.
    pub(super) fn linearise(
        &mut self,
        island: &Island,
        (step, contacts, view): (&Step<'_>, &[Contact], &IslandView<'_>),
        (next, placed, slots): (&mut [State], &mut [Option<Placed>], &Slots),
        compliance: f64,
    ) -> Option<()> {
        let map = NaturalMap::with_compliance(compliance);
        let Self { newton, iterate, couplings, joints, gears, .. } = self;
        let (eliminations, pieces) = newton.linearise(island, &map, compliance, iterate)?;
        for (&body, velocity) in view.bodies.iter().zip(&iterate.velocity) {
            next[body] = next_state(step, body, velocity);
        }
        couplings.clear();
        for (place, &index) in view.contacts.iter().enumerate() {
            let impulse = iterate.impulses[place];
            let gain = gain_of(&eliminations[place].answer);
            // What is open has no part in anything.
            if impulse == Vector3::zeros() && gain == Matrix3::zeros() {
                continue;
            }
            let contact = &contacts[index];
            let known = &mut placed[place];
            let placed = known.get_or_insert_with(|| Placed::of(step.world, contact, step.states));
            let on = (pieces[place], gain, impulse);
            couplings.push(LinearCoupling::new(step, (contact, placed, place), next, on));
        }
        if view.joints.is_empty() {
            joints.clear();
            gears.clear();
            return Some(());
        }
        let Iterate { velocity, impulses, .. } = &*iterate;
        let solved = Solved { pieces, impulses, points: iterate.points(), compliance };
        let of_body = |body: usize| {
            let Velocity { linear, spin } = velocity[view.places[body]];
            (linear, spin)
        };
        tied::linearise(step, island, (&solved, slots), of_body, (joints, gears));
        Some(())
    }
}
