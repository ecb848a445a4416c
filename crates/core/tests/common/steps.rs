//! Worlds, simulations and their steps.

use tumble_core::mechanics::State;
use tumble_core::simulation::{Motion, Simulation, StepRecord};
use tumble_core::step::StepStatus;
use tumble_core::world::{Integrator, Parameters, World};

/// World whose velocities are those of the ends of steps.
pub fn euler(parameters: Parameters) -> World {
    World::new(parameters).unwrap().with_integrator(Integrator::Euler)
}

/// Simulation with the native solver.
pub fn simulate(world: &World, starts: &[State]) -> Simulation<'static> {
    Simulation::new(world.clone(), starts.to_vec(), Motion::native(world)).unwrap()
}

/// Takes `count` steps, each of which `judge` must accept, and returns the last one.
pub fn last_step(
    simulation: &mut Simulation<'_>,
    count: usize,
    judge: impl Fn(&StepRecord) -> bool,
) -> StepRecord {
    let mut record = StepRecord::new();
    for _ in 0..count {
        simulation.step(&mut record).unwrap();
        assert!(judge(&record), "step {}: {:?}", record.index, record.report());
    }
    record
}

/// Takes `count` steps, each of which `judge` must accept, and returns them all.
pub fn steps(
    simulation: &mut Simulation<'_>,
    count: usize,
    judge: impl Fn(&StepRecord) -> bool,
) -> Vec<StepRecord> {
    (0..count).map(|_| last_step(simulation, 1, &judge)).collect()
}

/// Judge of a step that the solver solves as one problem with contacts or joints, to a residual below
/// `residual` [m/s].
pub fn converged(residual: f64) -> impl Fn(&StepRecord) -> bool {
    move |record| {
        let is_solved = matches!(record.status(), StepStatus::Converged | StepStatus::Retried);
        is_solved && record.residual() < residual
    }
}

/// Judge of a step that obeys the laws, by one problem or several.
pub fn is_solved(record: &StepRecord) -> bool {
    record.status().is_solved()
}

/// Judge of a step that did not fail.
pub fn has_not_failed(record: &StepRecord) -> bool {
    record.status() != StepStatus::Failed
}
