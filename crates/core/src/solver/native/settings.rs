//! Constants of the solver with units and reasons, and the settings of different kinds of islands.
//!
//! Numbers without a unit are ratios. ε is a compliance in the solver's units, where impulses are
//! divided by a mass and are velocities. The measurements behind the numbers are in the appendix of
//! `docs/native-solver.md`.

// Selection rule.

/// ε of the law with compliance, û = u + ε D p̂ (N6). The stiffness 1/ε times rounding (10⁻¹³ m/s)
/// is small against impulses. The solution is within 10⁻⁶ of the limit ε → 0.
pub(super) const COMPLIANCE: f64 = 1e-6;
/// ε κ of a rolling contact across its normal (N6), relative to its own response. A ball in a
/// groove of 15° a side presses on the walls as without friction, to 2·10⁻⁴.
pub(super) const ROLLING_COMPLIANCE: f64 = 0.03;
/// Number of stages with this larger compliance, before all stages run with isotropic compliance.
pub(super) const ROLLING_STAGES: usize = 4;
/// Distance to the next piece, relative to the largest impulse, beyond which the compliance cannot
/// change a contact's or stop's piece. It is a hundred times the effect of the compliance.
pub(super) const CLEARANCE: f64 = 100.0 * COMPLIANCE;

// Impulse changes over the last steps, relative to the largest impulse.

/// Largest change of settled impulses.
pub(super) const SETTLED: f64 = 1e-10;
/// Change below which impulses are solved to rounding, because they may be kept for many steps.
pub(super) const SETTLING: f64 = 1e-6;
/// Change above which the last impulses are a poor estimate of the next ones.
pub(super) const CHANGING: f64 = 1e-3;
/// The extrapolation of the last two steps is a good start up to this ratio of its residual to its
/// distance from the last velocities.
pub(super) const EXTRAPOLATION: f64 = 0.1;
/// Number of contacts above which an island without joints is large.
///
/// If its forces change, the proximal point method goes first. In smaller islands Newton's method
/// mostly finds the solution of the selection rule. It does not depend on the order of bodies or on
/// the axes.
pub(super) const LARGE_ISLAND: usize = 16;
/// Number of contacts above which an island without joints is a heap. The proximal point method then
/// takes its steps for heaps. In a tower of six boxes these would take 1.2 times the iterations.
pub(super) const HEAP: usize = 64;

// Newton's method.

/// Largest number of iterations from one start. Solved steps take 5 to 20.
pub(super) const NEWTON_ITERATIONS: u32 = 40;
/// Armijo's constant: sufficient fraction of the decrease predicted by the linear model.
pub(super) const SUFFICIENT_DECREASE: f64 = 1e-4;
/// Number of full steps that may increase the residual near a solution, where kinks of the natural
/// map stop the line search.
pub(super) const WHOLE_STEPS: u32 = 6;
/// ε in the Newton matrix of the law without compliance. The root of the rounding unit balances its
/// error with rounding against 1/ε.
pub(super) const DETERMINED_COMPLIANCE: f64 = 1e-8;
/// Iterations without compliance before the law with compliance is tried.
pub(super) const DETERMINED_ITERATIONS: u32 = 12;
/// Largest number of corrections towards the limit ε → 0. One nearly always suffices. For rolling
/// contacts each leaves 3 %.
pub(super) const CORRECTIONS: u32 = 8;
/// Residual reduction by a correction up to which its factorised matrix is reused.
pub(super) const KEPT_CORRECTION: f64 = 0.1;
/// Residual reduction by a Newton step up to which its factorised matrix is reused.
pub(super) const KEPT_STEP: f64 = 0.01;

// Proximal point method.

