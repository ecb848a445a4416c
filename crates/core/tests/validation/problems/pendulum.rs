//! A rod on a hinge: a pendulum, held by dry friction, and held by a motor.
//!
//! J = I + m a² about the pin, at the distance a from the centre.

use crate::planar::{Bar, Linkage, PlanarBody, PlanarPin, PlanarSurface};
use crate::prelude::*;
use std::f64::consts::TAU;

const ARM: f64 = 0.5; // a, m
/// m; the pin is at the upper end.
const HALF_SIDES: Vector3<f64> = Vector3::new(0.02, 0.02, ARM);
const HEIGHT: f64 = 2.0; // The pin above the ground, m
/// The length scale of the hinge, m: a unit impulse turns the slender rod about as much as it moves it.
const BEARING: f64 = 0.3;
const START: f64 = 1.0; // φ at the start, rad
const PERIODS: usize = 4; // Periods of the run

#[derive(Clone, Copy)]
struct Rod {
    mass: f64,
    gravity: f64,
}

impl Rod {
    fn from_inputs(inputs: &TestInputs) -> Result<Self, Refusal> {
        let [mass, gravity] = inputs.all([Mass, Gravity])?;
        Ok(Self { mass, gravity })
    }

    /// I, kg m².
    fn own_moment(&self) -> f64 {
        self.mass * (HALF_SIDES[0].powi(2) + HALF_SIDES[2].powi(2)) / 3.0
    }

    /// J, kg m².
    fn moment(&self) -> f64 {
        self.own_moment() + self.mass * ARM.powi(2)
    }

    /// m g a, N m.
    fn weight(&self) -> f64 {
        self.mass * self.gravity * ARM
    }

    /// Released from [`START`] with `drive`.
    fn setup(&self, drive: Drive, duration: f64) -> Result<Setup, Refusal> {
        let position = v3(-ARM * START.sin(), 0.0, HEIGHT - ARM * START.cos());
        let start = State { attitude: about_y(START), ..at_rest(position) };
        let rod = Subject::solid_box(self.mass, HALF_SIDES, start)?;
        let ends = [ARM, HEIGHT].map(|z| v3(0.0, 0.0, z));
        let joint = hinge(0, None, ends, Vector3::y(), drive)?.with_length(BEARING);
        Ok(Setup { joints: vec![joint], ..Setup::new(vec![rod], self.gravity, 0.5, duration) })
    }

    /// The scheme's x of the centre at the start and after each step of `h` (s): [`Linkage::steps`].
    fn swing(&self, h: f64, steps: usize) -> Vec<f64> {
        let bars = vec![Bar { mass: self.mass, moment: self.own_moment() }];
        let (at, there) = (Vector2::new(0.0, ARM), Vector2::zeros());
        let start = PlanarBody::at(Vector2::new(-ARM * START.sin(), -ARM * START.cos()), -START);
        let pins = vec![PlanarPin { a: 0, at, b: None, there }];
        let linkage = Linkage { plane: PlanarSurface::Upright, bars, pins, start: vec![start] };
        let weight = (Vector2::new(0.0, -self.mass * self.gravity), 0.0);
        let track = linkage.steps(h, steps, |_| vec![weight]);
        track.iter().map(|bodies| bodies[0].place[0]).collect()
    }
}

/// The mean of [`PERIODS`] periods of `values` in steps of `h`, s.
fn period(values: &[f64], h: f64) -> f64 {
    2.0 * mean_interval(&zeros(values, h, |before, after| before * after < 0.0), 2 * PERIODS)
}

/// A rod swings on a hinge from 1 rad: its period is the elliptic integral's, 2π √(J/(m g
/// a))/agm(1, cos ½φ₀), and its end stays on the pin.
pub(crate) const PENDULUM: TestProblem = TestProblem {
    name: "pendulum",
    time_step: 0.002,
    inputs: &[(Mass, 2.0), EARTH],
    ..TestProblem::solved_by(pendulum)
};

