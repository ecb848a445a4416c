//! Boxes that bounce: on a face, again and again, and once on an edge.

use super::prelude::*;

/// Below this share (½ h ω)² the order does not show for rounding.
const LEAST_SHARE: f64 = 1e-9;

/// m.
const HALF_SIDES: Vector3<f64> = Vector3::new(0.2, 0.15, 0.1);
/// How high the box falls from, m.
const DROP: f64 = 0.5;
/// Bounces that are looked at.
const BOUNCES: usize = 3;

/// What the steps make of a fall from [`DROP`]: heights and times of the bounces.
struct Bounces {
    /// The highest point after each impact, m.
    heights: [f64; BOUNCES],
    /// When each impact's step begins, and that of the one after the last, s.
    impacts: [f64; BOUNCES + 1],
}

impl Bounces {
    /// From heights z_k = z(k h) above the ground, the next of which `step` gives.
    fn of(h: f64, heights: impl IntoIterator<Item = f64>, impacts: &[usize]) -> Self {
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

    /// The step in one unknown, the height z of the lower face: free flight, or, where it would
    /// end at 0 or below, the impact (29),
    ///
    /// ```text
    /// v⁺ = v − h g,   or   v⁺ = −e v where z + h (v − h g) ≤ 0;   z⁺ = z + h v⁺
    /// ```
    fn of_steps(h: f64, g: f64, e: f64) -> Self {
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
        Self::of(h, heights, &impacts)
    }
}

/// A box that falls flat and bounces.
pub static BOUNCING_BOX: Posed = Posed {
    name: "bouncing-box",
    about: "A box falls flat from half a metre and bounces: the n-th bounce is e²ⁿ times as high, \
            and lasts eⁿ times as long as the fall and its rise.",
    time_step: 0.002,
    inputs: &[(Input::Mass, 2.0), (Input::Friction, 0.3), (Input::Restitution, 0.7), EARTH],
    ..Posed::by(bouncing_box)
};

/// With v = √(2 g H),
///
/// ```text
/// H_n = e²ⁿ H,   t_n = (v/g) (1 + 2 e + … + 2 eⁿ⁻¹)
/// ```
///
/// An impact's step begins up to h v above the ground and leaves from there; so every bounce may
/// be off by that, and by the speed h g of a step.
fn bouncing_box(inputs: &Inputs, laboratory: &mut Laboratory<'_>) -> Solved {
    let (mass, g) = (inputs.get(Input::Mass)?, inputs.get(Input::Gravity)?);
    let (friction, e) = (inputs.get(Input::Friction)?, inputs.get(Input::Restitution)?);
    let h = laboratory.time_step();
    let speed = (2.0 * g * DROP).sqrt();
    let last = speed * e.powi(BOUNCES as i32);
    Unsuitable::when(last <= 8.0 * g * h, || {
        format!(
            "bounce {BOUNCES} leaves with {last:.3} m/s, slower than four steps' gravity twice \
             over; a larger restitution or a smaller time step is needed"
        )
    })?;
    let time = |n: usize| {
        let flights: f64 = (1..n).map(|bounce| e.powi(bounce as i32)).sum();
        speed / g * (1.0 + 2.0 * flights)
    };
    let start = resting(HALF_SIDES[2] + DROP);
    let duration = time(BOUNCES + 1) + 8.0 * (BOUNCES + 1) as f64 * h;
    let setup =
        Setup::new(vec![Subject::solid_box(mass, HALF_SIDES, start)?], g, friction, duration);
    let run = laboratory.run(&Setup { restitution: e, ..setup })?;
    let height = |state: &State| state.position[2] - HALF_SIDES[2];
    let impacts: Vec<_> = (0..run.steps()).filter(|&k| run.forces(0)[k][2] > 0.0).collect();
    let measured = Bounces::of(h, run.states(0).iter().map(height), &impacts);
    let discrete = Bounces::of_steps(h, g, e);

    // An impact repeats what its normal law and the flights before lack.
    let lacking = run.flight_speed_slack() + 2.0 * run.sum(|residual| residual.normal);
    let slack = 2.0 * (speed / g + duration) * lacking + run.flight_way_slack();
    let steps = speed / (g * h);
    let mut quantities = Vec::new();
    let names = ["height of the first bounce", "height of the second", "height of the third"];
    for (bounce, name) in names.into_iter().enumerate() {
        let exact = e.powi(2 * (bounce as i32 + 1)) * DROP;
        let off = 2.0 * (bounce + 1) as f64 * h * (speed + h * g);
        quantities.push(
            exactly((name, "m"), measured.heights[bounce], exact, slack)
                .in_steps(discrete.heights[bounce], Convergence::within(off, steps)),
        );
    }
    quantities.push(
        exactly(
            ("time of the fourth impact", "s"),
            measured.impacts[BOUNCES],
            time(BOUNCES + 1),
            run.rounding(duration),
        )
        .in_steps(
            discrete.impacts[BOUNCES],
            Convergence::within(6.0 * (BOUNCES + 1) as f64 * h, steps),
        ),
    );
    let exact = |t: f64| {
        let bounce = (1..=BOUNCES + 1).rev().find(|&n| time(n) <= t);
        let (begin, rise) = bounce.map_or((0.0, 0.0), |n| (time(n), speed * e.powi(n as i32)));
        let (t, from) = (t - begin, if bounce.is_some() { 0.0 } else { DROP });
        from + rise * t - 0.5 * g * t * t
    };
    let curve = Curve::of(("height", "m"), &run, |k| height(&run.states(0)[k])).beside(exact);
    Ok(Findings { quantities, curve })
}

/// The tilt of the box that lands on an edge, rad.
const TILT: f64 = 0.5;

/// A box that lands on an edge.
pub static EDGE_IMPACT: Posed = Posed {
    name: "edge-impact",
    about: "A tilted box lands on an edge without friction or gravity: the impulse p = (1 + e) \
            v/(1/m + d²/I) throws it up and turns it, d being the edge's distance from below the \
            centre.",
    time_step: 0.0005,
    inputs: &[(Input::Mass, 2.0), (Input::Restitution, 0.6), (Input::Speed, 1.5)],
    ..Posed::by(edge_impact)
};

/// ```text
/// v_z⁺ = p/m − v,   ω⁺ = p d/I,   I = ⅓ m (a² + c²),   d = a cos θ − c sin θ
/// ```
///
/// The step's law speaks of the same velocities (eq. 29), so that its impulse is exact; the spin that
/// turns the box has it as its momentum,
///
/// ```text
/// p d = I ω⁺ (1 + (½ h ω⁺)²).
/// ```
fn edge_impact(inputs: &Inputs, laboratory: &mut Laboratory<'_>) -> Solved {
    let [mass, speed, e] = inputs.all([Input::Mass, Input::Speed, Input::Restitution])?;
    let h = laboratory.time_step();
    let [a, _, c] = HALF_SIDES.into();
    let (sin, cos) = TILT.sin_cos();
    let (lever, below) = (a * cos - c * sin, a * sin + c * cos);
    let inertia = mass * (a * a + c * c) / 3.0;
    let exact = (1.0 + e) * speed / (1.0 / mass + lever * lever / inertia) * lever / inertia;
    let bounced = |spin: f64| spin * inertia / (lever * mass) - speed;
    let spin = of_step(exact, |spin| {
        let (turning, slope) = momentum(h, spin);
        (turning - exact, slope)
    });

    // Half a step above the ground; the impact comes in the first step.
    let mut start = resting(below + 0.5 * h * speed);
    start.velocity[2] = -speed;
    // The edge at +x, −z is the lowest: tilted about −y.
    let (sin, cos) = (0.5 * TILT).sin_cos();
    start.attitude = Vector4::new(cos, 0.0, sin, 0.0);
    let setup = Setup::new(vec![Subject::solid_box(mass, HALF_SIDES, start)?], 0.0, 0.0, 20.0 * h);
    let run = laboratory.run(&Setup { restitution: e, ..setup })?;
    let end = run.end(0);

    let lacking = run.sum(|residual| residual.momentum + residual.normal + residual.kinematics)
        + run.flight_rounding();
    let turning = run.rounding(exact.abs()) + 2.0 * lacking / lever.abs();
    let steps = (1.0 / (h * exact.abs())).min(f64::MAX);
    let share = (0.5 * h * exact).powi(2);
    let convergence = match share < LEAST_SHARE {
        true => Convergence::within(share * exact.abs(), steps),
        false => Convergence::order(2, steps),
    };
    let upwards = exactly(("speed upwards", "m/s"), end.velocity[2], bounced(exact), 2.0 * lacking);
    let about = exactly(("spin about the edge", "rad/s"), -end.spin[1], exact, turning);
    Ok(Findings {
        quantities: vec![
            upwards,
            about.in_steps(spin, convergence),
            exactly(("speed sideways", "m/s"), end.velocity[0], 0.0, lacking),
        ],
        curve: run
            .curve(("speed upwards", "m/s"), 0, |state| state.velocity[2])
            .beside(|t| if t > 0.0 { bounced(exact) } else { -speed }),
    })
}

/// The root of a function, which comes with its slope, near `start`.
fn of_step(start: f64, function: impl Fn(f64) -> (f64, f64)) -> f64 {
    let mut root = start;
    // Quadratic convergence; the step is small.
    for _ in 0..50 {
        let (value, slope) = function(root);
        let next = root - value / slope;
        if next == root {
            break;
        }
        root = next;
    }
    root
}
