//! A block on a block: on a slope, and with the lower one pulled.

use super::prelude::*;

/// m.
const LOWER: Vector3<f64> = Vector3::new(1.0, 0.3, 0.05);
const UPPER: Vector3<f64> = Vector3::new(0.1, 0.1, 0.05);
/// The upper block, in masses of the lower one.
const UPPER_SHARE: f64 = 0.5;
/// How far the upper block may slide on the lower one, m.
const WAY: f64 = 1.2;
/// s.
const DURATION: f64 = 0.5;
/// How long a threshold is watched, s.
const WATCH: f64 = 0.2;
/// Thresholds are looked for to this share of them.
const RESOLUTION: f64 = 1e-6;
/// A block moves if it is this fast, as a share of μ g times the time watched.
const MOVING: f64 = 1e-8;
/// Corners that slide: of two faces.
const CORNERS: f64 = 8.0;

/// Two blocks and what is rough.
#[derive(Debug, Clone, Copy)]
struct Blocks {
    /// m₁ and m₂, kg.
    masses: [f64; 2],
    /// μ₁ to the ground, μ₂ between them.
    frictions: [f64; 2],
}

/// Of the lower and the upper block, m/s².
type Accelerations = [f64; 2];

impl Blocks {
    fn new(inputs: &Inputs, shares: [f64; 2]) -> Result<Self, Unsuitable> {
        let (mass, friction) = (inputs.get(Input::Mass)?, inputs.get(Input::Friction)?);
        Unsuitable::when(friction > 1.5, || {
            format!("with mu {friction} the upper block may tip over; 1.5 is the most")
        })?;
        let frictions = shares.map(|share| share * friction);
        Ok(Self { masses: [mass, UPPER_SHARE * mass], frictions })
    }

    fn mass(&self) -> f64 {
        self.masses[0] + self.masses[1]
    }

    /// The blocks, the upper one at `x` (m) on the lower one, pulled by `force`, N.
    fn setup(&self, x: f64, force: f64, duration: f64) -> Result<Setup, Unsuitable> {
        let mut above = resting(2.0 * LOWER[2] + UPPER[2]);
        above.position[0] = x;
        let pull = Polyline::constant(Vector3::new(force, 0.0, 0.0))?;
        let lower = Subject::solid_box(self.masses[0], LOWER, resting(LOWER[2]))?.pulled(pull)?;
        let bodies = vec![lower, Subject::solid_box(self.masses[1], UPPER, above)?];
        let frictions =
            vec![(0, Partner::Ground, self.frictions[0]), (1, Partner::Body(0), self.frictions[1])];
        Ok(Setup { frictions, ..Setup::new(bodies, 0.0, self.frictions[0], duration) })
    }

    /// Down a slope with gravity `s` along it and `n` onto it, both from rest. As one with
    /// a = max(0, s − μ₁ n), if the upper one holds with what that takes, min(s, μ₁ n) ≤ μ₂ n;
    /// else
    ///
    /// ```text
    /// a₂ = s − μ₂ n,   m₁ a₁ = max(0, m₁ s + μ₂ m₂ n − μ₁ (m₁ + m₂) n)
    /// ```
    fn sliding(&self, s: f64, n: f64) -> Accelerations {
        let [lower, upper] = self.frictions;
        if s.min(lower * n) <= upper * n {
            return [(s - lower * n).max(0.0); 2];
        }
        let [m1, m2] = self.masses;
        let pull = m1 * s + (upper * m2 - lower * self.mass()) * n;
        [(pull / m1).max(0.0), s - upper * n]
    }

    /// (μ₁ + μ₂) (m₁ + m₂) g: the pull beyond which the upper block stays behind, N. As one
    /// they have (F − μ₁ (m₁ + m₂) g)/(m₁ + m₂), and the upper one no more than μ₂ g.
    fn parting_force(&self, gravity: f64) -> f64 {
        (self.frictions[0] + self.frictions[1]) * self.mass() * gravity
    }

