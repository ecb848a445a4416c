//! The native solver's tolerances, each with its reason, in one place.
//!
//! All are speeds: residuals are compared with them in m/s, each contact in its own scale (eq.
//! 18). The numbers are those of the tutorial's cube; another world has them multiplied by its
//! [speed scale](crate::world::World::speed_scale), so that a smaller copy of a scene is
//! solved as the larger one is. No tolerance is below what the step's own speeds are rounded
//! to.

use crate::world::World;

/// ε of the compliance û = u + ε p̂ while a solution is sought (N6): large enough that the
/// stiffness 1/ε times rounding (10⁻¹³ m/s) stays small against impulses, small enough that
/// the selected solution is within 10⁻⁶ of the limit.
pub(super) const COMPLIANCE: f64 = 1e-6;
/// ε κ of a contact that can roll (N6), in parts of its own response w_t: across its normal it gives by
/// so much where along it gives by ε. What rolls brings unstrained material to the contact, so that
/// springs across are relaxed where those along are not. κ is 10⁵ for a ball by itself: large enough that it
/// presses on the walls of a groove of 15° a side as without friction, to 2·10⁻⁴; small enough that
/// the limit is taken in a few corrections.
pub(super) const ROLLING_GIVE: f64 = 0.03;
/// So many starts with that selection; where none of them solves the step, equal compliance is next.
pub(super) const ROLLING_STARTS: usize = 4;
/// The compliances to follow where the limit cannot be taken from the first.
pub(super) const COMPLIANCES: [f64; 4] = [COMPLIANCE, 1e-7, 1e-8, 1e-9];
/// A path of compliance is given up where even a step by this factor is too long.
pub(super) const SHORTEST_FACTOR: f64 = 0.8;
/// ε of the first proximal step from impulses that are nearly a solution, and the least one.
pub(super) const FIRST_PROXIMAL: f64 = 1e-5;
pub(super) const LEAST_COMPLIANCE: f64 = 1e-10;
/// The same, and the scaling of the natural map, in a crowd whose forces change: impulses that differ from
/// the last ones by a third of themselves (the median of settling heaps of 100 boxes) are far for 10⁻⁵, and
/// with 0.1 and 10 half the iterations do. Where that leads nowhere, as in one step of nine, the second does.
pub(super) const MOVED: [(f64, f64); 2] = [(0.1, 10.0), (0.01, 1.0)];
/// The same from impulses found in this step, to which contacts have come since: from these 0.01 leads on (0.1 takes three proximal
/// steps more, and goes back).
pub(super) const FOUND: [(f64, f64); 2] = [(0.01, 10.0), (0.01, 1.0)];
/// Impulses that changed by more than this part change on, and a crowd's are sought [so](MOVED).
pub(super) const RESTLESS: f64 = 1e-3;
/// What ε is multiplied by after a proximal step that took Newton's method at most
/// [`PROXIMAL_EASE`] iterations, and after one whose end it did not find; it is doubled after one
/// that took more than [`PROXIMAL_EFFORT`].
pub(super) const PROXIMAL_GROWTH: f64 = 0.3;
pub(super) const PROXIMAL_RETREAT: f64 = 5.0;
pub(super) const PROXIMAL_EASE: u32 = 5;
pub(super) const PROXIMAL_EFFORT: u32 = 10;
/// Iterations of Newton's method in a proximal step, and how near to its end it must come, in
/// parts of the residual so far: nothing is gained by more.
pub(super) const PROXIMAL_ITERATIONS: u32 = 15;
pub(super) const PROXIMAL_SHARE: f64 = 1e-2;
/// The same in a crowd: what Newton's method has to gain there comes by pieces, not by squares.
pub(super) const CROWD_SHARE: f64 = 0.05;
/// The most easy proximal steps of a crowd for which ε stays as it is after steps that failed; fewer once one leaves no more
/// than this part of the residual.
pub(super) const LONGEST_WAIT: u32 = 16;
pub(super) const WORTH_MORE: f64 = 0.1;
/// Proximal steps from one start, and after it is solved, towards rounding.
pub(super) const MOST_PROXIMAL_STEPS: u32 = 300;
pub(super) const MOST_REFINEMENTS: u32 = 3;
/// Scalings of the natural map to try with the proximal point method.
pub(super) const PROXIMAL_SHARPNESSES: [f64; 3] = [1.0, 1e2, 1e4];
/// Scalings of the natural map to try where Newton's method stalls near a solution.
pub(super) const SHARPNESSES: [f64; 7] = [1.0, 1e1, 1e2, 1e3, 1e4, 1e5, 1e6];
/// Relative margins on the cone to try when a limit is taken: a contact exactly on its cone may
/// belong to either side.
pub(super) const STICK_MARGINS: [f64; 3] = [0.0, 1e-3, -1e-3];
/// A turn by more than this in one step, rad, is large: a lever no longer resembles its velocity.
pub(super) const LARGE_TURN: f64 = 1.0;
/// A gain of energy in a step by more than this part of the kinetic energy is large.
pub(super) const LARGE_GAIN: f64 = 1e-3;
/// A motion slower than this, m/s in the world's scale, has no energy to speak of.
pub(super) const SLOW: f64 = 1e-4;
/// A large turn is explained by the motion if it is no more than this times what the body came with.
pub(super) const TURN_GAIN: f64 = 2.0;
/// Impulses that changed by less than this part of the largest one have settled: what Newton's
/// method would still change is smaller by far.
pub(super) const SETTLED: f64 = 1e-10;
/// Impulses that changed by less than this part may soon have: they are solved for to rounding.
pub(super) const SETTLING: f64 = 1e-6;
/// A body has many contacts from here on: more than a box has corners.
pub(super) const MANY_CONTACTS: usize = 12;
/// So many sweeps before the first start of a body with many contacts that move: of a rolling rim
/// of 1000 points every eighth step needed another start without them, and none does with them.
pub(super) const FIRST_SWEEPS: u32 = 10;
/// Iterations that an island may take in a step, all starts together: fifty times what the hardest
/// steps of the tests need, and some ten milliseconds with four contacts. An island that has used
/// them is reported with the best point found.
pub(super) const BUDGET: u32 = 20_000;
/// The same for bodies that hold each other, whose hard steps need it.
pub(super) const BUDGET_TOGETHER: u32 = 60_000;
/// These budgets are for up to so many contacts; with more they shrink as an iteration grows.
pub(super) const BUDGET_CONTACTS: usize = 8;
/// A start may use up this part of what is left of the budget.
pub(super) const BUDGET_STARTS: u32 = 4;
/// The least budget: all starts but the scattered ones.
pub(super) const LEAST_BUDGET: u32 = 6_000;
/// Iterations of a start among those of what joints tie, before all of them are tried again with more: of a hopper under
/// random drives the first start solves 99.5 % of the steps in 13, and takes up to 10 000 where another one needs ten.
pub(super) const FIRST_EFFORT: u32 = 100;
/// So many starts may lead to the same solution that makes energy before it is taken.
pub(super) const SAME_SOLUTIONS: u32 = 3;
/// Solutions that make the same energy but for this part of it are the same.
pub(super) const SAME_ENERGY: f64 = 1e-6;
/// Iterations of Newton's method from one start.
pub(super) const NEWTON_ITERATIONS: u32 = 40;
/// The same in a crowd from impulses that are nearly a solution: what takes more mostly leads nowhere.
pub(super) const LED_ITERATIONS: u32 = 15;
/// The same from the interior point of a structure, where some four are enough.
pub(super) const STANDING_ITERATIONS: u32 = 10;
/// ε in the Newton matrix where nothing is to be selected: the root of what doubles resolve, so that as much is lost by it
/// as by rounding against the stiffness 1/ε.
pub(super) const DETERMINED: f64 = 1e-8;
/// Iterations of Newton's method where it is to be seen whether anything is to be selected.
pub(super) const DETERMINED_ITERATIONS: u32 = 12;
/// Impulses of which the laws leave no more than this part open are selected: the part by which those of the law with
/// [`COMPLIANCE`] are off.
pub(super) const LEFT_OPEN: f64 = 1e-6;
/// Where a row is farther than this part of the largest impulse from another piece of its law, it stays on its own whatever
/// gives way by [`COMPLIANCE`]: a hundred times as far.
pub(super) const CLEAR: f64 = 100.0 * COMPLIANCE;
/// What the last two steps lead to is a good start where it misses the laws by no more than this part of how far it is away.
pub(super) const FORESEEN: f64 = 0.1;
/// A step that leaves no more than this part of the residual was made with a matrix that is good for the next one, too.
pub(super) const KEPT_FACTORS: f64 = 0.1;
/// The same while Newton's method is still far: digits that come more slowly cost more than a new matrix. (Of an ant under random drives
/// instructions within a step are 0.84 of those with the part above.)
pub(super) const FAST_FACTORS: f64 = 0.01;
/// Slopes of couplings are kept from one matrix of a proximal step to the next while they change by no more than this part of
/// the compliance in it: the velocities then miss a solution of Newton's method by no more than this part of the step.
pub(super) const KEPT_SLOPES: f64 = 1e-3;
/// Corrections towards the limit of vanishing compliance; one nearly always suffices. Those that leave little enough for the
/// [factors to be kept](KEPT_FACTORS) are not counted.
pub(super) const CORRECTIONS: u32 = 3;
/// The same where contacts [can roll](ROLLING_GIVE): each shrinks what is left to 3 %.
pub(super) const ROLLING_CORRECTIONS: u32 = 8;
/// Whole Newton steps that may be taken near a solution although the residual grows.
pub(super) const WHOLE_STEPS: u32 = 6;
/// Whole Newton steps that may be taken anywhere when a search along the direction finds nothing
/// better: contacts that change places, as those of a rolling rim, make the residual grow on the way.
pub(super) const JUMPS: u32 = 8;
/// The same in a crowd.
pub(super) const CROWD_JUMPS: u32 = 2;
/// A step shorter than this fraction of Newton's is a stall.
pub(super) const SHORTEST_STEP: f64 = 1e-4;
/// The same in a crowd, where steps shorter than 1/16 gain a fiftieth and a third of all evaluations went into looking for them; and
/// in a proximal step of one.
pub(super) const CROWD_SHORTEST_STEP: f64 = 0.1;
pub(super) const PROXIMAL_SHORTEST_STEP: f64 = 0.03;
/// The part of the decrease that the linear model promises which a step must bring (Armijo).
pub(super) const SUFFICIENT_DECREASE: f64 = 1e-4;

