//! The constants of the solver, each with its unit and its reason, and what differs between kinds
//! of islands.
//!
//! Numbers without a unit are ratios. ε is a compliance in the solver's units, where an impulse is
//! divided by a mass and so is a velocity. The measurements behind the numbers are in the appendix
//! of `docs/native-solver.md`.

// The law that selects a solution.

/// ε of the law with compliance, û = u + ε D p̂ (N6). The stiffness 1/ε times rounding
/// (10⁻¹³ m/s) stays small against impulses, and the solution is within 10⁻⁶ of the limit ε → 0.
pub(super) const COMPLIANCE: f64 = 1e-6;
/// ε κ of a rolling contact across its normal (N6), in parts of its own response. A ball in a
/// groove of 15° a side presses on the walls as without friction, to 2·10⁻⁴.
pub(super) const ROLLING_COMPLIANCE: f64 = 0.03;
/// Stages that use this larger compliance before all stages are run with an equal one.
pub(super) const ROLLING_STAGES: usize = 4;
/// A contact or stop this far from its next piece, in parts of the largest impulse, stays on its
/// own piece whatever the compliance does: a hundred times what the compliance moves.
pub(super) const CLEARANCE: f64 = 100.0 * COMPLIANCE;

// What is known from the steps before, in parts of the largest impulse.

/// Impulses are settled if they changed by less than this.
pub(super) const SETTLED: f64 = 1e-10;
/// Impulses that changed by less than this are solved for to rounding, since they may be kept for
/// many steps.
pub(super) const SETTLING: f64 = 1e-6;
/// Impulses that changed by more than this are not nearly those of the next step.
pub(super) const CHANGING: f64 = 1e-3;
/// The extrapolation of the last two steps is a good start if its residual is at most this part of
/// its distance from the last velocities.
pub(super) const EXTRAPOLATION: f64 = 0.1;
/// An island without joints is large above this number of contacts. If its forces change, the
/// proximal point method goes first. Elsewhere Newton's method mostly leads to the solution of the
/// selection rule, which does not depend on the order of bodies or on the axes.
pub(super) const LARGE_ISLAND: usize = 16;

// Newton's method.

/// Iterations from one start: steps that are solved take 5 to 20.
pub(super) const NEWTON_ITERATIONS: u32 = 40;
/// Armijo's constant: the part of the decrease promised by the linear model that is enough.
pub(super) const SUFFICIENT_DECREASE: f64 = 1e-4;
/// Whole steps that may increase the residual near a solution, where the kinks of the natural map
/// stop the line search.
pub(super) const WHOLE_STEPS: u32 = 6;
/// ε in the Newton matrix of the law without compliance: the root of the rounding unit, so that as
/// much is lost to it as to rounding against 1/ε.
pub(super) const DETERMINED_COMPLIANCE: f64 = 1e-8;
/// Iterations of the law without compliance before the law with compliance is tried.
pub(super) const DETERMINED_ITERATIONS: u32 = 12;
/// Corrections towards the limit ε → 0; one nearly always suffices, and of rolling contacts each
/// leaves 3 %.
pub(super) const CORRECTIONS: u32 = 8;
/// A correction that leaves at most this part of the residual keeps its factorised matrix.
pub(super) const KEPT_CORRECTION: f64 = 0.1;
/// A Newton step that leaves at most this part of the residual keeps its factorised matrix.
pub(super) const KEPT_STEP: f64 = 0.01;

// The proximal point method.

/// The first ε from impulses of another step, and from the best point.
pub(super) const PROXIMAL_COMPLIANCE: f64 = 1e-3;
/// The first ε from a point where Newton's method ended near a solution.
pub(super) const POLISHING_COMPLIANCE: f64 = 1e-5;
/// The least ε: less is lost to rounding.
pub(super) const LEAST_COMPLIANCE: f64 = 1e-10;
/// The factors on ε after a step of at most [`EASY_STEP`] iterations, after one of more than twice
/// as many, and after a failed one.
pub(super) const PROXIMAL_FACTORS: [f64; 3] = [0.3, 2.0, 5.0];
/// Newton iterations of a proximal step that is easy, and the most that one may take.
pub(super) const EASY_STEP: u32 = 5;
pub(super) const LONGEST_STEP: u32 = 15;
/// A proximal step is solved to this part of the residual before it.
pub(super) const PROXIMAL_ACCURACY: f64 = 0.05;
/// Further proximal steps, towards rounding, after the step counts as solved.
pub(super) const REFINEMENTS: u32 = 3;

// The interior point method.

