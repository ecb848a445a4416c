//! Boxes at rest on each other: what carries what.

use super::prelude::*;

/// m.
const HALF_SIDES: Vector3<f64> = Vector3::new(0.2, 0.2, 0.1);
/// Boxes of the stack.
const BOXES: usize = 10;
/// The heavy box, in masses of the light one.
const RATIO: f64 = 1e4;
/// s.
const DURATION: f64 = 1.0;

/// What box `index` of a stack stands on.
fn below(index: usize) -> Partner {
    if index == 0 { Partner::Ground } else { Partner::Body(index - 1) }
}

/// Boxes of these masses on each other, with what the forces between them must be.
struct Tower {
    /// kg, from below.
    masses: Vec<f64>,
    gravity: f64,
}

/// What was seen of a tower in all steps.
struct Seen {
    run: Run,
    /// The force under each box of each step, as a share of the weight above.
    shares: Vec<Vec<f64>>,
    /// The largest difference between two points under one box, as a share of a quarter of the force: where a box has moved by
    /// a micrometre, a corner is two points, as its edges cross those of the box below.
    uneven: f64,
    /// The longest way of a box, m.
    way: f64,
}

impl Tower {
    fn run(&self, friction: f64, laboratory: &mut Laboratory<'_>) -> Result<Seen, Unsuitable> {
        let height = |index: usize| (2.0 * index as f64 + 1.0) * HALF_SIDES[2];
        let bodies = self
            .masses
            .iter()
            .enumerate()
            .map(|(index, &mass)| Subject::solid_box(mass, HALF_SIDES, resting(height(index))));
        let bodies = bodies.collect::<Result<_, _>>()?;
        let setup = Setup::new(bodies, self.gravity, friction, DURATION);
        let (run, seen) = laboratory.watch(&setup, |step| self.look(step))?;
        let (shares, uneven): (Vec<_>, Vec<f64>) = seen.into_iter().unzip();
        let uneven = uneven.into_iter().fold(0.0, f64::max);
        let ways = (0..self.masses.len()).flat_map(|index| {
            let start = Vector3::new(0.0, 0.0, height(index));
            run.states(index).iter().map(move |state| (state.position - start).norm())
        });
        let way = ways.fold(0.0, f64::max);
        Ok(Seen { run, shares, uneven, way })
    }

    /// The forces under the boxes as shares of the weights above, and how uneven corners are.
    fn look(&self, step: &Taken<'_>) -> (Vec<f64>, f64) {
        let (mut shares, mut uneven) = (Vec::new(), 0.0_f64);
        for index in 0..self.masses.len() {
            let weight = self.gravity * self.masses[index..].iter().sum::<f64>();
            let corners = step.between(index, below(index));
            let corners: Vec<f64> = corners.map(|contact| contact.normal_force).collect();
            let most = corners.iter().copied().fold(0.0, f64::max);
            let least = corners.iter().copied().fold(f64::INFINITY, f64::min);
            shares.push(corners.iter().sum::<f64>() / weight);
            uneven = uneven.max((most - least) * CORNERS / weight);
        }
        (shares, uneven)
    }

    /// What the residuals allow a force under a box, as a share of the weight above.
    ///
    /// The force balances what is above, Σ m (g + (v⁺ − v)/h), to within Σ m δ_m/h. A box at
    /// rest is no faster than the gaps below it change, and its positions lag: with n boxes
    /// |v| ≤ n (δ_n + δ_k), at both ends of the step.
    fn force_slack(&self, run: &Run) -> f64 {
        let boxes = self.masses.len() as f64;
        let largest = |part: fn(&super::Residual) -> f64| run.largest(part);
        let astray = 2.0 * boxes * (largest(|r| r.normal) + largest(|r| r.kinematics));
        (largest(|r| r.momentum) + astray) / (self.gravity * run.time_step)
            + 16.0 * boxes * f64::EPSILON
    }

    /// How far boxes at rest may be from where they were, m: a seat each.
    fn way_slack(&self, run: &Run) -> f64 {
        self.masses.len() as f64 * (run.seat() + run.creep())
    }
}

/// A stack of equal boxes.
pub static STACK: Posed = Posed {
    name: "stack",
    about: "Ten equal boxes rest on each other: the force under each is the weight above it, \
            shared by its four corners alike.",
    time_step: 0.002,
    inputs: &[(Input::Mass, 1.0), (Input::Friction, 0.5), EARTH],
    bodies: BOXES,
    ..Posed::by(stack)
};

