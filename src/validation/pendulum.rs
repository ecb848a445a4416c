//! A rod on a hinge: it swings, is held by friction, and by a motor that gives way.
//!
//! The rod has the mass m, the moment I about its centre and the pin at the distance a from there, so that
//! J = I + m a² about the pin. At the angle φ from hanging down gravity has the moment −m g a sin φ.

use super::prelude::*;
use crate::joint::{Drive, Joint, JointFrame, Motor};
use std::f64::consts::TAU;

/// Half the sides, m; the pin is at the upper end.
const HALF_SIDES: Vector3<f64> = Vector3::new(0.02, 0.02, Rod::ARM);
/// Of the pin: nothing comes near the ground, m.
const HEIGHT: f64 = 2.0;
/// Of the hinge, which no motion depends on, m.
const BEARING: f64 = 0.3;
/// φ at the start, rad.
const START: f64 = 1.0;
/// Periods that are watched.
const PERIODS: usize = 4;
/// Enough for an angle of a step to settle to the last digit.
const ROUNDS: usize = 30;
/// Why the other solver is not asked.
pub(super) const TOO_EXACT: Option<&str> =
    Some("more digits are asked for than its residuals of 1e-6 m/s and more leave");

/// A rod under a gravity.
#[derive(Clone, Copy)]
struct Rod {
    mass: f64,
    gravity: f64,
}

impl Rod {
    fn of(inputs: &Inputs) -> Result<Self, Unsuitable> {
        Ok(Self { mass: inputs.get(Input::Mass)?, gravity: inputs.get(Input::Gravity)? })
    }

    /// a, m.
    const ARM: f64 = 0.5;

    /// I, kg m².
    fn own_moment(&self) -> f64 {
        self.mass * (HALF_SIDES[0].powi(2) + HALF_SIDES[2].powi(2)) / 3.0
    }

    /// J, kg m².
    fn moment(&self) -> f64 {
        self.own_moment() + self.mass * Self::ARM.powi(2)
    }

    /// m g a, N m.
    fn weight(&self) -> f64 {
        self.mass * self.gravity * Self::ARM
    }

    /// Let go at `angle` under `drive`.
    fn setup(&self, angle: f64, drive: Drive, duration: f64) -> Result<Setup, Unsuitable> {
        let (sin, cos) = (0.5 * angle).sin_cos();
        let start = State {
            position: Vector3::new(-Self::ARM * angle.sin(), 0.0, HEIGHT - Self::ARM * angle.cos()),
            attitude: Vector4::new(cos, 0.0, sin, 0.0),
            ..resting(HEIGHT)
        };
        let rod = Subject::solid_box(self.mass, HALF_SIDES, start)?;
        let hinge = |z: f64| JointFrame::along(Vector3::new(0.0, 0.0, z), Vector3::y());
        let frames = [hinge(Self::ARM)?, hinge(HEIGHT)?];
        // Slender as it is, an impulse of this length turns it by about as much as its mass.
        let joint = Joint::revolute(0, None, frames, drive).with_length(BEARING);
        Ok(Setup { joints: vec![joint], ..Setup::new(vec![rod], self.gravity, 0.5, duration) })
    }

    /// φ at the start and after each of so many steps of `h` (s). With r(φ) = −a (sin φ, cos φ) from the pin, the
    /// force f on the pin and the spin ω⁺ = (2/h) tan ½(φ⁺ − φ), the step's φ⁺ is the root of
    ///
    /// ```text
    /// v⁺ = (r(φ⁺) − r(φ))/h,   f = m (v⁺ − v)/h + m g,
    /// I (w(ω⁺) − w(ω)) = h (−r(φ)) × f,   w(ω) = ω (1 + (½ h ω)²)
    /// ```
    fn swing(&self, start: f64, h: f64, steps: usize) -> Vec<f64> {
        let (m, own) = (self.mass, self.own_moment());
        let mut angles = vec![start];
        let (mut speed, mut spin) = ((0.0, 0.0), 0.0);
        for k in 0..steps {
            let angle = angles[k];
            let (sin, cos) = angle.sin_cos();
            let mut turned = h * spin;
            let mut next = (speed, spin);
            for _ in 0..ROUNDS {
                // r(φ⁺) − r(φ) of the half angle and the middle.
                let (half_sin, half_cos) = (0.5 * turned).sin_cos();
                let (middle_sin, middle_cos) = (angle + 0.5 * turned).sin_cos();
                let chord = -2.0 * Self::ARM * half_sin / h;
                let now = (chord * middle_cos, -chord * middle_sin);
                let turning = 2.0 / h * half_sin / half_cos;
                let (momentum_now, slope) = momentum(h, turning);
                let force =
                    (m * (now.0 - speed.0) / h, m * (now.1 - speed.1) / h + self.gravity * m);
                let torque = Self::ARM * (cos * force.0 - sin * force.1);
                let missed = own * (momentum_now - momentum(h, spin).0) - h * torque;
                let (end_sin, end_cos) = (angle + turned).sin_cos();
                let pushed = -m * Self::ARM.powi(2) / h * (cos * end_cos + sin * end_sin);
                let by_turn = own * slope * (1.0 + (0.5 * h * turning).powi(2)) / h - pushed;
                next = (now, turning);
                turned -= missed / by_turn;
            }
            (speed, spin) = next;
            angles.push(angle + turned);
        }
        angles
    }
}

