//! A box that is pushed over the ground under 25 balls: SimBenchmark's rolling test.
//!
//! The box, of the mass M, slides with the friction f₁ = μ (M + n m) g of the ground, and takes the
//! n balls on it with it, which roll. With p the speed that friction gives a ball in a step, v and
//! u = R ω the speeds of ball and rim, V that of the box,
//!
//! ```text
//! v⁺ = v + p,   w(u⁺) = w(u) + ⁵⁄₂ p,   V⁺ = V + h (F − f₁)/M − n (m/M) p
//! V⁺ = v⁺ + u⁺
//! ```
//!
//! with the w(u) of `rolling.rs`. In continuous time w(u) = u, and all accelerations are constant:
//!
//! ```text
//! a_ball = (F − f₁)/M/(⁷⁄₂ + n m/M),   a_box = ⁷⁄₂ a_ball,   R ω̇ = ⁵⁄₂ a_ball
//! ```

use super::prelude::*;

/// m.
const HALF_SIDES: Vector3<f64> = Vector3::new(10.0, 10.0, 0.5);
const RADIUS: f64 = 0.5;
const APART: f64 = 2.0;
/// Balls along each side.
const SIDE: usize = 5;
const BALLS: f64 = (SIDE * SIDE) as f64;
/// The box, in masses of a ball.
const RATIO: f64 = 10.0;
/// F − f₁, in N for balls of 1 kg: of 150 N against μ = 0.4.
const LEFT: f64 = 150.0 - 0.4 * (RATIO + BALLS) * 9.81;
/// Friction between ball and box, in those of the ground.
const ROUGH: f64 = 2.0;
/// s.
const DURATION: f64 = 1.0;
/// Along y, and at 60° to x.
const DIRECTIONS: [Vector2<f64>; 2] =
    [Vector2::new(0.0, 1.0), Vector2::new(0.5, 0.866_025_403_784_438_6)];
/// Contacts: of the balls, and corners of the box.
const CONTACTS: f64 = BALLS + 4.0;
/// Newton's method settles in a few.
const ROUNDS: usize = 20;

/// Speeds of the box, of a ball and of its rim, m/s.
#[derive(Debug, Clone, Copy, Default)]
struct Speeds {
    plate: f64,
    ball: f64,
    rim: f64,
}

/// (F − f₁)/M, m/s².
fn push() -> f64 {
    LEFT / RATIO
}

/// a_ball, m/s².
fn acceleration() -> f64 {
    push() / (3.5 + BALLS / RATIO)
}

impl Speeds {
    /// A step of h.
    fn step(&self, h: f64) -> Self {
        let turning = |rim: f64| momentum(h / RADIUS, rim);
        let after = |rim: f64| {
            let p = 0.4 * (turning(rim).0 - turning(self.rim).0);
            let plate = self.plate + h * push() - BALLS / RATIO * p;
            Self { plate, ball: self.ball + p, rim }
        };
        let mut rim = self.rim;
        for _ in 0..ROUNDS {
            let Self { plate, ball, .. } = after(rim);
            let by_turning = 0.4 * turning(rim).1 * (1.0 + BALLS / RATIO);
            rim -= (ball + rim - plate) / (by_turning + 1.0);
        }
        after(rim)
    }

    /// In continuous time.
    fn exact(t: f64) -> Self {
        let ball = acceleration() * t;
        Self { plate: 3.5 * ball, ball, rim: 2.5 * ball }
    }

    /// The squares of the errors against `other`, of the box and of all balls, a body, m²/s²: the
    /// metric of SimBenchmark.
    fn error(&self, other: &Self) -> f64 {
        let (plate, ball) = (self.plate - other.plate, self.ball - other.ball);
        (plate * plate + BALLS * ball * ball) / (1.0 + BALLS)
    }
}

/// The box pushed along `direction`, balls of `mass` on it.
fn setup(
    direction: &Vector2<f64>,
    (mass, friction, gravity): (f64, f64, f64),
) -> Result<Setup, Unsuitable> {
    let held = friction * (RATIO + BALLS) * gravity;
    let force = mass * (held + LEFT);
    let pull = Polyline::constant(Vector3::new(force * direction[0], force * direction[1], 0.0))?;
    let plate = Subject::solid_box(RATIO * mass, HALF_SIDES, resting(HALF_SIDES[2]))?;
    let mut bodies = vec![plate.pulled(pull)?];
    let start = |place: usize| {
        let at = |number: usize| (number as f64 - 0.5 * (SIDE as f64 - 1.0)) * APART;
        let mut start = resting(2.0 * HALF_SIDES[2] + RADIUS);
        (start.position[0], start.position[1]) = (at(place % SIDE), at(place / SIDE));
        start
    };
    bodies.extend(Subject::balls(mass, RADIUS, (0..SIDE * SIDE).map(start))?);
    let frictions = (1..bodies.len()).map(|ball| (ball, Partner::Body(0), ROUGH * friction));
    let frictions = frictions.collect();
    Ok(Setup { frictions, ..Setup::new(bodies, gravity, friction, DURATION) })
}

