//! Stages of an island's solution, in order, and the loop over them.
//!
//! 1. Newton's method from the last impulses, unless these are already the solution (`previous`);
//! 2. the proximal point method from the last impulses (`proximal point`; for one body at the end);
//! 3. Newton's method from zero impulses (`zero`);
//! 4. an interior point method from several centres, then Newton's method (`interior point`);
//! 5. with joints, the method of multipliers from zero impulses (`multipliers`), without contacts before 4;
//! 6. the proximal point method from the best point so far (`best point`).
//!
//! The first stage that leads to a solution ends the loop. Equation numbers refer to
//! `docs/native-solver.md`.

use super::coupling::Coupling;
use super::effort::SolveEffort;
use super::equations::{Equations, Velocities};
use super::interior_point::InteriorPoint;
use super::law::{MapPiece, NaturalMap};
use super::newton::{Iterate, Newton, NewtonRun, exact_residual};
use super::proximal::Proximal;
use super::settings::{
    CENTRES, CHANGING, COMPLIANCE, EXTRAPOLATION, POLISHING_COMPLIANCE, PROXIMAL_COMPLIANCE,
    ROLLING_STAGES, SAME_GAIN, SAME_SOLUTIONS, SETTLED, Settings,
};
use nalgebra::Vector3;

/// Names of the stages in reports: all values of
/// [`StepReport::start`](crate::step::StepReport::start) for the native solver.
pub const STARTS: [&str; 7] = [
    "previous",
    "proximal point",
    "zero",
    "interior point",
    "best point",
    "equal compliance",
    "multipliers",
];

/// Method and its initial point.
#[derive(Debug, Clone, Copy, PartialEq)]
enum Stage {
    /// Newton's method from the last impulses. Solves more than 99.9 % of the steps of one body.
    Previous,
    /// Proximal point method from the last impulses.
    Proximal,
    /// Newton's method from zero impulses.
    Zero,
    /// Interior point method from impulses of this multiple of the momentum, then Newton's method.
    /// Finds jams, where one point takes all momentum.
    InteriorPoint(f64),
    /// Proximal point method from the best point of the earlier stages.
    Best,
    /// Method of multipliers from zero impulses, then Newton's method.
    Multipliers,
}

/// Stage with its compliance.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct StageRun {
    stage: Stage,
    /// True if rolling contacts have isotropic compliance (N6).
    equal_compliance: bool,
}

impl StageRun {
    /// Newton's method from the last impulses.
    pub(super) const PREVIOUS: Self = Self { stage: Stage::Previous, equal_compliance: false };

    /// Newton's method from zero impulses.
    pub(super) const ZERO: Self = Self { stage: Stage::Zero, equal_compliance: false };

    /// Name in reports.
    pub(super) fn name(self) -> &'static str {
        STARTS[match self.stage {
            _ if self.equal_compliance => 5,
            Stage::Previous => 0,
            Stage::Proximal => 1,
            Stage::Zero => 2,
            Stage::InteriorPoint(_) => 3,
            Stage::Best => 4,
            Stage::Multipliers => 6,
        }]
    }

    /// True if compliance in all impulses selects its solution (N6), not compliance in their
    /// changes (N13).
    fn selects(self) -> bool {
        !matches!(self.stage, Stage::Proximal | Stage::Best | Stage::Multipliers)
    }
}

/// All stages in order, with `first` before the others. With rolling contacts the first few stages
/// run with their larger compliance, then all stages with isotropic compliance.
fn runs(
    settings: &Settings,
    first: Option<Stage>,
    can_roll: bool,
    has_contacts: bool,
) -> impl Iterator<Item = StageRun> {
    let (second, last) = if settings.proximal_stage {
        (Some(Stage::Proximal), None)
    } else {
        (None, Some(Stage::Proximal))
    };
    let multipliers = settings.has_multipliers.then_some(Stage::Multipliers);
    // Without contacts they solve a convex problem. Otherwise they seldom lead to a solution.
    let (early, late) = if has_contacts { (None, multipliers) } else { (multipliers, None) };
    let rest = [Some(Stage::Previous), second, Some(Stage::Zero), early];
    let rest = rest.into_iter().flatten();
    // Joint rows have no interior, so that all centres lead to the same point.
    let centres = CENTRES.into_iter().take(if has_contacts { CENTRES.len() } else { 1 });
    let rest = rest.chain(centres.map(Stage::InteriorPoint)).chain(late);
    let rest = rest.chain([Stage::Best]).chain(last);
    let all = first.into_iter().chain(rest.filter(move |stage| first != Some(*stage)));
    let rolling = all.clone().take(if can_roll { ROLLING_STAGES } else { 0 });
    let rolling = rolling.map(|stage| StageRun { stage, equal_compliance: false });
    rolling.chain(all.map(move |stage| StageRun { stage, equal_compliance: can_roll }))
}

