//! A flat box that spins on level ground until friction stops it.

use super::prelude::*;
use super::stopping::stopping_time;

/// A flat box spinning about the vertical.
pub static SPINNING_BOX: Posed = Posed {
    name: "spinning-box",
    about: "A flat box spins on its four corners: friction at the radius R stops it after R ω/(3 μ \
            g), while its centre stays.",
    time_step: 0.002,
    inputs: &[(Input::Mass, 1.0), (Input::Friction, 0.3), EARTH, (Input::Speed, 10.0)],
    unit_of_speed: "rad/s",
    ..Posed::by(spinning_box)
};

/// Friction at every corner is along its circle, together μ m g however the corners
/// share the weight, with the arm R = √(a² + b²). With I = m (a² + b²)/3 = m R²/3:
///
/// ```text
/// ω(t) = ω − 3 μ g t/R,   t_stop = R ω/(3 μ g),   φ = ½ ω t_stop
/// ```
///
/// [`Spinner`] has the step's.
fn spinning_box(inputs: &Inputs, laboratory: &mut Laboratory<'_>) -> Solved {
    let spinner = Spinner::new(inputs, laboratory.time_step())?;
    let mut start = resting(HALF_SIDES[2]);
    start.spin = Vector3::new(0.0, 0.0, spinner.spin);
    let (h, time) = (laboratory.time_step(), spinner.spin / spinner.deceleration());
    let bodies = vec![Subject::solid_box(inputs.get(Input::Mass)?, HALF_SIDES, start)?];
    let duration = 1.25 * time + 4.0 * h;
    let run = laboratory.run(&Setup::new(bodies, spinner.gravity, spinner.friction, duration))?;

    let discrete = spinner.discrete_spins(h, run.steps());
    let (slack, radius) = (spinner.slack(&run, &discrete), radius());
    let measured: Vec<f64> = run.states(0).iter().map(|state| state.spin[2]).collect();
    let whole = discrete.iter().filter(|spin| **spin > 0.0).count() as f64;
    // The second term of the angle's error is a share ¼ φ ω h of the first.
    let fine = 4.0 / (0.5 * spinner.spin * time * spinner.spin * h);
    let angles = turned(run.states(0));
    let angle = |t: f64| {
        let t = t.min(time);
        spinner.spin * t - 0.5 * spinner.deceleration() * t * t
    };
    let astray = run.states(0).iter().map(|state| state.position.xy().norm()).fold(0.0, f64::max);
    let decrement = radius * spinner.deceleration() * h;
    let stop = stopping_time((&measured, &discrete), decrement, time, h, &slack);
    Ok(Findings {
        quantities: vec![
            Quantity { convergence: Convergence::order(2, whole), ..stop },
            exactly(
                ("angle turned", "rad"),
                angles[angles.len() - 1],
                angle(time),
                slack.way() / radius,
            )
            .in_steps(
                discrete[1..].iter().map(|spin| turn(h, *spin)).sum(),
                Convergence::order(1, whole.min(fine)),
            ),
            at_most_zero(("way of the centre", "m"), astray, slack.across),
        ],
        curve: Curve::of(("angle turned", "rad"), &run, |k| angles[k]).beside(angle),
    })
}

/// m.
const HALF_SIDES: Vector3<f64> = Vector3::new(0.2, 0.2, 0.02);
/// Enough for the spin of a step to settle to the last digit.
const ROUNDS: usize = 40;

/// R, m.
fn radius() -> f64 {
    HALF_SIDES[0].hypot(HALF_SIDES[1])
}

/// A box that spins on its four corners.
///
/// The step turns it by ψ = 2 atan(½ h ω⁺), so that a corner's mean slip is along a chord,
/// and friction, against it, has the arm R cos ½ψ at the attitude of the step's start. The
/// spin after the step is the root of
///
/// ```text
/// w(ω⁺) = w(ω) − D/√(1 + (½ h ω⁺)²),   w(ω) = ω (1 + (½ h ω)²),   D = 3 μ g h/R
/// ```
///
/// or zero if w(ω) ≤ D. Since the arm is shorter by a share of at most (ω h)²/8, the stop comes
/// later, to second order in h; the angle φ, which goes with the spin at the step's end, lacks
/// ½ ω h, and gains up to φ (ω h)²/8 by the longer time.
struct Spinner {
    friction: f64,
    gravity: f64,
    /// At the start, rad/s.
    spin: f64,
}

/// What a step turns the box by, rad.
fn turn(h: f64, spin: f64) -> f64 {
    2.0 * (0.5 * h * spin).atan()
}

/// The angle that the box has turned by in each state, rad: the sum of the angles between
/// attitudes.
fn turned(states: &[State]) -> Vec<f64> {
    let mut angles = vec![0.0];
    for pair in states.windows(2) {
        let (p, q) = (&pair[0].attitude, &pair[1].attitude);
        // The conjugate of p times q, of which w and z remain.
        let cos = p[0] * q[0] + p[3] * q[3];
        let sin = p[0] * q[3] - p[3] * q[0];
        angles.push(angles[angles.len() - 1] + 2.0 * sin.atan2(cos));
    }
    angles
}

impl Spinner {
    fn new(inputs: &Inputs, h: f64) -> Result<Self, Unsuitable> {
        let [friction, gravity, spin] =
            inputs.all([Input::Friction, Input::Gravity, Input::Speed])?;
        Unsuitable::when(spin * h > 0.5, || {
            format!("speed {spin} rad/s turns the box by more than half a radian a step")
        })?;
        Ok(Self { friction, gravity, spin })
    }

    /// 3 μ g/R, rad/s².
    fn deceleration(&self) -> f64 {
        3.0 * self.friction * self.gravity / radius()
    }

    /// The spin at the start and after each step, rad/s.
    fn discrete_spins(&self, h: f64, steps: usize) -> Vec<f64> {
        let lost = self.deceleration() * h;
        let mut spins = vec![self.spin];
        for k in 0..steps {
            let before = momentum(h, spins[k]).0;
            let mut after = 0.0;
            if before > lost {
                // Newton's method, whose slope lacks a share of ¼ h² D ω.
                after = spins[k];
                for _ in 0..ROUNDS {
                    let (turning, slope) = momentum(h, after);
                    let missed = turning + lost / (0.5 * h * after).hypot(1.0) - before;
                    after -= missed / slope;
                }
            }
            spins.push(after);
        }
        spins
    }

    /// The rim, of mobility m R²/I = 3, is what slides.
    fn slack(&self, run: &Run, spins: &[f64]) -> SlideSlack {
        let h = run.time_step;
        let grip = self.friction * self.gravity * h;
        let lean = HALF_SIDES[2] / HALF_SIDES[1];
        let slider = Slider { mobility: 3.0, friction: self.friction, grip, lean };
        let lost = self.deceleration() * h;
        let steps = spins.windows(2).map(|pair| SlideStep {
            slip: 2.0 * radius() / h * (0.5 * turn(h, pair[1])).sin(),
            share: pair[0] / lost,
        });
        slider.slack(run, steps)
    }
}
