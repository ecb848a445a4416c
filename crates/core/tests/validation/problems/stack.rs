//! Boxes at rest on each other.

use crate::prelude::*;

const HALF_SIDES: Vector3<f64> = Vector3::new(0.2, 0.2, 0.1); // m
const BOXES: usize = 10; // Boxes of the stack
const RATIO: f64 = 1e4; // The heavy box, in masses of the light one
const DURATION: f64 = 1.0; // s
const CORNERS: f64 = 4.0; // Corners of a face
/// The largest difference of the forces at two corners by the laws alone, in their mean.
const UNEVEN: f64 = 2.0;
/// The difference of equal forces in the minimum-compliance limit: the native solver's smallest
/// compliance is 1e-9.
const EVEN: f64 = 5e-10;

/// A tower of boxes and the results of its run.
struct Tower {
    /// The force under each box in each step, as a share of the weight above.
    shares: Vec<Vec<f64>>,
    /// The largest difference between two corners under a box, as a share of a quarter of the force.
    uneven: f64,
    /// The longest distance of a box from its start, m, and its tolerance.
    way: f64,
    way_tolerance: f64,
    tolerance: f64, // The tolerance of a share
}

impl Tower {
    /// Boxes of these masses, from below.
    fn stand(
        inputs: &TestInputs,
        masses: &[f64],
        runner: &mut Runner<'_>,
    ) -> Result<Self, Refusal> {
        let [gravity, friction] = inputs.all([Gravity, Friction])?;
        let height = |index: usize| (2.0 * index as f64 + 1.0) * HALF_SIDES[2];
        let bodies = masses.iter().enumerate();
        let bodies =
            bodies.map(|(k, &mass)| Subject::solid_box(mass, HALF_SIDES, resting(height(k))));
        let bodies = bodies.collect::<Result<_, _>>()?;
        let (run, seen) =
            runner.watch(&Setup::new(bodies, gravity, friction, DURATION), |step| {
                let (mut shares, mut uneven) = (Vec::new(), 0.0_f64);
                for index in 0..masses.len() {
                    let weight = gravity * masses[index..].iter().sum::<f64>();
                    let below = if index == 0 { Partner::Ground } else { Partner::Body(index - 1) };
                    let corners = step.between(index, below).map(|contact| contact.normal_force);
                    let corners: Vec<_> = corners.collect();
                    let least = corners.iter().copied().fold(f64::INFINITY, f64::min);
                    shares.push(corners.iter().sum::<f64>() / weight);
                    uneven = uneven.max((largest(corners) - least) * CORNERS / weight);
                }
                (shares, uneven)
            })?;
        let (shares, uneven): (Vec<_>, Vec<f64>) = seen.into_iter().unzip();
        let ways = (0..masses.len()).map(|index| run.strayed(index));
        let (way, uneven) = (largest(ways), largest(uneven));
        let count = masses.len() as f64;
        let tolerance = force_tolerance(&run, gravity, count);
        // A seat for each box.
        let way_tolerance = count * (run.seat() + run.creep());
        Ok(Self { shares, uneven, way, way_tolerance, tolerance })
    }
}

/// The tolerance of the force under a box, as a share of the weight above: (δ_m + 2 n (δ_n + δ_k))/(g h)
/// for n boxes.
fn force_tolerance(run: &TestRun, gravity: f64, boxes: f64) -> f64 {
    let astray = 2.0 * boxes * (run.largest(|r| r.normal) + run.largest(|r| r.kinematics));
    (run.largest(|r| r.momentum) + astray) / (gravity * run.time_step) + 16.0 * boxes * f64::EPSILON
}

/// Ten equal boxes rest on each other: the force under each is the weight above it, shared by its
/// four corners alike.
pub(crate) const STACK: TestProblem = TestProblem {
    name: "stack",
    time_step: 0.002,
    inputs: &[(Mass, 1.0), (Friction, 0.5), EARTH],
    bodies: BOXES,
    ..TestProblem::solved_by(stack)
};

/// N_i = (n − i) m g under box i, counted from 0 at the bottom. Corners share it equally with the
/// selection rule, the minimum-compliance limit.
fn stack(inputs: &TestInputs, runner: &mut Runner<'_>) -> SolvedBy {
    let [mass] = inputs.all([Mass])?;
    let tower = Tower::stand(inputs, &[mass; BOXES], runner)?;
    let (allowed, count, last) = (tower.tolerance, BOXES as f64, last(&tower.shares));
    let worst = largest(tower.shares.iter().flatten().map(|share| (share - 1.0).abs()));
    let uneven = if runner.selects { EVEN } else { UNEVEN } + allowed;
    let lowest = ("force under the lowest box", "m g");
    Ok(vec![
        equal(lowest, count * last[0], count, count * allowed),
        equal(("force under the highest box", "m g"), last[BOXES - 1], 1.0, allowed),
        at_most_zero(("largest error of a force, of it", "1"), worst, allowed),
        at_most_zero(("largest difference of corners, of them", "1"), tower.uneven, uneven),
        at_most_zero(("longest way of a box", "m"), tower.way, tower.way_tolerance),
    ])
}

/// A box rests on one of a ten-thousandth of its mass, and the other way round: the light one
/// carries the heavy one, and nothing sinks.
pub(crate) const MASS_RATIO: TestProblem = TestProblem {
    name: "mass-ratio",
    time_step: 0.002,
    inputs: &[(Mass, 1.0), (Friction, 0.5), EARTH],
    bodies: 2,
    // Ipopt: with such mass ratios, it solves a few percent of the steps only from the native solution.
    ..TestProblem::solved_by(mass_ratio)
};

/// The force under each box is the weight above it.
fn mass_ratio(inputs: &TestInputs, runner: &mut Runner<'_>) -> SolvedBy {
    let [mass] = inputs.all([Mass])?;
    let above = Tower::stand(inputs, &[mass, RATIO * mass], runner)?;
    let below = Tower::stand(inputs, &[RATIO * mass, mass], runner)?;
    let share = |name: &'static str, tower: &Tower, index: usize| {
        equal((name, "1"), last(&tower.shares)[index], 1.0, tower.tolerance)
    };
    let way = above.way.max(below.way);
    let way_tolerance = above.way_tolerance.max(below.way_tolerance);
    Ok(vec![
        share("heavy on light: force between, of weight", &above, 1),
        share("heavy on light: force of ground, of weight", &above, 0),
        share("light on heavy: force between, of weight", &below, 1),
        share("light on heavy: force of ground, of weight", &below, 0),
        at_most_zero(("longest way of a box", "m"), way, way_tolerance),
    ])
}
