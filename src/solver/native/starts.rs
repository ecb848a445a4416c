//! Where an iteration starts, in the order in which starts are tried.

use super::equations::StepEquations;
use nalgebra::Vector3;
use rand_mt::Mt;
use std::f64::consts::TAU;

/// A start of Newton's method.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) enum Start {
    /// The impulses of the previous step: enough for more than 99.7 % of contact steps.
    Previous,
    /// No impulses.
    Zero,
    /// An interior point's answer, itself started with normal impulses of this multiple
    /// of the momentum: finds the jams, where one point takes all momentum.
    InteriorPoint(f64),
    /// Impulses scattered over the cones, by number; the same for every step.
    Scattered(u32),
}

/// How many scattered starts are tried before a step is given up.
const MOST_SCATTERED: u32 = 1024;

const FIRST: [Start; 7] = [
    Start::Previous,
    Start::Zero,
    Start::InteriorPoint(1.0),
    Start::InteriorPoint(0.1),
    Start::InteriorPoint(10.0),
    Start::InteriorPoint(0.01),
    Start::InteriorPoint(100.0),
];

impl Start {
    /// The word of a report.
    pub(super) fn name(self) -> &'static str {
        match self {
            Self::Previous => "previous",
            Self::Zero => "zero",
            Self::InteriorPoint(_) => "interior point",
            Self::Scattered(_) => "scattered",
        }
    }
}

/// All starts in their order.
pub(super) fn all() -> impl Iterator<Item = Start> {
    FIRST.into_iter().chain((0..MOST_SCATTERED).map(Start::Scattered))
}

/// Scattered start `number`: each candidate with even odds open or pressed by up to a
/// multiple of the momentum (one for all candidates, between 0.01 and 10), its friction
/// anywhere in the cone.
pub(super) fn scatter(number: u32, equations: &StepEquations, impulses: &mut Vec<Vector3<f64>>) {
    let mut twister = Mt::new(number);
    let mut uniform = || f64::from(twister.next_u32()) / f64::from(u32::MAX);
    let strength = equations.speed() * 10_f64.powf(3.0 * uniform() - 2.0);
    for candidate in equations.candidates() {
        let (open, press, spread, angle) = (uniform() < 0.5, uniform(), uniform(), TAU * uniform());
        let normal = if open { 0.0 } else { strength * press };
        let friction = candidate.friction * normal * spread.sqrt();
        let impulse = Vector3::new(friction * angle.cos(), friction * angle.sin(), normal);
        impulses.push(candidate.frame * impulse);
    }
}
