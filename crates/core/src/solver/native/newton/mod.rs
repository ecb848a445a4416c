//! Semismooth Newton on the natural map of the contact law, with every contact eliminated.
//!
//! Equation numbers are those of `docs/native-solver.md` and, from J on, of `docs/joints.md`.

mod iterate;
mod limit;

use super::coupling::Coupling;
use super::effort::SolveEffort;
use super::equations::{Elimination, Equations, EvaluatedPoint, MapResidual, Velocities, reserve};
use super::law::{Answer, LawRows, MapPiece, NaturalMap};
use super::settings::{COMPLIANCE, KEPT_STEP, NEWTON_ITERATIONS, SUFFICIENT_DECREASE, WHOLE_STEPS};
use nalgebra::Vector3;

pub(super) use iterate::{Iterate, evaluate, evaluate_again, exact_residual};

/// Every coupling eliminated, and the piece that it is on.
pub(super) type Linearised<'a, E> = (&'a [Elimination<<E as Equations>::Slope>], &'a [MapPiece]);

/// How an iteration is run.
#[derive(Debug, Clone, Copy)]
pub(super) struct NewtonRun {
    /// ε in the Newton matrix: that of the law, or any where the law has none.
    pub(super) compliance: f64,
    /// The most iterations.
    pub(super) iterations: u32,
    /// The residual of the law at which it has converged, m/s.
    pub(super) residual: f64,
}

impl NewtonRun {
    /// That of the law with [`COMPLIANCE`].
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
    /// Whether the compliance in the matrix is alike in all directions, also of contacts that can roll.
    gives_alike: bool,
}