/// The multiples of the momentum that its impulses begin with, in the order of the stages.
pub(super) const CENTRES: [f64; 5] = [1.0, 0.1, 10.0, 0.01, 100.0];
/// Iterations of one start; those that converge take 10 to 30.
pub(super) const INTERIOR_ITERATIONS: u32 = 60;
/// The part of the way to the boundary of the cones that a step may go.
pub(super) const TO_BOUNDARY: f64 = 0.995;
/// The error of the equations at which Newton's method takes over, in parts of the speed of the
/// island.
pub(super) const INTERIOR_ERROR: f64 = 1e-9;
/// The least speed, m/s, and the least friction that a start is scaled with.
pub(super) const LEAST_SCALE: f64 = 1e-6;

// When to stop, and what to reject.

/// Iterations of one stage. Stages that solve a step take at most a few hundred.
pub(super) const STAGE_ITERATIONS: u32 = 1500;
/// A turn in one step that is large, rad, if the body came with less than half of it: a lever no
/// longer resembles its velocity, and such solutions of the discrete equations make energy.
pub(super) const LARGE_TURN: f64 = 1.0;
/// A gain of energy in one step that is large, in parts of the kinetic energy.
pub(super) const LARGE_GAIN: f64 = 1e-3;
/// A motion slower than this, m/s, has no energy to speak of.
pub(super) const SLOW: f64 = 1e-4;
/// So many stages may lead to the same gain of energy, to the part [`SAME_GAIN`], before the
/// solution is taken: the discrete step has no other.
pub(super) const SAME_SOLUTIONS: u32 = 3;
pub(super) const SAME_GAIN: f64 = 1e-6;

/// The differences between one body, several bodies, and rows without bodies.
#[derive(Debug)]
pub(super) struct Settings {
    /// Whether the island is [large](LARGE_ISLAND).
    pub(super) is_large: bool,
    /// Whether the proximal point method from the last impulses is the second stage, not the last one:
    /// of one body Newton's method from zero does as well.
    pub(super) proximal_stage: bool,
    /// The complementarity at which the interior point hands over, in parts of the squared speed.
    /// Among several bodies less: contacts without a load are told apart only by rounding.
    pub(super) complementarity: f64,
    /// Whole Newton steps that may be taken where the line search finds no shorter one. They help
    /// where contacts change places, as on a rolling rim; in large islands more than two lead
    /// away.
    pub(super) jumps: u32,
    /// The shortest step of the line search, in parts of Newton's. Among several bodies steps below
    /// 1/32 gain nothing; at the stops of joints they do.
    pub(super) shortest_step: f64,
    /// ε in the matrix on the way to the limit of vanishing compliance, in parts of
    /// [`COMPLIANCE`]. Each correction leaves about this part times the ratio of the responses of
    /// light bodies to those of what they carry.
    pub(super) limit_compliance: f64,
    /// Whether a factorised matrix is kept while steps shrink the residual fast: what joints hold
    /// moves smoothly.
    pub(super) keeps_factors: bool,
    /// Whether bodies at rest are kept at rest to the last bit. Of several bodies the solution's
    /// velocities of 10⁻¹² m/s would add up.
    pub(super) keeps_rest: bool,
    /// Whether any solution of the law will do, also one that compliance did not select.
    pub(super) takes_any: bool,
}

const ONE_BODY: Settings = Settings {
    is_large: false,
    proximal_stage: false,
    complementarity: 1e-13,
    jumps: 8,
    shortest_step: 1e-4,
    limit_compliance: 1.0,
    keeps_factors: false,
    keeps_rest: false,
    takes_any: false,
};

const ONE_LARGE_BODY: Settings = Settings { is_large: true, ..ONE_BODY };

const SEVERAL: Settings = Settings {
    proximal_stage: true,
    complementarity: 1e-19,
    shortest_step: 0.03,
    keeps_rest: true,
    ..ONE_BODY
};

const SEVERAL_LARGE: Settings = Settings { is_large: true, jumps: 2, ..SEVERAL };

const JOINTED: Settings =
    Settings { shortest_step: 1e-4, limit_compliance: 0.01, keeps_factors: true, ..SEVERAL };

const PROBLEM: Settings = Settings { proximal_stage: true, jumps: 2, ..ONE_BODY };

impl Settings {
    /// The settings of an island of `bodies` bodies and `contacts` contacts, with joints or without.
    pub(super) fn of(bodies: usize, contacts: usize, has_joints: bool) -> &'static Self {
        match (bodies, contacts > LARGE_ISLAND) {
            _ if has_joints => &JOINTED,
            (1, false) => &ONE_BODY,
            (1, true) => &ONE_LARGE_BODY,
            (_, false) => &SEVERAL,
            (_, true) => &SEVERAL_LARGE,
        }
    }

    /// The settings of a contact problem given by matrices. Either `any` solution will do, or only the
    /// one that vanishing compliance selects.
    pub(super) fn of_problem(any: bool) -> &'static Self {
        const ANY: Settings = Settings { takes_any: true, ..PROBLEM };
        if any { &ANY } else { &PROBLEM }
    }
}
