//! Thresholds for toppling a tall box: a push, and a slope.

use super::rocking::TallBox;
use crate::edge::{Planar, tilt};
use crate::prelude::*;

/// A tall box turns about an edge: it topples if its spin is more than √(2 m g (R − c)/I), and
/// falls back if it is less.
pub(crate) const PUSHED_OVER: TestProblem = TestProblem {
    name: "pushed-over",
    time_step: 0.001,
    inputs: &[(Mass, 3.0), EARTH],
    ..TestProblem::solved_by(pushed_over)
};

/// ½ I ω² = m g (R − c) at the threshold, discrete by the recurrence of `edge.rs`.
fn pushed_over(inputs: &TestInputs, runner: &mut Runner<'_>) -> SolvedBy {
    let tall = TallBox::new(inputs)?;
    let (critical, balance) = (tall.critical_spin(), tall.balance());
    let (h, duration) = (runner.time_step, 20.0 * tall.growth_time());
    // The box is beyond the balance or returns.
    let decided = |state: &Planar| state.tilt > balance || state.spin < 0.0;
    let around = [0.8 * critical, 1.2 * critical + h * tall.deceleration()];
    let discrete = Threshold::find(around, 1e-14 * critical, |spin| {
        let motion = tall.discrete(h, spin, duration, decided);
        Ok((last(&motion).tilt > balance, 0.0))
    })?;
    let measured = Threshold::near(discrete.value, 1e-6 * critical, |spin| {
        let setup = tall.setup(tall.pushed(spin), duration)?;
        let run = runner.run_until(&setup, |step| decided(&Planar::from_state(&step.after[0])))?;
        Ok((tilt(run.end(0)) > balance, tall.spin_tolerance(&run, spin)))
    })?;
    let tolerance = measured.tolerance + discrete.tolerance;
    let spin = equal(("spin that topples", "rad/s"), measured.value, critical, tolerance);
    Ok(vec![spin.stepped(discrete.value, order(1, tall.growth_time() / h))])
}

/// A tall box stands on a slope with friction enough: it topples where the slope is steeper than
/// a/c, its half width over its half height.
pub(crate) const SLOPE_TOPPLE: TestProblem = TestProblem {
    name: "slope-topple",
    time_step: 0.002,
    inputs: &[(Mass, 3.0), EARTH],
    ..TestProblem::solved_by(slope_topple)
};

const RESOLUTION: f64 = 1e-6; // rad

/// tan θ = a/c at the threshold.
fn slope_topple(inputs: &TestInputs, runner: &mut Runner<'_>) -> SolvedBy {
    let tall = TallBox::new(inputs)?;
    let balance = tall.balance();
    let measured = Threshold::near(balance, RESOLUTION, |slope| {
        // A tilt of the resolution grows to 0.1 in this time.
        let duration = 1.2 * (0.1 / RESOLUTION).ln() * tall.growth_time();
        let level = tall.setup(resting(tall.half_sides[2]), duration)?;
        let setup = Setup { slope: slope.to_degrees(), ..level };
        let run = runner.run_until(&setup, |step| tilt(&step.after[0]) > 0.1)?;
        let over = tilt(run.end(0)) > 0.05;
        Ok((over, if over { tall.tipped(&run) } else { tall.propped(&run) }))
    })?;
    Ok(vec![measured.equals(("slope that topples", "rad"), balance)])
}

impl TallBox {
    /// The angle below the threshold at which residuals may tip the box over, rad: τ δω for their spin δω,
    /// τ² = I/(m g R).
    fn tipped(&self, run: &TestRun) -> f64 {
        self.growth_time() * self.spin_tolerance(run, self.critical_spin())
    }

    /// The angle above the threshold at which residuals may prop the box up, rad. Gravity causes
    /// g h R δ in a step at the angle δ. Residuals of velocities (lever R + R²/(3ℓ)), of two upper
    /// corners (2a) and of positions (¾ g δ t) act against it.
    fn propped(&self, run: &TestRun) -> f64 {
        let (radius, steps) = (self.radius(), run.steps() as f64);
        let pull = self.gravity * run.time_step * radius;
        let pushed = run.sum(|r| r.momentum) / steps;
        let pushed = pushed * (radius + radius * radius / (3.0 * self.half_sides.amax()));
        let held = 4.0 * self.half_sides[0] * run.sum(|r| r.normal) / steps;
        let grown = 0.75 * self.gravity * run.end_time();
        (pushed + held) / pull + run.largest(|r| r.kinematics) / grown + run.rounding(1.0)
    }
}