/// The time between the first passage through zero and that of `PERIODS` periods later, over these, where a number has
/// these `values` in steps of `h` (s): along straight lines. NaN where there are not as many.
fn period(values: impl Iterator<Item = f64>, h: f64) -> f64 {
    let values: Vec<_> = values.collect();
    let passes = values.windows(2).enumerate().filter(|(_, pair)| pair[0] * pair[1] < 0.0);
    let times: Vec<_> =
        passes.map(|(k, pair)| h * (k as f64 + pair[0] / (pair[0] - pair[1]))).collect();
    match times.get(2 * PERIODS) {
        Some(last) => (last - times[0]) / PERIODS as f64,
        None => f64::NAN,
    }
}

/// The arithmetic–geometric mean.
pub(super) fn mean(mut a: f64, mut b: f64) -> f64 {
    for _ in 0..10 {
        (a, b) = (0.5 * (a + b), (a * b).sqrt());
    }
    a
}

/// A pendulum of large swings.
pub static PENDULUM: Posed = Posed {
    name: "pendulum",
    about: "A rod swings on a hinge from 1 rad: its period is the elliptic integral's, \
            2π √(J/(m g a))/agm(1, cos ½φ₀), and its end stays on the pin.",
    time_step: 0.002,
    inputs: &[(Input::Mass, 2.0), EARTH],
    beyond_ipopt: TOO_EXACT,
    ..Posed::by(pendulum)
};

/// T = 2π √(J/(m g a))/agm(1, cos ½φ₀); [`Rod::swing`] has the step's.
fn pendulum(inputs: &Inputs, laboratory: &mut Laboratory<'_>) -> Solved {
    let (rod, h) = (Rod::of(inputs)?, laboratory.time_step());
    let exact = TAU * (rod.moment() / rod.weight()).sqrt() / mean(1.0, (0.5 * START).cos());
    Unsuitable::when(exact < 100.0 * h, || format!("a period of {exact:.3} s has too few steps"))?;
    let duration = (PERIODS as f64 + 0.6) * exact;
    let run = laboratory.run(&rod.setup(START, Drive::NONE, duration)?)?;
    let angles = rod.swing(START, h, run.steps());
    let discrete = period(angles.iter().map(|angle| -angle.sin()), h);
    let x = |state: &State| state.position[0];
    let measured = period(run.states(0).iter().map(x), h);
    // What velocities lack moves the phase, and the amplitude, of which it is a smooth function.
    let fastest = Rod::ARM * (2.0 * rod.weight() * (1.0 - START.cos()) / rod.moment()).sqrt();
    let lost = run.sum(|residual| residual.joint) * h + run.flight_way_slack();
    let apart = |state: &State| {
        let top = crate::mechanics::quaternion::rotation(&state.attitude) * Vector3::z() * Rod::ARM;
        (state.position + top - Vector3::new(0.0, 0.0, HEIGHT)).norm()
    };
    let farthest = run.states(0).iter().map(apart).fold(0.0, f64::max);
    let held = h * run.largest(|residual| residual.joint) + 64.0 * f64::EPSILON * HEIGHT;
    Ok(Findings {
        quantities: vec![
            exactly(("period", "s"), measured, exact, 2.0 * lost / fastest)
                .in_steps(discrete, Convergence::order(2, 0.1 * exact / h)),
            at_most_zero(("way of its end from the pin", "m"), farthest, held),
        ],
        curve: run.curve(("place of the centre along x", "m"), 0, x).beside(|_| f64::NAN),
    })
}

/// A rod that friction in its hinge holds aslant.
pub static STIFF_HINGE: Posed = Posed {
    name: "stiff-hinge",
    about: "Dry friction in its hinge holds a rod aslant at 1 rad if it has the moment of the \
            weight, m g a sin φ.",
    time_step: 0.004,
    inputs: &[(Input::Mass, 2.0), EARTH],
    beyond_ipopt: TOO_EXACT,
    ..Posed::by(stiff_hinge)
};