/// Of which point the eliminations and the factorised system are.
#[derive(Debug, Clone, Default)]
struct KeptFactor {
    /// The pieces there, and the compliance.
    pieces: Vec<MapPiece>,
    compliance: f64,
    /// Whether they are good enough for the next step, too.
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
            gives_alike: false,
        }
    }

    /// Room for so many contacts.
    pub(super) fn reserve(&mut self, contacts: usize) {
        self.trial.reserve(contacts);
        reserve(&mut self.pieces, contacts);
        reserve(&mut self.kept.pieces, contacts);
        reserve(&mut self.eliminations, contacts);
    }

    /// Solves the law of `map` from `iterate`. Returns whether it converged.
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

    /// The same from a point that was evaluated for `map`; leaves the last point evaluated.
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
        // Without compliance the iteration is near a solution, and to stay there.
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
            if merit.largest <= tolerances.whole_steps && whole_steps > 0 {
                self.try_step(iterate, 1.0);
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
                self.try_step(iterate, 1.0);
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

    /// Solves the law with a compliance that acts on changes from the impulses p̂_0 of `iterate`
    /// alone, from there:
    ///
    /// ```text
    /// û = u + ε D (p̂ − p̂_0)                                                   (N13)
    /// ```
    ///
    /// `is_evaluated` tells that the iterate was, for any law. Returns whether it converged.
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
        self.trial.shifts.clear();
        self.trial.shifts.extend_from_slice(&iterate.shifts);
        match is_evaluated {
            true => evaluate_again(equations, map, iterate),
            false => evaluate(equations, map, iterate),
        };
        let converged = self.go_on(equations, map, run, iterate, effort);
        iterate.forget_impulses();
        self.trial.forget_impulses();
        converged
    }

    /// Linearises the law evaluated last at `iterate` with the compliance `matrix`, and factorises
    /// the system of the velocities. Returns every coupling eliminated and the piece that it is on;
    /// `None` where the system is singular.
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

    /// The same with what `answer` makes of every coupling in place of the law's answers; the pieces are the law's.
    pub(super) fn linearise_as(
        &mut self,
        equations: &E,
        answer: impl FnMut(usize, &Coupling, &Vector3<f64>) -> Option<Answer>,
        iterate: &Iterate<E>,
    ) -> Option<Linearised<'_, E>> {
        self.find_pieces(equations, iterate);
        self.kept.are_good = false;
        let Iterate { velocity, points, scratch, .. } = iterate;
        let at = EvaluatedPoint { velocity, points, scratch };
        let is_regular = equations.linearise(at, answer, &mut self.eliminations, &mut self.system);
        is_regular.then_some((&self.eliminations, &self.pieces))
    }

    /// The pieces that were found last.
    pub(super) fn pieces(&self) -> &[MapPiece] {
        &self.pieces
    }

    /// The system that was factorised last.
    pub(super) fn system(&mut self) -> &mut E::System {
        &mut self.system
    }

    /// Finds the pieces that the map evaluated last puts the couplings on.
    fn find_pieces(&mut self, equations: &E, iterate: &Iterate<E>) {
        self.pieces.clear();
        self.pieces.extend(iterate.pulls.iter().map(|pull| pull.piece(equations.graphs())));
    }

    /// The Newton direction of the velocities for the law evaluated last and the modes found
    /// before; the impulses' part follows from the eliminations. `false` where there is none.
    ///
    /// Where the eliminations and the factorised system of a point before are still good, they are kept: what they ask for is found anew
    /// from the residuals here.
    fn set_direction(&mut self, equations: &E, matrix: f64, iterate: &Iterate<E>) -> bool {
        let Iterate { velocity, impulses, points, pulls, scratch, .. } = iterate;
        let gives_alike = self.gives_alike;
        let Self { step, pieces, eliminations, system, kept, .. } = self;
        let (at, graphs) = (EvaluatedPoint { velocity, points, scratch }, equations.graphs());
        let answer = |index: usize, coupling: &Coupling| {
            let alike;
            let mut rows = &coupling.rows;
            if E::MAY_BE_TIED && gives_alike && !rows.give_alike() {
                alike = rows.giving_alike();
                rows = &alike;
            }
            pulls[index].answer(pieces[index], LawRows { rows, graphs }, &impulses[index], matrix)
        };
        if kept.are_good && kept.compliance == matrix && kept.pieces == *pieces {
            let couplings = equations.couplings().iter().zip(&mut *eliminations);
            for (index, (coupling, elimination)) in couplings.enumerate() {
                let alike = (gives_alike && !coupling.rows.give_alike())
                    .then(|| coupling.rows.giving_alike());
                let of = LawRows { rows: alike.as_ref().unwrap_or(&coupling.rows), graphs };
                let Answer { offset, gain } = &mut elimination.answer;
                *offset = pulls[index].offset(pieces[index], of, &impulses[index], matrix, gain);
            }
            return equations.direction(scratch, eliminations, system, step);
        }
        kept.are_good = false;
        if equations.settings().keeps_factors {
            kept.pieces.clone_from(pieces);
            kept.compliance = matrix;
        }
        let answer =
            |index: usize, coupling: &Coupling, _: &Vector3<f64>| Some(answer(index, coupling));
        equations.linearise(at, answer, eliminations, system)
            && equations.direction(scratch, eliminations, system, step)
    }

    /// Halves the step until the residual falls enough; moves `iterate` there.
    fn search(
        &mut self,
        equations: &E,
        map: &NaturalMap,
        iterate: &mut Iterate<E>,
        merit: &MapResidual,
    ) -> Option<MapResidual> {
        let mut length = 1.0;
        while length >= equations.settings().shortest_step {
            self.try_step(iterate, length);
            let trial = evaluate(equations, map, &mut self.trial);
            if trial.squared < (1.0 - SUFFICIENT_DECREASE * length) * merit.squared {
                std::mem::swap(iterate, &mut self.trial);
                return Some(trial);
            }
            length *= 0.5;
        }
        None
    }

    /// The trial point `length` along the direction.
    fn try_step(&mut self, iterate: &Iterate<E>, length: f64) {
        let Self { trial, step, eliminations, .. } = self;
        trial.velocity.set_moved(&iterate.velocity, length, step);
        trial.impulses.clear();
        let moved = iterate
            .impulses
            .iter()
            .zip(&*eliminations)
            .map(|(impulse, contact)| impulse + length * contact.impulse_step(step));
        trial.impulses.extend(moved);
    }
}

/// Whether a step that made of a residual another one, at most a `part` of it, may be followed by one with the same factors.
fn keeps(equations: &impl Equations, before: f64, after: f64, part: f64) -> bool {
    equations.settings().keeps_factors && after <= part * before
}
