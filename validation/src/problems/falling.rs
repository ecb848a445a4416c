//! A body in free flight.

use crate::prelude::*;

const DURATION: f64 = 1.0;

pub(crate) const FREE_FALL: Problem = Problem {
    name: "free-fall",
    about: "A box thrown sideways falls for a second: z = z₀ − ½ g t², x = v t.",
    time_step: 0.002,
    inputs: &[(Mass, 2.0), EARTH, (Speed, 3.0)],
    ..Problem::solved_by(free_fall)
};

/// z(t) = z_0 − ½ g t², v_z(t) = −g t, x(t) = v t. The step moves with the velocity at its end,
/// v_k = −k g h, so that after N steps
///
/// ```text
/// z_0 − z_N = h Σ k g h = ½ g h² N (N + 1)
/// ```
///
/// which is ½ g h t more than ½ g t². Velocities and the horizontal distance are exact.
fn free_fall(inputs: &Inputs, runner: &mut Runner<'_>) -> Solved {
    let [mass, g, speed] = inputs.all([Mass, Gravity, Speed])?;
    let mut start = resting(0.75 * g * DURATION * DURATION + 1.0);
    start.velocity[0] = speed;
    let bodies = vec![Subject::solid_box(mass, v3(0.2, 0.15, 0.1), start)?];
    let run = runner.run(&Setup::new(bodies, g, 0.3, DURATION))?;
    let (end, h, steps, t) = (run.end(0), run.time_step, run.steps() as f64, run.end_time());
    let (top, way) = (start.position[2], run.flight_way());
    let fallen = |t: f64| 0.5 * g * t * t;
    let discrete = 0.5 * g * h * h * steps * (steps + 1.0);
    Findings::new(
        run.curve(("height", "m"), 0, |state| state.position[2]).beside(|t| top - fallen(t)),
        [
            equal(("height fallen", "m"), top - end.position[2], fallen(t), way)
                .stepped(discrete, order(1, steps)),
            equal(("speed downwards", "m/s"), -end.velocity[2], g * t, run.flight_speed()),
            equal(("way sideways", "m"), end.position[0], speed * t, way),
        ],
    )
}