/// Residual of a step that counts as solved, m/s: what the certificate is held against, where no
/// [other](crate::solver::native::NativeSolver::with_residual) is asked for.
pub const ACCEPTED_RESIDUAL: f64 = 1e-9;
/// The largest that may be asked for, m/s: half of what gravity gives in a step of 2 ms.
pub const LARGEST_RESIDUAL: f64 = 1e-2;
/// The law without compliance is met: rounding of φ⁺/h. A warm start that is as near is the
/// solution.
const EXACT: f64 = 1e-12;
/// The same words of bodies that hold each other (see [`Tolerances::together`]).
const SOLVED_TOGETHER: f64 = 3e-10;
const LEVEL: f64 = 5e-10;
/// To this a crowd is solved as long as contacts come to it: points are then off by 2·10⁻⁶ m in a step of
/// 2 ms, which hardly changes what they meet, and the iterations to it are a tenth of those to the end.
const ROUGH: f64 = 1e-3;
/// What such a solution lets overlap at less than this speed is not looked at: it is within what the solution itself misses, and
/// found in the end.
const MISSED_ROUGHLY: f64 = 0.1 * ROUGH;
const REST: f64 = 3e-10;
/// Speeds are rounded to this part of themselves, sixteen roundings.
const ROUNDING: f64 = 16.0 * f64::EPSILON;

