//! Cost of derivatives, as multiples of the time of a simulation.
//!
//! It measures a run of steps, the run with linearisation, the run with the Jacobian by the states,
//! and a backward pass.
//!
//! ```text
//! cargo run --release -p tumble-measure --bin derivatives [SCENARIO.toml...]
//! ```
//!
//! With `step`, `linearised`, `jacobian` or `backwards` as the first argument, the program does
//! only this work, once and without a clock, in the function `done`. Callgrind counts it with
//! `--toggle-collect='derivatives::done'`.

use std::error::Error;
use std::path::Path;
use std::sync::Arc;
use std::time::{Duration, Instant};
use tumble_core::derivative::StateChange;
use tumble_core::mechanics::State;
use tumble_core::simulation::{Checkpoints, Run, Simulation, StepRecord};
use tumble_core::solver::native::StepDerivative;
use tumble_scene::scene::Scene;

/// Number of interleaved runs; the fastest counts.
const TURNS: usize = 7;
const STEPS: u64 = 300;
const HEADING: &str =
    "scene             a step, µs   linearised   with its Jacobian   run backwards";

/// Work per step.
#[derive(Clone, Copy, PartialEq)]
enum Work {
    Step,
    Linearise,
    Jacobian,
    Backwards,
}

impl Work {
    const NAMES: [(&str, Self); 4] = [
        ("step", Self::Step),
        ("linearised", Self::Linearise),
        ("jacobian", Self::Jacobian),
        ("backwards", Self::Backwards),
    ];
}

fn timed(scene: &Scene, work: Work) -> Result<Duration, Box<dyn Error>> {
    let mut simulation =
        scene.simulation(&Arc::default()).map_err(|failure| failure.to_string())?;
    let begun = Instant::now();
    done(&mut simulation, STEPS.min(scene.rows - 1), work)?;
    Ok(begun.elapsed())
}

#[inline(never)]
fn done(simulation: &mut Simulation<'_>, steps: u64, work: Work) -> Result<(), Box<dyn Error>> {
    let bodies = simulation.states().len();
    let (mut record, mut derivative) = (StepRecord::new(), StepDerivative::new());
    let mut end = Vec::new();
    if work == Work::Backwards {
        let along = StateChange::from_array(&[1.0; StateChange::LEN]);
        simulation.gradient(&mut Run {
            steps,
            before: &mut |_: &mut Simulation<'_>| Ok(()),
            by_states: &mut |k: u64, states: &[State]| {
                (k == steps).then(|| vec![along; states.len()])
            },
            constants: &[],
            inputs: &[],
            checkpoints: Checkpoints::default(),
            smoothing: None,
            has_impact_times: false,
        })?;
        return Ok(());
    }
    if work != Work::Step {
        // The derivative of a step is one of middle velocities.
        simulation.use_middle_velocities();
    }
    for _ in 0..steps {
        simulation.step(&mut record)?;
        if work == Work::Step {
            continue;
        }
        simulation.linearise(&record, &mut derivative)?;
        let columns = if work == Work::Jacobian { bodies } else { 0 };
        for body in 0..columns {
            derivative.jacobian_wrt_state(body, &mut end)?;
        }
    }
    Ok(())
}

fn main() -> Result<(), Box<dyn Error>> {
    let mut given: Vec<String> = std::env::args().skip(1).collect();
    let one = given.first().and_then(|word| Work::NAMES.iter().find(|(name, _)| name == word));
    if one.is_some() {
        given.remove(0);
    }
    let usual = ["real-cube", "stack", "pyramid", "pile", "double-pendulum", "chain"];
    let usual = usual.map(|name| format!("scenarios/{name}.toml"));
    let files = if given.is_empty() { usual.to_vec() } else { given };
    if one.is_none() {
        println!("{HEADING}");
    }
    for file in &files {
        let text = std::fs::read_to_string(file)?;
        let read = |path: &Path, _: u64| std::fs::read(path);
        let scene = Scene::from_text(&text, Path::new(file), &[], &read)
            .map_err(|failure| failure.to_string())?;
        if let Some((_, work)) = one {
            timed(&scene, *work)?;
            continue;
        }
        let mut least = [Duration::MAX; 4];
        for _ in 0..TURNS {
            for (least, (_, work)) in least.iter_mut().zip(Work::NAMES) {
                *least = timed(&scene, work)?.min(*least);
            }
        }
        let [step, others @ ..] = least.map(|time| time.as_secs_f64());
        let each = 1e6 * step / STEPS.min(scene.rows - 1) as f64;
        let [linearised, jacobian, backwards] = others.map(|time| time / step);
        let name = Path::new(file).file_stem().unwrap_or_default().to_string_lossy();
        println!("{name:16}  {each:10.2}   {linearised:10.2}   {jacobian:17.2}   {backwards:13.2}");
    }
    Ok(())
}
