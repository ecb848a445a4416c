//! A box that is pushed over the ground under 25 balls: SimBenchmark's rolling test.

use crate::prelude::*;

/// m.
const HALF_SIDES: Vector3<f64> = Vector3::new(10.0, 10.0, 0.5);
const RADIUS: f64 = 0.5;
const APART: f64 = 2.0;
/// Balls along each side.
const SIDE: usize = 5;
const BALLS: f64 = (SIDE * SIDE) as f64;
const RATIO: f64 = 10.0; // The box, in masses of a ball
/// F − f₁, in N for balls of 1 kg: 150 N against μ = 0.4.
const LEFT: f64 = 150.0 - 0.4 * (RATIO + BALLS) * 9.81;
/// (F − f₁)/M and a_ball, m/s².
const PUSH: f64 = LEFT / RATIO;
const ACCELERATION: f64 = PUSH / (3.5 + BALLS / RATIO);
const ROUGH: f64 = 2.0; // Friction between ball and box, in that of the ground
const DURATION: f64 = 1.0; // s
/// Along y, and at 60° to x.
const DIRECTIONS: [Vector2<f64>; 2] =
    [Vector2::new(0.0, 1.0), Vector2::new(0.5, 0.866_025_403_784_438_6)];
const CONTACTS: f64 = BALLS + 4.0; // Contacts of the balls, and corners of the box

/// Speeds of the box, of a ball and of its rim, m/s.
#[derive(Debug, Clone, Copy, Default)]
struct GridSpeeds {
    plate: f64,
    ball: f64,
    rim: f64,
}

impl GridSpeeds {
    /// The scheme's step of h. Friction changes the speed of a ball by p:
    ///
    /// ```text
    /// v⁺ = v + p,   w(u⁺) = w(u) + ⁵⁄₂ p,   V⁺ = V + h (F − f₁)/M − n (m/M) p,   V⁺ = v⁺ + u⁺
    /// ```
    fn step(&self, h: f64) -> Self {
        let turning = |rim: f64| momentum(h / RADIUS, rim);
        let after = |rim: f64| {
            let p = 0.4 * (turning(rim).0 - turning(self.rim).0);
            let plate = self.plate + h * PUSH - BALLS / RATIO * p;
            Self { plate, ball: self.ball + p, rim }
        };
        after(newton(self.rim, |rim| {
            let Self { plate, ball, .. } = after(rim);
            (ball + rim - plate, 0.4 * turning(rim).1 * (1.0 + BALLS / RATIO) + 1.0)
        }))
    }

    /// The speeds in continuous time.
    fn exact(t: f64) -> Self {
        let ball = ACCELERATION * t;
        Self { plate: 3.5 * ball, ball, rim: 2.5 * ball }
    }

    /// SimBenchmark's metric: the mean squared error of the box and the balls, m²/s².
    fn error(&self, other: &Self) -> f64 {
        let (plate, ball) = (self.plate - other.plate, self.ball - other.ball);
        (plate * plate + BALLS * ball * ball) / (1.0 + BALLS)
    }

    /// The speeds in state `k` along `direction`: of the box, and of the ball and the rim that are
    /// farthest from `expected`.
    fn measured(run: &TestRun, k: usize, direction: &Vector2<f64>, expected: &Self) -> Self {
        let along = |state: &State| state.velocity.xy().dot(direction);
        // ω × (−R e_z) at the bottom of a ball.
        let rim =
            |state: &State| RADIUS * (state.spin[0] * direction[1] - state.spin[1] * direction[0]);
        let worst = |of: &dyn Fn(&State) -> f64, expected: f64| {
            let farther =
                |a: f64, b: f64| if (b - expected).abs() > (a - expected).abs() { b } else { a };
            (1..=SIDE * SIDE).map(|index| of(&run.states(index)[k])).fold(expected, farther)
        };
        Self {
            plate: along(&run.states(0)[k]),
            ball: worst(&along, expected.ball),
            rim: worst(&rim, expected.rim),
        }
    }
}