    /// With the lower one pulled by more than the ground holds: as one, or beyond the parting
    /// force
    ///
    /// ```text
    /// a₂ = μ₂ g,   m₁ a₁ = F − μ₁ (m₁ + m₂) g − μ₂ m₂ g
    /// ```
    fn pulled(&self, force: f64, gravity: f64) -> Accelerations {
        let left = force - self.frictions[0] * self.mass() * gravity;
        if force <= self.parting_force(gravity) {
            return [left / self.mass(); 2];
        }
        let upper = self.frictions[1] * gravity;
        [(left - upper * self.masses[1]) / self.masses[0], upper]
    }
}

/// How long two blocks can slide apart with these accelerations, s.
fn duration(accelerations: &Accelerations) -> f64 {
    let apart = (accelerations[1] - accelerations[0]).abs();
    DURATION.min((2.0 * WAY / apart).sqrt())
}

/// What the residuals of `run` allow the speed of a block, m/s: the laws of all corners and
/// the equations of both blocks, the lighter one's impulses counted for the heavier, step by
/// step.
fn speed_slack(run: &Run) -> f64 {
    let missed = run.sum(|residual| residual.friction + residual.normal);
    let lacked = run.sum(|residual| residual.momentum) + run.largest(|r| r.kinematics);
    (CORNERS * missed + 2.0 * lacked) / UPPER_SHARE + run.flight_rounding()
}

/// The acceleration that the residuals of a step make on the average, m/s².
fn mean_slack(run: &Run) -> f64 {
    speed_slack(run) / run.time(run.steps())
}

/// What is said of the blocks where they move apart.
const UPPER_MOVES: [&str; 2] = ["speed of the upper block", "way of the upper block"];
const LOWER_MOVES: [&str; 2] = ["speed of the lower block", "way of the lower block"];

