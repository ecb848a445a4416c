//! Derivatives of runs of random articulated bodies, by initial states, wrenches, joint forces and
//! motor targets, against differences of runs.
//!
//! A difference that does not agree needs a mark: a diagnostic of the gradient, or of the runs,
//! that says why.

mod directions;
mod runs;
mod tree;

use super::draw::Draw;
use crate::common::prelude::*;
use directions::{Direction, directions};
use rand_mt::Mt;
use runs::{Inputs, Steps, beside, gradient, run, warmed_up};
use std::collections::BTreeMap;
use tree::{Situation, Tree};
use tumble_core::simulation::RunGradient;

/// Largest relative error of a derivative.
const EXACT: f64 = 1e-6;
/// Step sizes of the differences, in the units of a body.
const SIZES: [f64; 3] = [1e-3, 1e-4, 1e-5];

/// Result of a comparison.
#[derive(Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Debug)]
enum Mark {
    Agrees,
    /// The error is below the accuracy of the solutions over the step size.
    Digits,
    /// A step of the run, or of all runs beside it, is not solved.
    Unsolved,
    /// Contacts with unknown features.
    Unknown,
    /// Force distributions that were kept.
    Kept,
    /// A margin is smaller than the change by the smallest difference.
    Margin,
    /// The same for a feature margin.
    FeatureMargin,
    /// Changed starts are beyond the limits of a joint, and refused.
    Refused,
    Missed,
}

/// Numbers of comparisons by situation and mark.
#[derive(Default)]
struct Tally {
    marks: BTreeMap<(&'static str, Mark), usize>,
    worst: f64,
    missed: Vec<String>,
    refused: usize,
    /// Bodies on the ground with a loaded contact in the run.
    touching: usize,
}

impl Tally {
    fn count(&self, mark: Mark) -> usize {
        self.marks.iter().filter(|((_, own), _)| *own == mark).map(|(_, count)| count).sum()
    }

    fn all(&self) -> usize {
        self.marks.values().sum()
    }
}

/// Largest difference of speeds and of impulses over mass of two runs (m/s).
fn change(tree: &Tree, one: &Steps, other: &Steps) -> f64 {
    let (bodies, h) = (tree.world.bodies(), tree.world.time_step());
    let mass = bodies.iter().map(RigidBody::mass).fold(f64::INFINITY, f64::min);
    let mut most = 0.0_f64;
    for (one, other) in one.records.iter().zip(&other.records) {
        for ((a, b), body) in one.next_states().iter().zip(other.next_states()).zip(bodies) {
            let speeds = (a.velocity - b.velocity).norm() + body.reach() * (a.spin - b.spin).norm();
            most = most.max(speeds);
        }
        let beyond = |one: &[_], other: &[_]| {
            let each = one.iter().map(|a: &ContactForce| {
                let same = other.iter().find(|b: &&ContactForce| b.key == a.key);
                (a.force - same.map_or(Vector3::zeros(), |same| same.force)).norm()
            });
            each.fold(0.0, f64::max) * h / mass
        };
        let (a, b) = (&one.first().solution.contacts, &other.first().solution.contacts);
        most = most.max(beyond(a, b)).max(beyond(b, a));
    }
    most
}

/// Gradient of a run and what it is compared with.
struct Comparison<'t> {
    tree: &'t Tree,
    inputs: &'t [Inputs],
    base: Steps,
    weights: Vec<StateChange>,
    found: RunGradient,
}

impl<'t> Comparison<'t> {
    fn new(tree: &'t Tree, inputs: &'t [Inputs], draw: &mut Draw) -> Option<Self> {
        let units = tree.units;
        let one = |_| StateChange {
            position: draw.vector(1.0 / units.length),
            turn: draw.vector(1.0),
            velocity: draw.vector(1.0 / units.speed()),
            spin: draw.vector(units.time),
        };
        let weights: Vec<_> = tree.states.iter().map(one).collect();
        let base = run(&tree.world, tree.states.clone(), inputs, None)?;
        let found = gradient(tree, inputs, &weights);
        Some(Self { tree, inputs, base, weights, found })
    }

    /// Scalar after a run, relative to that of the base.
    fn value(&self, steps: &Steps) -> Option<f64> {
        let (base, end) = (self.base.records.last()?, steps.records.last()?);
        let each = base.next_states().iter().zip(end.next_states()).zip(&self.weights);
        Some(each.map(|((a, b), weight)| weight.dot(&StateChange::between(a, b))).sum())
    }

