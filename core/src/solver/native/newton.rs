//! Semismooth Newton on the natural map of the contact law, with every contact eliminated.
//!
//! Equation numbers are those of `docs/native-solver.md` and, from J on, of `docs/joints.md`.

use super::coupling::Coupling;
use super::effort::Effort;
use super::equations::{Determined, Elimination, Equations, Point, Residual, Velocities, reserve};
use super::law::{Factored, NaturalMap, Piece, Pull};
use super::tolerances::{
    CLEAR, CORRECTIONS, DETERMINED_ITERATIONS, FAST_FACTORS, JUMPS, KEPT_FACTORS, LEFT_OPEN,
    NEWTON_ITERATIONS, ROLLING_CORRECTIONS, SETTLING, SHORTEST_STEP, SUFFICIENT_DECREASE,
    WHOLE_STEPS,
};
use nalgebra::Vector3;

/// Every coupling eliminated, and the piece that it is on.
pub(super) type Linearised<'a, E> = (&'a [Elimination<<E as Equations>::Slope>], &'a [Piece]);

/// A point of the iteration.
#[derive(Debug, Clone)]
pub(super) struct Iterate<E: Equations> {
    pub(super) velocity: E::Velocity,
    /// p̂ of every coupling, m/s, world.
    pub(super) impulses: Vec<Vector3<f64>>,
    /// u of every coupling (N2), kept from the last evaluation.
    points: Vec<Vector3<f64>>,
    /// The arguments of every coupling's projections, for the map evaluated last.
    pulls: Vec<Pull>,
    /// The residual of the equations of motion, which no map of the laws changes.
    motion: Residual,
    /// The map evaluated last, and the residual.
    map: NaturalMap,
    residual: Residual,
    /// ε D p̂_0 of every coupling, m/s, where the compliance acts on changes from impulses p̂_0
    /// (N13); empty otherwise.
    shifts: Vec<Vector3<f64>>,
    scratch: E::Scratch,
}

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
    pieces: Vec<Piece>,
    eliminations: Vec<Elimination<E::Slope>>,
    system: E::System,
    kept: Kept,
    /// Whether the compliance in the matrix is alike in all directions, also of contacts that can roll.
    gives_alike: bool,
}

