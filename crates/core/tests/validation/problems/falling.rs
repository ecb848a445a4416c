//! A body in free flight.

use crate::prelude::*;

const DURATION: f64 = 1.0;

/// A box thrown sideways falls for a second: z = z₀ − ½ g t², x = v t.
pub(crate) const FREE_FALL: TestProblem = TestProblem {
    name: "free-fall",
    time_step: 0.002,
    inputs: &[(Mass, 2.0), EARTH, (Speed, 3.0)],
    ..TestProblem::solved_by(free_fall)
};

/// z₀ − z = ½ g t², v_z = −g t, x = v t.
fn free_fall(inputs: &TestInputs, runner: &mut Runner<'_>) -> SolvedBy {
    let [mass, g, speed] = inputs.all([Mass, Gravity, Speed])?;
    let mut start = resting(0.75 * g * DURATION * DURATION + 1.0);
    start.velocity[0] = speed;
    let run = runner.run(&Setup::from_box(mass, v3(0.2, 0.15, 0.1), start, g, 0.3, DURATION)?)?;
    let (end, t, top, way) = (run.end(0), run.end_time(), start.position[2], run.flight_way());
    Ok(vec![
        run.accelerated(("height fallen", "m"), top - end.position[2], g, way),
        equal(("speed downwards", "m/s"), -end.velocity[2], g * t, run.flight_speed()),
        equal(("way sideways", "m"), end.position[0], speed * t, way),
    ])
}
