//! Semismooth Newton method on the natural map of the contact law, with every contact eliminated.
//!
//! Equation numbers refer to `docs/native-solver.md`. Numbers from J on refer to `docs/joints.md`.

mod iterate;
mod limit;
mod multipliers;

use super::coupling::Coupling;
use super::effort::SolveEffort;
use super::equations::{
    Elimination, Equations, EvaluatedPoint, MapResidual, MomentPlace, Velocities, reserve,
};
use super::law::{Gain, LawRows, LocalSolution, MapPiece, NaturalMap};
use super::settings::{COMPLIANCE, KEPT_STEP, NEWTON_ITERATIONS, SUFFICIENT_DECREASE, WHOLE_STEPS};
use nalgebra::Vector3;

pub(super) use iterate::{Iterate, evaluate, evaluate_again, exact_residual};

/// Elimination and piece of every coupling.
pub(super) type Linearised<'a, E> = (&'a [Elimination<<E as Equations>::Slope>], &'a [MapPiece]);

/// Parameters of a Newton iteration.
#[derive(Debug, Clone, Copy)]
pub(super) struct NewtonRun {
    /// ε in the Newton matrix: the one of the law, or any value for a law without compliance.
    pub(super) compliance: f64,
    /// Largest number of iterations.
    pub(super) iterations: u32,
    /// Residual of the law at convergence (m/s).
    pub(super) residual: f64,
}

impl NewtonRun {
    /// Parameters for the law with [`COMPLIANCE`].
    pub(super) fn with_compliance(equations: &impl Equations) -> Self {
        let residual = equations.tolerances().newton;
        Self { compliance: COMPLIANCE, iterations: NEWTON_ITERATIONS, residual }
    }
}

/// Scratch of the iteration.
#[derive(Debug, Clone)]
pub(super) struct Newton<E: Equations> {
    trial: Iterate<E>,
    step: E::Velocity,
    pieces: Vec<MapPiece>,
    eliminations: Vec<Elimination<E::Slope>>,
    system: E::System,
    kept: KeptFactor,
    /// True if the matrix uses isotropic compliance, also for rolling contacts.
    is_isotropic: bool,
}

/// Point that the eliminations and the factorised system belong to.
#[derive(Debug, Clone, Default)]
struct KeptFactor {
    /// Pieces at that point; `compliance` is the ε of the matrix.
    pieces: Vec<MapPiece>,
    compliance: f64,
    /// True if the factors may be used for the next step.
    are_good: bool,
}

impl<E: Equations> Newton<E> {
    pub(super) fn new() -> Self {
        Self {
            trial: Iterate::new(),
            step: E::Velocity::empty(),
            pieces: Vec::new(),
            eliminations: Vec::new(),
            system: E::System::default(),
            kept: KeptFactor::default(),
            is_isotropic: false,
        }
    }

    /// Reserves memory for `contacts` contacts.
    pub(super) fn reserve(&mut self, contacts: usize) {
        self.trial.reserve(contacts);
        reserve(&mut self.pieces, contacts);
        reserve(&mut self.kept.pieces, contacts);
        reserve(&mut self.eliminations, contacts);
    }

    /// Solves the law of `map` from `iterate`. Returns true on convergence.
    pub(super) fn solve(
        &mut self,
        equations: &E,
        map: &NaturalMap,
        run: NewtonRun,
        iterate: &mut Iterate<E>,
        effort: &mut SolveEffort<'_>,
    ) -> bool {
        evaluate(equations, map, iterate);
        self.go_on(equations, map, run, iterate, effort)
    }

