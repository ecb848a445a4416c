//! Derivatives of a scalar loss of each rollout in a batch: one reverse pass per rollout, on all
//! threads.
//!
//! Each is the [`Simulation::gradient`](tumble_core::simulation::Simulation::gradient) of its
//! rollout. Its definitions and limits hold here too.

use super::batch::{Batch, rollout_slice};
use super::run::{RolloutError, hand_out};
use super::watch::RolloutWatch;
use std::num::NonZeroUsize;
use tumble_core::derivative::StateChange;
use tumble_core::error::Error;
use tumble_core::joint::{Drive, Gear, Motor};
use tumble_core::mechanics::{State, Wrench};
use tumble_core::simulation::{Checkpoints, Run, RunGradient, Simulation};
use tumble_core::solver::native::Smoothing;
use tumble_core::world::Constant;

/// Derivatives of each rollout's loss with respect to states: twelve per body, see [`StateChange`].
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Cotangents<'a> {
    /// Derivatives with respect to the states after the last step: (B or 1, N, 12).
    Ends(&'a [f64]),
    /// Derivatives with respect to the states after each step: (B or 1, T, N, 12).
    States(&'a [f64]),
}

/// Arguments of the derivatives besides starts and controls.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct By<'a> {
    /// World constants.
    pub constants: &'a [Constant],
    /// Smoothing of the differentiated steps: see [`Run::smoothing`].
    pub smoothing: Option<Smoothing>,
}

/// Derivatives of each rollout's loss.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Gradients {
    /// Derivatives with respect to the initial states: (B, N, 12).
    pub starts: Vec<f64>,
    /// Derivatives with respect to the wrenches of every step, even without controls: (B, T, N, 6).
    pub controls: Vec<f64>,
    /// Derivatives with respect to the targets of every step: (B, T, M). Empty without
    /// [motors](Batch::motors).
    pub motors: Vec<f64>,
    /// Derivatives with respect to the forces along axes in every step: (B, T, D). Empty without
    /// [joint forces](Batch::joint_forces).
    pub joint_forces: Vec<f64>,
    /// Derivatives with respect to the requested constants, in their order: B times the numbers of
    /// one world. If inertias are [varied](Batch::parameters) too, they are held fixed for
    /// derivatives with respect to masses.
    pub constants: Vec<Vec<f64>>,
    /// Diagnostics of each rollout.
    pub noted: Vec<Noted>,
}

/// Diagnostics of the derivatives of a rollout: see [`RunGradient`].
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Noted {
    /// Smallest margin, m/s, and its step.
    pub margin: (f64, u64),
    /// Smallest feature margin, m/s, and its step.
    pub feature_margin: (f64, u64),
    /// Number of steps that failed or are wild.
    pub unsolved: u64,
    /// Number of steps with contact features that are not known functions of the poses.
    pub unknown: u64,
    /// Number of steps that kept the distribution of hyperstatic forces.
    pub kept: u64,
    /// Number of steps that applied only part of their restitution.
    pub limited: u64,
    /// Number of intervals with an impact whose time is [left out](RunGradient::untimed).
    pub untimed: u64,
}

/// Derivatives of the losses of the rollouts of `batch`: with respect to initial states, wrenches
/// in every step, and the constants of `by`. Uses at most `threads` threads; the number of threads
/// does not change the results. Each thread stores the derivatives of up to 300 steps and up to 300
/// saved simulations.
///
/// # Errors
/// Arrays with other lengths than [`Batch`] and [`Cotangents`] define; the first rollout by index
/// that is refused or has no derivative; [`Error::Interrupted`].
pub fn gradients(
    batch: &Batch<'_>,
    cotangents: Cotangents<'_>,
    by: By<'_>,
    threads: NonZeroUsize,
    watch: RolloutWatch<'_>,
) -> Result<Gradients, RolloutError> {
    let of_all = |error| RolloutError { rollout: None, error };
    check(batch, cotangents).map_err(of_all)?;
    let rollouts = 0..batch.rollouts;
    let found = hand_out(rollouts, batch.rollouts, threads, watch, |rollout, _, _| {
        one(batch, cotangents, by, (rollout, watch))
    })?;
    let mut all =
        Gradients { constants: vec![Vec::new(); by.constants.len()], ..Gradients::default() };
    for found in found {
        all.starts.extend(found.states.iter().flat_map(StateChange::to_array));
        all.controls.extend(found.wrenches.iter().flatten().flat_map(six));
        all.motors.extend(found.inputs.iter().flat_map(|of| targets(batch, of)));
        all.joint_forces.extend(found.inputs.iter().flat_map(|of| forces(batch, of)));
        all.constants.iter_mut().zip(&found.constants).for_each(|(all, own)| all.extend(own));
        let RunGradient {
            margin, feature_margin, unsolved, unknown, kept, limited, untimed, ..
        } = found;
        all.noted.push(Noted { margin, feature_margin, unsolved, unknown, kept, limited, untimed });
    }
    Ok(all)
}

/// Constants that the arrays of a batch set in each step.
///
/// A larger offset of a gear acts like a larger target of its motor.
fn inputs(batch: &Batch<'_>) -> Vec<Constant> {
    let motors = [Constant::MotorTarget, Constant::GearOffset];
    let motors = motors.into_iter().filter(|_| !batch.motors.is_empty());
    motors.chain((!batch.joint_forces.is_empty()).then_some(Constant::JointForce)).collect()
}

