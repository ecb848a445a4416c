//! What derivatives cost: of scenes, the time of a run of steps, of the same with each step linearised, with its whole Jacobian
//! by states too, and of a pass backwards through the run, as multiples of the run's own.
//!
//! ```text
//! cargo run --release --example derivatives [SCENARIO.toml...]
//! ```

use std::error::Error;
use std::path::Path;
use std::sync::Arc;
use std::time::{Duration, Instant};
use tumble::derivative::StateChange;
use tumble::mechanics::State;
use tumble::scenario::scene::Scene;
use tumble::scenario::settings::Settings;
use tumble::simulation::{Checkpoints, Run, Simulation, StepRecord};
use tumble::solver::native::StepDerivative;

/// Each is the least of so many runs, taken in turn.
const TURNS: usize = 7;
const STEPS: u64 = 300;

/// What is done with each step.
#[derive(Clone, Copy, PartialEq)]
enum Work {
    Step,
    Linearise,
    Jacobian,
    Backwards,
}

fn timed(scene: &Scene, work: Work) -> Result<Duration, Box<dyn Error>> {
    let mut simulation =
        scene.simulation(&Arc::default()).map_err(|failure| failure.to_string())?;
    let bodies = simulation.states().len();
    let (mut record, mut derivative) = (StepRecord::new(), StepDerivative::new());
    let mut end = Vec::new();
    let steps = STEPS.min(scene.rows - 1);
    let begun = Instant::now();
    if work == Work::Backwards {
        let along = StateChange::from_array(&[1.0; StateChange::LEN]);
        simulation.gradient(&mut Run {
            steps,
            before: &mut |_: &mut Simulation<'_>| Ok(()),
            by_states: &mut |k: u64, states: &[State]| {
                (k == steps).then(|| vec![along; states.len()])
            },
            constants: &[],
            checkpoints: Checkpoints::default(),
            compliance: None,
        })?;
        return Ok(begun.elapsed());
    }
    for _ in 0..steps {
        simulation.step(&mut record)?;
        if work == Work::Step {
            continue;
        }
        simulation.linearise(&record, &mut derivative)?;
        let columns = if work == Work::Jacobian { bodies } else { 0 };
        for body in 0..columns {
            derivative.by_state(body, &mut end)?;
        }
    }
    Ok(begun.elapsed())
}

fn main() -> Result<(), Box<dyn Error>> {
    let given: Vec<String> = std::env::args().skip(1).collect();
    let usual = ["real-cube", "stack", "pyramid", "pile", "double-pendulum", "chain"];
    let usual = usual.map(|name| format!("scenarios/{name}.toml"));
    let files = if given.is_empty() { usual.to_vec() } else { given };
    println!("scene             a step, µs   linearised   with its Jacobian   run backwards");
    for file in &files {
        let text = std::fs::read_to_string(file)?;
        let read = |path: &Path, _: u64| std::fs::read(path);
        let scene = Scene::of_text(&text, Path::new(file), Settings::default(), &read)
            .map_err(|failure| failure.to_string())?;
        let works = [Work::Step, Work::Linearise, Work::Jacobian, Work::Backwards];
        let mut least = [Duration::MAX; 4];
        for _ in 0..TURNS {
            for (least, work) in least.iter_mut().zip(works) {
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