/// Result of all stages.
#[derive(Debug, Clone, Copy)]
pub(super) struct StageOutcome {
    pub(super) solved: bool,
    pub(super) run: StageRun,
    /// True if found by the law with compliance: it is the solution of the selection rule.
    pub(super) selected: bool,
    /// True if another stage failed before.
    pub(super) retried: bool,
}

impl StageOutcome {
    /// Result without a solution.
    pub(super) const UNSOLVED: Self =
        Self { solved: false, run: StageRun::PREVIOUS, selected: false, retried: false };
}

/// Quality of a stage's end point. Smaller is better.
#[derive(Debug, Clone, Copy, PartialEq, PartialOrd)]
struct Rank {
    unsolved: bool,
    /// True if the solution rotates a body further than its initial motion explains.
    turns_too_far: bool,
    /// Relative energy gain of a solution, or 0 if small.
    gain: f64,
    /// Residual of the law without compliance (m/s).
    residual: f64,
}

#[derive(Debug, Clone, Copy)]
struct StageEnd {
    /// Residual of the law without compliance (m/s).
    residual: f64,
    /// True if the point is acceptable: the law with compliance was solved on the way, or the
    /// change from a known point is small.
    selected: bool,
}

/// Methods of the stages and their memory.
#[derive(Debug, Clone)]
pub(super) struct StageSolver<E: Equations> {
    newton: Newton<E>,
    interior_point: InteriorPoint<E>,
    proximal: Proximal<E>,
    iterate: Iterate<E>,
    /// Best end point of a stage.
    best: Iterate<E>,
    /// Point to compare with or to return to.
    other: Iterate<E>,
}

impl<E: Equations> StageSolver<E> {
    pub(super) fn new() -> Self {
        Self {
            newton: Newton::new(),
            interior_point: InteriorPoint::new(),
            proximal: Proximal::new(),
            iterate: Iterate::new(),
            best: Iterate::new(),
            other: Iterate::new(),
        }
    }

    /// Reserves memory for `couplings` couplings in all stages.
    pub(super) fn reserve(&mut self, couplings: usize) {
        self.newton.reserve(couplings);
        self.interior_point.reserve(couplings);
        self.proximal.reserve(couplings);
        self.iterate.reserve(couplings);
        self.best.reserve(couplings);
        self.other.reserve(couplings);
    }

    /// V of the last solution.
    pub(super) fn velocity(&self) -> &E::Velocity {
        &self.iterate.velocity
    }

    /// p̂ of every coupling in the last solution (m/s, world).
    pub(super) fn impulses(&self) -> &[Vector3<f64>] {
        &self.iterate.impulses
    }

    /// u of every coupling in the last solution (m/s, world).
    pub(super) fn points(&self) -> &[Vector3<f64>] {
        self.iterate.points()
    }

    /// Piece of the natural map with compliance and distance to the next piece (m/s), for each contact
    /// and joint coupling of the last solution.
    pub(super) fn pieces(&self, equations: &E) -> impl Iterator<Item = (MapPiece, f64)> {
        const MAP: NaturalMap = NaturalMap::with_compliance(COMPLIANCE);
        let couplings = equations.couplings().iter().zip(self.impulses()).zip(self.points());
        couplings.map(|((coupling, impulse), u)| {
            let graphs = equations.graphs();
            let (projection, _) = coupling.evaluated(&MAP, graphs, &[], u, impulse);
            (projection.piece(graphs), projection.margin(graphs))
        })
    }

