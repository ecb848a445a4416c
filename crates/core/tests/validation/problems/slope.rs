//! A box let go on a slope.

use crate::prelude::*;

/// A box on a slope for a minute: below atan μ, as usually, it stays where it is and does not
/// creep; above, it slides.
pub(crate) const STICK: TestProblem = TestProblem {
    name: "slope-stick",
    time_step: 0.01,
    inputs: &[(Mass, 2.0), (Friction, 0.4), EARTH, (Slope, 20.0)],
    ..TestProblem::solved_by(|inputs, runner| let_go(inputs, runner, 60.0))
};

/// A box on a slope: above atan μ, as usually, it slides with a = g (sin θ − μ cos θ); below, it
/// stays.
pub(crate) const SLIDE: TestProblem = TestProblem {
    name: "slope-slide",
    time_step: 0.002,
    inputs: &[(Mass, 2.0), (Friction, 0.4), EARTH, (Slope, 30.0)],
    ..TestProblem::solved_by(|inputs, runner| let_go(inputs, runner, 2.0))
};

const HALF_SIDES: Vector3<f64> = Vector3::new(0.2, 0.15, 0.1); // m

/// a = max(0, g (sin θ − μ cos θ)), v = a t and x = ½ a t².
fn let_go(inputs: &TestInputs, runner: &mut Runner<'_>, duration: f64) -> SolvedBy {
    let [mass, friction, g, slope] = inputs.all([Mass, Friction, Gravity, Slope])?;
    let (sin, cos) = slope.to_radians().sin_cos();
    let why = format!(
        "with mu {friction} on a slope of {slope}° the box tips over; use a smaller mu or slope"
    );
    Refusal::when(friction.min(sin / cos) * HALF_SIDES[2] >= 0.95 * HALF_SIDES[0], why)?;
    let (along, onto) = (g * sin, g * cos);
    let pull = along - friction * onto;
    // A slope of atan μ to the last digit sticks.
    let a = if pull > 1e-12 * along { pull } else { 0.0 };
    let setup = Setup::from_box(mass, HALF_SIDES, resting(HALF_SIDES[2]), g, friction, duration)?;
    let run = runner.run(&Setup { slope, ..setup })?;
    let (h, t, end) = (run.time_step, run.end_time(), run.end(0));
    let grip = friction * onto * h;
    let slider = Slider { mobility: 1.0, friction, grip, lean: HALF_SIDES[2] / HALF_SIDES[1] };
    let share = along * h / grip;
    let exact = (1..=run.steps()).map(|k| SlideStep { slip: k as f64 * a * h, share });
    let allowed = slider.tolerance(&run, exact);
    let astray = end.position[1].hypot(end.position[2] - HALF_SIDES[2]);
    let way = ("way down the slope", "m");
    Ok(vec![
        run.accelerated(way, end.position[0], a, allowed.way()),
        equal(("speed down the slope", "m/s"), end.velocity[0], a * t, allowed.speed()),
        at_most_zero(("way across and off the slope", "m"), astray, allowed.across + run.seat()),
    ])
}
