//! A block on a block: on a slope, and with the lower one pulled.

use crate::prelude::*;

/// m.
const LOWER: Vector3<f64> = Vector3::new(1.0, 0.3, 0.05);
const UPPER: Vector3<f64> = Vector3::new(0.1, 0.1, 0.05);
const UPPER_SHARE: f64 = 0.5; // The upper block, in masses of the lower one
const WAY: f64 = 1.2; // The largest distance of the upper block on the lower one, m
const DURATION: f64 = 0.5; // s
const WATCH: f64 = 0.2; // Simulated time at a threshold, s
const CORNERS: f64 = 8.0; // Corners that slide, of two faces

#[derive(Debug, Clone, Copy)]
struct Blocks {
    /// m₁ and m₂, kg.
    masses: [f64; 2],
    /// μ₁ to the ground, μ₂ between the blocks.
    frictions: [f64; 2],
    gravity: f64,
}

/// Accelerations of the lower and the upper block, m/s².
type Accelerations = [f64; 2];

impl Blocks {
    fn new(inputs: &TestInputs, shares: [f64; 2]) -> Result<Self, Refusal> {
        let [mass, friction, gravity] = inputs.all([Mass, Friction, Gravity])?;
        let why = format!("with mu {friction} the upper block may tip over; allowed: up to 1.5");
        Refusal::when(friction > 1.5, why)?;
        let frictions = shares.map(|share| share * friction);
        Ok(Self { masses: [mass, UPPER_SHARE * mass], frictions, gravity })
    }

    fn mass(&self) -> f64 {
        self.masses[0] + self.masses[1]
    }

    /// The two blocks, with the upper one at `x` (m) on the lower one. A force of `force` (N) acts
    /// on the lower block.
    fn setup(&self, x: f64, force: f64, duration: f64) -> Result<Setup, Refusal> {
        let above = at_rest(v3(x, 0.0, 2.0 * LOWER[2] + UPPER[2]));
        let pull = Polyline::constant(v3(force, 0.0, 0.0))?;
        let lower = Subject::solid_box(self.masses[0], LOWER, resting(LOWER[2]))?.pulled(pull)?;
        let bodies = vec![lower, Subject::solid_box(self.masses[1], UPPER, above)?];
        let frictions =
            vec![(0, Partner::Ground, self.frictions[0]), (1, Partner::Body(0), self.frictions[1])];
        Ok(Setup { frictions, ..Setup::new(bodies, self.gravity, self.frictions[0], duration) })
    }

    /// Accelerations on a slope with gravity `s` along it and `n` normal to it. Both blocks move
    /// with max(0, s − μ₁ n) if min(s, μ₁ n) ≤ μ₂ n. Otherwise:
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

    /// The force (μ₁ + μ₂) (m₁ + m₂) g beyond which the upper block slips, N.
    fn parting_force(&self) -> f64 {
        (self.frictions[0] + self.frictions[1]) * self.mass() * self.gravity
    }

    /// Accelerations under a force on the lower block above its friction with the ground. Both
    /// blocks move together. Beyond the parting force:
    ///
    /// ```text
    /// a₂ = μ₂ g,   m₁ a₁ = F − μ₁ (m₁ + m₂) g − μ₂ m₂ g
    /// ```
    fn pulled(&self, force: f64) -> Accelerations {
        let left = force - self.frictions[0] * self.mass() * self.gravity;
        if force <= self.parting_force() {
            return [left / self.mass(); 2];
        }
        let upper = self.frictions[1] * self.gravity;
        [(left - upper * self.masses[1]) / self.masses[0], upper]
    }
}

/// The time in which the blocks slide apart by [`WAY`], at most [`DURATION`], s.
fn duration(accelerations: &Accelerations) -> f64 {
    let apart = (accelerations[1] - accelerations[0]).abs();
    DURATION.min((2.0 * WAY / apart).sqrt())
}

/// The tolerance of the speed of a block, m/s. It sums the residuals of the contact laws of all
/// corners and of the equations of both blocks. Impulses on the lighter block count for the heavier
/// one.
fn speed_tolerance(run: &TestRun) -> f64 {
    let missed = run.sum(|r| r.friction + r.normal);
    let lacked = run.sum(|r| r.momentum) + run.largest(|r| r.kinematics);
    (CORNERS * missed + 2.0 * lacked) / UPPER_SHARE + run.flight_rounding()
}

/// The mean tolerance of an acceleration, m/s².
fn mean_tolerance(run: &TestRun) -> f64 {
    speed_tolerance(run) / run.end_time()
}

const UPPER_MOVES: [&str; 2] = ["speed of the upper block", "way of the upper block"];
const LOWER_MOVES: [&str; 2] = ["speed of the lower block", "way of the lower block"];