/// Newton's third law from the top down: N_i = (n − i) m g under box i, counted from 0 at
/// the bottom. The laws leave open how four corners share it; equal vanishing compliances
/// (native-solver.md, section 4), which the native solver takes, share it alike, for the stack
/// is symmetric. Both are those
/// of a step at rest, too, whatever h is.
fn stack(inputs: &Inputs, laboratory: &mut Laboratory<'_>) -> Solved {
    let (mass, gravity) = (inputs.get(Input::Mass)?, inputs.get(Input::Gravity)?);
    let tower = Tower { masses: vec![mass; BOXES], gravity };
    let seen = tower.run(inputs.get(Input::Friction)?, laboratory)?;
    let (slack, count) = (tower.force_slack(&seen.run), BOXES as f64);
    let last = &seen.shares[seen.shares.len() - 1];
    let error = |share: &f64| (share - 1.0).abs();
    let worst = seen.shares.iter().flatten().map(error).fold(0.0, f64::max);
    let bottom = |k: usize| count * seen.shares[k][0];
    Ok(Findings {
        quantities: vec![
            exactly(("force under the lowest box", "m g"), count * last[0], count, count * slack),
            exactly(("force under the highest box", "m g"), last[BOXES - 1], 1.0, slack),
            at_most_zero(("largest error of a force, of it", "1"), worst, slack),
            at_most_zero(
                ("largest difference of corners, of them", "1"),
                seen.uneven,
                if laboratory.selects() { EVEN } else { UNEVEN } + slack,
            ),
            at_most_zero(("longest way of a box", "m"), seen.way, tower.way_slack(&seen.run)),
        ],
        curve: seen
            .run
            .curve_of_steps(("force under the lowest box", "m g"), bottom)
            .beside(|_| count),
    })
}

/// What the laws alone allow: four forces with the sum N and no moment about the middle are ¼ N ± t
/// with t ≤ ¼ N, and differ by 2 t, twice their mean.
const UNEVEN: f64 = 2.0;

/// Of a box.
const CORNERS: f64 = 4.0;

/// What the limit of vanishing compliances may leave of a difference between equal forces: the
/// least compliance that the native solver takes it from is 1e-9, and the limit is nearer still.
const EVEN: f64 = 5e-10;

/// A heavy box on a light one, and the other way round.
pub static MASS_RATIO: Posed = Posed {
    name: "mass-ratio",
    about: "A box rests on one of a ten-thousandth of its mass, and the other way round: the light \
            one carries the heavy one, and nothing sinks.",
    time_step: 0.002,
    inputs: &[(Input::Mass, 1.0), (Input::Friction, 0.5), EARTH],
    bodies: 2,
    beyond_ipopt: Some(
        "of such masses it solves some steps in a hundred only with the native solution",
    ),
    ..Posed::by(mass_ratio)
};

/// The force under each box is the weight above it, as in [`STACK`], and the boxes stay
/// where they are.
fn mass_ratio(inputs: &Inputs, laboratory: &mut Laboratory<'_>) -> Solved {
    let [mass, gravity, friction] = inputs.all([Input::Mass, Input::Gravity, Input::Friction])?;
    let heavy_above = Tower { masses: vec![mass, RATIO * mass], gravity };
    let heavy_below = Tower { masses: vec![RATIO * mass, mass], gravity };
    let above = heavy_above.run(friction, laboratory)?;
    let below = heavy_below.run(friction, laboratory)?;
    let share = |name: &'static str, tower: &Tower, seen: &Seen, index: usize| {
        let last = &seen.shares[seen.shares.len() - 1];
        let slack = tower.force_slack(&seen.run);
        exactly((name, "1"), last[index], 1.0, slack)
    };
    let way = above.way.max(below.way);
    let slack = heavy_above.way_slack(&above.run).max(heavy_below.way_slack(&below.run));
    Ok(Findings {
        quantities: vec![
            share("heavy on light: force between, of weight", &heavy_above, &above, 1),
            share("heavy on light: force of ground, of weight", &heavy_above, &above, 0),
            share("light on heavy: force between, of weight", &heavy_below, &below, 1),
            share("light on heavy: force of ground, of weight", &heavy_below, &below, 0),
            at_most_zero(("longest way of a box", "m"), way, slack),
        ],
        curve: above
            .run
            .curve_of_steps(("heavy on light: force between, of weight", "1"), |k| {
                above.shares[k][1]
            })
            .beside(|_| 1.0),
    })
}