/// s.
const HELD_FOR: f64 = 0.2;
/// The threshold is looked for to this share of it.
const RESOLUTION: f64 = 1e-6;
/// It slips if it is this fast, as a share of g times the time.
const SLIPPING: f64 = 1e-8;

/// At rest the friction is m g a sin φ in every step, whatever h is; with less it slips.
fn stiff_hinge(inputs: &Inputs, laboratory: &mut Laboratory<'_>) -> Solved {
    let (rod, h) = (Rod::of(inputs)?, laboratory.time_step());
    let needed = rod.weight() * START.sin();
    let slack = |run: &Run| {
        let lacked = run.largest(|residual| residual.momentum + residual.joint);
        needed * (16.0 * lacked / (rod.gravity * h) + 64.0 * f64::EPSILON * HEIGHT)
    };
    let setup = |friction: f64| rod.setup(START, Drive { friction, ..Drive::NONE }, HELD_FOR);
    let (run, torques) =
        laboratory.watch(&setup(1.5 * needed)?, |step| step.joints[0].torque[2])?;
    let found = Threshold::near(needed, RESOLUTION * needed, |friction| {
        let run = laboratory.run(&setup(friction)?)?;
        // What it is said to need less of, it slips with.
        Ok((run.fastest_at_end() <= SLIPPING * rod.gravity * HELD_FOR, slack(&run)))
    })?;
    let held = torques[torques.len() - 1];
    let way = (run.end(0).position - run.states(0)[0].position).norm();
    Ok(Findings {
        quantities: vec![
            exactly(("torque that holds it", "N m"), held, needed, slack(&run)),
            at_most_zero(
                ("way of the centre", "m"),
                way,
                HELD_FOR * run.largest(|r| r.joint + r.momentum) + 64.0 * f64::EPSILON * HEIGHT,
            ),
            found.beside(("threshold of friction", "N m"), needed),
        ],
        curve: run
            .curve_of_steps(("torque that holds it", "N m"), |k| torques[k])
            .beside(|_| needed),
    })
}

/// A motor that holds a rod up with a stiffness.
pub static SERVO: Posed = Posed {
    name: "servo",
    about: "A motor with the stiffness k pulls a rod to an angle; the rod hangs below it by the \
            angle at which k (φ₀ − φ) is the moment of the weight, m g a sin φ.",
    time_step: 0.002,
    inputs: &[(Input::Mass, 2.0), EARTH],
    beyond_ipopt: TOO_EXACT,
    ..Posed::by(servo)
};

/// k, in m g a; and how long it settles for, in √(J/k).
const STIFFNESS: f64 = 4.0;
const SETTLES: f64 = 60.0;

/// Damped critically, d = 2 √(k J), it comes to rest; of a step at rest the balance is exact, whatever h is.
fn servo(inputs: &Inputs, laboratory: &mut Laboratory<'_>) -> Solved {
    let (rod, h) = (Rod::of(inputs)?, laboratory.time_step());
    let stiffness = STIFFNESS * rod.weight();
    let unit = (rod.moment() / stiffness).sqrt();
    let damping = 2.0 * stiffness * unit;
    let motor = Motor::Position { target: START, stiffness, damping, most: 100.0 * stiffness };
    let drive = Drive { motor: Some(motor), ..Drive::NONE };
    let (run, torques) = laboratory
        .watch(&rod.setup(START, drive, SETTLES * unit)?, |step| step.joints[0].torque[2])?;
    let mut angle = START;
    for _ in 0..ROUNDS {
        let missed = STIFFNESS * (START - angle) - angle.sin();
        angle += missed / (STIFFNESS + angle.cos());
    }
    let found = |state: &State| 2.0 * state.attitude[2].atan2(state.attitude[0]);
    // A force that is missed moves it by that over k.
    let last = run.residuals[run.steps() - 1];
    let lacked = (last.momentum + last.joint) / (rod.gravity * h);
    let slack = 8.0 * lacked + 1024.0 * f64::EPSILON * HEIGHT;
    let held = torques[torques.len() - 1];
    Ok(Findings {
        quantities: vec![
            exactly(("angle at rest", "rad"), found(run.end(0)), angle, slack),
            exactly(
                ("torque of the motor", "N m"),
                held,
                rod.weight() * angle.sin(),
                rod.weight() * STIFFNESS * slack,
            ),
        ],
        curve: run.curve(("angle", "rad"), 0, found).beside(|_| angle),
    })
}
