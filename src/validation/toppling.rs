//! What it takes to topple a tall box: a push, or a slope.

use super::prelude::*;
use super::rocking::{TallBox, tilt};

/// A tall box pushed over its edge.
pub static PUSHED_OVER: Posed = Posed {
    name: "pushed-over",
    about: "A tall box turns about an edge: it topples if its spin is more than √(2 m g (R − \
            c)/I), and falls back if it is less.",
    time_step: 0.001,
    inputs: &[(Input::Mass, 3.0), EARTH],
    ..Posed::by(pushed_over)
};

/// The energy ½ I ω² must lift the centre by R − c. The step's own threshold is that of
/// the recurrence of `edge.rs`; the simulation's is looked for near it. The spin lags by up
/// to a step of deceleration, m g a h/I: first order.
fn pushed_over(inputs: &Inputs, laboratory: &mut Laboratory<'_>) -> Solved {
    let tall = TallBox::new(inputs)?;
    let (critical, balance) = (tall.critical_spin(), tall.balance());
    let (h, duration) = (laboratory.time_step(), 20.0 * tall.growth_time());
    // Past the balance, or on the way back.
    let decided = |tilt: f64, spin: f64| tilt > balance || spin < 0.0;
    let mut curve = Curve::default();
    let steps = (h, (duration / h).round() as usize);
    let around = (0.8 * critical, 1.2 * critical + h * tall.deceleration());
    let discrete = Threshold::find(around, 1e-14 * critical, |spin| {
        let over = |motion: Vec<(f64, f64)>| motion[motion.len() - 1].0 > balance;
        Ok((over(tall.discrete(spin, steps, decided)), 0.0))
    })?;
    let measured = Threshold::near(discrete.value, 1e-6 * critical, |spin| {
        let setup = tall.setup(tall.pushed(spin), duration)?;
        let run = laboratory
            .run_until(&setup, &mut |step| decided(tilt(&step.after[0]), step.after[0].spin[1]))?;
        curve = run.curve(("tilt near the threshold", "rad"), 0, tilt).beside(|_| balance);
        Ok((tilt(run.end(0)) > balance, tall.spin_slack(&run, spin)))
    })?;
    Ok(Findings {
        quantities: vec![
            exactly(
                ("spin that topples", "rad/s"),
                measured.value,
                critical,
                measured.slack + discrete.slack,
            )
            .in_steps(discrete.value, Convergence::order(1, tall.growth_time() / h)),
        ],
        curve,
    })
}

/// A tall box on a slope that gets steeper.
pub static SLOPE_TOPPLE: Posed = Posed {
    name: "slope-topple",
    about: "A tall box stands on a slope with friction enough: it topples where the slope is \
            steeper than a/c, its half width over its half height.",
    time_step: 0.002,
    inputs: &[(Input::Mass, 3.0), EARTH],
    ..Posed::by(slope_topple)
};

/// Gravity passes through the lower edge at tan θ = a/c. A box that is at rest is exactly
/// at rest, so that the step adds no error.
fn slope_topple(inputs: &Inputs, laboratory: &mut Laboratory<'_>) -> Solved {
    let tall = TallBox::new(inputs)?;
    let balance = tall.balance();
    let mut curve = Curve::default();
    let measured = Threshold::near(balance, RESOLUTION, |slope| {
        // A tilt of the resolution grows to 0.1 in this time.
        let duration = 1.2 * (0.1 / RESOLUTION).ln() * tall.growth_time();
        let setup = Setup {
            slope: slope.to_degrees(),
            ..tall.setup(resting(tall.half_sides[2]), duration)?
        };
        let run = laboratory.run_until(&setup, &mut |step| tilt(&step.after[0]) > 0.1)?;
        curve = run.curve(("tilt near the threshold", "rad"), 0, tilt);
        let over = tilt(run.end(0)) > 0.05;
        Ok((over, if over { tall.tipped(&run) } else { tall.propped(&run) }))
    })?;
    Ok(Findings {
        quantities: vec![measured.beside(("slope that topples", "rad"), balance)],
        curve,
    })
}

/// rad.
const RESOLUTION: f64 = 1e-6;

impl TallBox {
    /// How far below the threshold the residuals of `run` may tip the box over, rad: τ δω,
    /// with the spin δω that they may give it. A box that stands δ below, set turning with
    /// ω, falls back if ½ I ω² < ½ m g R δ², and τ² = I/(m g R).
    fn tipped(&self, run: &Run) -> f64 {
        self.growth_time() * self.spin_slack(run, self.critical_spin())
    }

    /// How far above the threshold the residuals of `run` may prop it up, rad. At δ above it
    /// each step pulls with g h R δ, per unit mass, about the lower edge. Against it there
    /// are what velocities lack (R + R²/(3ℓ) for a lever), a pull δ_n at each of the two upper
    /// corners, 2a away, and positions that stay behind the velocities by as much as these
    /// have grown in the time t, ¾ g δ t.
    fn propped(&self, run: &Run) -> f64 {
        let (radius, steps) = (self.radius(), run.steps() as f64);
        let reach = self.half_sides.amax();
        let pull = self.gravity * run.time_step * radius;
        let pushed = run.sum(|residual| residual.momentum) / steps;
        let pushed = pushed * (radius + radius * radius / (3.0 * reach));
        let held = 4.0 * self.half_sides[0] * run.sum(|residual| residual.normal) / steps;
        let behind = run.largest(|residual| residual.kinematics);
        let grown = 0.75 * self.gravity * run.time(run.steps());
        (pushed + held) / pull + behind / grown + run.rounding(1.0)
    }
}