/// First ε from the best point.
pub(super) const PROXIMAL_COMPLIANCE: f64 = 1e-3;
/// First ε from a point where Newton's method ended near a solution.
pub(super) const POLISHING_COMPLIANCE: f64 = 1e-5;
/// Smallest ε: below it rounding dominates.
pub(super) const LEAST_COMPLIANCE: f64 = 1e-10;
/// Factors on ε after a step of at most [`EASY_STEP`] iterations, after one of more than twice as
/// many, and after a failed one.
pub(super) const PROXIMAL_FACTORS: [f64; 3] = [0.3, 2.0, 5.0];
/// Largest number of Newton iterations of an easy proximal step; `LONGEST_STEP` is that of any
/// step.
pub(super) const EASY_STEP: u32 = 5;
pub(super) const LONGEST_STEP: u32 = 15;
/// Required residual reduction of a proximal step.
pub(super) const PROXIMAL_ACCURACY: f64 = 0.05;
/// Residual reduction by one proximal step after which ε shrinks again although steps have failed.
pub(super) const FAST_REDUCTION: f64 = 0.1;
/// Number of further proximal steps, towards rounding, after the step counts as solved.
pub(super) const REFINEMENTS: u32 = 3;
/// Number of contacts and joint rows up to which an island of several bodies is refined while its forces
/// change, as in a falling heap.
pub(super) const REFINED_COUPLINGS: usize = 128;

// Method of multipliers.

/// First and smallest ε.
pub(super) const MULTIPLIER_COMPLIANCE: f64 = 0.1;
pub(super) const LEAST_MULTIPLIER_COMPLIANCE: f64 = 1e-6;
/// Residual of the equations of motion for given multipliers, relative to that of the law.
pub(super) const MULTIPLIER_ACCURACY: f64 = 1e-4;
/// Largest number of changes of the multipliers.
pub(super) const MULTIPLIER_STEPS: u32 = 40;
/// Largest number of iterations for given multipliers, and of points along one direction.
pub(super) const MULTIPLIER_ITERATIONS: u32 = 30;
pub(super) const MULTIPLIER_SEARCH: u32 = 20;

// Interior point method.

/// Initial impulses as multiples of the momentum, in the order of the stages.
pub(super) const CENTRES: [f64; 5] = [1.0, 0.1, 10.0, 0.01, 100.0];
/// Largest number of iterations from one start. Converging starts take 10 to 30.
pub(super) const INTERIOR_ITERATIONS: u32 = 60;
/// Largest fraction of the distance to the boundary of the cones for one step.
pub(super) const TO_BOUNDARY: f64 = 0.995;
/// Error of the equations at which Newton's method takes over, relative to the speed of the island.
pub(super) const INTERIOR_ERROR: f64 = 1e-9;
/// Smallest speed (m/s) and smallest friction for scaling a start.
pub(super) const LEAST_SCALE: f64 = 1e-6;

// Termination and rejection.

/// Largest number of iterations of one stage. Successful stages take at most a few hundred.
pub(super) const STAGE_ITERATIONS: u32 = 1500;
/// Numbers of stages, and of iterations in each, of an island without a solution, or after failed steps.
pub(super) const LIMITED_STAGES: u32 = 4;
pub(super) const LIMITED_ITERATIONS: u32 = 100;
/// Rotation in one step (rad) that is too large for a body with less than half of it at the start.
/// Lever arms then rotate too far, and such discrete solutions gain energy.
pub(super) const LARGE_TURN: f64 = 1.0;
/// Energy gain in one step that is too large, relative to the kinetic energy.
pub(super) const LARGE_GAIN: f64 = 1e-3;
/// Speed below which kinetic energy is ignored (m/s).
pub(super) const SLOW: f64 = 1e-4;
/// Number of stages that may lead to the same energy gain, within [`SAME_GAIN`], before the
/// solution is accepted: the discrete step has no other.
pub(super) const SAME_SOLUTIONS: u32 = 3;
pub(super) const SAME_GAIN: f64 = 1e-6;

