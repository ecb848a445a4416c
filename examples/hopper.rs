//! Gradient-based control of a hopper: the knee torque in twelve windows of 10 ms.
//!
//! The torso rises to a target height, first by any torques, then with the least effort. During the
//! run the foot sticks and lifts off, and the knee reaches its stop. One reverse pass computes the
//! derivatives with respect to all windows.
//!
//! ```text
//! cargo run --release --example hopper
//! ```

use nalgebra::{SVector, Vector3, Vector4};
use tumble::{
    Checkpoints, Drive, Error, Joint, JointFrame, Motion, Parameters, RigidBody, Run, Simulation,
    State, StateChange, World, Wrench,
};

/// Indices of the bodies.
const TORSO: usize = 0;
const THIGH: usize = 1;
const SHANK: usize = 2;
/// Half length and half width of thigh and shank, m.
const HALF: f64 = 0.2;
const WIDTH: f64 = 0.02;
/// Initial tilt of thigh and shank, rad.
const LEAN: f64 = 0.7;
/// Number of steps of 1 ms in a window, and in a run that surely includes the highest point.
const WINDOW: u64 = 10;
const STEPS: u64 = 600;
/// Number of windows.
const COUNT: usize = 12;
/// Target height of the torso, m.
const HEIGHT: f64 = 1.2;

type Torques = SVector<f64, COUNT>;

/// Creates the hopper at rest on its foot with a bent knee. The torso is on a vertical slide, and
/// hip and knee are hinges.
fn hopper() -> Result<Simulation<'static>, Error> {
    let half = Vector3::new(WIDTH, WIDTH, HALF);
    let leg = RigidBody::solid_box(0.5, half)?;
    let torso = RigidBody::solid_box(4.0, Vector3::repeat(0.1))?;
    let about = |angle: f64| Vector4::new((0.5 * angle).cos(), 0.0, (0.5 * angle).sin(), 0.0);
    let still = |position: Vector3<f64>, angle: f64| State {
        attitude: about(angle),
        ..State::at_rest(position)
    };
    let (sin, cos) = LEAN.sin_cos();
    // The lower edge of the shank is on the ground.
    let foot = WIDTH * sin;
    let states = [
        still(Vector3::new(0.0, 0.0, 4.0 * HALF * cos + foot), 0.0),
        still(Vector3::new(HALF * sin, 0.0, 3.0 * HALF * cos + foot), -LEAN),
        still(Vector3::new(HALF * sin, 0.0, HALF * cos + foot), LEAN),
    ];
    let at = |z: f64, axis: Vector3<f64>| JointFrame::along(Vector3::new(0.0, 0.0, z), axis);
    let (up, across) = (Vector3::z(), Vector3::y());
    let hip = Drive { damping: 0.05, ..Drive::NONE };
    // The knee bends by −2.6 rad at most, and is never straight.
    let knee = Drive { damping: 0.05, limits: Some([-2.6, -0.1]), ..Drive::NONE };
    let joints = vec![
        Joint::prismatic(TORSO, None, [at(0.0, up)?, at(0.0, up)?], Drive::NONE),
        Joint::revolute(THIGH, Some(TORSO), [at(HALF, across)?, at(0.0, across)?], hip),
        Joint::revolute(THIGH, Some(SHANK), [at(-HALF, across)?, at(HALF, across)?], knee),
    ];
    let world = World::new(Parameters {
        friction: 0.8,
        time_step: 0.001,
        ..Parameters::new(vec![torso, leg.clone(), leg])
    })?;
    let world = world.with_joints(joints)?;
    let motion = Motion::native(&world);
    Simulation::new(world, states, motion)
}

/// Sets the knee torque for the next step.
fn push(simulation: &mut Simulation<'_>, torques: &Torques) -> Result<(), Error> {
    let torque = torques.get((simulation.index() / WINDOW) as usize).copied().unwrap_or(0.0);
    let about = |torque: f64| Wrench { torque: Vector3::y() * torque, ..Wrench::zero() };
    simulation.set_wrench(THIGH, about(torque))?;
    simulation.set_wrench(SHANK, about(-torque))
}

