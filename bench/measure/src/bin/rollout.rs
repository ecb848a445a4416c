//! Rollouts of the tutorial's cube from many initial states, compared with a plain loop.
//!
//! The results must be equal. Run `cargo run --release -p tumble-measure --bin rollout`, optionally
//! with the numbers of rollouts, steps and threads: `… -- 2000 500 4`.
//!
//! The exit code is 3 if a step did not converge, 1 if a number differs, 2 for a bad argument.

use std::error::Error;
use std::num::NonZeroUsize;
use std::process::ExitCode;
use std::time::Instant;
use tumble::rollout::{Batch, RolloutOutputs, RolloutReport, RolloutWatch, roll_out};
use tumble_core::mechanics::State;
use tumble_core::simulation::scene::{TutorialScene, tutorial_parameters};
use tumble_core::simulation::{Motion, Simulation, StepRecord};
use tumble_core::world::World;

/// Number of rounds. The fastest counts, because the machine has other work.
const ROUNDS: usize = 9;

fn start(seed: usize) -> State {
    let scene = TutorialScene::drop();
    let mut start = scene.start(scene.attitude(seed as u32));
    // Low enough that most steps have contacts.
    start.position[2] = 1.8;
    start
}

/// Plain loop on this thread.
fn looped(
    world: &World,
    rollouts: usize,
    steps: usize,
    states: &mut [f64],
) -> Result<(), tumble_core::error::Error> {
    let mut record = StepRecord::new();
    for (seed, states) in (0..rollouts).zip(states.chunks_exact_mut(13 * steps)) {
        let motion = Motion::native(world);
        let mut simulation = Simulation::new(world.clone(), [start(seed)], motion)?;
        for row in states.chunks_exact_mut(13) {
            simulation.step(&mut record)?;
            row.copy_from_slice(simulation.state().to_vector().as_slice());
        }
    }
    Ok(())
}

fn main() -> Result<ExitCode, Box<dyn Error>> {
    let numbers: Result<Vec<usize>, _> = std::env::args().skip(1).map(|n| n.parse()).collect();
    let [rollouts, steps, threads] = match numbers.as_deref() {
        Ok([]) => [400, 500, 2],
        Ok(&[rollouts, steps, threads]) if rollouts * steps * threads > 0 => {
            [rollouts, steps, threads]
        }
        _ => {
            eprintln!("three numbers from 1 are needed: rollouts, steps and threads");
            return Ok(ExitCode::from(2));
        }
    };
    let world = World::new(tutorial_parameters()?)?;
    let starts: Vec<f64> =
        (0..rollouts).flat_map(|seed| start(seed).to_vector().data.0[0]).collect();
    let batch = Batch {
        world: &world,
        motion: &|world| Ok(Motion::native(world)),
        loads: &[],
        courses: &[],
        index: 0,
        rollouts,
        steps,
        starts: &starts,
        controls: &[],
        motors: &[],
        joint_forces: &[],
        parameters: &[],
    };
    let mut states = vec![0.0; rollouts * steps * 13];
    let mut expected = states.clone();
    let mut fastest = [f64::INFINITY; 3];
    let mut report = RolloutReport::default();
    for _ in 0..ROUNDS {
        let clock = Instant::now();
        looped(&world, rollouts, steps, &mut expected)?;
        fastest[0] = fastest[0].min(clock.elapsed().as_secs_f64());
        for (place, threads) in [(1, 1), (2, threads)] {
            let clock = Instant::now();
            let outputs = RolloutOutputs { states: &mut states, ..RolloutOutputs::default() };
            let threads = NonZeroUsize::new(threads).unwrap_or(NonZeroUsize::MIN);
            report = roll_out(&batch, outputs, threads, RolloutWatch::default())?;
            fastest[place] = fastest[place].min(clock.elapsed().as_secs_f64());
        }
    }
    let count = (rollouts * steps) as f64;
    let names = ["a plain loop".to_owned(), "1 thread".to_owned(), format!("{threads} threads")];
    for (name, seconds) in names.iter().zip(fastest) {
        let ratio = fastest[0] / seconds;
        println!(
            "{name:<14}{:8.3} µs a step, {ratio:.3} of the loop's speed",
            seconds / count * 1e6
        );
    }
    let same = states == expected;
    println!("numbers the same: {same}; steps not solved: {}", report.unsolved.len());
    Ok(ExitCode::from(match (same, report.unsolved.is_empty()) {
        (false, _) => 1,
        (true, false) => 3,
        (true, true) => 0,
    }))
}