/// Speed and distance of block `index` with the acceleration `a`.
fn moved(
    [speed, way]: [&'static str; 2],
    run: &TestRun,
    index: usize,
    a: f64,
) -> [TestQuantity; 2] {
    let (t, end, off) = (run.end_time(), run.end(index), speed_tolerance(run));
    let found = end.position[0] - run.states(index)[0].position[0];
    [
        equal((speed, "m/s"), end.velocity[0], a * t, off),
        run.accelerated((way, "m"), found, a, t * off + run.seat()),
    ]
}

/// A block on a block on a slope: the one on top, held by μ/2, slides beyond atan μ/2 and leaves
/// the lower one, held by μ; the other way round both slide as one. Each slides at the threshold of
/// its own face.
pub(crate) const BLOCKS_ON_SLOPE: TestProblem = TestProblem {
    name: "blocks-on-slope",
    time_step: 0.005,
    inputs: &[(Mass, 2.0), (Friction, 0.4), EARTH, (Slope, 30.0)],
    bodies: 2,
    ..TestProblem::solved_by(blocks_on_slope)
};

/// [`Blocks::sliding`] with the smoother face above and below; its threshold is atan μ/2 in both.
fn blocks_on_slope(inputs: &TestInputs, runner: &mut Runner<'_>) -> SolvedBy {
    let [gravity, slope] = inputs.all([Gravity, Slope])?;
    let smooth_above = Blocks::new(inputs, [1.0, 0.5])?;
    let smooth_below = Blocks::new(inputs, [0.5, 1.0])?;
    let (sin, cos) = slope.to_radians().sin_cos();
    let at_threshold = |friction: &f64| (sin / cos / friction - 1.0).abs() < 1e-3;
    let why = format!("a slope of {slope}° is a threshold, mu or mu/2; choose another slope");
    Refusal::when(smooth_above.frictions.iter().any(at_threshold), why)?;
    let mut go = |blocks: &Blocks| -> Result<(TestRun, Accelerations), Refusal> {
        let expected = blocks.sliding(gravity * sin, gravity * cos);
        let setup = blocks.setup(UPPER[0] - LOWER[0] + 0.05, 0.0, duration(&expected))?;
        Ok((runner.run(&Setup { slope, ..setup })?, expected))
    };
    let (apart, [lower, upper]) = go(&smooth_above)?;
    let (together, [as_one, _]) = go(&smooth_below)?;
    let onset = smooth_above.frictions[1].atan();
    let mut threshold = |blocks: &Blocks, name: &'static str, index: usize| {
        let found = Threshold::near(onset, RESOLUTION * onset, |slope| {
            let setup = blocks.setup(0.0, 0.0, WATCH)?;
            let run = runner.run(&Setup { slope: slope.to_degrees(), ..setup })?;
            let speed = run.end(index).velocity.norm();
            Ok((speed > MOVING * onset * gravity * WATCH, mean_tolerance(&run) / gravity))
        })?;
        Ok::<_, Refusal>([found.equals((name, "rad"), onset)])
    };
    let as_one_names = ["speed of both, smooth below", "way of both, smooth below"];
    Ok([
        &moved(UPPER_MOVES, &apart, 1, upper)[..],
        &moved(LOWER_MOVES, &apart, 0, lower),
        &moved(as_one_names, &together, 1, as_one),
        &threshold(&smooth_above, "threshold of the upper face", 1)?,
        &threshold(&smooth_below, "threshold of the lower face", 0)?,
    ]
    .concat())
}

/// The lower of two blocks is pulled: they go as one up to (μ₁ + μ₂)(m₁ + m₂) g, with μ₁ on the
/// ground and μ₂ between them; beyond, the upper one has μ₂ g and stays behind.
pub(crate) const PULLED_BLOCK: TestProblem = TestProblem {
    name: "pulled-block",
    time_step: 0.005,
    inputs: &[(Mass, 2.0), (Friction, 0.4), EARTH],
    bodies: 2,
    // Ipopt: at the onset of sliding, its residuals reach 1e-3 m/s.
    ..TestProblem::solved_by(pulled_block)
};

/// [`Blocks::pulled`] with μ₁ = μ/2 and μ₂ = μ, on both sides of the parting force.
fn pulled_block(inputs: &TestInputs, runner: &mut Runner<'_>) -> SolvedBy {
    let blocks = Blocks::new(inputs, [0.5, 1.0])?;
    let (gravity, parting) = (blocks.gravity, blocks.parting_force());
    let held = blocks.frictions[0] * blocks.mass() * gravity;
    let mut go = |force: f64| -> Result<(TestRun, Accelerations), Refusal> {
        let expected = blocks.pulled(force);
        let setup = blocks.setup(LOWER[0] - UPPER[0] - 0.05, force, duration(&expected))?;
        Ok((runner.run(&setup)?, expected))
    };
    let (together, [as_one, _]) = go(0.5 * (held + parting))?;
    let (apart, [lower, upper]) = go(1.5 * parting)?;
    let found = Threshold::near(parting, RESOLUTION * parting, |force| {
        let run = runner.run(&blocks.setup(0.0, force, WATCH)?)?;
        let [first, second] = [0, 1].map(|index| run.end(index).velocity[0]);
        let parts = first - second > MOVING * blocks.frictions[1] * gravity * WATCH;
        Ok((parts, blocks.mass() * mean_tolerance(&run)))
    })?;
    Ok([
        &moved(["speed as one", "way as one"], &together, 1, as_one)[..],
        &moved(UPPER_MOVES, &apart, 1, upper),
        &moved(LOWER_MOVES, &apart, 0, lower),
        &[found.equals(("threshold of the pull", "N"), parting)],
    ]
    .concat())
}