    /// Runs the stages until one leads to a solution. Otherwise leaves the best point found.
    ///
    /// `previous` are p̂ of the last step (m/s, world). `accepted` is the largest residual that is
    /// not a failure (m/s).
    ///
    /// Some solutions are only kept as a fallback: those not selected by the law with compliance,
    /// and those that rotate a body too far or gain energy from nothing.
    pub(super) fn solve(
        &mut self,
        equations: &mut E,
        previous: &[Vector3<f64>],
        accepted: f64,
        effort: &mut SolveEffort<'_>,
    ) -> StageOutcome {
        let settings = equations.settings();
        let first = first_stage(equations, previous);
        let can_roll = !equations.setting().all_isotropic;
        let mut best: Option<(Rank, StageRun, bool)> = None;
        let mut same_solutions = 0;
        let has_contacts = equations.couplings().iter().any(Coupling::is_contact);
        for run in runs(settings, first, can_roll, has_contacts) {
            if run.equal_compliance {
                equations.setting_mut().make_isotropic();
            }
            effort.begin_stage();
            let end = self.run(equations, run.stage, previous, effort);
            let rank = self.rank(equations, end.residual);
            let selected = end.selected && run.selects();
            // A sound solution ends the search. Others are ranked.
            let is_sound = !rank.unsolved && !rank.turns_too_far && rank.gain == 0.0;
            if is_sound && (end.selected || settings.takes_any) {
                return StageOutcome { solved: true, run, selected, retried: best.is_some() };
            }
            // Stages that end with one gain have one solution. After a few of them it is taken.
            let gains_as = |best: &Rank| (rank.gain - best.gain).abs() <= SAME_GAIN * rank.gain;
            let is_same = rank.gain > 0.0 && best.is_some_and(|(best, ..)| gains_as(&best));
            same_solutions += u32::from(is_same);
            if best.is_none_or(|(best, ..)| rank < best) {
                same_solutions = if is_same { same_solutions } else { 0 };
                best = Some((rank, run, selected));
                self.best.copy_from(&self.iterate);
            }
            if same_solutions == SAME_SOLUTIONS || effort.is_last_stage() {
                break;
            }
        }
        self.iterate.copy_from(&self.best);
        if !self.iterate.is_finite() {
            // Occurs only if the step's data overflow. Free flight is finite at least.
            self.begin_from_zero(equations);
            self.iterate.evaluate_points(equations);
        }
        let Some((rank, run, selected)) = best else { return StageOutcome::UNSOLVED };
        let solved = !rank.unsolved || rank.residual <= accepted;
        StageOutcome { solved, run, selected, retried: run != StageRun::PREVIOUS }
    }

    fn run(
        &mut self,
        equations: &E,
        stage: Stage,
        previous: &[Vector3<f64>],
        effort: &mut SolveEffort<'_>,
    ) -> StageEnd {
        match stage {
            Stage::Previous => {
                self.begin_from(equations, previous);
                // Accept: the last impulses are the solution. Otherwise Newton's method from them.
                if let Some(residual) = self.repeat(equations) {
                    return StageEnd { residual, selected: true };
                }
                let is_evaluated = self.extrapolate(equations);
                self.descend(equations, is_evaluated, effort)
            }
            Stage::Proximal => {
                self.begin_from(equations, previous);
                let Settings { first_compliance, tangential_factor, .. } = *equations.settings();
                let map = NaturalMap { compliance: first_compliance, tangential_factor };
                self.change_little(equations, map, effort)
            }
            Stage::Zero => {
                self.begin_from_zero(equations);
                self.descend(equations, false, effort)
            }
            Stage::InteriorPoint(centre) => {
                let Self { interior_point, iterate, .. } = self;
                interior_point.solve(equations, centre, iterate, effort);
                self.descend(equations, false, effort)
            }
            Stage::Multipliers => {
                self.begin_from_zero(equations);
                let Self { newton, iterate, other, .. } = self;
                // Multipliers lead near a solution, and the proximal point method continues.
                let residual = newton.solve_by_multipliers(equations, other, iterate, effort);
                if residual > equations.tolerances().near {
                    return StageEnd { residual, selected: true };
                }
                let map = NaturalMap::with_compliance(PROXIMAL_COMPLIANCE);
                self.change_little(equations, map, effort)
            }
            Stage::Best => {
                self.iterate.copy_from(&self.best);
                let map = NaturalMap::with_compliance(PROXIMAL_COMPLIANCE);
                self.change_little(equations, map, effort)
            }
        }
    }

    /// Sets the iterate to the impulses of the last step.
    fn begin_from(&mut self, equations: &E, impulses: &[Vector3<f64>]) {
        let Iterate { impulses: start, velocity, .. } = &mut self.iterate;
        start.clear();
        start.extend_from_slice(impulses);
        equations.set_first_velocity(impulses, velocity);
    }

    /// Sets the iterate to zero impulses.
    fn begin_from_zero(&mut self, equations: &E) {
        let Iterate { impulses, velocity, .. } = &mut self.iterate;
        impulses.clear();
        impulses.resize(equations.couplings().len(), Vector3::zeros());
        equations.set_velocity_after(impulses, velocity);
    }

    /// Accepts the last impulses if they are this step's solution. Returns the residual (m/s).
    ///
    /// They must not have changed in the last step, so that compliance has nothing left to select.
    /// They must obey the law without compliance to rounding. The residual alone is not sufficient:
    /// it is insensitive to undetermined force distributions.
    ///
    /// Unchanged velocities are then kept to the last bit. Rounding in the sum of the impulses
    /// would accumulate from step to step and tilt the face of a body at rest. Of several bodies,
    /// those at rest stay at rest.
    fn repeat(&mut self, equations: &E) -> Option<f64> {
        if equations.setting().unsettled > SETTLED {
            return None;
        }
        let tolerances = *equations.tolerances();
        equations.keep_velocity(&mut self.iterate.velocity);
        let residual = exact_residual(equations, &mut self.iterate);
        let held_speed = self.iterate.held_speed(equations);
        if residual <= tolerances.repeated && held_speed <= tolerances.still {
            return Some(residual);
        }
        equations.set_first_velocity(&self.iterate.impulses, &mut self.iterate.velocity);
        None
    }