/// Speed and way of block `index`. Velocities are exact, v_k = k a h, and the way is
/// x = ½ a h² N (N + 1); a block that is held does not move.
fn moved(
    [speed, way]: [&'static str; 2],
    run: &Run,
    index: usize,
    acceleration: f64,
) -> [Quantity; 2] {
    let (a, h, steps) = (acceleration, run.time_step, run.steps() as f64);
    let (t, slack) = (run.time(run.steps()), speed_slack(run));
    let end = run.end(index);
    let start = run.states(index)[0].position[0];
    let convergence = if a > 0.0 { Convergence::order(1, steps) } else { Convergence::Exact };
    [
        exactly((speed, "m/s"), end.velocity[0], a * t, slack),
        exactly((way, "m"), end.position[0] - start, 0.5 * a * t * t, t * slack + run.seat())
            .in_steps(0.5 * a * h * h * steps * (steps + 1.0), convergence),
    ]
}

/// A block on a block on a slope.
pub static BLOCKS_ON_SLOPE: Posed = Posed {
    name: "blocks-on-slope",
    about: "A block on a block on a slope: the one on top, held by μ/2, slides beyond atan μ/2 and \
            leaves the lower one, held by μ; the other way round both slide as one. Each slides at \
            the threshold of its own face.",
    time_step: 0.005,
    inputs: &[(Input::Mass, 2.0), (Input::Friction, 0.4), EARTH, (Input::Slope, 30.0)],
    bodies: 2,
    ..Posed::by(blocks_on_slope)
};

/// [`Blocks::sliding`], with μ below and μ/2 above and the other way round. The thresholds
/// are atan μ/2 for the upper face where it is the smoother one, and for the lower one
/// where that is; steps at rest and at constant friction are exact.
fn blocks_on_slope(inputs: &Inputs, laboratory: &mut Laboratory<'_>) -> Solved {
    let (gravity, slope) = (inputs.get(Input::Gravity)?, inputs.get(Input::Slope)?);
    let smooth_above = Blocks::new(inputs, [1.0, 0.5])?;
    let smooth_below = Blocks::new(inputs, [0.5, 1.0])?;
    let (sin, cos) = slope.to_radians().sin_cos();
    for friction in [smooth_above.frictions[0], smooth_above.frictions[1]] {
        Unsuitable::when((sin / cos / friction - 1.0).abs() < 1e-3, || {
            format!("a slope of {slope}° is a threshold, mu or mu/2; one beside it is needed")
        })?;
    }
    let mut go = |blocks: &Blocks| -> Result<(Run, Accelerations), Unsuitable> {
        let expected = blocks.sliding(gravity * sin, gravity * cos);
        let setup = blocks.setup(UPPER[0] - LOWER[0] + 0.05, 0.0, duration(&expected))?;
        Ok((laboratory.run(&Setup { slope, gravity, ..setup })?, expected))
    };
    let (apart, [lower, upper]) = go(&smooth_above)?;
    let (together, [as_one, _]) = go(&smooth_below)?;
    let onset = smooth_above.frictions[1].atan();
    let as_one_names = ["speed of both, smooth below", "way of both, smooth below"];
    let moved_blocks = [
        moved(UPPER_MOVES, &apart, 1, upper),
        moved(LOWER_MOVES, &apart, 0, lower),
        moved(as_one_names, &together, 1, as_one),
    ];
    let mut quantities = moved_blocks.concat();
    for (name, blocks, index) in [
        ("threshold of the upper face", &smooth_above, 1),
        ("threshold of the lower face", &smooth_below, 0),
    ] {
        let found = Threshold::near(onset, RESOLUTION * onset, |slope| {
            let setup = blocks.setup(0.0, 0.0, WATCH)?;
            let run = laboratory.run(&Setup { slope: slope.to_degrees(), gravity, ..setup })?;
            let speed = run.end(index).velocity.norm();
            let slack = mean_slack(&run) / gravity;
            Ok((speed > MOVING * onset * gravity * WATCH, slack))
        })?;
        quantities.push(found.beside((name, "rad"), onset));
    }
    Ok(Findings {
        quantities,
        curve: apart
            .curve((UPPER_MOVES[0], "m/s"), 1, |state| state.velocity[0])
            .beside(|t| upper * t),
    })
}

/// A block on a block that is pulled.
pub static PULLED_BLOCK: Posed = Posed {
    name: "pulled-block",
    about: "The lower of two blocks is pulled: they go as one up to (μ₁ + μ₂)(m₁ + m₂) g, with μ₁ \
            on the ground and μ₂ between them; beyond, the upper one has μ₂ g and stays behind.",
    time_step: 0.005,
    inputs: &[(Input::Mass, 2.0), (Input::Friction, 0.4), EARTH],
    bodies: 2,
    beyond_ipopt: Some("on the brink of sliding it leaves residuals of 1e-3 m/s"),
    ..Posed::by(pulled_block)
};

/// [`Blocks::pulled`], with μ₁ = μ/2 and μ₂ = μ, on both sides of the parting force: by a
/// pull half way between what the ground holds and it, and by 1.5 of it.
fn pulled_block(inputs: &Inputs, laboratory: &mut Laboratory<'_>) -> Solved {
    let gravity = inputs.get(Input::Gravity)?;
    let blocks = Blocks::new(inputs, [0.5, 1.0])?;
    let parting = blocks.parting_force(gravity);
    let held = blocks.frictions[0] * blocks.mass() * gravity;
    let front = LOWER[0] - UPPER[0] - 0.05;
    let mut go = |force: f64| -> Result<(Run, Accelerations), Unsuitable> {
        let expected = blocks.pulled(force, gravity);
        let setup = blocks.setup(front, force, duration(&expected))?;
        Ok((laboratory.run(&Setup { gravity, ..setup })?, expected))
    };
    let (together, [as_one, _]) = go(0.5 * (held + parting))?;
    let (apart, [lower, upper]) = go(1.5 * parting)?;
    let found = Threshold::near(parting, RESOLUTION * parting, |force| {
        let run = laboratory.run(&Setup { gravity, ..blocks.setup(0.0, force, WATCH)? })?;
        let [first, second] = [0, 1].map(|index| run.end(index).velocity[0]);
        let slack = blocks.mass() * mean_slack(&run);
        Ok((first - second > MOVING * blocks.frictions[1] * gravity * WATCH, slack))
    })?;
    let moved_blocks = [
        moved(["speed as one", "way as one"], &together, 1, as_one),
        moved(UPPER_MOVES, &apart, 1, upper),
        moved(LOWER_MOVES, &apart, 0, lower),
    ];
    let mut quantities = moved_blocks.concat();
    quantities.push(found.beside(("threshold of the pull", "N"), parting));
    Ok(Findings {
        quantities,
        curve: apart
            .curve((LOWER_MOVES[0], "m/s"), 0, |state| state.velocity[0])
            .beside(|t| lower * t),
    })
}