/// The box pushed along `direction`, with balls of `mass` on it.
fn setup(direction: &Vector2<f64>, [mass, friction, gravity]: [f64; 3]) -> Result<Setup, Refusal> {
    let held = friction * (RATIO + BALLS) * gravity;
    let force = mass * (held + LEFT);
    let pull = Polyline::constant(v3(force * direction[0], force * direction[1], 0.0))?;
    let plate = Subject::solid_box(RATIO * mass, HALF_SIDES, resting(HALF_SIDES[2]))?;
    let mut bodies = vec![plate.pulled(pull)?];
    let start = |place: usize| {
        let at = |number: usize| (number as f64 - 0.5 * (SIDE as f64 - 1.0)) * APART;
        at_rest(v3(at(place % SIDE), at(place / SIDE), 2.0 * HALF_SIDES[2] + RADIUS))
    };
    bodies.extend(Subject::balls(mass, RADIUS, (0..SIDE * SIDE).map(start))?);
    let frictions = (1..bodies.len()).map(|ball| (ball, Partner::Body(0), ROUGH * friction));
    let frictions = frictions.collect();
    Ok(Setup { frictions, ..Setup::new(bodies, gravity, friction, DURATION) })
}

/// The tolerance of a speed, m/s: the residuals of the laws of all contacts and of the equations of all
/// bodies, summed. A contact's share for the box is a tenth of that for a ball.
fn tolerance(run: &TestRun) -> f64 {
    let missed = run.sum(|r| r.friction + r.normal);
    let lacked = run.sum(|r| r.momentum) + run.largest(|r| r.kinematics);
    CONTACTS * missed / RATIO + missed + 3.0 * lacked + 4.0 * run.flight_rounding()
}

/// SimBenchmark's rolling test: a box is pushed over the ground, along y and diagonally, under 25
/// balls that roll on it, with a_ball = (F − f₁)/M/(⁷⁄₂ + n m/M) and ⁷⁄₂ of that for the box.
pub(crate) const BALL_GRID: TestProblem = TestProblem {
    name: "ball-grid",
    time_step: 0.01,
    inputs: &[(Mass, 1.0), (Friction, 0.4), EARTH],
    bodies: 1 + SIDE * SIDE,
    ..TestProblem::solved_by(ball_grid)
};

/// a_ball = (F − f₁)/M/(⁷⁄₂ + n m/M), a_box = ⁷⁄₂ a_ball, R ω̇ = ⁵⁄₂ a_ball.
fn ball_grid(inputs: &TestInputs, runner: &mut Runner<'_>) -> SolvedBy {
    let values = inputs.all([Mass, Friction, Gravity])?;
    let ([_, friction, gravity], h) = (values, runner.time_step);
    let why = format!("with mu {friction} the balls slide on the box; use a larger mu");
    Refusal::when(ACCELERATION > 0.9 * ROUGH * friction * gravity, why)?;
    let names = [
        ["along y: speed of the box", "speed of a ball", "speed of a rim"],
        ["diagonally: speed of the box", "speed of a ball, too", "speed of a rim, too"],
    ];
    let mut quantities = Vec::new();
    let (mut squares, mut sideways, mut allowed) = ([0.0; 2], 0.0_f64, 0.0_f64);
    for (direction, names) in DIRECTIONS.iter().zip(names) {
        let run = runner.run(&setup(direction, values)?)?;
        let (mut discrete, off) = (GridSpeeds::default(), tolerance(&run));
        let steps = run.steps() as f64;
        for k in 1..=run.steps() {
            discrete = discrete.step(h);
            let found = GridSpeeds::measured(&run, k, direction, &discrete);
            let exact = GridSpeeds::exact(run.time(k));
            squares[0] += 0.5 * found.error(&exact) / steps;
            squares[1] += 0.5 * discrete.error(&exact) / steps;
        }
        let across = Vector2::new(-direction[1], direction[0]);
        let strayed = run.all_states().map(|state| state.velocity.xy().dot(&across).abs());
        sideways = strayed.fold(sideways, f64::max);
        allowed = allowed.max(off);
        let found = GridSpeeds::measured(&run, run.steps(), direction, &discrete);
        let exact = GridSpeeds::exact(run.end_time());
        for (name, speed) in names.into_iter().zip([
            (|speeds| speeds.plate) as fn(&GridSpeeds) -> f64,
            |speeds| speeds.ball,
            |speeds| speeds.rim,
        ]) {
            let quantity = equal((name, "m/s"), speed(&found), speed(&exact), 2.5 * off);
            let lag = lagging(h / RADIUS, exact.rim, 10.0 * exact.rim, steps);
            quantities.push(quantity.stepped(speed(&discrete), lag));
        }
    }
    let off = 2.0 * allowed * (squares[1].sqrt() + allowed);
    quantities.extend([
        equal(("mean squared error of a velocity", "m²/s²"), squares[0], 0.0, off)
            .stepped(squares[1], within(off, DURATION / h)),
        at_most_zero(("speed sideways", "m/s"), sideways, allowed),
    ]);
    Ok(quantities)
}
