//! From starts to a solution: Newton's method with compliance and its limit, from one start after
//! another.

use super::effort::SolveEffort;
use super::equations::{Equations, Velocities};
use super::interior_point::{GOOD_ENOUGH, InteriorPoint, TOLD_APART};
use super::law::{MapPiece, NaturalMap};
use super::newton::{Iterate, Newton, Until, exact_residual};
use super::policy::StartMethod;
use super::proximal::Proximal;
use super::starts;
use super::sweeps::sweep;
use super::tolerances::{
    COMPLIANCE, COMPLIANCES, DETERMINED, FIRST_PROXIMAL, FIRST_SWEEPS, FORESEEN, FOUND,
    LED_ITERATIONS, MANY_CONTACTS, MOVED, PROXIMAL_SHARPNESSES, SAME_ENERGY, SAME_SOLUTIONS,
    SETTLED, SHARPNESSES, SHORTEST_FACTOR, STANDING_ITERATIONS, STICK_MARGINS,
};
use nalgebra::Vector3;

/// Newton's method, the interior point, and where they stand.
#[derive(Debug, Clone)]
pub(super) struct Descent<E: Equations> {
    newton: Newton<E>,
    interior_point: InteriorPoint<E>,
    proximal: Proximal<E>,
    iterate: Iterate<E>,
    /// The best point of all starts, for a step that none of them solves.
    best: Iterate<E>,
    /// The best point of a start.
    best_of_descent: Iterate<E>,
    /// The last point of a path of compliance.
    last_of_path: Iterate<E>,
}

/// What a start or all starts came to.
#[derive(Debug, Clone, Copy)]
pub(super) struct DescentOutcome {
    pub(super) solved: bool,
    pub(super) start: StartMethod,
    /// Whether the law with compliance led to it, so that it is the solution of the selection rule.
    pub(super) selected: bool,
    /// Whether another start had failed before.
    pub(super) retried: bool,
    /// Whether it was [solved roughly](Known::roughly).
    pub(super) rough: bool,
}

/// What is known of a step before it is solved.
#[derive(Debug, Clone, Copy)]
pub(super) struct Known<'a> {
    /// The impulses p̂ of the last step, m/s, world.
    pub(super) previous: &'a [Vector3<f64>],
    /// Those found in this step for the contacts that were known before, nothing for others; `None` at first.
    pub(super) found: Option<&'a [Vector3<f64>]>,
    /// Whether a crowd whose forces change may be solved roughly, because contacts may still come to it.
    pub(super) roughly: bool,
}

/// How good the end of a start is: the least is best.
#[derive(Debug, Clone, Copy, PartialEq, PartialOrd)]
struct Rank {
    unsolved: bool,
    /// A solution that turns a body further in one step than its motion explains. (Of points that
    /// are none, the residual alone counts.)
    turns_too_far: bool,
    /// What a solution makes of energy in what joints tie, in parts of what it has; 0 where it is little.
    made: f64,
    /// Without compliance, m/s.
    residual: f64,
}

/// Where a start led.
#[derive(Debug, Clone, Copy)]
struct Reached {
    /// Without compliance, m/s.
    residual: f64,
    /// Whether the law with compliance was solved on the way, so that the point is the one
    /// of the selection rule.
    selected: bool,
}

impl<E: Equations> Descent<E> {
    pub(super) fn new() -> Self {
        Self {
            newton: Newton::new(),
            interior_point: InteriorPoint::new(),
            proximal: Proximal::new(),
            iterate: Iterate::new(),
            best: Iterate::new(),
            best_of_descent: Iterate::new(),
            last_of_path: Iterate::new(),
        }
    }

    /// Room for so many contacts, in all that any start needs.
    pub(super) fn reserve(&mut self, contacts: usize) {
        self.newton.reserve(contacts);
        self.interior_point.reserve(contacts);
        self.iterate.reserve(contacts);
        self.best.reserve(contacts);
        self.best_of_descent.reserve(contacts);
        self.last_of_path.reserve(contacts);
        self.proximal.reserve(contacts);
    }

