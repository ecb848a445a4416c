//! Where an iteration starts, in the order in which starts are tried.

use super::coupling::Coupling;
use super::policy::Policy;
use super::tolerances::ROLLING_STARTS;
use nalgebra::Vector3;
use rand_mt::Mt;

/// A start of Newton's method.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) enum Start {
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
    /// [`SOFTEST`], by this factor from one to the next.
    Compliant(f64),
    /// An interior point's answer, itself started with normal impulses of this multiple
    /// of the momentum: finds the jams, where one point takes all momentum.
    InteriorPoint(f64),
    /// What this number of Gauss–Seidel sweeps makes of no impulses.
    Swept(u32),
    /// Impulses scattered over the cones, by number; the same for every step.
    Scattered(u32),
}

impl Start {
    /// Whether it is one of a crowd whose forces change, to be gone on from where more contacts come to it.
    pub(super) fn is_of_crowds(self) -> bool {
        matches!(self, Self::Moved | Self::Found | Self::Led)
    }

    /// Whether what it ends at is selected by compliance in all impulses, not in their changes.
    pub(super) fn is_by_rule(self) -> bool {
        !matches!(self, Self::Kept | Self::Moved | Self::Found | Self::Best(_))
    }
}

/// ε where a path of compliance starts: a tenth of a body's own response.
pub(super) const SOFTEST: f64 = 0.1;

impl Start {
    /// The word of a report.
    pub(super) fn name(self) -> &'static str {
        match self {
            Self::Previous => "previous",
            Self::Alike => "equal compliance",
            Self::Kept => "kept",
            Self::Moved => "moved",
            Self::Found => "found",
            Self::Led => "led",
            Self::Best(_) => "best",
            Self::Zero => "zero",
            Self::Compliant(_) => "compliance",
            Self::InteriorPoint(_) => "interior point",
            Self::Swept(_) => "sweeps",
            Self::Scattered(_) => "scattered",
        }
    }
}

/// All starts in their order, for so many contacts, behind those that what is known of the step asks for.
/// Where some of them can roll, a few with the selection of those come before others.
pub(super) fn all(
    policy: &Policy,
    contacts: usize,
    rolls: bool,
    asked: [Option<Start>; 3],
) -> impl Iterator<Item = Start> {
    let (first, scattered) = policy.starts(contacts);
    let rolling = first.iter().copied().take(if rolls { ROLLING_STARTS } else { 0 });
    let alike = rolls.then_some(Start::Alike);
    let rest = first.iter().copied().skip(usize::from(rolls));
    asked
        .into_iter()
        .flatten()
        .chain(rolling)
        .chain(alike)
        .chain(rest)
        .chain((0..scattered).map(Start::Scattered))
}

/// Scattered start `number`: of each coupling an impulse anywhere in its set, of up to a
/// multiple of the momentum (one for all couplings, between 0.01 and 10).
pub(super) fn scatter(
    number: u32,
    couplings: &[Coupling],
    speed: f64,
    impulses: &mut Vec<Vector3<f64>>,
) {
    let mut twister = Mt::new(number);
    let mut uniform = || f64::from(twister.next_u32()) / f64::from(u32::MAX);
    let strength = speed * libm::exp10(3.0 * uniform() - 2.0);
    let all = couplings.iter();
    impulses.extend(all.map(|c| c.law.scattered(&c.rows, strength, &mut uniform)));
}