    /// Judges the derivative along a direction, and returns its error.
    fn judged(&self, along: &Direction) -> (Mark, f64) {
        let products = along.products(self.tree, &self.found);
        let slope: f64 = products.iter().sum();
        // Typical size of the sum: its terms have random signs.
        let typical = products.iter().map(|product| product * product).sum::<f64>().sqrt();
        let count = self.tree.states.len() as f64;
        // Accuracy of the solutions relative to the speed scale.
        let exact = 3e-11 * count;
        let (mut best, mut beyond, mut moved) = (f64::INFINITY, f64::INFINITY, f64::INFINITY);
        let mut all_refused = true;
        for size in SIZES {
            let ends =
                [-2.0, -1.0, 1.0, 2.0].map(|k| beside(self.tree, self.inputs, along, k * size));
            let [Some(back2), Some(back), Some(ahead), Some(ahead2)] = ends else { continue };
            all_refused = false;
            let ends = [back2, back, ahead, ahead2];
            if ends.iter().any(|steps| !steps.is_solved) {
                continue;
            }
            let [back2, back, ahead, ahead2] = ends.each_ref().map(|end| self.value(end).unwrap());
            // Error of order size⁴.
            let expected = (8.0 * (ahead - back) - (ahead2 - back2)) / (12.0 * size);
            let scale = typical.max(slope.abs()).max(expected.abs()).max(1e-9);
            let error = (slope - expected).abs() / scale;
            best = best.min(error);
            beyond = beyond.min(error - exact / size / scale);
            let each = ends.iter().map(|end| change(self.tree, &self.base, end));
            moved = moved.min(each.fold(0.0, f64::max));
        }
        let found = &self.found;
        let mark = if best <= EXACT {
            Mark::Agrees
        } else if all_refused {
            Mark::Refused
        } else if found.unsolved > 0 || best == f64::INFINITY {
            Mark::Unsolved
        } else if found.unknown > 0 {
            Mark::Unknown
        } else if found.kept > 0 {
            Mark::Kept
        } else if found.margin.0 < 2.0 * moved {
            Mark::Margin
        } else if found.feature_margin.0 < 2.0 * moved {
            Mark::FeatureMargin
        } else if beyond <= EXACT {
            Mark::Digits
        } else {
            Mark::Missed
        };
        (mark, best)
    }
}

/// Compares `count` articulated bodies, in all situations and sizes in turn.
fn compare_all(count: usize) {
    let mut tally = Tally::default();
    for number in 0..count {
        let mut draw = Draw(Mt::new(1000 + number as u32));
        let situation = Situation::ALL[number % 4];
        let length = [0.01, 1.0, 100.0][number / 4 % 3];
        let mut tree = draw.tree(situation, length);
        let steps = 3 + number % 4;
        let Some(inputs) = warmed_up(&mut tree, situation, steps) else {
            tally.refused += 1;
            continue;
        };
        let all = directions(&tree, steps, &mut draw);
        let Some(comparison) = Comparison::new(&tree, &inputs, &mut draw) else {
            tally.refused += 1;
            continue;
        };
        let loaded = |record: &StepRecord| {
            record.first().solution.contacts.iter().any(ContactForce::carries_force)
        };
        tally.touching += usize::from(comparison.base.records.iter().any(loaded));
        for along in &all {
            let (mark, error) = comparison.judged(along);
            let name = match situation {
                Situation::Flying => "flying",
                Situation::Lying => "lying",
                Situation::Sliding => "sliding",
                Situation::Walking => "walking",
            };
            *tally.marks.entry((name, mark)).or_default() += 1;
            if mark == Mark::Agrees {
                tally.worst = tally.worst.max(error);
            }
            if mark == Mark::Missed {
                let RunGradient { margin, feature_margin, .. } = &comparison.found;
                tally.missed.push(format!(
                    "{number} {name} {length} m, {} links, {}: {error:.1e}, margins {:.1e} {:.1e}",
                    tree.states.len(),
                    along.name,
                    margin.0,
                    feature_margin.0
                ));
            }
        }
    }
    for ((situation, mark), count) in &tally.marks {
        println!("{situation} {mark:?}: {count}");
    }
    println!("{} of {count} touch the ground", tally.touching);
    println!("{} of {count} starts refused, worst agreement {:.1e}", tally.refused, tally.worst);
    assert!(tally.missed.is_empty(), "{}", tally.missed.join("\n"));
    assert!(2 * tally.count(Mark::Agrees) > tally.all());
    assert!(3 * tally.touching > 2 * count);
}

#[test]
fn a_few_articulated_bodies_against_differences() {
    compare_all(48);
}

#[test]
#[ignore = "slow"]
fn a_thousand_articulated_bodies_against_differences() {
    compare_all(1000);
}
