//! Time of a step of several boxes, in parts of one run of each scene of `bench/scenes`.
//!
//! Command: `cargo bench --bench several`. Scenes at rest are timed after their contacts are found.
//! The pile is timed twice: when boxes first meet, and when most of them lie.

#[path = "../bench/measure/src/lib.rs"]
mod boxes;

use boxes::BenchScene;
use criterion::{BatchSize, Criterion, criterion_group, criterion_main};
use std::error::Error;
use tumble_core::simulation::{Simulation, StepRecord};
use tumble_core::solver::native::NativeSolver;

/// Name, file, the steps before the part that is timed, and how many it has.
const PARTS: [(&str, &str, usize, usize); 5] = [
    ("stack of 10", include_str!("../bench/scenes/stack.json"), 10, 100),
    ("pyramid of 15", include_str!("../bench/scenes/pyramid.json"), 10, 100),
    ("wall of 36", include_str!("../bench/scenes/wall.json"), 10, 20),
    ("pile of 30, falling", include_str!("../bench/scenes/pile.json"), 220, 20),
    ("pile of 30, settling", include_str!("../bench/scenes/pile.json"), 500, 20),
];

fn benches(criterion: &mut Criterion) -> Result<(), Box<dyn Error>> {
    let mut group = criterion.benchmark_group("several");
    group.sample_size(10);
    for (name, text, before, steps) in PARTS {
        let scene: BenchScene = serde_json::from_str(text)?;
        let world = scene.world()?;
        assert!(before + steps <= scene.steps, "{name}: behind the end of the scene");
        let advance = |simulation: &mut Simulation<'_>, steps: usize| {
            let mut record = StepRecord::new();
            (0..steps).try_for_each(|_| simulation.step(&mut record))
        };
        group.bench_function(format!("{name}, {steps} steps"), |bencher| {
            bencher.iter_batched(
                || -> Result<_, tumble_core::error::Error> {
                    let mut simulation = scene.begin(&world, NativeSolver::new(&world))?;
                    advance(&mut simulation, before)?;
                    Ok(simulation)
                },
                |simulation| simulation.and_then(|mut s| advance(&mut s, steps)),
                BatchSize::PerIteration,
            );
        });
    }
    group.finish();
    Ok(())
}

/// Criterion's functions return nothing: an error here is a bug in the scenes' files.
fn all(criterion: &mut Criterion) {
    benches(criterion).expect("the scenes are valid");
}

criterion_group!(several, all);
criterion_main!(several);