/// T = 2π √(J/(m g a))/agm(1, cos ½φ₀), discrete by [`Rod::swing`].
fn pendulum(inputs: &TestInputs, runner: &mut Runner<'_>) -> SolvedBy {
    let (rod, h) = (Rod::from_inputs(inputs)?, runner.time_step);
    let exact = TAU * (rod.moment() / rod.weight()).sqrt() / agm(1.0, (0.5 * START).cos());
    Refusal::when(
        exact < 100.0 * h,
        format!("a period of {exact:.3} s has too few steps; use a smaller time step"),
    )?;
    let run = runner.run(&rod.setup(Drive::NONE, (PERIODS as f64 + 0.6) * exact)?)?;
    let discrete = period(&rod.swing(h, run.steps()), h);
    let x: Vec<_> = run.states(0).iter().map(|state| state.position[0]).collect();
    let measured = period(&x, h);
    // The residual of velocities changes the phase and the amplitude. The phase is a smooth
    // function of the amplitude.
    let fastest = ARM * (2.0 * rod.weight() * (1.0 - START.cos()) / rod.moment()).sqrt();
    let lost = run.sum(|r| r.joint) * h + run.flight_way();
    let farthest = run.most(0, |state| {
        let top = rotation(&state.attitude) * Vector3::z() * ARM;
        (state.position + top - v3(0.0, 0.0, HEIGHT)).norm()
    });
    let held = h * run.largest(|r| r.joint) + 64.0 * f64::EPSILON * HEIGHT;
    Ok(vec![
        equal(("period", "s"), measured, exact, 2.0 * lost / fastest)
            .stepped(discrete, order(2, 0.1 * exact / h)),
        at_most_zero(("way of its end from the pin", "m"), farthest, held),
    ])
}

/// Dry friction in its hinge holds a rod aslant at 1 rad if it has the moment of the weight, m g a
/// sin φ.
pub(crate) const STIFF_HINGE: TestProblem = TestProblem {
    name: "stiff-hinge",
    time_step: 0.004,
    inputs: &[(Mass, 2.0), EARTH],
    ..TestProblem::solved_by(stiff_hinge)
};

const HELD_FOR: f64 = 0.2; // s

/// The friction at rest, and its threshold, is m g a sin φ.
fn stiff_hinge(inputs: &TestInputs, runner: &mut Runner<'_>) -> SolvedBy {
    let (rod, h) = (Rod::from_inputs(inputs)?, runner.time_step);
    let needed = rod.weight() * START.sin();
    let tolerance = |run: &TestRun| {
        let lacked = run.largest(|r| r.momentum + r.joint);
        needed * (16.0 * lacked / (rod.gravity * h) + 64.0 * f64::EPSILON * HEIGHT)
    };
    let setup = |friction: f64| rod.setup(Drive { friction, ..Drive::NONE }, HELD_FOR);
    let (run, torques) = runner.watch(&setup(1.5 * needed)?, |step| step.joints[0].torque[2])?;
    let found = Threshold::at_rest(runner, needed, setup, tolerance)?;
    let still = HELD_FOR * run.largest(|r| r.joint + r.momentum) + 64.0 * f64::EPSILON * HEIGHT;
    Ok(vec![
        equal(("torque that holds it", "N m"), *last(&torques), needed, tolerance(&run)),
        at_most_zero(("way of the centre", "m"), run.moved(0), still),
        found.equals(("threshold of friction", "N m"), needed),
    ])
}

/// A motor with the stiffness k pulls a rod to an angle; the rod hangs below it by the angle at
/// which k (φ₀ − φ) is the moment of the weight, m g a sin φ.
pub(crate) const SERVO: TestProblem = TestProblem {
    name: "servo",
    time_step: 0.002,
    inputs: &[(Mass, 2.0), EARTH],
    ..TestProblem::solved_by(servo)
};

/// k, in m g a; and the simulated time, in √(J/k).
const STIFFNESS: f64 = 4.0;
const SETTLES: f64 = 60.0;

/// k (φ₀ − φ) = m g a sin φ at rest, with the critical damping 2 √(k J).
fn servo(inputs: &TestInputs, runner: &mut Runner<'_>) -> SolvedBy {
    let (rod, h) = (Rod::from_inputs(inputs)?, runner.time_step);
    let stiffness = STIFFNESS * rod.weight();
    let unit = (rod.moment() / stiffness).sqrt();
    let damping = 2.0 * stiffness * unit;
    let motor = Motor::Position { target: START, stiffness, damping, max_force: 100.0 * stiffness };
    let drive = Drive { motor: Some(motor), ..Drive::NONE };
    let setup = rod.setup(drive, SETTLES * unit)?;
    let (run, torques) = runner.watch(&setup, |step| step.joints[0].torque[2])?;
    let angle = newton(START, |angle| {
        (-(STIFFNESS * (START - angle) - angle.sin()), STIFFNESS + angle.cos())
    });
    // A force that is missed moves the rod by that over k.
    let residual = last(&run.residuals);
    let lacked = (residual.momentum + residual.joint) / (rod.gravity * h);
    let off = 8.0 * lacked + 1024.0 * f64::EPSILON * HEIGHT;
    let (held, torque) = (*last(&torques), rod.weight() * angle.sin());
    let found = |state: &State| angle_about(1, state);
    let torque_off = rod.weight() * STIFFNESS * off;
    Ok(vec![
        equal(("angle at rest", "rad"), found(run.end(0)), angle, off),
        equal(("torque of the motor", "N m"), held, torque, torque_off),
    ])
}
