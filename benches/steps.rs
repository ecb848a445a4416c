//! Time of one contact step in each regime, and of whole runs of the drop scene.
//!
//! `cargo bench` runs all; `cargo bench -- native` or `-- 'one step/slide'` some. The
//! steps come from the native run of seed 42; Ipopt solves the same steps, from the same
//! previous solutions.

use criterion::{BatchSize, Criterion, criterion_group, criterion_main};
use std::hint::black_box;
use tumble::solver::ipopt::{IpoptSolver, Ladder, MOST_ITERATIONS, Rung, TOLERANCE};
use tumble_core::contact::{Candidates, Contact, Detection};
use tumble_core::error::Error;
use tumble_core::mechanics::{State, Wrench};
use tumble_core::simulation::scene::{self, TutorialScene};
use tumble_core::simulation::{Motion, Simulation, StepRecord};
use tumble_core::solver::native::NativeSolver;
use tumble_core::step::{Step, StepSolution, StepSolver};
use tumble_core::world::World;

/// A step to be solved again and again.
struct Recorded {
    regime: &'static str,
    state: State,
    free: State,
    contacts: Vec<Contact>,
    previous: StepSolution,
    earlier: StepSolution,
}

fn world() -> Result<World, Error> {
    World::new(scene::tutorial_parameters()?)
}

fn simulation<'a>(
    world: &World,
    solver: Box<dyn StepSolver + 'a>,
) -> Result<Simulation<'a>, Error> {
    let scene = TutorialScene::drop();
    let motion = Motion::Contact { detection: Detection::default(), solver };
    Simulation::new(world.clone(), [scene.start(scene.attitude(42))], motion)
}

/// Steps of seed 42, and the kind of motion in them.
const REGIMES: [(&str, u64); 4] = [("impact", 234), ("slide", 500), ("stick", 700), ("rest", 950)];

fn record(world: &World) -> Result<Vec<Recorded>, Error> {
    let mut simulation = simulation(world, Box::new(NativeSolver::new(world)))?;
    let mut row = StepRecord::new();
    let mut recorded = Vec::new();
    let (mut previous, mut earlier) = (StepSolution::default(), StepSolution::default());
    for k in 0..999 {
        simulation.step(&mut row)?;
        if let Some((regime, _)) = REGIMES.iter().find(|(_, at)| *at == k) {
            let state = *row.state();
            let free = world.free_flight(0, &state, &Wrench::zero());
            let mut contacts = Vec::new();
            Detection::default().find(world, &[state], &[free], &mut contacts);
            let (previous, earlier) = (previous.clone(), earlier.clone());
            recorded.push(Recorded { regime, state, free, contacts, previous, earlier });
        }
        earlier = std::mem::replace(&mut previous, row.first().solution.clone());
    }
    Ok(recorded)
}

fn one_step(
    criterion: &mut Criterion,
    world: &World,
    name: &str,
    solver: &mut dyn StepSolver,
) -> Result<(), Error> {
    let wrenches = &[Wrench::zero()];
    for recorded in record(world)? {
        let Recorded { regime, state, free, contacts, previous, earlier } = &recorded;
        let (states, free, earlier) = (&[*state], &[*free], Some(earlier));
        let step = Step { world, states, wrenches, free, previous, earlier, interrupt: None };
        let mut solution = previous.clone();
        let mut candidates = Candidates::from(contacts.clone());
        criterion.bench_function(&format!("one step/{regime}/{name}"), |bencher| {
            bencher.iter(|| {
                candidates.clear();
                candidates.extend(contacts.iter().copied());
                black_box(solver.solve(black_box(&step), &mut candidates, &mut solution))
            });
        });
    }
    Ok(())
}

fn benches(criterion: &mut Criterion) -> Result<(), Error> {
    let world = world()?;
    let ipopt = || {
        let options = IpoptSolver::options(TOLERANCE, MOST_ITERATIONS);
        IpoptSolver::new(&world, options)
    };
    let start = simulation(&world, Box::new(NativeSolver::new(&world)))?;
    let (state, wrench) = (*start.state(), Wrench::zero());
    criterion.bench_function("one step/free", |bencher| {
        bencher.iter(|| black_box(world.free_flight(0, black_box(&state), &wrench)));
    });
    one_step(criterion, &world, "native", &mut NativeSolver::new(&world))?;
    one_step(criterion, &world, "ipopt", &mut ipopt()?)?;

    let whole_run = |mut simulation: Simulation<'_>| -> Result<State, Error> {
        let mut row = StepRecord::new();
        for _ in 0..999 {
            simulation.step(&mut row)?;
        }
        Ok(*simulation.state())
    };
    criterion.bench_function("999 steps, seed 42/native", |bencher| {
        bencher.iter_batched(
            || simulation(&world, Box::new(NativeSolver::new(&world))),
            |simulation| simulation.and_then(whole_run),
            BatchSize::SmallInput,
        );
    });
    let mut slow = criterion.benchmark_group("999 steps, seed 42");
    slow.sample_size(10);
    slow.bench_function("ipopt", |bencher| {
        bencher.iter_batched(
            || {
                let ladder = Ladder::new(&world, ipopt()?, &Rung::ALL);
                simulation(&world, Box::new(ladder))
            },
            |simulation| simulation.and_then(whole_run),
            BatchSize::PerIteration,
        );
    });
    slow.finish();
    Ok(())
}

/// Criterion's functions return nothing: an error here is a bug in the constants above.
fn all(criterion: &mut Criterion) {
    benches(criterion).expect("the drop scene is valid");
}

criterion_group!(steps, all);
criterion_main!(steps);
