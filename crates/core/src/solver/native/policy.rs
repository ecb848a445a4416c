//! How the solution of an island is sought: what differs between one body and several that hold each
//! other, in one place.

use super::tolerances::{BUDGET, BUDGET_TOGETHER, FIRST_EFFORT, Tolerances};

/// A start of Newton's method.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) enum StartMethod {
    /// The impulses of the previous step: enough for more than 99.7 % of contact steps.
    Previous,
    /// The impulses of the previous step, from here on with compliance that is equal in all directions,
    /// also of what [can roll](super::tolerances::ROLLING_GIVE).
    Alike,
    /// The impulses of the previous step, changed as little as it takes: where forces are shared in
    /// many ways, those of bodies that hold each other stay as they are.
    Kept,
    /// The same in a crowd whose forces change: by large steps at first.
    Moved,
    /// The impulses found in this step before more contacts came to it, gone on from as from [`Moved`](Self::Moved).
    Found,
    /// The same impulses once all contacts are known, where these are few enough that compliance may lead from there to
    /// a solution.
    Led,
    /// The best point of the starts before, changed as little as it takes, by compliance of this size at
    /// first.
    Best(f64),
    /// No impulses.
    Zero,
    /// Where a path of less and less compliance leads, from no impulses and a compliance of
    /// [`SOFTEST`](super::starts::SOFTEST), by this factor from one to the next.
    Compliant(f64),
    /// An interior point's answer, itself started with normal impulses of this multiple
    /// of the momentum: finds the jams, where one point takes all momentum.
    InteriorPoint(f64),
    /// An interior point's answer for a structure of which nothing pressed before: started with the momentum of every body
    /// among its own contacts, and gone on until it is known which of them press.
    Structure,
    /// What this number of Gauss–Seidel sweeps makes of no impulses.
    Swept(u32),
    /// Impulses scattered over the cones, by number; the same for every step.
    Scattered(u32),
}

impl StartMethod {
    /// Whether it is one of a crowd whose forces change, to be gone on from where more contacts come to it.
    pub(super) fn is_of_crowds(self) -> bool {
        matches!(self, Self::Moved | Self::Found | Self::Led)
    }

    /// Whether what it ends at is selected by compliance in all impulses, not in their changes.
    pub(super) fn is_by_rule(self) -> bool {
        !matches!(self, Self::Kept | Self::Moved | Self::Found | Self::Best(_))
    }
}

/// What depends on how many bodies there are.
#[derive(Debug)]
pub(super) struct Policy {
    /// The starts in their order, and those of more than [`CROWDED`] contacts.
    starts: &'static [StartMethod],
    starts_of_crowds: &'static [StartMethod],
    /// How many scattered starts are tried before a step is given up.
    scattered: u32,
    /// Iterations that an island may take in a step.
    pub(super) budget: u32,
    /// Iterations that every start but the scattered ones may take before all of them are tried again with whatever is left of the
    /// budget; [`u32::MAX`] where they are tried once. Where one start leads to a solution in no time, another one may not
    /// for thousands.
    pub(super) first_effort: u32,
    /// Whether forces that change hands among many contacts are sought by sweeps first: among several
    /// bodies these are too slow to help.
    pub(super) sweeps_first: bool,
    /// Whether compliance on changes is the first remedy near a solution: of several bodies it helps
    /// most; of one, what is cheaper mostly does.
    pub(super) takes_out_first: bool,
    /// Whether the best point of a descent is kept: of several bodies, what less compliance makes of a
    /// point may be far worse.
    pub(super) keeps_best: bool,
    /// Whether what is at rest is kept at rest. Solved to a tolerance the velocities of several bodies
    /// are some 10⁻¹² m/s, by which they would creep into each other until gaps of that size tell the
    /// shares of the forces.
    pub(super) settles: bool,
    /// Whether impulses of the last step are those of this one only where they obey it to rounding.
    repeats_exactly: bool,
    /// Whether a factorised matrix is kept for further steps as long as they shrink the residual by much: what joints tie
    /// moves smoothly.
    pub(super) keeps_factors: bool,
    /// ε in the matrix on the way to the limit of vanishing compliance where the law's own is slow, in parts of that: each correction
    /// shrinks what is left to about that part of what the own responses of light bodies are to those of all that they carry.
    pub(super) limit_compliance: f64,
    /// Whether any solution will do, also one that compliance did not select.
    pub(super) takes_any: bool,
    /// Whether the forces of a crowd that change are gone on from as they are, and known roughly before all
    /// its contacts are.
    follows_crowds: bool,
}

/// For one body: a few unknowns, so that many starts cost little.
static ALONE: Policy = Policy {
    starts: &[
        StartMethod::Previous,
        StartMethod::Zero,
        StartMethod::InteriorPoint(1.0),
        StartMethod::InteriorPoint(0.1),
        StartMethod::InteriorPoint(10.0),
        StartMethod::InteriorPoint(0.01),
        StartMethod::InteriorPoint(100.0),
        StartMethod::Compliant(0.1),
        StartMethod::Compliant(0.3),
    ],
    starts_of_crowds: &[],
    scattered: 1024,
    budget: BUDGET,
    first_effort: u32::MAX,
    sweeps_first: true,
    takes_out_first: false,
    keeps_best: false,
    settles: false,
    repeats_exactly: true,
    keeps_factors: false,
    limit_compliance: 1.0,
    takes_any: false,
    follows_crowds: false,
};

