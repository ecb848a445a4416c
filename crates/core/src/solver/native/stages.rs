//! The stages of the solution of an island, in their order, and the loop over them.
//!
//! 1. Newton's method from the last impulses, unless these are the solution already (`previous`);
//! 2. the proximal point method from the last impulses (`proximal point`; of one body at the end);
//! 3. Newton's method from no impulses (`zero`);
//! 4. an interior point at several centres, then Newton's method from it (`interior point`);
//! 5. the proximal point method from the best point so far (`best point`).
//!
//! The first stage that leads to a solution ends the loop. Equation numbers are those of
//! `docs/native-solver.md`.

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

/// The words of reports for the stages: all that
/// [`StepReport::start`](crate::step::StepReport::start) has of the native solver.
pub const STARTS: [&str; 6] =
    ["previous", "proximal point", "zero", "interior point", "best point", "equal compliance"];

/// A method and where it starts.
#[derive(Debug, Clone, Copy, PartialEq)]
enum Stage {
    /// Newton's method from the last impulses: enough for more than 99.9 % of the steps of one body.
    Previous,
    /// The proximal point method from the last impulses.
    Proximal,
    /// Newton's method from no impulses.
    Zero,
    /// An interior point from impulses of this multiple of the momentum, then Newton's method: finds
    /// jams, where one point takes all momentum.
    InteriorPoint(f64),
    /// The proximal point method from the best point of the stages before.
    Best,
}

/// A stage as it is run.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct StageRun {
    stage: Stage,
    /// Whether contacts that can roll have the same compliance in all directions (N6).
    equal_compliance: bool,
}

impl StageRun {
    /// Newton's method from the last impulses.
    pub(super) const PREVIOUS: Self = Self { stage: Stage::Previous, equal_compliance: false };

    /// Newton's method from no impulses.
    pub(super) const ZERO: Self = Self { stage: Stage::Zero, equal_compliance: false };

    /// The word of a report.
    pub(super) fn name(self) -> &'static str {
        STARTS[match self.stage {
            _ if self.equal_compliance => 5,
            Stage::Previous => 0,
            Stage::Proximal => 1,
            Stage::Zero => 2,
            Stage::InteriorPoint(_) => 3,
            Stage::Best => 4,
        }]
    }

    /// Whether compliance in all impulses selects its solution (N6), not compliance in their
    /// changes (N13).
    fn selects(self) -> bool {
        !matches!(self.stage, Stage::Proximal | Stage::Best)
    }
}

/// All stages in their order, `first` before the others. Where contacts can roll, the first few are
/// run with their larger compliance, then all with an equal one.
fn runs(
    settings: &Settings,
    first: Option<Stage>,
    can_roll: bool,
) -> impl Iterator<Item = StageRun> {
    let (second, last) = match settings.proximal_stage {
        true => (Some(Stage::Proximal), None),
        false => (None, Some(Stage::Proximal)),
    };
    let rest = [Some(Stage::Previous), second, Some(Stage::Zero)].into_iter().flatten();
    let rest = rest.chain(CENTRES.map(Stage::InteriorPoint)).chain([Stage::Best]).chain(last);
    let all = first.into_iter().chain(rest.filter(move |stage| first != Some(*stage)));
    let rolling = all.clone().take(if can_roll { ROLLING_STAGES } else { 0 });
    let rolling = rolling.map(|stage| StageRun { stage, equal_compliance: false });
    rolling.chain(all.map(move |stage| StageRun { stage, equal_compliance: can_roll }))
}

/// The result of all stages.
#[derive(Debug, Clone, Copy)]
pub(super) struct StageOutcome {
    pub(super) solved: bool,
    pub(super) run: StageRun,
    /// Whether the law with compliance led to it, so that it is the solution of the selection rule.
    pub(super) selected: bool,
    /// Whether another stage had failed before.
    pub(super) retried: bool,
}

impl StageOutcome {
    /// Nothing was solved.
    pub(super) const UNSOLVED: Self =
        Self { solved: false, run: StageRun::PREVIOUS, selected: false, retried: false };
}