    /// Iterates from a point evaluated for `map`. Leaves the last point evaluated.
    fn go_on(
        &mut self,
        equations: &E,
        map: &NaturalMap,
        run: NewtonRun,
        iterate: &mut Iterate<E>,
        effort: &mut SolveEffort<'_>,
    ) -> bool {
        let tolerances = equations.tolerances();
        let mut merit = iterate.residual;
        // Without compliance the iteration starts near a solution and must stay there.
        let mut jumps = if map.compliance > 0.0 { equations.settings().jumps } else { 0 };
        let mut whole_steps = WHOLE_STEPS;
        self.kept.are_good = false;
        for _ in 0..run.iterations {
            if merit.largest <= run.residual {
                return true;
            }
            if !effort.spend() {
                return false;
            }
            self.find_pieces(equations, iterate);
            if !self.set_direction(equations, run.compliance, iterate) {
                return false;
            }
            let (before, were_kept) = (merit.largest, self.kept.are_good);
            // Near a solution: full steps, a few of which may increase the residual.
            if merit.largest <= tolerances.whole_steps && whole_steps > 0 {
                self.try_step(equations, iterate, 1.0);
                let trial = evaluate(equations, map, &mut self.trial);
                if were_kept && trial.squared >= merit.squared {
                    self.kept.are_good = false;
                    continue;
                }
                whole_steps -= u32::from(trial.squared >= merit.squared);
                std::mem::swap(iterate, &mut self.trial);
                merit = trial;
            } else if let Some(better) = self.search(equations, map, iterate, &merit) {
                merit = better;
            } else if were_kept {
                self.kept.are_good = false;
                continue;
            } else if jumps > 0 {
                self.try_step(equations, iterate, 1.0);
                merit = evaluate(equations, map, &mut self.trial);
                std::mem::swap(iterate, &mut self.trial);
                jumps -= 1;
            } else {
                return false;
            }
            self.kept.are_good = keeps(equations, before, merit.largest, KEPT_STEP);
        }
        merit.largest <= run.residual
    }

    /// Solves the law from `iterate`, with compliance on changes from its impulses p̂_0 only:
    ///
    /// ```text
    /// û = u + ε D (p̂ − p̂_0)                                                   (N13)
    /// ```
    ///
    /// `is_evaluated` is true if the iterate was evaluated for some law. Returns true on
    /// convergence.
    pub(super) fn solve_from_here(
        &mut self,
        equations: &E,
        map: &NaturalMap,
        run: NewtonRun,
        is_evaluated: bool,
        iterate: &mut Iterate<E>,
        effort: &mut SolveEffort<'_>,
    ) -> bool {
        iterate.keep_impulses(equations, map);
        self.trial.shifts.clone_from(&iterate.shifts);
        if is_evaluated {
            evaluate_again(equations, map, iterate)
        } else {
            evaluate(equations, map, iterate)
        };
        let converged = self.go_on(equations, map, run, iterate, effort);
        iterate.forget_impulses();
        self.trial.forget_impulses();
        converged
    }