/// Derivatives with respect to targets, from those with respect to the inputs of a step.
fn targets<'a>(batch: &Batch<'_>, inputs: &'a [Vec<f64>]) -> impl Iterator<Item = f64> + 'a {
    let (joints, gears) = match inputs {
        [joints, gears, ..] if !batch.motors.is_empty() => (&joints[..], &gears[..]),
        _ => (&[][..], &[][..]),
    };
    let driven = if gears.is_empty() { Vec::new() } else { batch.world.gear_motors() };
    joints.iter().copied().chain(driven.into_iter().map(|gear| gears[gear]))
}

/// Derivatives with respect to joint forces, from those with respect to the inputs of a step.
fn forces<'a>(batch: &Batch<'_>, inputs: &'a [Vec<f64>]) -> impl Iterator<Item = f64> + 'a {
    let last = inputs.last().filter(|_| !batch.joint_forces.is_empty());
    last.into_iter().flatten().copied()
}

/// Refuses motors of gears whose force depends on more than the distance from the target.
fn check_gears(batch: &Batch<'_>) -> Result<(), Error> {
    let gears = batch.world.gears().iter().filter_map(Gear::drive);
    let is_known = |drive: &Drive| {
        let is_free = drive.limits.is_none() && drive.stiffness == 0.0;
        is_free && matches!(drive.motor, Some(Motor::Position { .. }))
    };
    let mut driven = gears.filter(|drive| drive.motor.is_some());
    if batch.motors.is_empty() || driven.all(is_known) {
        return Ok(());
    }
    Err(Error::Unsupported {
        what: "derivative by the target of a gear's motor beside limits or a spring, or with a speed",
        why: "only a motor with a target position and nothing beside it has one; leave motors out",
    })
}

fn six(wrench: &Wrench) -> [f64; 6] {
    let Wrench { force, torque } = wrench;
    [force[0], force[1], force[2], torque[0], torque[1], torque[2]]
}

fn check(batch: &Batch<'_>, cotangents: Cotangents<'_>) -> Result<(), Error> {
    batch.check(&super::RolloutOutputs::default())?;
    check_gears(batch)?;
    let (numbers, width, allowed) = match cotangents {
        Cotangents::Ends(numbers) => (numbers, batch.change_width(), "(B or 1, N, 12)"),
        Cotangents::States(numbers) => {
            let width = batch.change_width().checked_mul(batch.steps);
            (numbers, width.unwrap_or(usize::MAX), "(B or 1, T, N, 12)")
        }
    };
    let count = numbers.len();
    let fits = count == width || Some(count) == width.checked_mul(batch.rollouts);
    let field = "numbers in the cotangents";
    if fits { Ok(()) } else { Err(Error::Count { field, count, allowed }) }
}

/// Derivatives of one rollout.
fn one(
    batch: &Batch<'_>,
    cotangents: Cotangents<'_>,
    By { constants: by, smoothing }: By<'_>,
    (rollout, watch): (usize, RolloutWatch<'_>),
) -> Result<RunGradient, Error> {
    let (mut simulation, driven) = batch.simulation(rollout, watch)?;
    let (width, steps) = (batch.change_width(), batch.steps as u64);
    let changes = |numbers: &[f64]| {
        let each = numbers.chunks_exact(StateChange::LEN);
        let change = |twelve: &[f64]| StateChange::from_array(&std::array::from_fn(|k| twelve[k]));
        each.map(change).collect()
    };
    // Derivatives by the states, or by the last states only
    let mut by_states = |k: u64, _: &[State]| match cotangents {
        Cotangents::Ends(all) => (k == steps).then(|| changes(rollout_slice(all, width, rollout))),
        Cotangents::States(all) => (k > 0).then(|| {
            let of_rollout = rollout_slice(all, width * batch.steps, rollout);
            changes(&of_rollout[(k as usize - 1) * width..][..width])
        }),
    };
    let mut before = |simulation: &mut Simulation<'_>| {
        let step = (simulation.index() - batch.index) as usize;
        batch.set(&driven, rollout, step, simulation)
    };
    // A mass changes its inertia in proportion. Where both vary, subtract the part through the
    // inertia.
    let is_varied = |constant| batch.parameters.iter().any(|given| given.constant == constant);
    let held = is_varied(Constant::Inertia) && by.contains(&Constant::Mass);
    let requested: Vec<Constant> =
        by.iter().copied().chain(held.then_some(Constant::Inertia)).collect();
    let inputs = inputs(batch);
    let mut run = Run {
        steps,
        before: &mut before,
        by_states: &mut by_states,
        constants: &requested,
        inputs: &inputs,
        checkpoints: Checkpoints::default(),
        smoothing,
        has_impact_times: false,
    };
    let mut found = simulation.gradient(&mut run)?;
    if let Some(by_inertia) = held.then(|| found.constants.pop()).flatten() {
        let bodies = simulation.world().bodies();
        let masses = by.iter().zip(&mut found.constants).filter(|(by, _)| **by == Constant::Mass);
        for (_, by_mass) in masses {
            for (body, by_mass) in by_mass.iter_mut().enumerate() {
                // The matrix is symmetric, so row and column order agree.
                let own = bodies[body].inertia() / bodies[body].mass();
                let carried = own.iter().zip(&by_inertia[9 * body..]);
                *by_mass -= carried.map(|(own, by)| own * by).sum::<f64>();
            }
        }
    }
    Ok(found)
}
