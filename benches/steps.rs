//! Time of one contact step in each regime, and of whole runs of the drop scene.
//!
//! `cargo bench` runs all; `cargo bench -- native` or `-- 'one step/slide'` some. The
//! steps come from the native run of seed 42; Ipopt solves the same steps, from the same
//! previous solutions.

use criterion::{BatchSize, Criterion, criterion_group, criterion_main};
use std::hint::black_box;
use tumble::contact::detection::Detection;
use tumble::error::Error;
use tumble::world::ContactModel;
use tumble::simulation::scene::{self, Scene};
use tumble::simulation::{Motion, Simulation, StepRecord};
use tumble::solver::ipopt::{Formulation, IpoptSolver, Ladder, Rung};
use tumble::solver::native::NativeSolver;
use tumble::step::{Decision, Step, StepSolver};
use tumble::mechanics::state::{State, Wrench};

/// A step to be solved again and again.
struct Recorded {
    regime: &'static str,
    state: State,
    free: State,
    active: Vec<bool>,
    previous: Decision,
}

fn model() -> Result<ContactModel, Error> {
    ContactModel::new(scene::tutorial_parameters()?)
}

fn simulation<'a>(
    model: &ContactModel,
    solver: Box<dyn StepSolver + 'a>,
) -> Result<Simulation<'a>, Error> {
    let scene = Scene::drop();
    let motion = Motion::Contact { detection: Detection::default(), solver };
    Simulation::new(model.clone(), scene.start(scene.attitude(42)), motion)
}

/// What the steps of seed 42 are at these k, by the certified native run.
const REGIMES: [(&str, u64); 4] = [("impact", 234), ("slide", 500), ("stick", 700), ("rest", 950)];

fn record(model: &ContactModel) -> Result<Vec<Recorded>, Error> {
    let mut simulation = simulation(model, Box::new(NativeSolver::new(model)))?;
    let mut row = StepRecord::new(&simulation.state(), model.contact_count());
    let mut recorded = Vec::new();
    for k in 0..999 {
        let previous = row.solution.clone();
        simulation.step(&mut row)?;
        if let Some((regime, _)) = REGIMES.iter().find(|(_, at)| *at == k) {
            let free = model.free_flight(&row.state, &Wrench::zero());
            let mut active = vec![false; model.contact_count()];
            Detection::default().flag(model, &row.state, &free, &mut active);
            recorded.push(Recorded { regime, state: row.state, free, active, previous });
        }
    }
    Ok(recorded)
}

fn one_step(
    criterion: &mut Criterion,
    model: &ContactModel,
    name: &str,
    solver: &mut dyn StepSolver,
) -> Result<(), Error> {
    let wrench = Wrench::zero();
    for recorded in record(model)? {
        let Recorded { regime, state, free, active, previous } = &recorded;
        let step = Step { model, state, wrench: &wrench, free, previous };
        let mut solution = previous.clone();
        let mut flags = active.clone();
        criterion.bench_function(&format!("one step/{regime}/{name}"), |bencher| {
            bencher.iter(|| {
                flags.copy_from_slice(active);
                black_box(solver.solve(black_box(&step), &mut flags, &mut solution))
            });
        });
    }
    Ok(())
}

fn benches(criterion: &mut Criterion) -> Result<(), Error> {
    let model = model()?;
    let ipopt = || {
        let options = IpoptSolver::options(&model, scene::TOLERANCE, scene::MOST_ITERATIONS);
        IpoptSolver::new(&model, Formulation::default(), options)
    };
    let start = simulation(&model, Box::new(NativeSolver::new(&model)))?;
    let (state, wrench) = (start.state(), Wrench::zero());
    criterion.bench_function("one step/free", |bencher| {
        bencher.iter(|| black_box(model.free_flight(black_box(&state), &wrench)));
    });
    one_step(criterion, &model, "native", &mut NativeSolver::new(&model))?;
    one_step(criterion, &model, "ipopt", &mut ipopt()?)?;

    let whole_run = |mut simulation: Simulation<'_>| -> Result<State, Error> {
        let mut row = StepRecord::new(&simulation.state(), model.contact_count());
        for _ in 0..999 {
            simulation.step(&mut row)?;
        }
        Ok(simulation.state())
    };
    criterion.bench_function("999 steps, seed 42/native", |bencher| {
        bencher.iter_batched(
            || simulation(&model, Box::new(NativeSolver::new(&model))),
            |simulation| simulation.and_then(whole_run),
            BatchSize::SmallInput,
        );
    });
    let mut slow = criterion.benchmark_group("999 steps, seed 42");
    slow.sample_size(10);
    slow.bench_function("ipopt", |bencher| {
        bencher.iter_batched(
            || {
                let ladder = Ladder::new(&model, ipopt()?, &Rung::ALL);
                simulation(&model, Box::new(ladder))
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
