//! The energy of a cube thrown on the ground.

use crate::prelude::*;
use tumble_core::simulation::random::random_attitude;

const HALF_SIDE: f64 = 1.0; // m

/// A cube is thrown on the ground and tumbles to rest: no step adds more energy than its finite
/// turn can, and at the end there is left what a cube at rest on a face has.
pub(crate) const TUMBLE: TestProblem = TestProblem {
    name: "tumble",
    time_step: 0.002,
    inputs: &[(Mass, 10.0), (Friction, 0.3), EARTH, (Speed, 4.0)],
    ..TestProblem::solved_by(tumble)
};

/// E = ½ m v² + ½ ωᵀ I ω + m g z never grows, and ends as m g a.
fn tumble(inputs: &TestInputs, runner: &mut Runner<'_>) -> SolvedBy {
    let [mass, g, friction, speed] = inputs.all([Mass, Gravity, Friction, Speed])?;
    let start = State {
        attitude: random_attitude(42),
        velocity: v3(0.0, speed, 0.0),
        spin: v3(0.0, -2.0, 1.0),
        ..resting(2.5)
    };
    // Falls and rolls, flights with all the speed upwards, and a slide with all the speed.
    let duration = 10.0 * (2.0 * HALF_SIDE / g).sqrt()
        + 4.0 * (speed + 3.0) / g
        + 2.0 * (speed + 3.0) / (friction * g);
    let setup = Setup::from_box(mass, Vector3::repeat(HALF_SIDE), start, g, friction, duration)?;
    let mut ledger = Ledger { time_step: runner.time_step, ..Ledger::default() };
    let (run, _) = runner.watch(&setup, |step| ledger.enter(&setup, step))?;
    let energy = |state: &State| energy(&setup, run.time_step, state);
    let ([gain, gap], end) = ([ledger.gain, ledger.gap], energy(run.end(0)));
    let rest = rest_tolerance(&run, mass, g);
    Ok(vec![
        at_most_zero(("largest gain beyond the turn's", "J"), gain.0, gain.1),
        equal(("largest gap in the balance", "J"), gap.0, 0.0, gap.1),
        equal(("energy at the end", "J"), end, mass * g * HALF_SIDE, rest),
    ])
}

/// E, J, with steps of `h` (s).
fn energy(setup: &Setup, h: f64, state: &State) -> f64 {
    let body = &setup.bodies[0].body;
    let (turning, _) = turning_energy(body, h, state);
    0.5 * body.mass() * state.velocity.norm_squared()
        + turning
        + body.mass() * setup.gravity * state.position[2]
}

/// The rotational energy T of a cube, J, and Λ. With the angular momentum w(ω) per moment of inertia
/// they are
///
/// ```text
/// Λ = I ∫ w dω,   P(ω) = ∇Λ,   T = ω·P − Λ
/// ```
fn turning_energy(body: &RigidBody, h: f64, state: &State) -> (f64, f64) {
    /// Positions and weights of Gauss's rule with three points.
    const GAUSS: [(f64, f64); 3] = [
        (0.112_701_665_379_258_3, 5.0 / 18.0),
        (0.5, 8.0 / 18.0),
        (0.887_298_334_620_741_7, 5.0 / 18.0),
    ];
    let (spin, moment) = (state.spin.norm(), body.inertia()[(0, 0)]);
    // w is ω and a term of the ninth order, to whose share of 1e-9 the rule is right.
    let mean: f64 = GAUSS.iter().map(|(at, weight)| weight * momentum(h, at * spin).0).sum();
    let lambda = moment * mean * spin;
    (moment * momentum(h, spin).0 * spin - lambda, lambda)
}

/// The energy balance of a step, J, with impulses p = h f at corners c and V = v⁺ + A(q) (ω⁺ × c):
///
/// ```text
/// E⁺ − E = Σ p·V − ½ m |v⁺ − v|² − B ≤ Σ |p| |ω⁺ × c| ½ψ,   B = Λ⁺ − Λ − P(ω)·(ω⁺ − ω) ≥ 0
/// ```
struct Balance {
    change: f64,  // E⁺ − E
    entered: f64, // Σ p·V − ½ m |v⁺ − v|² − B
    turning: f64, // Σ |p| |ω⁺ × c| ½ψ
    impulse: f64, // Σ |p|, N s
}

