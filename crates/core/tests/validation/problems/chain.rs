//! A chain of links in free flight.

use super::pair::changes;
use crate::prelude::*;

/// Number of links. Half sides of a link (m) and simulated time (s).
const LINKS: usize = 5;
const HALF_SIDES: Vector3<f64> = Vector3::new(0.15, 0.04, 0.02);
const DURATION: f64 = 0.5;
const HEIGHT: f64 = 4.0; // Above the ground, m

/// Five links with hinges turn in empty space, with friction and springs between them: the linear
/// and the angular momentum of all stay.
pub(crate) const FREE_CHAIN: TestProblem = TestProblem {
    name: "free-chain",
    time_step: 0.002,
    inputs: &[(Mass, 1.0), (Speed, 3.0)],
    bodies: LINKS,
    ..TestProblem::solved_by(free_chain)
};

/// Σ m v and Σ r × m v + A P⁻(ω) are constant.
fn free_chain(inputs: &TestInputs, runner: &mut Runner<'_>) -> SolvedBy {
    let [mass, speed] = inputs.all([Mass, Speed])?;
    let why = format!(
        "with speed {speed} rad/s it turns too far per step; use a smaller speed or time step"
    );
    Refusal::when(speed * runner.time_step > 0.1, why)?;
    let middle = v3(0.0, 0.0, HEIGHT);
    let spin = speed * v3(0.3, 0.8, -0.5);
    let bodies = (0..LINKS).map(|link| {
        let arm = Vector3::x() * (2.0 * HALF_SIDES[0] * (link as f64 - 1.5));
        let start = State { velocity: spin.cross(&arm), spin, ..at_rest(middle + arm) };
        Subject::solid_box(mass * (1.0 + 0.3 * link as f64), HALF_SIDES, start)
    });
    let bodies = bodies.collect::<Result<_, _>>()?;
    let ends = [-1.0, 1.0].map(|side| Vector3::x() * (side * HALF_SIDES[0]));
    let square = mass * speed * speed;
    let drive = Drive {
        friction: 1e-3 * square,
        stiffness: 0.05 * square,
        damping: 1e-3 * mass * speed,
        ..Drive::NONE
    };
    let joints = (1..LINKS).map(|link| hinge(link, Some(link - 1), ends, v3(0.3, 1.0, 0.2), drive));
    let joints = joints.collect::<Result<_, Error>>()?;
    let setup = Setup { joints, ..Setup::new(bodies, 0.0, 0.5, DURATION) };
    let run = runner.run(&setup)?;
    let (strayed, turned) = changes(&setup.bodies, &run, &middle);
    let total = mass * (LINKS as f64 + 3.0);
    let lacked = run.sum(|r| r.momentum) + 4.0 * run.flight_rounding();
    let astray = run.sum(|r| r.kinematics) * run.time_step;
    let arm = run.all_states().map(|state| (state.position - middle).norm()).fold(1.0, f64::max);
    let rounding = 4.0 * run.rounding(HEIGHT) * speed;
    let turned_off = total * (3.0 * arm * lacked + speed * astray + rounding);
    Ok(vec![
        at_most_zero(("change of the momentum", "kg m/s"), strayed, total * lacked),
        at_most_zero(("change of the angular momentum", "kg m²/s"), turned, turned_off),
    ])
}