/// Of which point the eliminations and the factorised system are.
#[derive(Debug, Clone, Default)]
struct Kept {
    /// The pieces there, and the compliance.
    pieces: Vec<Piece>,
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
            kept: Kept::default(),
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
        effort: &mut Effort<'_>,
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
        (mut merit, iterate): (Residual, &mut Iterate<E>),
        effort: &mut Effort<'_>,
    ) -> (bool, Residual) {
        let tolerances = equations.tolerances();
        // Without compliance the iteration is near a solution, and to stay there.
        let (mut whole_steps, mut jumps) =
            (WHOLE_STEPS, if map.compliance > 0.0 { JUMPS } else { 0 });
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
    /// Returns whether it converged.
    pub(super) fn solve_from_here(
        &mut self,
        equations: &E,
        map: &NaturalMap,
        until: Until,
        iterate: &mut Iterate<E>,
        effort: &mut Effort<'_>,
    ) -> bool {
        let compliance = map.compliance;
        iterate.keep_impulses(equations, map);
        self.trial.shifts.clear();
        self.trial.shifts.extend_from_slice(&iterate.shifts);
        let converged = self.solve(equations, map, (compliance, until), iterate, effort);
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

    /// The pieces that were found last.
    pub(super) fn pieces(&self) -> &[Piece] {
        &self.pieces
    }

    /// The system that was factorised last.
    pub(super) fn system(&mut self) -> &mut E::System {
        &mut self.system
    }

    /// Moves a solution of `law` to the limit of vanishing compliance (N9): the law without
    /// compliance, every contact on the piece that `law` puts it on, and the compliance in
    /// the matrix alone, which leaves the undetermined part of the impulses where it is.
    /// Returns the residual of the law without compliance. The iterate must have been evaluated.
    pub(super) fn take_limit(
        &mut self,
        equations: &E,
        map: &NaturalMap,
        iterate: &mut Iterate<E>,
        effort: &mut Effort<'_>,
    ) -> f64 {
        if iterate.map != *map {
            evaluate_again(equations, map, iterate);
        }
        self.find_pieces(equations, map, iterate);
        let merit = evaluate_again(equations, &NaturalMap::EXACT, iterate);
        // Any multiple of the compliance leaves the same part of the impulses where it is; the less of it, the more do these feel
        // of rounding, so that what settles would not come to rest.
        // That of the law itself, with which the matrix is factorised, goes first, where nothing gives more than it.
        let setting = equations.setting();
        let settles = setting.unsettled <= SETTLING;
        let part = if settles { 1.0 } else { equations.policy().limit_compliance };
        let first = if setting.all_give_alike { 1.0 } else { part };
        let matrix = (map.compliance * first, map.compliance * part);
        let most = if setting.all_give_alike { CORRECTIONS } else { ROLLING_CORRECTIONS };
        self.correct(equations, (matrix, limit(equations), most), (merit, iterate), effort)
    }

    /// Moves a point near a solution of the law without compliance there, where the pieces are those found last, with
    /// the compliance `matrix` in the Newton matrix, and the second one from where the first is slow, until a residual of
    /// `limit`, by so many corrections that leave more than a small part of it. Returns the residual.
    fn correct(
        &mut self,
        equations: &E,
        ((mut matrix, least), limit, mut left): ((f64, f64), f64, u32),
        (mut merit, iterate): (Residual, &mut Iterate<E>),
        effort: &mut Effort<'_>,
    ) -> f64 {
        let enough = self::limit(equations);
        while left > 0 {
            if merit.largest <= limit || !effort.spend() {
                break;
            }
            if !self.set_direction(equations, matrix, iterate) {
                break;
            }
            self.try_step(iterate, 1.0);
            let corrected = evaluate(equations, &NaturalMap::EXACT, &mut self.trial);
            let good = keeps(equations, merit.largest, corrected.largest, KEPT_FACTORS);
            let were_kept = std::mem::replace(&mut self.kept.are_good, good);
            let changes = matrix > least && !good;
            if changes {
                matrix = least;
            } else if !good {
                left -= 1;
            }
            if corrected.largest >= merit.largest {
                if (were_kept || changes) && merit.largest > enough {
                    continue;
                }
                break;
            }
            std::mem::swap(iterate, &mut self.trial);
            merit = corrected;
        }
        merit.largest
    }

    /// Solves the law without compliance, where nothing is to be selected, with the compliance `matrix` in the Newton matrix.
    /// `evaluated` tells that the iterate was, for that law. Returns the residual; infinite where something turns out to be to
    /// select.
    pub(super) fn solve_determined(
        &mut self,
        equations: &E,
        (evaluated, matrix, determined): (bool, f64, Determined),
        iterate: &mut Iterate<E>,
        effort: &mut Effort<'_>,
    ) -> f64 {
        // What rolls gives more across only for the rule's sake: in the matrix it would make this slow.
        self.gives_alike = true;
        let residual =
            self.find_determined(equations, (evaluated, matrix, determined), iterate, effort);
        self.gives_alike = false;
        residual
    }

    /// The same with the compliance as it is set.
    fn find_determined(
        &mut self,
        equations: &E,
        (evaluated, matrix, determined): (bool, f64, Determined),
        iterate: &mut Iterate<E>,
        effort: &mut Effort<'_>,
    ) -> f64 {
        let (map, mut until) = (NaturalMap::EXACT, Until::converged(equations));
        if determined == Determined::Maybe {
            until.iterations = DETERMINED_ITERATIONS;
        }
        let merit = match evaluated {
            true => iterate.residual,
            false => evaluate(equations, &map, iterate),
        };
        let (converged, merit) =
            self.go_on(equations, &map, (matrix, until), (merit, iterate), effort);
        if !converged {
            return f64::INFINITY;
        }
        self.find_pieces(equations, &map, iterate);
        // Kept factors gain a digit or two a step, where Newton's method doubles them: not the first below the limit.
        let limit = KEPT_FACTORS * limit(equations);
        // What a correction does not shrink by much is rounding.
        let by = ((matrix, matrix), limit, 1);
        let residual = self.correct(equations, by, (merit, iterate), effort);
        let is_selected =
            determined == Determined::Surely || self.is_selected(equations, matrix, iterate);
        if is_selected { residual } else { f64::INFINITY }
    }

    /// Whether the laws leave nothing of the impulses of `iterate`, a solution, open. With the response W of the rows that hold,
    ///
    /// ```text
    /// r ← (W + ε E)⁻¹ ε r,   r = p̂ at first,                                   (J16)
    /// ```
    ///
    /// the step from u = 0 to u = −ε r, leaves of r what W does not see, and of all else little. What is open, and would not be where
    /// others give way, has a say too: no row may be so near to another piece of its law.
    fn is_selected(&mut self, equations: &E, matrix: f64, iterate: &mut Iterate<E>) -> bool {
        let mut before = largest(&iterate.impulses);
        let clear = CLEAR * before;
        if !iterate.pulls.iter().all(|pull| pull.clearance(equations.graphs()) > clear) {
            return false;
        }
        let (enough, mut is_selected) = (LEFT_OPEN * before, false);
        self.trial.impulses.clone_from(&iterate.impulses);
        self.trial.points.clone_from(&iterate.points);
        loop {
            let Self { trial, .. } = &*self;
            let points = iterate.points.iter_mut().zip(&trial.points).zip(&trial.impulses);
            points.for_each(|((point, u), left)| *point = u + matrix * left);
            evaluate_again(equations, &NaturalMap::EXACT, iterate);
            // The factors are those of a point near it, as long as the pieces are the same.
            self.kept.are_good = true;
            if !self.set_direction(equations, matrix, iterate) {
                break;
            }
            let Self { trial, eliminations, step, .. } = &mut *self;
            trial.impulses.clear();
            trial.impulses.extend(eliminations.iter().map(|of| of.impulse_step(step)));
            let left = largest(&trial.impulses);
            is_selected = left <= enough;
            if is_selected || left > KEPT_FACTORS * before {
                break;
            }
            before = left;
        }
        iterate.points.clone_from(&self.trial.points);
        evaluate_again(equations, &NaturalMap::EXACT, iterate);
        is_selected
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
        let (at, graphs) = (Point { velocity, points, scratch }, equations.graphs());
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
                elimination.answer.offset = answer(index, coupling).offset;
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
        merit: &Residual,
    ) -> Option<Residual> {
        let mut length = 1.0;
        while length >= SHORTEST_STEP {
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

impl<E: Equations> Iterate<E> {
    pub(super) fn new() -> Self {
        Self {
            velocity: E::Velocity::empty(),
            impulses: Vec::new(),
            points: Vec::new(),
            pulls: Vec::new(),
            motion: Residual::default(),
            map: NaturalMap::EXACT,
            residual: Residual::default(),
            shifts: Vec::new(),
            scratch: E::Scratch::default(),
        }
    }

    pub(super) fn reserve(&mut self, contacts: usize) {
        reserve(&mut self.impulses, contacts);
        reserve(&mut self.points, contacts);
        reserve(&mut self.pulls, contacts);
        reserve(&mut self.shifts, contacts);
    }

    /// The largest speed of a row that an impulse holds, m/s; of the last residual's point.
    pub(super) fn held_speed(&self, equations: &E) -> f64 {
        self.pulls.iter().map(|pull| pull.held_speed(equations.graphs())).fold(0.0, f64::max)
    }

    /// How far every coupling is from the next piece of its law, m/s; of the last evaluation.
    pub(super) fn margins(&self, equations: &E) -> impl Iterator<Item = f64> {
        self.pulls.iter().map(|pull| pull.margin(equations.graphs()))
    }

    /// At least so many rows are held wherever they are, of the last evaluation.
    pub(super) fn stiff_rows(&self, equations: &E) -> usize {
        let rows = |pull: &Pull| pull.stiff_rows(&self.map, equations.graphs());
        self.pulls.iter().map(rows).sum()
    }

    /// The gain of coupling `index` on a piece in its factors, with ε = `compliance`; of the last evaluation.
    pub(super) fn factored(
        &self,
        equations: &E,
        (index, piece): (usize, Piece),
        compliance: f64,
    ) -> Factored {
        let of = (&equations.couplings()[index].rows, equations.graphs());
        self.pulls[index].factored(piece, of, compliance)
    }

    /// u of every coupling, m/s, of the last evaluation.
    pub(super) fn points(&self) -> &[Vector3<f64>] {
        &self.points
    }

    /// Evaluates u of every coupling.
    pub(super) fn evaluate_points(&mut self, equations: &E) {
        equations.set_points(&self.velocity, &mut self.scratch, &mut self.points);
    }

    /// Has the compliance of `map` act on changes from the impulses alone (N13), from here on.
    pub(super) fn keep_impulses(&mut self, equations: &E, map: &NaturalMap) {
        let contacts = self.impulses.iter().zip(equations.couplings());
        self.shifts.clear();
        self.shifts.extend(
            contacts.map(|(impulse, contact)| map.compliance * contact.rows.given(impulse)),
        );
    }

    /// Has it act on the impulses again, in what is evaluated from here on.
    pub(super) fn forget_impulses(&mut self) {
        self.shifts.clear();
    }

    pub(super) fn is_finite(&self) -> bool {
        let impulses = self.impulses.iter().flatten();
        self.velocity.is_finite() && impulses.into_iter().all(|number| number.is_finite())
    }

    pub(super) fn copy_from(&mut self, other: &Self) {
        self.velocity.copy_from(&other.velocity);
        self.impulses.clear();
        self.impulses.extend_from_slice(&other.impulses);
        self.points.clear();
        self.points.extend_from_slice(&other.points);
        self.pulls.clear();
        self.pulls.extend_from_slice(&other.pulls);
        self.motion = other.motion;
        self.map = other.map;
        self.residual = other.residual;
    }
}

/// The largest entry.
fn largest(impulses: &[Vector3<f64>]) -> f64 {
    impulses.iter().map(Vector3::amax).fold(0.0, f64::max)
}

/// Whether a step that made of a residual another one, at most a `part` of it, may be followed by one with the same factors.
fn keeps(equations: &impl Equations, before: f64, after: f64, part: f64) -> bool {
    equations.policy().keeps_factors && after <= part * before
}

/// The residual at which the limit of vanishing compliance is reached: to rounding where the
/// impulses are settling, because they may be kept for many steps.
fn limit(equations: &impl Equations) -> f64 {
    let tolerances = equations.tolerances();
    if equations.setting().unsettled <= SETTLING { tolerances.rounding } else { tolerances.exact }
}

/// The residual of the law without compliance, m/s.
pub(super) fn exact_residual<E: Equations>(equations: &E, iterate: &mut Iterate<E>) -> f64 {
    evaluate(equations, &NaturalMap::EXACT, iterate).largest
}

/// The equations of motion (N1) and the natural map (N4) at a point, all as velocities.
pub(super) fn evaluate<E: Equations>(
    equations: &E,
    map: &NaturalMap,
    iterate: &mut Iterate<E>,
) -> Residual {
    let Iterate { velocity, impulses, points, scratch, motion, shifts, .. } = &mut *iterate;
    *motion = equations.motion_residual(velocity, impulses, scratch);
    equations.set_points(velocity, scratch, points);
    for (u, shift) in points.iter_mut().zip(shifts) {
        *u -= *shift;
    }
    evaluate_again(equations, map, iterate)
}

/// The same for another law at the point that was evaluated last.
fn evaluate_again<E: Equations>(
    equations: &E,
    map: &NaturalMap,
    iterate: &mut Iterate<E>,
) -> Residual {
    let (mut size, graphs) = (iterate.motion, equations.graphs());
    iterate.map = *map;
    iterate.pulls.clear();
    let couplings = equations.couplings().iter().zip(&iterate.impulses).zip(&iterate.points);
    for ((coupling, impulse), u) in couplings {
        let (pull, missed) = coupling.evaluated((map, graphs), u, impulse);
        iterate.pulls.push(pull);
        size.add(&missed);
    }
    if !size.squared.is_finite() {
        // A maximum drops NaN; a sum does not.
        size.largest = f64::INFINITY;
    }
    iterate.residual = size;
    size
}