impl Balance {
    fn new(setup: &Setup, h: f64, step: &TestStep<'_>) -> Self {
        let (body, old, new) = (&setup.bodies[0].body, &step.before[0], &step.after[0]);
        let (dv, dw) = (new.velocity - old.velocity, new.spin - old.spin);
        let [before, after] = [old, new].map(|state| turning_energy(body, h, state).1);
        let momentum = Rotation::Momentum.momentum(body.inertia(), &old.spin, h);
        let lost = 0.5 * body.mass() * dv.norm_squared() + after - before - momentum.dot(&dw);
        let angle = turn(h, new.spin.norm()).0;
        let to_world = rotation(&old.attitude);
        let (mut work, mut turning, mut impulse) = (0.0, 0.0, 0.0);
        for contact in step.contacts {
            let corner = body.contact_points()[contact.key.point].position;
            let (p, swing) = (h * contact.force, to_world * new.spin.cross(&corner));
            work += p.dot(&(new.velocity + swing));
            turning += p.norm() * swing.norm() * 0.5 * angle;
            impulse += p.norm();
        }
        let change = energy(setup, h, new) - energy(setup, h, old);
        Self { change, entered: work - lost, turning, impulse }
    }
}

/// The largest gain and the largest gap of all steps, each with its tolerance. Steps beyond their
/// tolerance take precedence.
#[derive(Default)]
struct Ledger {
    time_step: f64,
    gain: (f64, f64),
    gap: (f64, f64),
    height: f64, // δ_n of the step before, m/s
}

impl Ledger {
    /// Adds a step to the tolerances. Residuals of velocities and positions enter the balance with
    /// momentum and weight. A corner off the ground by h δ_n at either end of the step does the
    /// work p_z δ_n. A friction residual δ_f does the work (|p| + m |d|) δ_f.
    fn enter(&mut self, setup: &Setup, step: &TestStep<'_>) {
        let (h, body) = (self.time_step, &setup.bodies[0].body);
        let balance = Balance::new(setup, h, step);
        let (before, after) = (&step.before[0], &step.after[0]);
        let (mass, corners) = (body.mass(), body.contact_points().len() as f64);
        let reach = HALF_SIDE * 3.0_f64.sqrt();
        let speed = |state: &State| state.velocity.norm() + reach * state.spin.norm();
        let (momentum, residual) = (mass * (speed(before) + speed(after)), step.residual);
        let energy = energy(setup, h, before).abs() + energy(setup, h, after).abs();
        let rounding = 16.0 * f64::EPSILON * (energy + balance.impulse * speed(after));
        let gap = 2.0 * momentum * residual.momentum
            + mass * setup.gravity * h * residual.kinematics
            + rounding;
        let unlawful = balance.impulse * (residual.normal + self.height + residual.friction)
            + corners * momentum * residual.friction;
        let keep = |kept: &mut (f64, f64), found: (f64, f64)| {
            let rank = |(found, tolerance): (f64, f64)| (found > tolerance, found);
            if rank(found) >= rank(*kept) {
                *kept = found;
            }
        };
        let gained = (balance.change - balance.turning).max(0.0);
        keep(&mut self.gain, (gained, gap + unlawful));
        keep(&mut self.gap, ((balance.change - balance.entered).abs(), gap));
        self.height = residual.normal;
    }
}

/// The energy above m g a that residuals allow a resting cube, J. The height is off by h δ_n. The
/// speed is off by the residuals of the laws and of the positions.
fn rest_tolerance(run: &TestRun, mass: f64, gravity: f64) -> f64 {
    let Some(last) = run.residuals.last() else { return 0.0 };
    let speed = 4.0 * (last.normal + last.friction) + last.kinematics;
    let height = run.time_step * last.normal + run.rounding(HALF_SIDE);
    mass * gravity * height + mass * speed * speed
}
