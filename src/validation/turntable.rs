//! A block on a turntable: carried round, or left behind.

use super::prelude::*;

/// m.
const TABLE: Vector3<f64> = Vector3::new(1.0, 1.0, 0.1);
const BLOCK: Vector3<f64> = Vector3::new(0.08, 0.08, 0.05);
/// From the middle of the table to the block, m.
const DISTANCE: f64 = 0.6;
/// The table, in masses of the block.
const RATIO: f64 = 50.0;
/// How long it is watched, s.
const DURATION: f64 = 0.25;
/// Thresholds are looked for to this share of them.
const RESOLUTION: f64 = 1e-8;
/// The block slips if it is this far from its place, m.
const SLIPPED: f64 = 1e-10;
/// A table that turns by more than this in a step is far from even rotation, rad.
const MOST_TURN: f64 = 0.2;
/// Corners of both faces.
const CORNERS: f64 = 8.0;

/// Both bodies, as long as they turn as one.
///
/// The table stands on ice and nothing slows it, so that it turns with the block about their
/// common centre, at the radii r = d M/(m + M) and d m/(m + M). A step turns them by
/// ψ = 2 atan(½ h ω), along chords of 2 r sin ½ψ, so that velocities, which are those of the
/// chords, have the size 2 r sin ½ψ/h and turn by ψ as well: the acceleration is
///
/// ```text
/// (2 sin ½ψ)² r/h² = r ω²/(1 + (½ h ω)²)
/// ```
struct Pair {
    spin: f64,
    time_step: f64,
}

impl Pair {
    /// r of the block, m.
    fn radius() -> f64 {
        DISTANCE * RATIO / (1.0 + RATIO)
    }

    /// ψ, rad.
    fn turn(&self) -> f64 {
        2.0 * (0.5 * self.time_step * self.spin).atan()
    }

    /// At `place` (m, from the common centre along x) and `height`, as one step of turning
    /// leaves it.
    fn state(&self, place: f64, height: f64) -> State {
        let mut state = resting(height);
        state.position[0] = place;
        state.spin[2] = self.spin;
        // From where it was, turned back by ψ.
        let (sin, cos) = self.turn().sin_cos();
        state.velocity = Vector3::new(place * (1.0 - cos), place * sin, 0.0) / self.time_step;
        state
    }

    fn setup(&self, mass: f64, friction: f64, gravity: f64) -> Result<Setup, Unsuitable> {
        let block = self.state(Self::radius(), 2.0 * TABLE[2] + BLOCK[2]);
        let table = self.state(Self::radius() - DISTANCE, TABLE[2]);
        let bodies = vec![
            Subject::solid_box(RATIO * mass, TABLE, table)?,
            Subject::solid_box(mass, BLOCK, block)?,
        ];
        let frictions = vec![(0, Partner::Ground, 0.0)];
        Ok(Setup { frictions, ..Setup::new(bodies, gravity, friction, DURATION) })
    }
}

/// How far from its place on the table the block is in each state, m, and the horizontal force
/// on it in each step, N.
fn strayed(run: &Run) -> Vec<f64> {
    let place = |k: usize| {
        let (table, block) = (&run.states(0)[k], &run.states(1)[k]);
        let angle = 2.0 * table.attitude[3].atan2(table.attitude[0]);
        let (sin, cos) = angle.sin_cos();
        let apart = block.position - table.position;
        Vector3::new(cos * apart[0] + sin * apart[1], cos * apart[1] - sin * apart[0], apart[2])
    };
    let first = place(0);
    (0..=run.steps()).map(|k| (place(k) - first).norm()).collect()
}

/// What the residuals of `run` allow the acceleration of the block in a step, m/s².
fn slack(run: &Run) -> f64 {
    let missed = run.largest(|residual| residual.friction + residual.normal);
    let lacked = run.largest(|residual| residual.momentum + 2.0 * residual.kinematics);
    (2.0 * CORNERS * missed + 2.0 * lacked + 4.0 * run.flight_rounding()) / run.time_step
}

/// A block on a turntable that is faster and faster.
pub static TURNTABLE: Posed = Posed {
    name: "turntable",
    about: "A block on a turntable is carried round by friction m r ω², and slips where that is \
            more than μ m g.",
    time_step: 0.005,
    inputs: &[(Input::Mass, 1.0), (Input::Friction, 0.5), EARTH],
    bodies: 2,
    beyond_ipopt: Some("on the brink of sliding it leaves residuals of 1e-3 m/s"),
    ..Posed::by(turntable)
};

/// μ g = r ω² is the threshold; [`Pair`] has the step's, by which it is at
/// ω² = (μ g/r)/(1 − ¼ h² μ g/r): second order.
fn turntable(inputs: &Inputs, laboratory: &mut Laboratory<'_>) -> Solved {
    let (mass, friction) = (inputs.get(Input::Mass)?, inputs.get(Input::Friction)?);
    let (gravity, h) = (inputs.get(Input::Gravity)?, laboratory.time_step());
    let (square, steps) = (friction * gravity / Pair::radius(), DURATION / h);
    let critical = square.sqrt();
    Unsuitable::when(critical * h > MOST_TURN || friction * BLOCK[2] > 0.9 * BLOCK[0], || {
        format!(
            "with mu {friction} the block tips over, or the table turns by more than \
             {MOST_TURN} rad a step; a smaller one is needed"
        )
    })?;
    let discrete = (square / (1.0 - 0.25 * h * h * square)).sqrt();
    let carried = 0.9 * critical;
    let pair = Pair { spin: carried, time_step: h };
    let run = laboratory.run(&pair.setup(mass, friction, gravity)?)?;
    let forces = run.forces(1);
    let force = |k: usize| forces[k].xy().norm() / mass;
    let expected = Pair::radius() * carried * carried;
    let spin = |run: &Run| slack(run) / (2.0 * Pair::radius() * critical);
    let found = Threshold::near(discrete, RESOLUTION * discrete, |spin_rate| {
        let pair = Pair { spin: spin_rate, time_step: h };
        let run = laboratory.run(&pair.setup(mass, friction, gravity)?)?;
        let last = strayed(&run)[run.steps()];
        Ok((last > SLIPPED, spin(&run)))
    })?;
    let share = expected / (friction * gravity);
    let held = run.sum(|residual| residual.friction) / (1.0 - share * share).sqrt();
    let order = Convergence::order(2, steps);
    Ok(Findings {
        quantities: vec![
            exactly(
                ("acceleration of the block", "m/s²"),
                force(run.steps() - 1),
                expected,
                slack(&run),
            )
            .in_steps(expected / (1.0 + (0.5 * h * carried).powi(2)), order),
            at_most_zero(
                ("way on the table", "m"),
                strayed(&run).into_iter().fold(0.0, f64::max),
                2.0 * h * held + 8.0 * run.seat(),
            ),
            exactly(
                ("spin of the table", "rad/s"),
                run.end(0).spin[2],
                carried,
                2.0 * slack(&run) * h / Pair::radius() + run.flight_rounding(),
            ),
            found.beside(("threshold of the spin", "rad/s"), critical).in_steps(discrete, order),
        ],
        curve: run
            .curve_of_steps(("acceleration of the block", "m/s²"), force)
            .beside(|_| expected),
    })
}
