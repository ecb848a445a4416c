//! Sensitivity of a falling tower: a box of 0.2 × 0.2 × 0.8 m, pushed at its centre for 0.3 s.
//!
//! The table shows derivatives of the tilt after 0.8 s with respect to push, mass, friction,
//! gravity and size, by a reverse pass through the run. Each is in rad per relative change of the
//! parameter. Differences in the push check them. Push and mass have opposite effects. Friction has
//! none while the tower sticks.
//!
//! One critical push leaves the tower balanced on its edge. There the sensitivity grows at the rate
//! of an inverted pendulum, with R from the edge to the centre:
//!
//! ```text
//! ∂tilt/∂F ~ e^{pt},   p² = m g R/I_edge = 3 g/(4 R)
//! ```
//!
//! ```text
//! cargo run --release --example tower
//! ```

use nalgebra::Vector3;
use tumble::{
    Checkpoints, Constant, Error, Motion, Parameters, Plane, RigidBody, Rotation, Run, Simulation,
    State, StateChange, StepRecord, World, Wrench,
};

/// Number of steps of 1 ms with the push, and in the table.
const PUSHED: u64 = 300;
const STEPS: u64 = 800;
/// Half sides of the box, m.
const HALF: Vector3<f64> = Vector3::new(0.1, 0.1, 0.4);
const GRAVITY: f64 = 9.81;
const CONSTANTS: [Constant; 4] =
    [Constant::Mass, Constant::Friction, Constant::Gravity, Constant::Size];

fn simulation() -> Result<Simulation<'static>, Error> {
    let world = World::new(Parameters {
        bodies: vec![RigidBody::solid_box(3.0, HALF)?],
        ground: Some(Plane::level()),
        gravity: Vector3::new(0.0, 0.0, -GRAVITY),
        friction: 0.8,
        time_step: 0.001,
        rotation: Rotation::Momentum,
    })?;
    let start = State::at_rest(Vector3::new(0.0, 0.0, HALF[2]));
    let motion = Motion::native(&world);
    Simulation::new(world, [start], motion)
}

/// Sets the push (N) of the next step.
fn push(simulation: &mut Simulation<'_>, force: f64) -> Result<(), Error> {
    let force = if simulation.index() < PUSHED { force } else { 0.0 };
    simulation.set_wrench(0, Wrench { force: Vector3::x() * force, torque: Vector3::zeros() })
}

/// Tilt about y after `steps` steps, rad.
fn tilt(force: f64, steps: u64) -> Result<f64, Error> {
    let (mut simulation, mut record) = (simulation()?, StepRecord::new());
    for _ in 0..steps {
        push(&mut simulation, force)?;
        simulation.step(&mut record)?;
    }
    let attitude = simulation.states()[0].attitude;
    Ok(2.0 * attitude[2].atan2(attitude[0]))
}

/// ∂tilt/∂ln of push, mass, friction, gravity and size, and the smallest margin of the run, m/s.
fn parts(force: f64, steps: u64) -> Result<([f64; 5], f64), Error> {
    let mut simulation = simulation()?;
    let along = StateChange { turn: Vector3::y(), ..StateChange::zero() };
    let found = simulation.gradient(&mut Run {
        steps,
        before: &mut |simulation| push(simulation, force),
        by_states: &mut |k, _| (k == steps).then(|| vec![along]),
        constants: &CONSTANTS,
        inputs: &[],
        checkpoints: Checkpoints::default(),
        smoothing: None,
        has_impact_times: false,
    })?;
    let pushed = &found.wrenches[..PUSHED as usize];
    let by_push: f64 = pushed.iter().map(|wrenches| wrenches[0].force[0]).sum();
    let own = CONSTANTS.map(|constant| constant.values(simulation.world()));
    let part = |k: usize| -> f64 {
        found.constants[k].iter().zip(&own[k]).map(|(by, own)| by * own).sum()
    };
    Ok(([by_push * force, part(0), part(1), part(2), part(3)], found.margin.0))
}

fn main() -> Result<(), Error> {
    println!(
        "push, N   tilt, rad     by push  difference     by mass  friction  gravity    size  margin, m/s"
    );
    for force in [6.0, 8.0, 9.0, 9.5, 10.0, 10.5, 11.0, 12.0] {
        let ([by_push, mass, friction, gravity, size], margin) = parts(force, STEPS)?;
        let apart = 1e-6 * force;
        let (ahead, behind) = (tilt(force + apart, STEPS)?, tilt(force - apart, STEPS)?);
        let difference = force * (ahead - behind) / (2.0 * apart);
        let tilt = tilt(force, STEPS)?;
        println!(
            "{force:7.2}  {tilt:10.6}  {by_push:10.5}  {difference:10.5}  {mass:10.5}  {friction:8.0e}  \
             {gravity:7.3}  {size:6.3}  {margin:11.0e}"
        );
    }
    // Bisection for the critical push, which leaves the tower on its edge.
    let (mut falls_back, mut falls): (f64, f64) = (9.0, 10.5);
    let over = HALF[0].atan2(HALF[2]);
    while falls - falls_back > 1e-12 {
        let middle = 0.5 * (falls_back + falls);
        if tilt(middle, 5 * STEPS)? > over { falls = middle } else { falls_back = middle }
    }
    let rate = (0.75 * GRAVITY / HALF[0].hypot(HALF[2])).sqrt();
    println!("\na push of {falls:.9} N leaves it on its edge, at {over:.6} rad; p = {rate:.4}/s");
    println!("time, s   tilt, rad   by push, rad/N   rate since, 1/s");
    let mut before: Option<f64> = None;
    for steps in [400, 800, 1200, 1600, 2000, 2400] {
        let by_push = parts(falls, steps)?.0[0] / falls;
        let grown = before.map(|before| format!("{:.4}", (by_push / before).ln() / 0.4));
        let (time, tilt, grown) =
            (1e-3 * steps as f64, tilt(falls, steps)?, grown.unwrap_or_default());
        println!("{time:7.1}  {tilt:10.6}   {by_push:14.6e}   {grown:>15}");
        before = Some(by_push);
    }
    Ok(())
}