    /// Moves the iterate to the extrapolation of the last two steps, if that is closer to a
    /// solution. Returns true if the iterate was evaluated.
    fn extrapolate(&mut self, equations: &E) -> bool {
        let ahead = &mut self.other;
        let Some(foreseen_change) =
            equations.set_foreseen(&mut ahead.velocity, &mut ahead.impulses)
        else {
            return false;
        };
        let missed = exact_residual(equations, ahead);
        if missed <= EXTRAPOLATION * foreseen_change
            || missed < exact_residual(equations, &mut self.iterate)
        {
            std::mem::swap(&mut self.iterate, &mut self.other);
        }
        true
    }

    /// Newton's method with compliance from the iterate, then the limit of vanishing compliance
    /// (N9).
    ///
    /// If the limit narrowly misses the law, the proximal point method continues. If the rows may
    /// determine all impulses, the law without compliance goes first.
    fn descend(
        &mut self,
        equations: &E,
        is_evaluated: bool,
        effort: &mut SolveEffort<'_>,
    ) -> StageEnd {
        let tolerances = *equations.tolerances();
        let Self { newton, iterate, other: start, proximal, .. } = self;
        if let Some(determined) = equations.determined() {
            start.velocity.copy_from(&iterate.velocity);
            start.impulses.clone_from(&iterate.impulses);
            let residual =
                newton.solve_determined(equations, determined, is_evaluated, iterate, effort);
            if residual <= tolerances.solved {
                return StageEnd { residual, selected: true };
            }
            iterate.velocity.copy_from(&start.velocity);
            iterate.impulses.clone_from(&start.impulses);
        }
        let (map, run) =
            (NaturalMap::with_compliance(COMPLIANCE), NewtonRun::with_compliance(equations));
        let selected = newton.solve(equations, &map, run, iterate, effort);
        let mut residual = if selected {
            newton.take_limit(equations, &map, iterate, effort)
        } else {
            exact_residual(equations, iterate)
        };
        if residual > tolerances.solved && (selected || residual <= tolerances.near) {
            let map = NaturalMap::with_compliance(POLISHING_COMPLIANCE);
            residual = proximal.solve(equations, map, newton, iterate, effort);
        }
        StageEnd { residual, selected }
    }

    /// Proximal point method from the iterate. Its result is close and is accepted although
    /// compliance in all impulses did not select it.
    fn change_little(
        &mut self,
        equations: &E,
        map: NaturalMap,
        effort: &mut SolveEffort<'_>,
    ) -> StageEnd {
        let Self { proximal, newton, iterate, .. } = self;
        let residual = proximal.solve(equations, map, newton, iterate, effort);
        StageEnd { residual, selected: true }
    }

    /// Ranks the iterate with this `residual` (m/s). Keeps a solution's resting bodies at rest.
    /// Points that are not solutions are ranked by the residual only.
    fn rank(&mut self, equations: &E, residual: f64) -> Rank {
        if residual > equations.tolerances().solved && residual > self.iterate.rounding(equations) {
            return Rank { unsolved: true, turns_too_far: false, gain: 0.0, residual };
        }
        if equations.settings().keeps_rest {
            self.keep_rest(equations, residual);
        }
        let Iterate { velocity, impulses, .. } = &self.iterate;
        Rank {
            unsolved: false,
            turns_too_far: equations.turns_too_far(velocity),
            gain: equations.energy_made(velocity, impulses, self.iterate.points()),
            residual,
        }
    }

    /// Keeps resting bodies at rest, unless the residual grows.
    fn keep_rest(&mut self, equations: &E, residual: f64) {
        let Self { iterate, other: moved, .. } = self;
        moved.velocity.copy_from(&iterate.velocity);
        equations.keep_velocity(&mut iterate.velocity);
        if iterate.velocity != moved.velocity
            && exact_residual(equations, iterate) > residual.max(equations.tolerances().solved)
        {
            iterate.velocity.copy_from(&moved.velocity);
            exact_residual(equations, iterate);
        }
    }
}

/// Stage that goes before all others. In a large island it is the interior point method if no
/// impulse acted in the last step, and the proximal point method if the forces change.
fn first_stage<E: Equations>(equations: &E, previous: &[Vector3<f64>]) -> Option<Stage> {
    if !equations.settings().is_large {
        return None;
    }
    if previous.iter().all(|impulse| *impulse == Vector3::zeros()) {
        return Some(Stage::InteriorPoint(CENTRES[0]));
    }
    (equations.setting().unsettled > CHANGING).then_some(Stage::Proximal)
}
