//! The energy of a cube thrown on the ground.

use super::prelude::*;
use crate::mechanics::Rotation;
use crate::mechanics::quaternion::rotation;
use crate::simulation::random::random_attitude;

/// m.
const HALF_SIDE: f64 = 1.0;

/// A thrown cube, until it rests.
pub static TUMBLE: Posed = Posed {
    name: "tumble",
    about: "A cube is thrown on the ground and tumbles to rest: no step adds more energy than its \
            finite turn can, and at the end there is left what a cube at rest on a face has.",
    time_step: 0.002,
    inputs: &[(Input::Mass, 10.0), (Input::Friction, 0.3), EARTH, (Input::Speed, 4.0)],
    ..Posed::by(tumble)
};

/// Inelastic impacts and friction do no work: in continuous time E = ½ m v² + ½ ωᵀ I ω +
/// m g z never grows, and ends as m g a with the cube on a face. [`Balance`] has the
/// step's.
fn tumble(inputs: &Inputs, laboratory: &mut Laboratory<'_>) -> Solved {
    let (mass, g) = (inputs.get(Input::Mass)?, inputs.get(Input::Gravity)?);
    let (friction, speed) = (inputs.get(Input::Friction)?, inputs.get(Input::Speed)?);
    let start = State {
        position: Vector3::new(0.0, 0.0, 2.5),
        attitude: random_attitude(42),
        velocity: Vector3::new(0.0, speed, 0.0),
        spin: Vector3::new(0.0, -2.0, 1.0),
    };
    // Falls and rolls over, each of the time a fall takes, flights with all the speed
    // upwards, and a slide of all it has.
    let duration = 10.0 * (2.0 * HALF_SIDE / g).sqrt()
        + 4.0 * (speed + 3.0) / g
        + 2.0 * (speed + 3.0) / (friction * g);
    let cube = Subject::solid_box(mass, Vector3::repeat(HALF_SIDE), start)?;
    let setup = Setup::new(vec![cube], g, friction, duration);
    let mut ledger = Ledger::new(laboratory.time_step());
    let (run, _) = laboratory.watch(&setup, |step| ledger.enter(&setup, step))?;
    let Ledger { gain, gap, .. } = ledger;
    let at_rest = rest_slack(&run, mass, g);
    Ok(Findings {
        quantities: vec![
            at_most_zero(("largest gain beyond the turn's", "J"), gain.0, gain.1),
            exactly(("largest gap in the balance", "J"), gap.0, 0.0, gap.1),
            exactly(
                ("energy at the end", "J"),
                energy(&setup, run.time_step, run.end(0)),
                mass * g * HALF_SIDE,
                at_rest,
            ),
        ],
        curve: run.curve(("energy", "J"), 0, |state| energy(&setup, run.time_step, state)),
    })
}

/// E, J, in steps of `h` (s).
fn energy(setup: &Setup, h: f64, state: &State) -> f64 {
    let body = &setup.bodies[0].body;
    let (turning, _) = turning_energy(body, h, state);
    0.5 * body.mass() * state.velocity.norm_squared()
        + turning
        + body.mass() * setup.gravity * state.position[2]
}

/// The energy T of turning of a cube, J, and its Λ: with θ = ½ h |ω|
///
/// ```text
/// Λ = ½ I |ω|² (1 + ½ θ²),   P(ω) = ∇Λ = I ω (1 + θ²),   T = ω·P − Λ = ½ I |ω|² (1 + ³⁄₂ θ²)
/// ```
fn turning_energy(body: &RigidBody, h: f64, state: &State) -> (f64, f64) {
    let square = state.spin.norm_squared();
    let (theta, plain) = (0.25 * h * h * square, 0.5 * body.inertia()[(0, 0)] * square);
    (plain * (1.0 + 1.5 * theta), plain * (1.0 + 0.5 * theta))
}