    /// The velocities where the last solve ended.
    pub(super) fn velocity(&self) -> &E::Velocity {
        &self.iterate.velocity
    }

    /// p̂ of every coupling there, m/s, world.
    pub(super) fn impulses(&self) -> &[Vector3<f64>] {
        &self.iterate.impulses
    }

    /// u of every coupling there, m/s, world.
    pub(super) fn points(&self) -> &[Vector3<f64>] {
        self.iterate.points()
    }

    /// Of every coupling, the piece of the natural map with compliance that the last solve ended on, and
    /// how far the next one is, m/s.
    pub(super) fn pieces(&self, equations: &E) -> impl Iterator<Item = (MapPiece, f64)> {
        const MAP: NaturalMap = NaturalMap::with_compliance(COMPLIANCE);
        let couplings = equations.couplings().iter().zip(self.impulses()).zip(self.points());
        couplings.map(|((coupling, impulse), u)| {
            let pull = coupling.pull(&MAP, u, impulse);
            (pull.piece(&MAP, equations.graphs()), pull.margin(equations.graphs()))
        })
    }

    /// Tries one start after another until one leads to a solution; otherwise leaves the best point found.
    /// `accepted` is the residual of a point that is no failure, m/s.
    ///
    /// A solution that the law with compliance did not select, or one that turns a body
    /// too far in one step or makes energy in what joints tie, is kept, and another one preferred to it, as long as there are
    /// starts other than the scattered ones.
    pub(super) fn solve(
        &mut self,
        equations: &mut E,
        known: Known<'_>,
        accepted: f64,
        effort: &mut SolveEffort<'_>,
    ) -> DescentOutcome {
        let (previous, strict) = (known.previous, *equations.tolerances());
        let nothing = Rank {
            unsolved: true,
            turns_too_far: true,
            made: f64::INFINITY,
            residual: f64::INFINITY,
        };
        let mut best = (nothing, StartMethod::Previous, false);
        let takes_any = equations.policy().takes_any;
        let rolls = !equations.setting().all_give_alike;
        let asked = self.asked(equations, known);
        let (mut most, mut tried, mut same) = (equations.policy().first_effort, 0, 0);
        'efforts: loop {
            for start in starts::all(equations.policy(), previous.len(), rolls, asked) {
                let rough =
                    known.roughly && matches!(start, StartMethod::Moved | StartMethod::Found);
                let tolerances = if rough { strict.roughly() } else { strict };
                if known.roughly {
                    equations.setting_mut().tolerances = tolerances;
                }
                if start == StartMethod::Alike {
                    equations.setting_mut().give_alike();
                }
                let equations = &*equations;
                let enough = best.0.residual <= tolerances.sufficient;
                if (enough || most < u32::MAX) && matches!(start, StartMethod::Scattered(_)) {
                    break;
                }
                effort.begin_start(most);
                match (start, known.found) {
                    (StartMethod::Found | StartMethod::Led, Some(found)) => {
                        self.start(equations, found, start, effort)
                    }
                    _ => self.start(equations, previous, start, effort),
                }
                let repeated =
                    if start == StartMethod::Previous { self.repeat(equations) } else { None };
                let evaluated = start == StartMethod::Previous
                    && repeated.is_none()
                    && self.go_ahead(equations);
                let reached = match repeated {
                    Some(residual) => Reached { residual, selected: true },
                    None => match start {
                        StartMethod::Kept => self.keep(equations, &[(FIRST_PROXIMAL, 1.0)], effort),
                        StartMethod::Moved => self.keep(equations, &MOVED, effort),
                        StartMethod::Found => self.keep(equations, &FOUND, effort),
                        StartMethod::Led => self.lead(equations, LED_ITERATIONS, effort),
                        StartMethod::Structure => self.stand(equations, effort),
                        StartMethod::Best(compliance) => {
                            self.keep(equations, &[(compliance, 1.0)], effort)
                        }
                        _ => self.descend(equations, evaluated, effort),
                    },
                };
                let unsolved = reached.residual > tolerances.solved;
                let rank = Rank {
                    unsolved,
                    turns_too_far: !unsolved && equations.turns_too_far(&self.iterate.velocity),
                    made: match unsolved {
                        true => 0.0,
                        false => {
                            let Iterate { velocity, impulses, .. } = &self.iterate;
                            equations.energy_made(velocity, impulses, self.iterate.points())
                        }
                    },
                    residual: reached.residual,
                };
                let fits = reached.selected || takes_any;
                let selected = reached.selected && start.is_by_rule();
                if !rank.unsolved && fits && !rank.turns_too_far && rank.made == 0.0 {
                    if repeated.is_none() && !rough {
                        self.settle(equations, reached.residual);
                    }
                    return DescentOutcome {
                        solved: true,
                        start,
                        selected,
                        retried: tried > 0,
                        rough,
                    };
                }
                let apart = (rank.made - best.0.made).abs();
                let is_same = rank.made > 0.0 && apart <= SAME_ENERGY * rank.made;
                same += u32::from(is_same);
                if tried == 0 || rank < best.0 {
                    same = if is_same { same } else { 0 };
                    best = (rank, start, selected);
                    self.best.copy_from(&self.iterate);
                }
                tried += 1;
                if same == SAME_SOLUTIONS || effort.is_used_up() {
                    break 'efforts;
                }
            }
            if most == u32::MAX {
                break;
            }
            most = u32::MAX;
        }
        self.iterate.copy_from(&self.best);
        if !self.iterate.is_finite() {
            // Only where the step's own numbers overflow: free flight is at least finite.
            self.start(equations, previous, StartMethod::Zero, effort);
            self.iterate.evaluate_points(equations);
        }
        let solved = best.0.residual <= accepted;
        let (_, start, selected) = best;
        DescentOutcome {
            solved,
            start,
            selected,
            retried: start != StartMethod::Previous,
            rough: false,
        }
    }

    /// The starts that what is `known` of a crowd asks for before others. What was found for it before is gone on from, and
    /// where that fails the last impulses. Where nothing pressed in the last step, as in the first one, a
    /// structure begins with an interior point, and a vast one keeps what that came to in the step after. Where
    /// impulses change and do not nearly obey this step, the last ones are gone on from by large steps.
    fn asked(&mut self, equations: &E, known: Known<'_>) -> [Option<StartMethod>; 3] {
        let (contacts, policy) = (known.previous.len(), equations.policy());
        if !policy.follows(contacts) {
            return [None; 3];
        }
        if known.found.is_some() {
            let leads = !known.roughly && policy.leads(contacts);
            return [
                leads.then_some(StartMethod::Led),
                Some(StartMethod::Found),
                Some(StartMethod::Moved),
            ];
        }
        let vast = policy.is_vast(contacts);
        if known.previous.iter().all(|impulse| *impulse == Vector3::zeros()) {
            let structure = policy.is_structure(contacts);
            return [structure.then_some(StartMethod::Structure), None, None];
        }
        let iterate = &mut self.iterate;
        iterate.impulses.clear();
        iterate.impulses.extend_from_slice(known.previous);
        equations.set_first_velocity(known.previous, &mut iterate.velocity);
        let setting = equations.setting();
        let (changes, is_settled) = (setting.changes(), setting.unsettled <= SETTLED);
        if !changes && (is_settled || !vast) {
            return [None; 3];
        }
        let is_far = self.residual(equations) > equations.tolerances().near;
        let start = match is_far {
            true => changes.then_some(StartMethod::Moved),
            false => vast.then_some(StartMethod::Kept),
        };
        [start, None, None]
    }

    /// Whether the last step's impulses are this step's as they are: they did not change from
    /// the step before the last one to the last, so that Newton's method with compliance has
    /// nothing left to select between them, and they obey the law without compliance to
    /// rounding. A residual alone does not say so: it hardly feels the shares that the law
    /// leaves open.
    ///
    /// Where it is so, the residual, m/s, and the iterate keeps the velocities that the impulses
    /// leave as they were, to the last bit: rounding in the sum of the impulses would add up from step to step, until
    /// the face of a body at rest is warped by it.
    fn repeat(&mut self, equations: &E) -> Option<f64> {
        if equations.setting().unsettled > SETTLED {
            return None;
        }
        let tolerances = *equations.tolerances();
        equations.keep_velocity(&mut self.iterate.velocity);
        let residual = self.residual(equations);
        let sinking = self.iterate.held_speed(equations);
        let (enough, still) = equations.policy().repeats(&tolerances);
        if residual <= enough && sinking <= still {
            return Some(residual);
        }
        equations.set_first_velocity(&self.iterate.impulses, &mut self.iterate.velocity);
        None
    }

    /// Goes to where the last two steps lead, if that is nearer to a solution: surely where it misses the laws by little
    /// against the way there. Whether the iterate is one that was evaluated.
    fn go_ahead(&mut self, equations: &E) -> bool {
        let ahead = &mut self.last_of_path;
        let Some(way) = equations.set_foreseen(&mut ahead.velocity, &mut ahead.impulses) else {
            return false;
        };
        let missed = exact_residual(equations, ahead);
        if missed <= FORESEEN * way || missed < exact_residual(equations, &mut self.iterate) {
            std::mem::swap(&mut self.iterate, &mut self.last_of_path);
        }
        true
    }

    /// Keeps what is at rest at rest, where that is the [policy](super::policy::Policy::settles).
    fn settle(&mut self, equations: &E, residual: f64) {
        if !equations.policy().settles {
            return;
        }
        self.best.velocity.copy_from(&self.iterate.velocity);
        equations.keep_velocity(&mut self.iterate.velocity);
        if self.iterate.velocity == self.best.velocity {
            return;
        }
        if self.residual(equations) > residual.max(equations.tolerances().solved) {
            self.iterate.velocity.copy_from(&self.best.velocity);
            self.residual(equations);
        }
    }

    /// The residual of the law without compliance at the iterate, m/s.
    fn residual(&mut self, equations: &E) -> f64 {
        exact_residual(equations, &mut self.iterate)
    }

    /// Sets the iterate to a start; `previous` are the impulses that it may go on from.
    fn start(
        &mut self,
        equations: &E,
        previous: &[Vector3<f64>],
        start: StartMethod,
        effort: &mut SolveEffort<'_>,
    ) {
        let couplings = equations.couplings();
        let Self { interior_point, iterate, best, .. } = self;
        iterate.impulses.clear();
        match start {
            StartMethod::Previous
            | StartMethod::Alike
            | StartMethod::Kept
            | StartMethod::Moved
            | StartMethod::Found
            | StartMethod::Led => iterate.impulses.extend_from_slice(previous),
            StartMethod::Zero | StartMethod::Compliant(_) | StartMethod::Swept(_) => {
                iterate.impulses.extend(couplings.iter().map(|_| Vector3::zeros()));
            }
            StartMethod::InteriorPoint(scale) => {
                let by = (scale, GOOD_ENOUGH);
                return interior_point.solve(equations, by, iterate, effort);
            }
            StartMethod::Structure => {
                let by = (equations.bodies() as f64, TOLD_APART);
                return interior_point.solve(equations, by, iterate, effort);
            }
            StartMethod::Best(_) => return iterate.copy_from(best),
            StartMethod::Scattered(number) => {
                let (speed, impulses) = (equations.speed(), &mut iterate.impulses);
                starts::scatter(number, couplings, speed, impulses);
            }
        }
        match start {
            StartMethod::Previous
            | StartMethod::Alike
            | StartMethod::Kept
            | StartMethod::Moved
            | StartMethod::Found
            | StartMethod::Led => {
                equations.set_first_velocity(&iterate.impulses, &mut iterate.velocity)
            }
            _ => equations.set_velocity_after(&iterate.impulses, &mut iterate.velocity),
        }
        match start {
            StartMethod::Previous if is_restless(equations, iterate) => {
                sweep(equations, FIRST_SWEEPS, iterate, effort);
            }
            StartMethod::Compliant(factor) => self.follow(equations, factor, effort),
            StartMethod::Swept(number) => sweep(equations, number, iterate, effort),
            _ => {}
        }
    }

    /// Follows the solutions of less and less compliance from [`SOFTEST`](starts::SOFTEST) on, by
    /// `factor` from one to the next, in smaller steps where Newton's method does not follow. Where
    /// the path ends before the compliance is small, it is taken out from there by acting on
    /// changes alone.
    fn follow(&mut self, equations: &E, factor: f64, effort: &mut SolveEffort<'_>) {
        let Self { newton, iterate, last_of_path: last, .. } = self;
        let (mut compliance, mut factor) = (starts::SOFTEST, factor);
        let mut solve =
            |compliance: f64, iterate: &mut Iterate<E>, effort: &mut SolveEffort<'_>| {
                let (map, until) =
                    (NaturalMap::with_compliance(compliance), Until::converged(equations));
                newton.solve(equations, &map, (compliance, until), iterate, effort)
            };
        if !solve(compliance, iterate, effort) {
            return;
        }
        while compliance > COMPLIANCE {
            last.copy_from(iterate);
            let next = compliance * factor;
            if solve(next, iterate, effort) {
                compliance = next;
                continue;
            }
            iterate.copy_from(last);
            factor = factor.sqrt();
            if factor > SHORTEST_FACTOR || effort.is_over() {
                self.take_out(equations, (compliance, 1.0), effort);
                return;
            }
        }
    }

    /// Takes the compliance out by acting on changes alone, from a first ε on and with a scaling of
    /// the natural map. Returns the residual.
    fn take_out(&mut self, equations: &E, by: (f64, f64), effort: &mut SolveEffort<'_>) -> f64 {
        let Self { proximal, newton, iterate, .. } = self;
        proximal.solve(equations, by, newton, iterate, effort)
    }

    /// Newton with compliance, then its limit; with less and less compliance where the
    /// limit is not in reach. `evaluated` tells that the iterate was.
    fn descend(&mut self, equations: &E, evaluated: bool, effort: &mut SolveEffort<'_>) -> Reached {
        let tolerances = *equations.tolerances();
        let mut reached = Reached { residual: f64::INFINITY, selected: false };
        let mut least = f64::INFINITY;
        if let Some(determined) = equations.determined() {
            let Self { newton, iterate, last_of_path: start, .. } = &mut *self;
            start.velocity.copy_from(&iterate.velocity);
            start.impulses.clone_from(&iterate.impulses);
            let known = (evaluated, DETERMINED, determined);
            let residual = newton.solve_determined(equations, known, iterate, effort);
            if residual <= tolerances.solved {
                return Reached { residual, selected: true };
            }
            iterate.velocity.copy_from(&start.velocity);
            iterate.impulses.clone_from(&start.impulses);
        }
        for compliance in COMPLIANCES {
            let map = NaturalMap::with_compliance(compliance);
            let Self { newton, iterate, .. } = &mut *self;
            let by = (compliance, Until::converged(equations));
            let converged = newton.solve(equations, &map, by, iterate, effort);
            reached.selected |= converged;
            if converged {
                reached.residual = newton.take_limit(equations, &map, iterate, effort);
            } else {
                reached.residual = exact_residual(equations, iterate);
                if reached.residual > tolerances.near {
                    break;
                }
            }
            if reached.residual > tolerances.solved {
                reached.residual = self.polish(equations, compliance, effort);
            }
            if equations.policy().keeps_best && reached.residual < least {
                least = reached.residual;
                self.best_of_descent.copy_from(&self.iterate);
            }
            if reached.residual <= tolerances.solved || effort.is_over() {
                break;
            }
        }
        if least < reached.residual {
            self.iterate.copy_from(&self.best_of_descent);
            reached.residual = least;
        }
        reached
    }

    /// Newton's method with compliance from where the iterate is, and its limit: once, because what does not lead there at
    /// once has other ways.
    fn lead(&mut self, equations: &E, iterations: u32, effort: &mut SolveEffort<'_>) -> Reached {
        let map = NaturalMap::with_compliance(COMPLIANCE);
        let until = Until { iterations, ..Until::converged(equations) };
        let Self { newton, iterate, .. } = self;
        let selected = newton.solve(equations, &map, (COMPLIANCE, until), iterate, effort);
        let residual = match selected {
            true => newton.take_limit(equations, &map, iterate, effort),
            false => exact_residual(equations, iterate),
        };
        Reached { residual, selected }
    }

    /// The same in a few iterations from where an interior point of a structure ended; where that leads nowhere, compliance on changes from there.
    fn stand(&mut self, equations: &E, effort: &mut SolveEffort<'_>) -> Reached {
        self.last_of_path.copy_from(&self.iterate);
        let reached = self.lead(equations, STANDING_ITERATIONS, effort);
        if reached.selected && reached.residual <= equations.tolerances().solved {
            return reached;
        }
        self.iterate.copy_from(&self.last_of_path);
        self.keep(equations, &[(FIRST_PROXIMAL, 1.0)], effort)
    }

    /// Solves the law without compliance from where the iterate is: as it is, or by compliance on
    /// changes from there alone, in one of these ways after another. What is found so is near, and is taken although the law with
    /// compliance did not select it.
    fn keep(
        &mut self,
        equations: &E,
        ways: &[(f64, f64)],
        effort: &mut SolveEffort<'_>,
    ) -> Reached {
        let mut residual = f64::INFINITY;
        for &way in ways {
            residual = self.take_out(equations, way, effort);
            if residual <= equations.tolerances().solved || effort.is_over() {
                break;
            }
        }
        Reached { residual, selected: true }
    }

    /// Solves the law without compliance from a point near a solution, in every way there
    /// is. Returns its residual.
    fn polish(&mut self, equations: &E, compliance: f64, effort: &mut SolveEffort<'_>) -> f64 {
        let solved = equations.tolerances().solved;
        let takes_out_first = equations.policy().takes_out_first;
        if takes_out_first {
            let residual = self.take_out_sharply(equations, effort);
            if residual <= solved || effort.is_over() {
                return residual;
            }
        }
        let Self { newton, iterate, .. } = self;
        for sharpness in SHARPNESSES {
            let map = NaturalMap { sharpness, ..NaturalMap::EXACT };
            let by = (compliance, Until::converged(equations));
            newton.solve(equations, &map, by, iterate, effort);
            let residual = exact_residual(equations, iterate);
            if residual <= solved {
                return residual;
            }
        }
        let mut residual = f64::INFINITY;
        for stick_margin in STICK_MARGINS {
            let map = NaturalMap { stick_margin, ..NaturalMap::with_compliance(compliance) };
            residual = newton.take_limit(equations, &map, iterate, effort);
            if residual <= solved {
                return residual;
            }
        }
        if takes_out_first { residual } else { self.take_out_sharply(equations, effort) }
    }

    /// Takes the compliance out by acting on changes alone, with one scaling of the natural map
    /// after another. Returns the residual.
    fn take_out_sharply(&mut self, equations: &E, effort: &mut SolveEffort<'_>) -> f64 {
        let mut residual = f64::INFINITY;
        for sharpness in PROXIMAL_SHARPNESSES {
            residual = self.take_out(equations, (FIRST_PROXIMAL, sharpness), effort);
            if residual <= equations.tolerances().solved || effort.is_over() {
                break;
            }
        }
        residual
    }
}

/// Whether forces change hands among the many contacts of one body, as on a rim that rolls, so that
/// those of the last step are far from a solution: sweeps find which contacts press, where Newton's
/// method would have to guess. (Among several bodies they are too slow to help.)
fn is_restless<E: Equations>(equations: &E, iterate: &mut Iterate<E>) -> bool {
    let many = equations.couplings().len() >= MANY_CONTACTS;
    equations.policy().sweeps_first
        && many
        && equations.setting().unsettled > SETTLED
        && exact_residual(equations, iterate) > equations.tolerances().near
}
