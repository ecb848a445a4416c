//! Primal–dual interior point method on the laws' [barriers](Barrier).
//!
//! It is slower than Newton's method but has a large region of convergence. Newton's method
//! continues from its result. Equation numbers refer to `docs/native-solver.md`.

use super::effort::SolveEffort;
use super::equations::{Elimination, Equations, EvaluatedPoint, Velocities, reserve};
use super::law::{Barrier, LocalSolution, Pending};
use super::newton::Iterate;
use super::settings::{INTERIOR_ERROR, INTERIOR_ITERATIONS, LEAST_SCALE};
use nalgebra::Vector3;

/// Scratch of the iteration.
#[derive(Debug, Clone)]
pub(super) struct InteriorPoint<E: Equations> {
    barriers: Vec<Barrier>,
    steps: Vec<Barrier>,
    /// Data of the last elimination for the steps of the barriers.
    pending: Vec<Pending>,
    eliminations: Vec<Elimination<E::Slope>>,
    points: Vec<Vector3<f64>>,
    step: E::Velocity,
    moved: E::Velocity,
    scratch: E::Scratch,
    system: E::System,
}

impl<E: Equations> InteriorPoint<E> {
    pub(super) fn new() -> Self {
        Self {
            barriers: Vec::new(),
            steps: Vec::new(),
            pending: Vec::new(),
            eliminations: Vec::new(),
            points: Vec::new(),
            step: E::Velocity::empty(),
            moved: E::Velocity::empty(),
            scratch: E::Scratch::default(),
            system: E::System::default(),
        }
    }

    /// Reserves memory for `contacts` contacts.
    pub(super) fn reserve(&mut self, contacts: usize) {
        reserve(&mut self.barriers, contacts);
        reserve(&mut self.steps, contacts);
        reserve(&mut self.pending, contacts);
        reserve(&mut self.eliminations, contacts);
        reserve(&mut self.points, contacts);
    }

    /// Moves `iterate` near a solution from a centred start.
    ///
    /// The initial normal impulses are `centre` times the momentum of all bodies, divided by the
    /// number of contacts.
    pub(super) fn solve(
        &mut self,
        equations: &E,
        centre: f64,
        iterate: &mut Iterate<E>,
        effort: &mut SolveEffort<'_>,
    ) {
        let speed = self.start(equations, centre * equations.bodies() as f64, iterate);
        let target = equations.settings().complementarity * speed * speed;
        for _ in 0..INTERIOR_ITERATIONS {
            let gap = self.complementarity(0.0);
            let there = gap <= target && self.error(equations, iterate) <= INTERIOR_ERROR * speed;
            if there || !effort.spend() {
                return;
            }
            // The progress of the predictor determines the centring (Mehrotra).
            if !self.predict(equations, iterate) {
                return;
            }
            let after = self.complementarity(self.longest_step());
            let centring = (after / gap).clamp(0.0, 1.0).powi(3);
            if !self.correct(equations, centring * gap) {
                return;
            }
            self.advance(equations, iterate, self.longest_step());
        }
    }

    /// Moves `iterate` from a centred start to the point of the central path where every product is
    /// `kappa` (m²/s²). Returns true on success.
    pub(super) fn centre(
        &mut self,
        equations: &E,
        scale: f64,
        kappa: f64,
        iterate: &mut Iterate<E>,
        effort: &mut SolveEffort<'_>,
    ) -> bool {
        /// Tolerance of the products, relative to κ.
        const CENTRED: f64 = 1e-10;
        /// Multiple of κ above which the products are reduced as for a solution.
        const FAR: f64 = 4.0;
        self.start(equations, scale, iterate);
        let tolerances = equations.tolerances();
        let mut before = f64::INFINITY;
        for _ in 0..INTERIOR_ITERATIONS {
            let off = self.barriers.iter().map(|at| at.off_centre(kappa)).fold(0.0, f64::max);
            let error = self.error(equations, iterate);
            // Very different masses raise the rounding level above its usual bound.
            let is_least = error <= tolerances.newton && error > 0.5 * before;
            if off <= CENTRED * kappa && (error <= tolerances.rounding || is_least) {
                return true;
            }
            before = error;
            if !effort.spend() || !self.predict(equations, iterate) {
                return false;
            }
            let gap = self.complementarity(0.0);
            // Far from κ the centring is Mehrotra's, as for a solution.
            let aim = if gap > FAR * kappa {
                let after = self.complementarity(self.longest_step());
                ((after / gap).clamp(0.0, 1.0).powi(3) * gap).max(kappa)
            } else {
                // Newton's method, without the second-order term of the predictor.
                self.steps.iter_mut().for_each(|step| *step = step.nothing());
                kappa
            };
            if !self.correct(equations, aim) {
                return false;
            }
            self.advance(equations, iterate, self.longest_step());
        }
        false
    }

    /// Variables of coupling `index`.
    pub(super) fn barrier(&self, index: usize) -> &Barrier {
        &self.barriers[index]
    }

    /// Sets the centred start. Returns the speed scale (m/s).
    fn start(&mut self, equations: &E, scale: f64, iterate: &mut Iterate<E>) -> f64 {
        let couplings = equations.couplings();
        let speed = equations.speed().max(LEAST_SCALE);
        let strength = scale * speed / couplings.len() as f64;
        self.barriers.clear();
        self.barriers.extend(couplings.iter().map(|c| c.law.centred(&c.rows, speed, strength)));
        self.steps.clear();
        self.steps.extend(self.barriers.iter().map(Barrier::nothing));
        self.set_impulses(equations, iterate);
        equations.set_velocity_after(&[], &mut iterate.velocity);
        speed
    }