/// Settings that differ between one body, several bodies and problems without bodies.
#[derive(Debug)]
pub(super) struct Settings {
    /// True if the island is [large](LARGE_ISLAND).
    pub(super) is_large: bool,
    /// True if the proximal point method from the last impulses is the second stage, not the last.
    /// For one body Newton's method from zero does as well.
    pub(super) proximal_stage: bool,
    /// First ε of the proximal point method from the last impulses. In heaps a smaller one takes 1.4
    /// times the iterations.
    pub(super) first_compliance: f64,
    /// [Factor on ρ_t](super::law::NaturalMap) in the proximal steps of that stage.
    pub(super) tangential_factor: f64,
    /// Largest number of easy proximal steps with the same ε. It is the number of failed steps before
    /// them, up to this limit. Without such a wait every second step fails in a heap where the residual
    /// falls slowly.
    pub(super) longest_wait: u32,
    /// Complementarity at which the interior point method ends, relative to the squared speed. It
    /// is smaller for several bodies, where unloaded contacts differ by rounding only.
    pub(super) complementarity: f64,
    /// Number of full Newton steps allowed when the line search fails. They help if contacts
    /// alternate, as on a rolling rim. In large islands more than two lead away.
    pub(super) jumps: u32,
    /// Smallest step of the line search, relative to Newton's. For several bodies steps below 1/32
    /// gain nothing, except at joint stops.
    pub(super) shortest_step: f64,
    /// ε in the matrix for the limit of vanishing compliance, relative to [`COMPLIANCE`]. Each
    /// correction leaves about this part times the ratio of the responses of light bodies to those
    /// of their loads.
    pub(super) limit_compliance: f64,
    /// True if a factorised matrix is reused while the residual falls fast. Joint motion is smooth.
    pub(super) keeps_factors: bool,
    /// True if bodies at rest are kept at rest to the last bit. For several bodies velocity errors
    /// of 10⁻¹² m/s would accumulate.
    pub(super) keeps_rest: bool,
    /// True if any solution of the law is accepted, also without selection by compliance.
    pub(super) takes_any: bool,
    /// True if the method of multipliers is a stage.
    pub(super) has_multipliers: bool,
}

const ONE_BODY: Settings = Settings {
    is_large: false,
    proximal_stage: false,
    first_compliance: PROXIMAL_COMPLIANCE,
    tangential_factor: 1.0,
    longest_wait: 0,
    complementarity: 1e-13,
    jumps: 8,
    shortest_step: 1e-4,
    limit_compliance: 1.0,
    keeps_factors: false,
    keeps_rest: false,
    takes_any: false,
    has_multipliers: false,
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

const SEVERAL_IN_A_HEAP: Settings =
    Settings { first_compliance: 1e-2, tangential_factor: 10.0, longest_wait: 16, ..SEVERAL_LARGE };

const JOINTED: Settings = Settings {
    shortest_step: 1e-4,
    limit_compliance: 0.01,
    keeps_factors: true,
    has_multipliers: true,
    ..SEVERAL
};

const PROBLEM: Settings = Settings { proximal_stage: true, jumps: 2, ..ONE_BODY };

impl Settings {
    /// Settings of an island with `bodies` bodies and `contacts` contacts, with or without joints.
    pub(super) fn for_island(bodies: usize, contacts: usize, has_joints: bool) -> &'static Self {
        match (bodies, contacts > LARGE_ISLAND) {
            _ if has_joints => &JOINTED,
            (1, false) => &ONE_BODY,
            (1, true) => &ONE_LARGE_BODY,
            (_, false) => &SEVERAL,
            (_, true) if contacts > HEAP => &SEVERAL_IN_A_HEAP,
            (_, true) => &SEVERAL_LARGE,
        }
    }

    /// Settings of a contact problem given by matrices. With `any`, any solution is accepted.
    /// Otherwise only the one selected by vanishing compliance is.
    pub(super) fn for_problem(any: bool) -> &'static Self {
        const ANY: Settings = Settings { takes_any: true, ..PROBLEM };
        if any { &ANY } else { &PROBLEM }
    }
}
