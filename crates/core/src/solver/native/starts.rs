//! Where an iteration starts, in the order in which starts are tried.

use super::coupling::Coupling;
use super::policy::{Policy, StartMethod};
use super::tolerances::ROLLING_STARTS;
use nalgebra::Vector3;
use rand_mt::Mt;

/// ε where a path of compliance starts: a tenth of a body's own response.
pub(super) const SOFTEST: f64 = 0.1;

/// The words of reports for the starts of the native solver: all that
/// [`StepReport::start`](crate::step::StepReport::start) has of it.
pub const STARTS: [&str; 13] = [
    "previous",
    "equal compliance",
    "kept",
    "moved",
    "found",
    "led",
    "best",
    "zero",
    "compliance",
    "interior point",
    "structure",
    "sweeps",
    "scattered",
];

impl StartMethod {
    /// The word of a report.
    pub(super) fn name(self) -> &'static str {
        let place = match self {
            Self::Previous => 0,
            Self::Alike => 1,
            Self::Kept => 2,
            Self::Moved => 3,
            Self::Found => 4,
            Self::Led => 5,
            Self::Best(_) => 6,
            Self::Zero => 7,
            Self::Compliant(_) => 8,
            Self::InteriorPoint(_) => 9,
            Self::Structure => 10,
            Self::Swept(_) => 11,
            Self::Scattered(_) => 12,
        };
        STARTS[place]
    }
}

/// All starts in their order, for so many contacts, behind those that what is known of the step asks for.
/// Where some of them can roll, a few with the selection of those come before others.
pub(super) fn all(
    policy: &Policy,
    contacts: usize,
    rolls: bool,
    asked: [Option<StartMethod>; 3],
) -> impl Iterator<Item = StartMethod> {
    let (first, scattered) = policy.starts(contacts);
    let rolling = first.iter().copied().take(if rolls { ROLLING_STARTS } else { 0 });
    let alike = rolls.then_some(StartMethod::Alike);
    let rest = first.iter().copied().skip(usize::from(rolls));
    asked
        .into_iter()
        .flatten()
        .chain(rolling)
        .chain(alike)
        .chain(rest)
        .chain((0..scattered).map(StartMethod::Scattered))
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