/// What the residuals of `run` allow a speed, m/s: the laws of all contacts, each in its own scale,
/// and the equations of all bodies, step by step. A contact's share for the box is a tenth of that for
/// a ball.
fn slack(run: &Run) -> f64 {
    let missed = run.sum(|residual| residual.friction + residual.normal);
    let lacked = run.sum(|residual| residual.momentum) + run.largest(|r| r.kinematics);
    CONTACTS * missed / RATIO + missed + 3.0 * lacked + 4.0 * run.flight_rounding()
}

/// The speeds after step `k` along `direction`: of the box, and of the ball and the rim that are
/// farthest from `expected`.
fn measured(run: &Run, k: usize, direction: &Vector2<f64>, expected: &Speeds) -> Speeds {
    let along = |state: &State| state.velocity.xy().dot(direction);
    // The bottom of a ball moves on with the box: ω × (−R e_z) has the rim's speed along it.
    let rim =
        |state: &State| RADIUS * (state.spin[0] * direction[1] - state.spin[1] * direction[0]);
    let worst = |of: &dyn Fn(&State) -> f64, expected: f64| {
        let balls = (1..=SIDE * SIDE).map(|index| of(&run.states(index)[k]));
        balls.fold(expected, |worst, value| {
            if (value - expected).abs() > (worst - expected).abs() { value } else { worst }
        })
    };
    Speeds {
        plate: along(&run.states(0)[k]),
        ball: worst(&along, expected.ball),
        rim: worst(&rim, expected.rim),
    }
}

/// A box under balls.
pub static BALL_GRID: Posed = Posed {
    name: "ball-grid",
    about: "SimBenchmark's rolling test: a box is pushed over the ground, along y and diagonally, \
            under 25 balls that roll on it, with a_ball = (F − f₁)/M/(⁷⁄₂ + n m/M) and ⁷⁄₂ of that \
            for the box.",
    time_step: 0.01,
    inputs: &[(Input::Mass, 1.0), (Input::Friction, 0.4), EARTH],
    bodies: 1 + SIDE * SIDE,
    ..Posed::by(ball_grid)
};

/// The push is what friction of the ground takes, and 12.66 N a kilogram of a ball beyond: 150 N
/// with the usual inputs. What w(u) is above u makes the errors of second order, and their mean square
/// of fourth.
fn ball_grid(inputs: &Inputs, laboratory: &mut Laboratory<'_>) -> Solved {
    let (mass, friction) = (inputs.get(Input::Mass)?, inputs.get(Input::Friction)?);
    let (gravity, h) = (inputs.get(Input::Gravity)?, laboratory.time_step());
    Unsuitable::when(acceleration() > 0.9 * ROUGH * friction * gravity, || {
        format!("with mu {friction} the balls slide on the box; more friction is needed")
    })?;
    let names = [
        ["along y: speed of the box", "speed of a ball", "speed of a rim"],
        ["diagonally: speed of the box", "speed of a ball, too", "speed of a rim, too"],
    ];
    let (mut quantities, mut curve) = (Vec::new(), Curve::default());
    let (mut squares, mut sideways) = ([0.0; 2], 0.0_f64);
    let mut allowed = 0.0_f64;
    for (direction, names) in DIRECTIONS.iter().zip(names) {
        let run = laboratory.run(&setup(direction, (mass, friction, gravity))?)?;
        let (mut discrete, slack) = (Speeds::default(), slack(&run));
        let steps = run.steps() as f64;
        for k in 1..=run.steps() {
            discrete = discrete.step(h);
            let (found, exact) =
                (measured(&run, k, direction, &discrete), Speeds::exact(run.time(k)));
            squares[0] += 0.5 * found.error(&exact) / steps;
            squares[1] += 0.5 * discrete.error(&exact) / steps;
        }
        let across = Vector2::new(-direction[1], direction[0]);
        let strayed = run.all_states().map(|state| state.velocity.xy().dot(&across).abs());
        sideways = strayed.fold(sideways, f64::max);
        allowed = allowed.max(slack);
        let found = measured(&run, run.steps(), direction, &discrete);
        let exact = Speeds::exact(run.time(run.steps()));
        for (name, [measured, discrete, exact]) in names.into_iter().zip([
            [found.plate, discrete.plate, exact.plate],
            [found.ball, discrete.ball, exact.ball],
            [found.rim, discrete.rim, exact.rim],
        ]) {
            let convergence = Convergence::order(2, steps);
            let plain = exactly((name, "m/s"), measured, exact, 2.5 * slack);
            quantities.push(plain.in_steps(discrete, convergence));
        }
        curve = run
            .curve(("speed of the box, diagonally", "m/s"), 0, |state| {
                state.velocity.xy().dot(direction)
            })
            .beside(|t| Speeds::exact(t).plate);
    }
    let error = squares[1].sqrt();
    quantities.push(
        exactly(
            ("mean squared error of a velocity", "m²/s²"),
            squares[0],
            0.0,
            2.0 * allowed * (error + allowed),
        )
        .in_steps(squares[1], Convergence::order(4, DURATION / h)),
    );
    quantities.push(at_most_zero(("speed sideways", "m/s"), sideways, allowed));
    Ok(Findings { quantities, curve })
}
