//! Semismooth Newton on the natural map of the contact law, with every contact eliminated.
//!
//! Equation numbers are those of `docs/native-solver.md` and, from J on, of `docs/joints.md`.

mod iterate;
mod limit;

use super::coupling::Coupling;
use super::effort::SolveEffort;
use super::equations::{Elimination, Equations, EvaluatedPoint, MapResidual, Velocities, reserve};
use super::law::{Answer, MapPiece, NaturalMap};
use super::tolerances::{
    CROWD_JUMPS, CROWD_SHORTEST_STEP, FAST_FACTORS, JUMPS, KEPT_SLOPES, NEWTON_ITERATIONS,
    PROXIMAL_SHORTEST_STEP, SHORTEST_STEP, SUFFICIENT_DECREASE, WHOLE_STEPS,
};
use nalgebra::Vector3;

pub(super) use iterate::{Iterate, evaluate, evaluate_again, exact_residual};

/// Every coupling eliminated, and the piece that it is on.
pub(super) type Linearised<'a, E> = (&'a [Elimination<<E as Equations>::Slope>], &'a [MapPiece]);

/// When an iteration ends.
#[derive(Debug, Clone, Copy)]
pub(super) struct Until {
    /// After so many iterations,
    pub(super) iterations: u32,
    /// or where the residual of the law is at most this, m/s: it has converged.
    pub(super) residual: f64,
}

impl Until {
    /// It has converged as far as is asked of a solution with compliance.
    pub(super) fn converged(equations: &impl Equations) -> Self {
        Self { iterations: NEWTON_ITERATIONS, residual: equations.tolerances().newton }
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

    /// Solves `law` from `iterate`, with the compliance `matrix` in the Newton matrix: that
    /// of the law, or any where the law has none. Returns whether it converged.
    pub(super) fn solve(
        &mut self,
        equations: &E,
        map: &NaturalMap,
        (matrix, until): (f64, Until),
        iterate: &mut Iterate<E>,
        effort: &mut SolveEffort<'_>,
    ) -> bool {
        let merit = evaluate(equations, map, iterate);
        self.go_on(equations, map, (matrix, until), (merit, iterate), effort).0
    }

    /// The same from a point with the residual `merit`, which is returned of the last one.
    fn go_on(
        &mut self,
        equations: &E,
        map: &NaturalMap,
        (matrix, until): (f64, Until),
        (mut merit, iterate): (MapResidual, &mut Iterate<E>),
        effort: &mut SolveEffort<'_>,
    ) -> (bool, MapResidual) {
        let tolerances = equations.tolerances();
        // Without compliance the iteration is near a solution, and to stay there.
        let jumps = if in_crowd(equations) { CROWD_JUMPS } else { JUMPS };
        let (mut whole_steps, mut jumps) =
            (WHOLE_STEPS, if map.compliance > 0.0 { jumps } else { 0 });
        self.kept.are_good = false;
        for _ in 0..until.iterations {
            if merit.largest <= until.residual {
                return (true, merit);
            }
            if !effort.spend() {
                return (false, merit);
            }
            self.find_pieces(equations, map, iterate);
            if !self.set_direction(equations, matrix, iterate) {
                return (false, merit);
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
                return (false, merit);
            }
            self.kept.are_good = keeps(equations, before, merit.largest, FAST_FACTORS);
        }
        (merit.largest <= until.residual, merit)
    }

    /// Solves the law with a compliance that acts on changes from the impulses p̂_0 of `iterate`
    /// alone, from there:
    ///
    /// ```text
    /// û = u + ε D (p̂ − p̂_0)                                                   (N13)
    /// ```
    ///
    /// `evaluated` tells that the iterate was, for any law. Returns whether it converged.
    pub(super) fn solve_from_here(
        &mut self,
        equations: &E,
        map: &NaturalMap,
        (until, evaluated): (Until, bool),
        iterate: &mut Iterate<E>,
        effort: &mut SolveEffort<'_>,
    ) -> bool {
        let compliance = map.compliance;
        iterate.keep_impulses(equations, map);
        self.trial.shifts.clear();
        self.trial.shifts.extend_from_slice(&iterate.shifts);
        let merit = match evaluated {
            true => evaluate_again(equations, map, iterate),
            false => evaluate(equations, map, iterate),
        };
        let by = (compliance, until);
        let (converged, _) = self.go_on(equations, map, by, (merit, iterate), effort);
        iterate.forget_impulses();
        self.trial.forget_impulses();
        converged
    }

    /// Linearises `law`, which must be the one evaluated last, at `iterate` with the compliance `matrix`, and
    /// factorises the system of the velocities: what every coupling answers, and the piece that it is on. `None`
    /// where the system is singular.
    pub(super) fn linearise(
        &mut self,
        equations: &E,
        map: &NaturalMap,
        matrix: f64,
        iterate: &Iterate<E>,
    ) -> Option<Linearised<'_, E>> {
        self.find_pieces(equations, map, iterate);
        self.kept.are_good = false;
        let is_regular = self.set_direction(equations, matrix, iterate);
        is_regular.then_some((&self.eliminations, &self.pieces))
    }

