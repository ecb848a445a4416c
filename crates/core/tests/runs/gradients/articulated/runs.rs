//! Runs of a few steps from changed arguments, and their derivatives.

use super::directions::Direction;
use super::tree::{Situation, Tree};
use crate::common::prelude::*;
use tumble_core::simulation::{Checkpoints, Run, RunGradient};

/// Wrenches, joint forces and motor targets of one step.
#[derive(Clone, Default)]
pub struct Inputs {
    pub wrenches: Vec<Wrench>,
    pub forces: Vec<f64>,
    pub targets: Vec<f64>,
}

impl Inputs {
    /// Inputs of the world's own drives.
    pub fn new(world: &World) -> Self {
        Self {
            wrenches: vec![Wrench::zero(); world.bodies().len()],
            forces: Constant::JointForce.values(world),
            targets: Constant::MotorTarget.values(world),
        }
    }

    /// These inputs moved by `by` along `change`.
    pub fn plus(&self, by: f64, change: &Self) -> Self {
        let sum = |own: &[f64], change: &[f64]| -> Vec<f64> {
            own.iter().zip(change).map(|(own, change)| own + by * change).collect()
        };
        let wrenches = self.wrenches.iter().zip(&change.wrenches);
        let wrenches = wrenches.map(|(own, change)| Wrench {
            force: own.force + change.force * by,
            torque: own.torque + change.torque * by,
        });
        Self {
            wrenches: wrenches.collect(),
            forces: sum(&self.forces, &change.forces),
            targets: sum(&self.targets, &change.targets),
        }
    }

    /// Sets the inputs of the next step.
    pub fn set(&self, simulation: &mut Simulation<'_>) -> Result<(), Error> {
        for (body, wrench) in self.wrenches.iter().enumerate() {
            simulation.set_wrench(body, *wrench)?;
        }
        let mut targets = self.targets.iter();
        for ((joint, axis), force) in simulation.world().driven_axes().into_iter().zip(&self.forces)
        {
            let own = simulation.world().joints()[joint].drive(axis).copied().unwrap();
            let motor = own.motor.map(|motor| motor.to(*targets.next().unwrap()));
            simulation.set_drive(joint, axis, Drive { force: *force, motor, ..own })?;
        }
        Ok(())
    }
}

/// Steps of a run.
pub struct Steps {
    pub records: Vec<StepRecord>,
    pub is_solved: bool,
}

/// Run with arguments moved by `by` along a direction. `None` if the start is refused.
pub fn beside(tree: &Tree, inputs: &[Inputs], along: &Direction, by: f64) -> Option<Steps> {
    run(&tree.world, along.states(tree, by), inputs, Some((along, by)))
}

pub fn run(
    world: &World,
    states: Vec<State>,
    inputs: &[Inputs],
    along: Option<(&Direction, f64)>,
) -> Option<Steps> {
    let mut simulation = Simulation::new(world.clone(), states, Motion::native(world)).ok()?;
    let (mut records, mut is_solved) = (Vec::new(), true);
    for (step, own) in inputs.iter().enumerate() {
        let own = along.map_or(own.clone(), |(along, by)| own.plus(by, &along.inputs[step]));
        own.set(&mut simulation).unwrap();
        let mut record = StepRecord::new();
        simulation.step(&mut record).unwrap();
        let unsolved = [StepStatus::Failed, StepStatus::Substepped, StepStatus::Wild];
        is_solved &= !unsolved.contains(&record.status());
        records.push(record);
    }
    Some(Steps { records, is_solved })
}

/// Gradient of Σ w·δX after the last step. `weights` are w, one per body.
pub fn gradient(tree: &Tree, inputs: &[Inputs], weights: &[StateChange]) -> RunGradient {
    let Tree { world, states, .. } = tree;
    let mut simulation =
        Simulation::new(world.clone(), states.clone(), Motion::native(world)).unwrap();
    let steps = inputs.len() as u64;
    let mut run = Run {
        steps,
        before: &mut |simulation| inputs[simulation.index() as usize].set(simulation),
        by_states: &mut |step, _| (step == steps).then(|| weights.to_vec()),
        constants: &[],
        inputs: &[Constant::MotorTarget, Constant::JointForce],
        checkpoints: Checkpoints::default(),
        smoothing: None,
        has_impact_times: false,
    };
    simulation.gradient(&mut run).unwrap()
}

/// Moves a drawn tree into its situation, and returns the inputs of the `steps` that follow.
pub fn warmed_up(tree: &mut Tree, situation: Situation, steps: usize) -> Option<Vec<Inputs>> {
    let world = &tree.world;
    let own = Inputs::new(world);
    let units: Vec<f64> = world.motors().iter().map(|of| tree.units.coordinate(of.1)).collect();
    let h = world.time_step() / tree.units.time;
    let at = |step: usize| {
        let mut inputs = own.clone();
        if situation == Situation::Walking {
            for (motor, target) in inputs.targets.iter_mut().enumerate() {
                *target += 0.3 * units[motor] * (1.5 * h * step as f64 + motor as f64).sin();
            }
        }
        inputs
    };
    let warm = match situation {
        Situation::Flying => 10,
        Situation::Lying => 1000,
        Situation::Sliding | Situation::Walking => 400,
    };
    let inputs: Vec<Inputs> = (0..warm).map(at).collect();
    let after = |states: Vec<State>, inputs: &[Inputs]| {
        let steps = run(world, states, inputs, None)?;
        Some(steps.records.last()?.next_states().to_vec())
    };
    let mut states = after(tree.states.clone(), &inputs)?;
    if situation == Situation::Sliding {
        let along = Vector3::new(0.8, 0.6, 0.0) * tree.units.speed();
        states.iter_mut().for_each(|state| state.velocity += along);
        states = after(states, &inputs[..5])?;
    }
    tree.states = states;
    Some((warm..warm + steps).map(at).collect())
}