    /// Mean complementarity of all products after a step of `length` along `steps`.
    fn complementarity(&self, length: f64) -> f64 {
        let moved = self.barriers.iter().zip(&self.steps).map(|(at, step)| at.moved(step, length));
        let (mut total, mut count) = (0.0, 0);
        for (sum, products) in moved.map(|barrier| barrier.products()) {
            total += sum;
            count += products;
        }
        // Joints have no products.
        if count > 0 { total / count as f64 } else { 0.0 }
    }

    /// Largest error of the equations of motion and of the rows' speeds against û (m/s).
    fn error(&mut self, equations: &E, iterate: &Iterate<E>) -> f64 {
        let Self { barriers, points, scratch, .. } = self;
        let motion = equations.motion_residual(&iterate.velocity, &iterate.impulses, scratch);
        let mut largest = motion.largest;
        equations.set_points(&iterate.velocity, scratch, points);
        for ((coupling, barrier), u) in equations.couplings().iter().zip(&*barriers).zip(&*points) {
            let u = coupling.rows.frame.tr_mul(u);
            largest = largest.max(barrier.error(&u, equations.graphs()));
        }
        largest
    }

    /// Linearises at the iterate and computes the predictor. Returns false if the system is
    /// singular.
    ///
    /// `step` receives the direction of the velocities, `steps` the direction of the barriers'
    /// variables.
    fn predict(&mut self, equations: &E, iterate: &Iterate<E>) -> bool {
        let Self { barriers, pending, eliminations, points, scratch, system, .. } = self;
        let velocity = &iterate.velocity;
        equations.motion_residual(velocity, &iterate.impulses, scratch);
        equations.set_points(velocity, scratch, points);
        pending.clear();
        let linearised = equations.linearise(
            EvaluatedPoint { velocity, points, scratch },
            |index, coupling, u| {
                let (barrier, frame) = (&barriers[index], &coupling.rows.frame);
                let u = &frame.tr_mul(u);
                let (offset, gain, rest) =
                    barrier.eliminate(0.0, &barrier.nothing(), u, equations.graphs())?;
                pending.push(rest);
                Some(LocalSolution::full(frame * offset, frame * gain * frame.transpose()))
            },
            eliminations,
            system,
        );
        linearised && self.set_direction(equations)
    }

    /// Computes the direction to products of `kappa`, to second order along the last predictor.
    fn correct(&mut self, equations: &E, kappa: f64) -> bool {
        let Self { barriers, steps, pending, eliminations, points, .. } = self;
        let couplings = equations.couplings().iter().zip(&*points);
        let graphs = equations.graphs();
        let at = barriers.iter().zip(&*steps).zip(couplings);
        for (((barrier, predictor), (coupling, u)), (elimination, rest)) in
            at.zip(eliminations.iter_mut().zip(pending))
        {
            let frame = &coupling.rows.frame;
            let u = &frame.tr_mul(u);
            let Some((offset, _, left)) = barrier.eliminate(kappa, predictor, u, graphs) else {
                return false;
            };
            elimination.local_solution.offset = frame * offset;
            *rest = left;
        }
        self.set_direction(equations)
    }

    /// Solves the linearised system for the offsets of the eliminations.
    fn set_direction(&mut self, equations: &E) -> bool {
        let Self { barriers, steps, pending, eliminations, step, scratch, system, .. } = self;
        if !equations.direction(scratch, eliminations, system, step) {
            return false;
        }
        let couplings = equations.couplings().iter().zip(&*barriers);
        let solved = eliminations.iter().zip(&*pending);
        for ((target, (coupling, barrier)), (elimination, rest)) in
            steps.iter_mut().zip(couplings).zip(solved)
        {
            let frame = &coupling.rows.frame;
            let impulse = frame.tr_mul(&elimination.impulse_step(step));
            let moved = frame.tr_mul(&elimination.velocity_change(step));
            *target = barrier.step(&impulse, &moved, rest);
        }
        true
    }

    /// Longest step that keeps every barrier's variables strictly inside.
    fn longest_step(&self) -> f64 {
        let steps = self.barriers.iter().zip(&self.steps);
        steps.map(|(barrier, step)| barrier.longest_step(step)).fold(1.0, f64::min)
    }

    fn advance(&mut self, equations: &E, iterate: &mut Iterate<E>, length: f64) {
        self.moved.set_moved(&iterate.velocity, length, &self.step);
        iterate.velocity.copy_from(&self.moved);
        for (barrier, step) in self.barriers.iter_mut().zip(&self.steps) {
            *barrier = barrier.moved(step, length);
        }
        self.set_impulses(equations, iterate);
    }

    /// Sets the impulses of the barriers, in world axes.
    fn set_impulses(&self, equations: &E, iterate: &mut Iterate<E>) {
        let couplings = equations.couplings().iter().zip(&self.barriers);
        iterate.impulses.clear();
        let impulses = couplings.map(|(coupling, barrier)| coupling.rows.frame * barrier.impulse());
        iterate.impulses.extend(impulses);
    }
}
