//! Bodies that bounce: a box on a face and on an edge, and balls without loss.

use crate::prelude::*;

const HALF_SIDES: Vector3<f64> = Vector3::new(0.2, 0.15, 0.1); // m
const DROP: f64 = 0.5; // The height of the fall, m
const BOUNCES: usize = 3; // Bounces that are compared

/// The bounces after a fall from [`DROP`].
struct Bounces {
    /// The highest point after each impact, m.
    heights: [f64; BOUNCES],
    /// The start of each impact's step, and of the next one, s.
    impacts: [f64; BOUNCES + 1],
}

impl Bounces {
    /// The bounces with the heights z_k = z(k h) above the ground and the steps of the impacts.
    fn new(h: f64, heights: impl IntoIterator<Item = f64>, impacts: &[usize]) -> Self {
        let mut found = Self { heights: [0.0; BOUNCES], impacts: [f64::NAN; BOUNCES + 1] };
        for (slot, &step) in found.impacts.iter_mut().zip(impacts) {
            *slot = step as f64 * h;
        }
        for (k, height) in heights.into_iter().enumerate() {
            let bounce = impacts.iter().filter(|&&step| step < k).count();
            if (1..=BOUNCES).contains(&bounce) {
                found.heights[bounce - 1] = found.heights[bounce - 1].max(height);
            }
        }
        found
    }

    /// Simulates the scheme. The new velocity is v⁺ = v − h g, or v⁺ = −e v if z + h (v − h g) ≤ 0.
    /// The new height is z⁺ = z + h v⁺.
    fn from_steps(h: f64, g: f64, e: f64) -> Self {
        let (mut z, mut v) = (DROP, 0.0);
        let (mut heights, mut impacts) = (vec![z], Vec::new());
        for k in 0.. {
            let free = v - h * g;
            if z + h * free <= 0.0 {
                impacts.push(k);
                if impacts.len() > BOUNCES {
                    break;
                }
                v *= -e;
            } else {
                v = free;
            }
            z += h * v;
            heights.push(z);
        }
        Self::new(h, heights, &impacts)
    }
}

/// A box falls flat from half a metre and bounces: the n-th bounce is e²ⁿ times as high, and lasts
/// eⁿ times as long as the fall and its rise.
pub(crate) const BOUNCING_BOX: TestProblem = TestProblem {
    name: "bouncing-box",
    time_step: 0.002,
    inputs: &[(Mass, 2.0), (Friction, 0.3), (Restitution, 0.7), EARTH],
    ..TestProblem::solved_by(bouncing_box)
};

/// H_n = e²ⁿ H, t_n = (v/g) (1 + 2 e + … + 2 eⁿ⁻¹) with v = √(2 g H). A bounce may be off by the
/// distance h v of the impact's step and by the speed h g.
fn bouncing_box(inputs: &TestInputs, runner: &mut Runner<'_>) -> SolvedBy {
    let [mass, g, friction, e] = inputs.all([Mass, Gravity, Friction, Restitution])?;
    let h = runner.time_step;
    let speed = (2.0 * g * DROP).sqrt();
    let last = speed * e.powi(BOUNCES as i32);
    let why = format!(
        "bounce {BOUNCES} leaves with {last:.3} m/s, too slow for this time step; use a larger \
         restitution or a smaller time step"
    );
    Refusal::when(last <= 8.0 * g * h, why)?;
    let time = |n: usize| {
        let flights: f64 = (1..n).map(|bounce| e.powi(bounce as i32)).sum();
        speed / g * (1.0 + 2.0 * flights)
    };
    let count = (BOUNCES + 1) as f64;
    let duration = time(BOUNCES + 1) + 8.0 * count * h;
    let start = resting(HALF_SIDES[2] + DROP);
    let setup = Setup::from_box(mass, HALF_SIDES, start, g, friction, duration)?;
    let run = runner.run(&Setup { restitution: e, ..setup })?;
    let height = |state: &State| state.position[2] - HALF_SIDES[2];
    let impacts: Vec<_> = (0..run.steps()).filter(|&k| run.forces(0)[k][2] > 0.0).collect();
    let measured = Bounces::new(h, run.states(0).iter().map(height), &impacts);
    let discrete = Bounces::from_steps(h, g, e);

    // An impact repeats the residuals of its normal law and of earlier flights.
    let lacking = run.flight_speed() + 2.0 * run.sum(|r| r.normal);
    let allowed = 2.0 * (speed / g + duration) * lacking + run.flight_way();
    let steps = speed / (g * h);
    let names = ["height of the first bounce", "height of the second", "height of the third"];
    let mut quantities: Vec<_> = (0..BOUNCES)
        .map(|k| {
            let exact = e.powi(2 * (k as i32 + 1)) * DROP;
            let off = 2.0 * (k + 1) as f64 * h * (speed + h * g);
            equal((names[k], "m"), measured.heights[k], exact, allowed)
                .stepped(discrete.heights[k], within(off, steps))
        })
        .collect();
    let (fourth, end) = (measured.impacts[BOUNCES], time(BOUNCES + 1));
    quantities.push(
        equal(("time of the fourth impact", "s"), fourth, end, run.rounding(duration))
            .stepped(discrete.impacts[BOUNCES], within(6.0 * count * h, steps)),
    );
    Ok(quantities)
}

const TILT: f64 = 0.5; // The tilt of the box that lands on an edge, rad

/// A tilted box lands on an edge without friction or gravity: the impulse p = (1 + e) v/(1/m +
/// d²/I) throws it up and turns it, d being the edge's distance from below the centre.
pub(crate) const EDGE_IMPACT: TestProblem = TestProblem {
    name: "edge-impact",
    time_step: 0.0005,
    inputs: &[(Mass, 2.0), (Restitution, 0.6), (Speed, 1.5)],
    ..TestProblem::solved_by(edge_impact)
};

