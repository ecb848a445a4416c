//! A body thrown sideways that meets nothing.

use super::prelude::*;

/// s.
const DURATION: f64 = 1.0;

/// Free fall for a second.
pub static FREE_FALL: Posed = Posed {
    name: "free-fall",
    about: "A box thrown sideways falls for a second: z = z₀ − ½ g t², x = v t.",
    time_step: 0.002,
    inputs: &[(Input::Mass, 2.0), EARTH, (Input::Speed, 3.0)],
    ..Posed::by(free_fall)
};

/// z(t) = z_0 − ½ g t², v_z(t) = −g t, x(t) = v t.
///
/// The step takes the velocity at its end, v_k = −k g h, so that after N steps
///
/// ```text
/// z_0 − z_N = h Σ k g h = ½ g h² N (N + 1)
/// ```
///
/// which is ½ g h t more than ½ g t²; velocities and the way sideways are exact.
fn free_fall(inputs: &Inputs, laboratory: &mut Laboratory<'_>) -> Solved {
    let [mass, g, speed] = inputs.all([Input::Mass, Input::Gravity, Input::Speed])?;
    let mut start = resting(0.1);
    start.position[2] = 0.75 * g * DURATION * DURATION + 1.0;
    start.velocity = Vector3::new(speed, 0.0, 0.0);
    let bodies = vec![Subject::solid_box(mass, Vector3::new(0.2, 0.15, 0.1), start)?];
    let run = laboratory.run(&Setup::new(bodies, g, 0.3, DURATION))?;
    let (end, h, steps) = (run.end(0), run.time_step, run.steps() as f64);
    let t = run.time(run.steps());
    let fallen = |t: f64| 0.5 * g * t * t;
    let (speed_slack, way_slack) = (run.flight_speed_slack(), run.flight_way_slack());
    Ok(Findings {
        quantities: vec![
            exactly(
                ("height fallen", "m"),
                start.position[2] - end.position[2],
                fallen(t),
                way_slack,
            )
            .in_steps(0.5 * g * h * h * steps * (steps + 1.0), Convergence::order(1, steps)),
            exactly(("speed downwards", "m/s"), -end.velocity[2], g * t, speed_slack),
            exactly(("way sideways", "m"), end.position[0], speed * t, way_slack),
        ],
        curve: run
            .curve(("height", "m"), 0, |state| state.position[2])
            .beside(|t| start.position[2] - fallen(t)),
    })
}
