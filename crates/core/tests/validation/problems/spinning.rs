//! A flat box that spins on level ground until friction stops it.

use super::sliding::stopping_time;
use crate::prelude::*;

/// A flat box spins on its four corners: friction at the radius R stops it after R ω/(3 μ g), while
/// its centre stays.
pub(crate) const SPINNING_BOX: TestProblem = TestProblem {
    name: "spinning-box",
    time_step: 0.002,
    inputs: &[(Mass, 1.0), (Friction, 0.3), EARTH, (Speed, 10.0)],
    ..TestProblem::solved_by(spinning_box)
};

const HALF_SIDES: Vector3<f64> = Vector3::new(0.2, 0.2, 0.02); // m

/// ω(t) = ω − 3 μ g t/R, t_stop = R ω/(3 μ g), φ = ½ ω t_stop.
fn spinning_box(inputs: &TestInputs, runner: &mut Runner<'_>) -> SolvedBy {
    let [mass, friction, gravity, spin] = inputs.all([Mass, Friction, Gravity, Speed])?;
    let (h, radius) = (runner.time_step, HALF_SIDES[0].hypot(HALF_SIDES[1]));
    let why = format!(
        "speed {spin} rad/s turns the box by more than half a radian per step; use a smaller speed \
         or time step"
    );
    Refusal::when(spin * h > 0.5, why)?;
    let deceleration = 3.0 * friction * gravity / radius;
    let (lost, time) = (deceleration * h, spin / deceleration);
    let start = State { spin: v3(0.0, 0.0, spin), ..resting(HALF_SIDES[2]) };
    let duration = 1.25 * time + 4.0 * h;
    let run =
        runner.run(&Setup::from_box(mass, HALF_SIDES, start, gravity, friction, duration)?)?;

    let discrete = recurrence(spin, run.steps(), |spin| after_step(*spin, lost, h));
    // The rim, of mobility m R²/I = 3, slides.
    let lean = HALF_SIDES[2] / HALF_SIDES[1];
    let slider = Slider { mobility: 3.0, friction, grip: friction * gravity * h, lean };
    let steps = discrete.windows(2).map(|pair| SlideStep {
        slip: 2.0 * radius / h * (0.5 * turn(h, pair[1]).0).sin(),
        share: pair[0] / lost,
    });
    let allowed = slider.tolerance(&run, steps);
    let measured: Vec<f64> = run.states(0).iter().map(|state| state.spin[2]).collect();
    let whole = discrete.iter().filter(|spin| **spin > 0.0).count() as f64;
    // The second term of the angle's error is a share of about 0.8 φ ω h of the first. It changes
    // the order by 0.6 φ ω h.
    let fine = 1.0 / (0.6 * (0.5 * spin * time) * spin * h);
    let angles = turned(run.states(0));
    let angle = |t: f64| {
        let t = t.min(time);
        spin * t - 0.5 * deceleration * t * t
    };
    let astray = run.most(0, |state| state.position.xy().norm());
    let decrement = radius * deceleration * h;
    let stop = stopping_time([&measured, &discrete], decrement, time, h, &allowed);
    let discrete_angle = discrete[1..].iter().map(|spin| turn(h, *spin).0).sum();
    let label = ("angle turned", "rad");
    Ok(vec![
        TestQuantity { convergence: order(2, whole), ..stop },
        equal(label, *last(&angles), angle(time), allowed.way() / radius)
            .stepped(discrete_angle, order(1, whole.min(fine))),
        at_most_zero(("way of the centre", "m"), astray, allowed.across),
    ])
}

/// The accumulated rotation in each state, rad.
fn turned(states: &[State]) -> Vec<f64> {
    let mut angles = vec![0.0];
    for pair in states.windows(2) {
        let (p, q) = (&pair[0].attitude, &pair[1].attitude);
        // Product of the conjugate of p with q. Only w and z are nonzero.
        let cos = p[0] * q[0] + p[3] * q[3];
        let sin = p[0] * q[3] - p[3] * q[0];
        angles.push(last(&angles) + 2.0 * sin.atan2(cos));
    }
    angles
}

/// The spin after a step of the scheme, rad/s. With the rotation θ of the step, it is the root of
/// w(ω⁺) = w(ω) − D cos ½θ⁺, or zero if w(ω) ≤ D.
fn after_step(spin: f64, lost: f64, h: f64) -> f64 {
    let before = momentum(h, spin).0;
    // The derivative lacks a share of ¼ h² D ω.
    let missed = |after: f64| {
        let (turning, slope) = momentum(h, after);
        (turning + lost * (0.5 * turn(h, after).0).cos() - before, slope)
    };
    if before > lost { newton(spin, missed) } else { 0.0 }
}