/// p = (1 + e) v/(1/m + d²/I), v_z⁺ = p/m − v and ω⁺ = p d/I, discrete w(ω⁺) = p d/I.
/// Here I = ⅓ m (a² + c²) and d = a cos θ − c sin θ.
fn edge_impact(inputs: &TestInputs, runner: &mut Runner<'_>) -> SolvedBy {
    let [mass, speed, e] = inputs.all([Mass, Speed, Restitution])?;
    let h = runner.time_step;
    let [a, _, c] = HALF_SIDES.into();
    let (sin, cos) = TILT.sin_cos();
    let (lever, below) = (a * cos - c * sin, a * sin + c * cos);
    let inertia = mass * (a * a + c * c) / 3.0;
    let exact = (1.0 + e) * speed / (1.0 / mass + lever * lever / inertia) * lever / inertia;
    let upwards = exact * inertia / (lever * mass) - speed;
    let spin = newton(exact, |spin| {
        let (turning, slope) = momentum(h, spin);
        (turning - exact, slope)
    });

    // Half a step above the ground: the impact comes in the first step, on the edge at +x.
    let mut start = resting(below + 0.5 * h * speed);
    start.velocity[2] = -speed;
    start.attitude = about_y(TILT);
    let setup = Setup::from_box(mass, HALF_SIDES, start, 0.0, 0.0, 20.0 * h)?;
    let run = runner.run(&Setup { restitution: e, ..setup })?;
    let end = run.end(0);

    let lacking = run.sum(|r| r.momentum + r.normal + r.kinematics) + run.flight_rounding();
    let turning = run.rounding(exact.abs()) + 2.0 * lacking / lever.abs();
    let steps = (1.0 / (h * exact.abs())).min(f64::MAX);
    let convergence = lagging(h, exact, exact, steps);
    Ok(vec![
        equal(("speed upwards", "m/s"), end.velocity[2], upwards, 2.0 * lacking),
        equal(("spin about the edge", "rad/s"), -end.spin[1], exact, turning)
            .stepped(spin, convergence),
        equal(("speed sideways", "m/s"), end.velocity[0], 0.0, lacking),
    ])
}

/// Balls along each edge of the grid, their radius and distance, m.
const EDGE: usize = 7;
const BALLS: usize = EDGE * EDGE;
const RADIUS: f64 = 0.1;
const APART: f64 = 0.3;
/// The fall of the first ball, and how much longer each next one is, m.
const FALL: f64 = 1.0;
const HIGHER: f64 = 0.02;
const DURATION: f64 = 10.0; // s

/// 49 balls fall from 1 to 2 m and bounce without loss for ten seconds: each keeps its energy, and
/// the step keeps ½ v² + g z − ½ h g v.
pub(crate) const BOUNCING_BALLS: TestProblem = TestProblem {
    name: "bouncing-balls",
    time_step: 0.01,
    inputs: &[(Mass, 1.0), (Friction, 0.3), EARTH],
    bodies: BALLS,
    ..TestProblem::solved_by(bouncing_balls)
};

/// The step conserves ½ v² + g z − ½ h g v (eq. 30), about which the energy oscillates by ½ h g v.
fn bouncing_balls(inputs: &TestInputs, runner: &mut Runner<'_>) -> SolvedBy {
    let [mass, g, friction] = inputs.all([Mass, Gravity, Friction])?;
    let h = runner.time_step;
    let slowest = (2.0 * g * FALL).sqrt();
    let why = format!(
        "the lowest ball lands with {slowest:.3} m/s, too slow for this time step; use a smaller \
         time step"
    );
    Refusal::when(slowest <= 8.0 * g * h, why)?;
    let place = |index: usize| {
        let [x, y] = [index % EDGE, index / EDGE].map(|number| APART * number as f64);
        at_rest(v3(x, y, RADIUS + FALL + HIGHER * index as f64))
    };
    let balls = Subject::balls(mass, RADIUS, (0..BALLS).map(place))?;
    let run =
        runner.run(&Setup { restitution: 1.0, ..Setup::new(balls, g, friction, DURATION) })?;

    let kept = |state: &State| {
        let (v, z) = (state.velocity[2], state.position[2]);
        0.5 * v * v + g * z - 0.5 * h * g * v
    };
    let drift = (0..BALLS).map(|ball| {
        let start = kept(&run.states(ball)[0]);
        run.most(ball, |state| (kept(state) - start).abs())
    });
    let drift = largest(drift);
    let energy =
        |k: usize| run.mean(k, |state| 0.5 * state.velocity.norm_squared() + g * state.position[2]);
    let fastest = (2.0 * g * (FALL + HIGHER * BALLS as f64)).sqrt();
    let lacking = run.sum(|r| r.momentum + r.normal + r.kinematics);
    let off = 2.0 * lacking + run.rounding(fastest);
    let swing = largest((0..=run.steps()).map(|k| (energy(k) - energy(0)).abs()));
    let beyond = swing - 0.5 * h * g * fastest;
    let sideways = largest(run.all_states().map(|state| state.velocity.xy().norm()));
    Ok(vec![
        at_most_zero(("largest change of ½ v² + g z − ½ h g v", "J/kg"), drift, off * fastest),
        at_most_zero(("swing of the mean energy beyond ½ h g v", "J/kg"), beyond, off * fastest),
        at_most_zero(("speed sideways", "m/s"), sideways, off),
    ])
}