    /// Linearises the law evaluated last at `iterate` with the compliance `matrix`, and factorises
    /// the system of the velocities.
    ///
    /// Returns the elimination and the piece of every coupling. `None` if the system is singular.
    pub(super) fn linearise(
        &mut self,
        equations: &E,
        matrix: f64,
        iterate: &Iterate<E>,
    ) -> Option<Linearised<'_, E>> {
        self.find_pieces(equations, iterate);
        self.kept.are_good = false;
        let is_regular = self.set_direction(equations, matrix, iterate);
        is_regular.then_some((&self.eliminations, &self.pieces))
    }

    /// Linearises with the local solutions of `local_solution` instead of the law's. The pieces are the
    /// law's.
    pub(super) fn linearise_as(
        &mut self,
        equations: &E,
        local_solution: impl FnMut(usize, &Coupling, &Vector3<f64>) -> Option<LocalSolution>,
        iterate: &Iterate<E>,
    ) -> Option<Linearised<'_, E>> {
        self.find_pieces(equations, iterate);
        self.kept.are_good = false;
        let Iterate { velocity, points, scratch, .. } = iterate;
        let at = EvaluatedPoint { velocity, points, scratch };
        let is_regular =
            equations.linearise(at, local_solution, &mut self.eliminations, &mut self.system);
        is_regular.then_some((&self.eliminations, &self.pieces))
    }

    /// Pieces found last.
    pub(super) fn pieces(&self) -> &[MapPiece] {
        &self.pieces
    }

    /// System factorised last.
    pub(super) fn system(&mut self) -> &mut E::System {
        &mut self.system
    }

    /// Finds the pieces of all couplings for the map evaluated last.
    fn find_pieces(&mut self, equations: &E, iterate: &Iterate<E>) {
        self.pieces.clear();
        self.pieces.extend(
            iterate.projections.iter().map(|projection| projection.piece(equations.graphs())),
        );
    }

    /// Computes the Newton direction of the velocities for the law evaluated last and the pieces
    /// found last. The direction of the impulses follows from the eliminations. Returns false if
    /// the matrix is singular.
    ///
    /// Retained factors are reused while they are good. Only the offsets are then recomputed, from
    /// the current residuals.
    fn set_direction(&mut self, equations: &E, matrix: f64, iterate: &Iterate<E>) -> bool {
        let Iterate { velocity, impulses, points, projections, scratch, .. } = iterate;
        let is_isotropic = self.is_isotropic;
        let Self { step, pieces, eliminations, system, kept, .. } = self;
        let at = EvaluatedPoint { velocity, points, scratch };
        let graphs = equations.graphs();
        let local_solution = |index: usize, coupling: &Coupling| {
            let alike;
            let mut rows = &coupling.rows;
            if E::MAY_BE_TIED && is_isotropic && !rows.is_isotropic() {
                alike = rows.isotropic();
                rows = &alike;
            }
            projections[index].local_solution(
                pieces[index],
                LawRows { rows, graphs },
                &impulses[index],
                matrix,
            )
        };
        // Retained factors: same pieces and compliance. Only d of (N5) changes.
        if kept.are_good && kept.compliance == matrix && kept.pieces == *pieces {
            let couplings = equations.couplings().iter().zip(&mut *eliminations);
            for (index, (coupling, elimination)) in couplings.enumerate() {
                let alike = (is_isotropic && !coupling.rows.is_isotropic())
                    .then(|| coupling.rows.isotropic());
                let law_rows = LawRows { rows: alike.as_ref().unwrap_or(&coupling.rows), graphs };
                let LocalSolution { offset, gain } = &mut elimination.local_solution;
                *offset = projections[index].offset(
                    pieces[index],
                    law_rows,
                    &impulses[index],
                    matrix,
                    gain,
                );
            }
            return equations.direction(scratch, eliminations, system, step);
        }
        // d and D of (N5), then the matrix (N12)
        kept.are_good = false;
        if equations.settings().keeps_factors {
            kept.pieces.clone_from(pieces);
            kept.compliance = matrix;
        }
        let local_solution = |index: usize, coupling: &Coupling, _: &Vector3<f64>| {
            Some(local_solution(index, coupling))
        };
        equations.linearise(at, local_solution, eliminations, system)
            && equations.direction(scratch, eliminations, system, step)
    }

    /// Halves the step until the residual falls enough, and moves `iterate` there.
    fn search(
        &mut self,
        equations: &E,
        map: &NaturalMap,
        iterate: &mut Iterate<E>,
        merit: &MapResidual,
    ) -> Option<MapResidual> {
        let mut length = 1.0;
        while length >= equations.settings().shortest_step {
            self.try_step(equations, iterate, length);
            let trial = evaluate(equations, map, &mut self.trial);
            if trial.squared < (1.0 - SUFFICIENT_DECREASE * length) * merit.squared {
                std::mem::swap(iterate, &mut self.trial);
                return Some(trial);
            }
            length *= 0.5;
        }
        None
    }

    /// Sets the trial point at `length` along the direction.
    fn try_step(&mut self, equations: &E, iterate: &Iterate<E>, length: f64) {
        let Self { trial, step, eliminations, .. } = self;
        trial.velocity.set_moved(&iterate.velocity, length, step);
        trial.impulses.clear();
        let moved = iterate
            .impulses
            .iter()
            .zip(&*eliminations)
            .map(|(impulse, contact)| impulse + length * contact.impulse_step(step));
        trial.impulses.extend(moved);
        let before = &iterate.impulses;
        add_loads(equations, eliminations, |contact| before[contact], &mut trial.impulses);
    }
}

/// Adds to the impulses of moments what the change of their contacts' normal impulses makes of them.
/// `before` has the impulses of the contacts before the change.
#[inline]
fn add_loads<E: Equations>(
    equations: &E,
    eliminations: &[Elimination<E::Slope>],
    before: impl Fn(usize) -> Vector3<f64>,
    impulses: &mut [Vector3<f64>],
) {
    for &MomentPlace { moment, contact } in equations.moments() {
        if let Gain::Moment(gain) = &eliminations[moment].local_solution.gain {
            let normal = equations.couplings()[contact].rows.normal();
            let pressed = normal.dot(&(impulses[contact] - before(contact)));
            impulses[moment] += gain.by_load * pressed;
        }
    }
}

/// True if the factors may be reused: the step left at most a `part` of the residual.
fn keeps(equations: &impl Equations, before: f64, after: f64, part: f64) -> bool {
    equations.settings().keeps_factors && after <= part * before
}