/// Largest height of the torso, m, and its step.
fn highest(torques: &Torques) -> Result<(f64, u64), Error> {
    let (mut simulation, mut record) = (hopper()?, Default::default());
    let mut top = (0.0, 0);
    for _ in 0..STEPS {
        push(&mut simulation, torques)?;
        simulation.step(&mut record)?;
        let height = simulation.states()[TORSO].position.z;
        if height > top.0 {
            top = (height, simulation.index());
        }
    }
    Ok(top)
}

/// Derivatives of the height after `steps` steps with respect to the torques, 1/N, and the run's
/// margin to a kink, m/s.
fn slopes(torques: &Torques, steps: u64) -> Result<(Torques, f64), Error> {
    let found = hopper()?.gradient(&mut Run {
        steps,
        before: &mut |simulation| push(simulation, torques),
        by_states: &mut |k, states| {
            (k == steps).then(|| {
                let mut all = vec![StateChange::zero(); states.len()];
                all[TORSO].position = Vector3::z();
                all
            })
        },
        constants: &[],
        inputs: &[],
        checkpoints: Checkpoints::default(),
        smoothing: None,
        has_impact_times: false,
    })?;
    let mut slopes = Torques::zeros();
    for (k, wrenches) in found.wrenches.iter().enumerate().take(COUNT * WINDOW as usize) {
        slopes[k / WINDOW as usize] += wrenches[THIGH].torque.y - wrenches[SHANK].torque.y;
    }
    Ok((slopes, found.margin.0))
}

/// Finds the torques nearest to `torques` that reach the height: Gauss–Newton with step halving.
fn reached(mut torques: Torques) -> Result<(Torques, f64, u32), Error> {
    let (mut height, mut steps) = highest(&torques)?;
    let mut corrections = 0;
    while (height - HEIGHT).abs() > 1e-10 && corrections < 20 {
        let (slopes, _) = slopes(&torques, steps)?;
        let step = slopes * ((HEIGHT - height) / slopes.norm_squared());
        let mut length = 1.0;
        let better = loop {
            let next = torques + step * length;
            let found = highest(&next)?;
            if (found.0 - HEIGHT).abs() < (height - HEIGHT).abs() {
                break Some((next, found));
            }
            length *= 0.5;
            if length < 1e-6 {
                break None;
            }
        };
        let Some(found) = better else { break };
        (torques, (height, steps)) = found;
        corrections += 1;
    }
    Ok((torques, height, corrections))
}

fn main() -> Result<(), Error> {
    let mut torques = Torques::repeat(40.0);
    let (height, steps) = highest(&torques)?;
    println!("40 N m throughout: the torso rises to {height:.4} m");
    let (exact, margin) = slopes(&torques, steps)?;
    println!("window   dz/dτ, 1/N   difference   (margin {margin:.1e} m/s)");
    for window in 0..COUNT {
        let at = |by: f64| {
            let mut moved = torques;
            moved[window] += by;
            highest(&moved)
        };
        let difference = (at(1e-4)?.0 - at(-1e-4)?.0) / 2e-4;
        println!("{window:6}   {:10.3e}   {difference:10.3e}", exact[window]);
    }
    println!("\n     height − {HEIGHT} m   corrections   effort Σ τ² Δt, N² m² s   torques, N m");
    let effort = |torques: &Torques| torques.norm_squared() * 1e-3 * WINDOW as f64;
    let (mut height, mut corrections);
    (torques, height, corrections) = reached(torques)?;
    let mut length = 0.5;
    for search in 0..20 {
        let listed: Vec<String> = torques.iter().map(|torque| format!("{torque:.0}")).collect();
        println!(
            "{search:3}  {:14.1e}  {corrections:12}   {:24.3}   {}",
            height - HEIGHT,
            effort(&torques),
            listed.join(" ")
        );
        // A step reduces the effort within the tangent space of constant height, then restores the
        // height.
        let (_, steps) = highest(&torques)?;
        let (slopes, _) = slopes(&torques, steps)?;
        let along = slopes * (slopes.dot(&torques) / slopes.norm_squared());
        loop {
            let found = reached(torques - (torques - along) * length)?;
            if effort(&found.0) < effort(&torques) && (found.1 - HEIGHT).abs() < 1e-9 {
                (torques, height, corrections) = found;
                break;
            }
            length *= 0.5;
            if length < 1e-3 {
                println!("no step that is less effort was found");
                return Ok(());
            }
        }
    }
    Ok(())
}