    /// The same with what `answer` makes of every coupling in place of the law's answers; the pieces are the law's.
    pub(super) fn linearise_as(
        &mut self,
        equations: &E,
        map: &NaturalMap,
        answer: impl FnMut(usize, &Coupling, &Vector3<f64>) -> Option<Answer>,
        iterate: &Iterate<E>,
    ) -> Option<Linearised<'_, E>> {
        self.find_pieces(equations, map, iterate);
        self.kept.are_good = false;
        let Iterate { velocity, points, scratch, .. } = iterate;
        let at = EvaluatedPoint { velocity, points, scratch, slack: 0.0 };
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

    /// The pieces that `law`, which must be the one evaluated last, puts the contacts on.
    fn find_pieces(&mut self, equations: &E, map: &NaturalMap, iterate: &Iterate<E>) {
        self.pieces.clear();
        self.pieces.extend(iterate.pulls.iter().map(|pull| pull.piece(map, equations.graphs())));
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
        let keeps = in_crowd(equations) && !iterate.shifts.is_empty();
        let slack = if keeps { KEPT_SLOPES * matrix } else { 0.0 };
        let (at, graphs) =
            (EvaluatedPoint { velocity, points, scratch, slack }, equations.graphs());
        let answer = |index: usize, coupling: &Coupling| {
            let alike;
            let mut rows = &coupling.rows;
            if E::MAY_BE_TIED && gives_alike && !rows.give_alike() {
                alike = rows.giving_alike();
                rows = &alike;
            }
            pulls[index].answer(pieces[index], (rows, graphs), &impulses[index], matrix)
        };
        if kept.are_good && kept.compliance == matrix && kept.pieces == *pieces {
            let couplings = equations.couplings().iter().zip(&mut *eliminations);
            for (index, (coupling, elimination)) in couplings.enumerate() {
                let alike = (gives_alike && !coupling.rows.give_alike())
                    .then(|| coupling.rows.giving_alike());
                let of = (alike.as_ref().unwrap_or(&coupling.rows), graphs);
                let Answer { offset, gain } = &mut elimination.answer;
                *offset = pulls[index].offset(pieces[index], of, &impulses[index], (matrix, gain));
            }
            return equations.direction(scratch, eliminations, system, step);
        }
        kept.are_good = false;
        if equations.policy().keeps_factors {
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
        let shortest = match (in_crowd(equations), iterate.shifts.is_empty()) {
            (false, _) => SHORTEST_STEP,
            (true, true) => CROWD_SHORTEST_STEP,
            (true, false) => PROXIMAL_SHORTEST_STEP,
        };
        let mut length = 1.0;
        while length >= shortest {
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

/// Whether it is a crowd, of which what leads nowhere is given up sooner.
fn in_crowd<E: Equations>(equations: &E) -> bool {
    E::MAY_BE_TIED && equations.policy().follows(equations.couplings().len())
}

/// Whether a step that made of a residual another one, at most a `part` of it, may be followed by one with the same factors.
fn keeps(equations: &impl Equations, before: f64, after: f64, part: f64) -> bool {
    equations.policy().keeps_factors && after <= part * before
}