/// The quality of the end of a stage; the least is best.
#[derive(Debug, Clone, Copy, PartialEq, PartialOrd)]
struct Rank {
    unsolved: bool,
    /// A solution that turns a body further in one step than its motion explains.
    turns_too_far: bool,
    /// The energy that a solution gains from nothing, in parts of what it has; 0 where it is little.
    gain: f64,
    /// The residual of the law without compliance, m/s.
    residual: f64,
}

/// The end of a stage.
#[derive(Debug, Clone, Copy)]
struct StageEnd {
    /// The residual of the law without compliance, m/s.
    residual: f64,
    /// Whether the point is one to take: the law with compliance was solved on the way, or the
    /// change from a known point is small.
    selected: bool,
}

/// The methods of the stages and their memory.
#[derive(Debug, Clone)]
pub(super) struct StageSolver<E: Equations> {
    newton: Newton<E>,
    interior_point: InteriorPoint<E>,
    proximal: Proximal<E>,
    iterate: Iterate<E>,
    /// The best end of a stage.
    best: Iterate<E>,
    /// A point to compare with or to go back to.
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

    /// Makes room for so many couplings, in all that any stage needs.
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

    /// p̂ of every coupling in the last solution, m/s, world.
    pub(super) fn impulses(&self) -> &[Vector3<f64>] {
        &self.iterate.impulses
    }

    /// u of every coupling in the last solution, m/s, world.
    pub(super) fn points(&self) -> &[Vector3<f64>] {
        self.iterate.points()
    }

    /// The piece of the natural map with compliance that each coupling of the last solution is on, and
    /// the distance to the next piece, m/s.
    pub(super) fn pieces(&self, equations: &E) -> impl Iterator<Item = (MapPiece, f64)> {
        const MAP: NaturalMap = NaturalMap::with_compliance(COMPLIANCE);
        let couplings = equations.couplings().iter().zip(self.impulses()).zip(self.points());
        couplings.map(|((coupling, impulse), u)| {
            let pull = coupling.pull(&MAP, u, impulse);
            (pull.piece(equations.graphs()), pull.margin(equations.graphs()))
        })
    }

    /// Runs one stage after another until one leads to a solution; otherwise leaves the best point
    /// found. `previous` are p̂ of the last step, m/s, world, and `accepted` is the residual of a point
    /// that is no failure, m/s.
    ///
    /// A solution that the law with compliance did not select, or that turns a body too far or
    /// gains energy from nothing, is kept, and another one is preferred to it.
    pub(super) fn solve(
        &mut self,
        equations: &mut E,
        previous: &[Vector3<f64>],
        accepted: f64,
        effort: &mut SolveEffort<'_>,
    ) -> StageOutcome {
        let settings = equations.settings();
        let first = first_stage(equations, previous);
        let can_roll = !equations.setting().all_give_alike;
        let mut best: Option<(Rank, StageRun, bool)> = None;
        let mut same_solutions = 0;
        for run in runs(settings, first, can_roll) {
            if run.equal_compliance {
                equations.setting_mut().give_alike();
            }
            effort.begin_stage();
            let end = self.run(equations, run.stage, previous, effort);
            let rank = self.rank(equations, end.residual);
            let selected = end.selected && run.selects();
            let is_sound = !rank.unsolved && !rank.turns_too_far && rank.gain == 0.0;
            if is_sound && (end.selected || settings.takes_any) {
                return StageOutcome { solved: true, run, selected, retried: best.is_some() };
            }
            let gains_as = |best: &Rank| (rank.gain - best.gain).abs() <= SAME_GAIN * rank.gain;
            let is_same = rank.gain > 0.0 && best.is_some_and(|(best, ..)| gains_as(&best));
            same_solutions += u32::from(is_same);
            if best.is_none_or(|(best, ..)| rank < best) {
                same_solutions = if is_same { same_solutions } else { 0 };
                best = Some((rank, run, selected));
                self.best.copy_from(&self.iterate);
            }
            if same_solutions == SAME_SOLUTIONS || effort.is_interrupted() {
                break;
            }
        }
        self.iterate.copy_from(&self.best);
        if !self.iterate.is_finite() {
            // Only where the step's own numbers overflow: free flight is at least finite.
            self.begin_from_zero(equations);
            self.iterate.evaluate_points(equations);
        }
        let Some((rank, run, selected)) = best else { return StageOutcome::UNSOLVED };
        let solved = rank.residual <= accepted;
        StageOutcome { solved, run, selected, retried: run != StageRun::PREVIOUS }
    }