/// The tolerances of one step, m/s.
#[derive(Debug, Clone, Copy)]
pub(super) struct Tolerances {
    /// What is left where an equation is solved as well as doubles can.
    pub(super) rounding: f64,
    /// The limit of vanishing compliance is reached.
    pub(super) exact: f64,
    /// Newton's method with compliance has converged: a tenth of what is asked in the end.
    pub(super) newton: f64,
    /// A start has solved the step.
    pub(super) solved: f64,
    /// A start has solved the step well enough to say which contacts it has.
    pub(super) rough: f64,
    /// A point is taken if no start but the scattered ones does better.
    pub(super) sufficient: f64,
    /// Whole steps are taken where the residual is at most this, even where it grows: the
    /// natural map has kinks at the scale of the compliance, on which a search along the
    /// direction stalls although the next piece of the map has the solution.
    pub(super) whole_steps: f64,
    /// An iteration that stalled here is near enough to a solution to go on from it.
    pub(super) near: f64,
    /// A point that goes down through the ground at this speed was missed by detection.
    pub(super) missed: f64,
    /// The same where a crowd is solved well enough to say which contacts it has.
    pub(super) missed_roughly: f64,
    /// A gap that one step opens or closes at this speed counts as none.
    pub(super) level: f64,
    /// What was at rest and would move at most at this speed stays at rest.
    pub(super) rest: f64,
}