/// What a step does with the energy, J.
///
/// The equations of the step, multiplied by the new velocities, give without any
/// approximation, for impulses p = h f at corners c,
///
/// ```text
/// E⁺ − E = Σ p·V − ½ m |v⁺ − v|² − B,   V = v⁺ + A(q) (ω⁺ × c)
/// B = Λ⁺ − Λ − P(ω)·(ω⁺ − ω) ≥ 0
/// ```
///
/// with the convex Λ of [`turning_energy`].
///
/// The laws act on the mean motion d = (C⁺ − C)/h of a corner: p·d = −μ p_z |d_xy| − p_z z/h,
/// of which neither is positive. But V ≠ d, because the step turns the body by a finite
/// angle: with θ = ½ h |ω⁺|
///
/// ```text
/// V − d = A(q) [θ² ω⁺ × c − ½ h ω⁺ × (ω⁺ × c)]/(1 + θ²),   |V − d| = |ω⁺ × c| θ/√(1 + θ²)
/// ```
///
/// so that the energy grows by at most Σ |p| |ω⁺ × c| θ/√(1 + θ²), of order h in an impact and
/// h² at rest.
struct Balance {
    /// E⁺ − E.
    change: f64,
    /// Σ p·V − ½ m |v⁺ − v|² − B.
    entered: f64,
    /// Σ |p| |ω⁺ × c| θ/√(1 + θ²).
    turning: f64,
    /// Σ |p|, N s.
    impulse: f64,
}

impl Balance {
    fn of(setup: &Setup, h: f64, step: &Taken<'_>) -> Self {
        let (body, old, new) = (&setup.bodies[0].body, &step.before[0], &step.after[0]);
        let (dv, dw) = (new.velocity - old.velocity, new.spin - old.spin);
        let [before, after] = [old, new].map(|state| turning_energy(body, h, state).1);
        let momentum = Rotation::Momentum.momentum(body.inertia(), &old.spin, h);
        let lost = 0.5 * body.mass() * dv.norm_squared() + after - before - momentum.dot(&dw);
        let theta = 0.5 * h * new.spin.norm();
        let to_world = rotation(&old.attitude);
        let (mut work, mut turning, mut impulse) = (0.0, 0.0, 0.0);
        for contact in step.contacts {
            let corner = body.contact_points()[contact.key.point].position;
            let (p, swing) = (h * contact.force, to_world * new.spin.cross(&corner));
            work += p.dot(&(new.velocity + swing));
            turning += p.norm() * swing.norm() * theta / theta.hypot(1.0);
            impulse += p.norm();
        }
        let change = energy(setup, h, new) - energy(setup, h, old);
        Self { change, entered: work - lost, turning, impulse }
    }
}

/// Of all steps the largest gain and the largest gap, and the slack of each; where some are
/// beyond their slack, of these.
struct Ledger {
    time_step: f64,
    gain: (f64, f64),
    gap: (f64, f64),
    /// δ_n of the step before, m/s.
    height: f64,
}

impl Ledger {
    fn new(time_step: f64) -> Self {
        Self { time_step, gain: (0.0, 0.0), gap: (0.0, 0.0), height: 0.0 }
    }

    /// What velocities and positions lack is missing in the balance, times momentum and
    /// weight. A corner off the ground by h δ_n, at either end of the step, does work p_z δ_n,
    /// and friction that is off by δ_f does (|p| + m |d|) δ_f.
    fn enter(&mut self, setup: &Setup, step: &Taken<'_>) {
        let (h, mass) = (self.time_step, setup.bodies[0].body.mass());
        let balance = Balance::of(setup, h, step);
        let (before, after) = (&step.before[0], &step.after[0]);
        let corners = setup.bodies[0].body.contact_points().len() as f64;
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
        let keep = |kept: &mut (f64, f64), found: f64, slack: f64| {
            let rank = |(found, slack): (f64, f64)| (found > slack, found);
            if rank((found, slack)) >= rank(*kept) {
                *kept = (found, slack);
            }
        };
        keep(&mut self.gain, (balance.change - balance.turning).max(0.0), gap + unlawful);
        keep(&mut self.gap, (balance.change - balance.entered).abs(), gap);
        self.height = residual.normal;
    }
}

/// What the residuals allow a cube at rest to have besides m g a, J: its height is off by
/// h δ_n, and its speed is no more than what holds it and what its positions lack.
fn rest_slack(run: &Run, mass: f64, gravity: f64) -> f64 {
    let Some(last) = run.residuals.last() else { return 0.0 };
    let speed = 4.0 * (last.normal + last.friction) + last.kinematics;
    let height = run.time_step * last.normal + run.rounding(HALF_SIDE);
    mass * gravity * height + mass * speed * speed
}