/// For several bodies: in the order of what they solve for their cost. In a crowd, what is far from a
/// solution leads nowhere, and the best point so far nearly always on.
const TOGETHER: Policy = Policy {
    starts: &[
        StartMethod::Previous,
        StartMethod::Kept,
        StartMethod::Best(1e-3),
        StartMethod::Compliant(0.1),
        StartMethod::Best(1e-5),
        StartMethod::Zero,
        StartMethod::Swept(30),
        StartMethod::InteriorPoint(1.0),
        StartMethod::Best(1e-1),
        StartMethod::InteriorPoint(0.1),
        StartMethod::InteriorPoint(10.0),
        StartMethod::Compliant(0.3),
        StartMethod::Swept(300),
        StartMethod::InteriorPoint(0.01),
        StartMethod::Best(1e-3),
    ],
    starts_of_crowds: &[
        StartMethod::Previous,
        StartMethod::Kept,
        StartMethod::Best(1e-3),
        StartMethod::Compliant(0.1),
        StartMethod::Best(1e-1),
        StartMethod::InteriorPoint(1.0),
        StartMethod::Best(1e-4),
        StartMethod::Swept(30),
        StartMethod::Best(1e-2),
        StartMethod::Zero,
        StartMethod::Best(1e-5),
        StartMethod::Best(1e-3),
    ],
    scattered: 16,
    budget: BUDGET_TOGETHER,
    first_effort: u32::MAX,
    sweeps_first: false,
    takes_out_first: true,
    keeps_best: true,
    settles: true,
    repeats_exactly: false,
    keeps_factors: false,
    limit_compliance: 1.0,
    takes_any: false,
    follows_crowds: true,
};

static SEVERAL: Policy = TOGETHER;

/// For bodies that joints tie: a force that joints keep may be the same in every step and move them all
/// the same, by less than what a heap may leave.
/// What joints hold is not shared in many ways, and old reactions of light hinges lead astray.
static TIED: Policy = Policy {
    first_effort: FIRST_EFFORT,
    repeats_exactly: true,
    keeps_factors: true,
    limit_compliance: 0.01,
    follows_crowds: false,
    ..TOGETHER
};

/// For problems without bodies: nothing is known of how they came about, and nothing is at rest.
static POSED: Policy =
    Policy { settles: false, takes_any: true, follows_crowds: false, ..TOGETHER };

/// The same where the solution of the selection rule is asked for.
static SELECTED: Policy = Policy { takes_any: false, ..POSED };

const CROWDED: usize = 64;
/// With up to so many contacts the last impulses mostly lead to the selected solution, also where they change.
const FOLLOWED: usize = 16;
/// With up to so many the selected solution is sought, once the impulses are known by another way.
const LED: usize = 128;
/// From nothing Newton's method finds the forces of a structure with up to so many contacts as soon as an interior point does (10
/// iterations to 22 for a wall of 36 bricks, 22 to 16 for a pyramid of 55 cubes), with more not at all or later (first steps of
/// pyramids of 120 and 300 cubes take 18 and 21 in place of 164 and 167, of a wall of 1000 bricks 28 in place of 42).
const STRUCTURE: usize = 400;
/// With more contacts, what nearly obeys the laws is kept as it is.
const VAST: usize = 4000;

impl Policy {
    /// That of an island of so many bodies.
    pub(super) fn of(bodies: usize) -> &'static Self {
        if bodies == 1 { &ALONE } else { &SEVERAL }
    }

    /// That of bodies that joints tie.
    pub(super) fn tied() -> &'static Self {
        &TIED
    }

    /// That of problems without bodies, of which any solution will do or that of the selection rule.
    pub(super) fn posed(any: bool) -> &'static Self {
        if any { &POSED } else { &SELECTED }
    }

    /// The starts for so many contacts, and how many scattered ones come after them.
    pub(super) fn starts(&self, contacts: usize) -> (&'static [StartMethod], u32) {
        match contacts > CROWDED && !self.starts_of_crowds.is_empty() {
            true => (self.starts_of_crowds, 0),
            false => (self.starts, self.scattered),
        }
    }

    /// Whether so many contacts are a crowd whose forces are [followed](Self::follows_crowds).
    pub(super) fn follows(&self, contacts: usize) -> bool {
        self.follows_crowds && contacts > FOLLOWED
    }

    /// Whether compliance may lead a crowd of so many contacts from impulses that are nearly a solution to the selected one.
    pub(super) fn leads(&self, contacts: usize) -> bool {
        contacts <= LED
    }

    /// Whether so many contacts, none of which pressed before, are those of a structure that stands.
    pub(super) fn is_structure(&self, contacts: usize) -> bool {
        self.follows_crowds && contacts > STRUCTURE
    }

    /// Whether so many contacts are those of a structure in which compliance does not find its way from what nearly holds.
    pub(super) fn is_vast(&self, contacts: usize) -> bool {
        self.follows_crowds && contacts > VAST
    }

    /// The residual, and the speed at which what presses may change its gap, up to which the impulses of
    /// the last step are those of this one, m/s.
    pub(super) fn repeats(&self, tolerances: &Tolerances) -> (f64, f64) {
        match self.repeats_exactly {
            true => (tolerances.exact, tolerances.rounding),
            false => (tolerances.solved, tolerances.exact),
        }
    }
}