    /// Runs a stage.
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
                if let Some(residual) = self.repeat(equations) {
                    return StageEnd { residual, selected: true };
                }
                let is_evaluated = self.extrapolate(equations);
                self.descend(equations, is_evaluated, effort)
            }
            Stage::Proximal => {
                self.begin_from(equations, previous);
                self.change_little(equations, effort)
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
            Stage::Best => {
                self.iterate.copy_from(&self.best);
                self.change_little(equations, effort)
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

    /// Sets the iterate to no impulses.
    fn begin_from_zero(&mut self, equations: &E) {
        let Iterate { impulses, velocity, .. } = &mut self.iterate;
        impulses.clear();
        impulses.resize(equations.couplings().len(), Vector3::zeros());
        equations.set_velocity_after(impulses, velocity);
    }

    /// Whether the last impulses are this step's as they are: they did not change in the last step,
    /// so that compliance has nothing left to select between them, and they obey the law without
    /// compliance to rounding. A residual alone does not say so: it hardly feels the shares that the
    /// law leaves open.
    ///
    /// If so, returns the residual, m/s, and keeps velocities that the impulses leave as they were,
    /// to the last bit: rounding in the sum of the impulses would add up from step to step, until
    /// the face of a body at rest is warped by it. With several bodies, what is at rest stays there.
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

    /// Moves the iterate to the extrapolation of the last two steps, if that is nearer to a
    /// solution. Returns whether the iterate was evaluated.
    fn extrapolate(&mut self, equations: &E) -> bool {
        let ahead = &mut self.other;
        let Some(way) = equations.set_foreseen(&mut ahead.velocity, &mut ahead.impulses) else {
            return false;
        };
        let missed = exact_residual(equations, ahead);
        if missed <= EXTRAPOLATION * way || missed < exact_residual(equations, &mut self.iterate) {
            std::mem::swap(&mut self.iterate, &mut self.other);
        }
        true
    }

    /// Newton's method with compliance from the iterate, then the limit of vanishing compliance
    /// (N9); where that misses the law by little, the proximal point method from there. Where the
    /// rows may determine all impulses, the law without compliance goes first.
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
        let mut residual = match selected {
            true => newton.take_limit(equations, &map, iterate, effort),
            false => exact_residual(equations, iterate),
        };
        if residual > tolerances.solved && (selected || residual <= tolerances.near) {
            residual = proximal.solve(equations, POLISHING_COMPLIANCE, newton, iterate, effort);
        }
        StageEnd { residual, selected }
    }

    /// The proximal point method from the iterate. What it ends at is near, and is taken although
    /// compliance in all impulses did not select it.
    fn change_little(&mut self, equations: &E, effort: &mut SolveEffort<'_>) -> StageEnd {
        let Self { proximal, newton, iterate, .. } = self;
        let residual = proximal.solve(equations, PROXIMAL_COMPLIANCE, newton, iterate, effort);
        StageEnd { residual, selected: true }
    }

    /// Ranks the iterate, whose `residual` is known (m/s). A solution's bodies at rest are kept at rest.
    /// For points that are no solution only the residual counts.
    fn rank(&mut self, equations: &E, residual: f64) -> Rank {
        if residual > equations.tolerances().solved {
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

    /// Keeps what is at rest at rest, unless the residual grows by it.
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

/// The stage that goes before all others. In a large island it is an interior point if nothing
/// pressed in the last step, and the proximal point method if the forces change.
fn first_stage<E: Equations>(equations: &E, previous: &[Vector3<f64>]) -> Option<Stage> {
    if !equations.settings().is_large {
        return None;
    }
    if previous.iter().all(|impulse| *impulse == Vector3::zeros()) {
        return Some(Stage::InteriorPoint(CENTRES[0]));
    }
    (equations.setting().unsettled > CHANGING).then_some(Stage::Proximal)
}
