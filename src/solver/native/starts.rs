//! Where an iteration starts, in the order in which starts are tried.

use super::equations::Candidate;
use super::tolerances::ROLLING_STARTS;
use nalgebra::Vector3;
use rand_mt::Mt;
use std::f64::consts::TAU;

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

/// ε where a path of compliance starts: a tenth of a body's own response.
pub(super) const SOFTEST: f64 = 0.1;

/// For one body: a few unknowns, so that many starts cost little.
const ALONE: [Start; 9] = [
    Start::Previous,
    Start::Zero,
    Start::InteriorPoint(1.0),
    Start::InteriorPoint(0.1),
    Start::InteriorPoint(10.0),
    Start::InteriorPoint(0.01),
    Start::InteriorPoint(100.0),
    Start::Compliant(0.1),
    Start::Compliant(0.3),
];
/// How many scattered starts are tried for one body before a step is given up.
const SCATTERED_ALONE: u32 = 1024;

/// For several bodies: in the order of what they solve for their cost.
const TOGETHER: [Start; 15] = [
    Start::Previous,
    Start::Kept,
    Start::Best(1e-3),
    Start::Compliant(0.1),
    Start::Best(1e-5),
    Start::Zero,
    Start::Swept(30),
    Start::InteriorPoint(1.0),
    Start::Best(1e-1),
    Start::InteriorPoint(0.1),
    Start::InteriorPoint(10.0),
    Start::Compliant(0.3),
    Start::Swept(300),
    Start::InteriorPoint(0.01),
    Start::Best(1e-3),
];
const SCATTERED_TOGETHER: u32 = 16;

/// For several bodies with more than [`CROWDED`] contacts: what is far from a solution leads nowhere
/// there, and the best point so far nearly always on.
const CROWD: [Start; 12] = [
    Start::Previous,
    Start::Kept,
    Start::Best(1e-3),
    Start::Compliant(0.1),
    Start::Best(1e-1),
    Start::InteriorPoint(1.0),
    Start::Best(1e-4),
    Start::Swept(30),
    Start::Best(1e-2),
    Start::Zero,
    Start::Best(1e-5),
    Start::Best(1e-3),
];
const CROWDED: usize = 64;

impl Start {
    /// The word of a report.
    pub(super) fn name(self) -> &'static str {
        match self {
            Self::Previous => "previous",
            Self::Alike => "equal compliance",
            Self::Kept => "kept",
            Self::Best(_) => "best",
            Self::Zero => "zero",
            Self::Compliant(_) => "compliance",
            Self::InteriorPoint(_) => "interior point",
            Self::Swept(_) => "sweeps",
            Self::Scattered(_) => "scattered",
        }
    }
}

/// All starts in their order, for so many bodies and contacts. Where some of them can roll, a few with
/// the selection of those come first.
pub(super) fn all(bodies: usize, contacts: usize, rolls: bool) -> impl Iterator<Item = Start> {
    let (first, scattered) = match bodies {
        1 => (ALONE.as_slice(), SCATTERED_ALONE),
        _ if contacts > CROWDED => (CROWD.as_slice(), 0),
        _ => (TOGETHER.as_slice(), SCATTERED_TOGETHER),
    };
    let rolling = first.iter().copied().take(if rolls { ROLLING_STARTS } else { 0 });
    let alike = rolls.then_some(Start::Alike);
    let rest = first.iter().copied().skip(usize::from(rolls));
    rolling.chain(alike).chain(rest).chain((0..scattered).map(Start::Scattered))
}

/// Scattered start `number`: each candidate with even odds open or pressed by up to a
/// multiple of the momentum (one for all candidates, between 0.01 and 10), its friction
/// anywhere in the cone.
pub(super) fn scatter(
    number: u32,
    candidates: &[Candidate],
    speed: f64,
    impulses: &mut Vec<Vector3<f64>>,
) {
    let mut twister = Mt::new(number);
    let mut uniform = || f64::from(twister.next_u32()) / f64::from(u32::MAX);
    let strength = speed * libm::exp10(3.0 * uniform() - 2.0);
    for candidate in candidates {
        let (open, press, spread, angle) = (uniform() < 0.5, uniform(), uniform(), TAU * uniform());
        let normal = if open { 0.0 } else { strength * press };
        let friction = candidate.friction * normal * spread.sqrt();
        let (sin, cos) = libm::sincos(angle);
        let impulse = Vector3::new(friction * cos, friction * sin, normal);
        impulses.push(candidate.frame * impulse);
    }
}