impl Tolerances {
    /// Those of a step of `world` whose bodies move at `speed` (m/s).
    pub(super) fn of(world: &World, speed: f64) -> Self {
        let scale = world.speed_scale().max(ROUNDING / EXACT * speed);
        Self {
            rounding: 1e-14 * scale,
            exact: EXACT * scale,
            newton: 1e-11 * scale,
            solved: 1e-10 * scale,
            rough: ROUGH * scale,
            sufficient: 5e-10 * scale,
            whole_steps: 1e-5 * scale,
            near: 1e-4 * scale,
            missed: 1e-10 * scale,
            missed_roughly: MISSED_ROUGHLY * scale,
            level: 0.0,
            rest: EXACT * scale,
        }
    }

    /// Those of a problem without a world, whose velocities are in parts of its own speed, solved to a
    /// `residual` in the same parts.
    pub(super) fn posed(residual: f64) -> Self {
        let scale = (residual / ACCEPTED_RESIDUAL).max(ROUNDING / EXACT);
        // Near a solution is near whatever is asked for: between 1e-4 and 2e-2 it hardly matters.
        let near = 5e-3_f64.max(10.0 * residual);
        Self {
            rounding: 1e-14 * scale,
            exact: EXACT * scale,
            newton: 1e-11 * scale,
            solved: SOLVED_TOGETHER * scale,
            rough: SOLVED_TOGETHER * scale,
            sufficient: 5e-10 * scale,
            whole_steps: 0.1 * near,
            near,
            missed: 1e-10 * scale,
            missed_roughly: MISSED_ROUGHLY * scale,
            level: 0.0,
            rest: 0.0,
        }
    }

    /// The same for bodies that hold each other. Where forces are shared in many ways and some lie
    /// on the edge of their cones, the last digits come slowly, and what is left of them is in the
    /// gaps of the next step: a heap whose gaps contradict each other by 10⁻¹³ m has to push and to
    /// slide somewhere to obey them. So gaps of that size count as none; with what a solution may
    /// miss they stay below what is [accepted](ACCEPTED_RESIDUAL).
    pub(super) fn together(world: &World, speed: f64) -> Self {
        let alone = Self::of(world, speed);
        let scale = alone.exact / EXACT;
        Self { solved: SOLVED_TOGETHER * scale, level: LEVEL * scale, rest: REST * scale, ..alone }
    }

    /// The same for steps that may miss their laws by `factor` times as much: all that says when something is solved,
    /// level or at rest.
    pub(super) fn loosened(self, factor: f64) -> Self {
        let solved = factor * self.solved;
        Self {
            rounding: factor * self.rounding,
            exact: factor * self.exact,
            newton: factor * self.newton,
            solved,
            rough: self.rough.max(solved),
            sufficient: factor * self.sufficient,
            whole_steps: self.whole_steps.max(solved),
            near: self.near.max(solved),
            missed: factor * self.missed,
            missed_roughly: self.missed_roughly.max(factor * self.missed),
            level: factor * self.level,
            rest: factor * self.rest,
        }
    }

    /// The same where only contacts are to be found.
    pub(super) fn roughly(self) -> Self {
        let Self { rough, .. } = self;
        let newton = self.newton.max(PROXIMAL_SHARE * rough);
        Self { exact: rough, newton, solved: rough, sufficient: rough, ..self }
    }
}
