//! Trajectory optimisation: controls with which a scene meets its targets.

use crate::arrays::{Numbers, list, numbers, shaped, states_array, to_states};
use crate::errors::{refused, step_error};
use crate::scene::{PyScene, in_python};
use crate::watch::Watched;
use pyo3::exceptions::PyKeyboardInterrupt;
use pyo3::prelude::*;
use pyo3::types::PyDict;
use rayon::ThreadPoolBuilder;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, AtomicU64, Ordering};
use std::time::Instant;
use tumble_plan::file::ProblemFile;
use tumble_plan::{Plan, PlanError, PlanProblem, SearchProgress, SearchWatch};

/// Searches controls of the problem in `text` from `start`, for at most `time` (s), and returns the
/// plan as a dictionary.
#[pyfunction]
pub fn plan<'py>(
    py: Python<'py>,
    scene: PyRef<'_, PyScene>,
    text: &str,
    start: Option<Numbers<'_>>,
    states: Option<Numbers<'_>>,
    time: Option<f64>,
    threads: usize,
) -> PyResult<Bound<'py, PyDict>> {
    let mut content = (*scene.content).clone();
    if let Some(states) = &states {
        let states = to_states("states", states)?;
        let time = content.start_index as f64 * content.world.time_step();
        let mut document = content.document.clone();
        document.start_at(&states, time).map_err(in_python)?;
        content = content.with_document(document).map_err(in_python)?;
    }
    let file = ProblemFile::from_scene_text(content, text).map_err(refused)?;
    let problem = &file.problem;
    let start = match &start {
        Some(array) => numbers("start", array)?.to_vec(),
        None => {
            file.check_stages().map_err(refused)?;
            problem.zero()
        }
    };
    let (interrupt, done) = (Arc::new(AtomicBool::new(false)), AtomicU64::new(0));
    let pool = ThreadPoolBuilder::new().num_threads(threads).build().map_err(refused)?;
    let work = || {
        let clock = Instant::now();
        let time = time.or(file.time);
        let mut progress = |_: &SearchProgress<'_>| {
            done.fetch_add(1, Ordering::Relaxed);
            time.is_none_or(|time| clock.elapsed().as_secs_f64() < time)
        };
        let mut watch = SearchWatch { interrupt: &interrupt, progress: &mut progress };
        pool.install(|| problem.plan(&start, &file.built_stages(), &mut watch))
    };
    let watched = Watched { interrupt: &interrupt, done: &done, total: 0, progress: None };
    let found = watched.run(py, work)?.map_err(|error| match error {
        PlanError::Interrupted => PyKeyboardInterrupt::new_err(()),
        PlanError::Problem(why) => refused(why),
        PlanError::Step(error) => step_error(&error),
    })?;
    plan_values(py, problem, &found)
}

/// Converts a plan to a dictionary.
fn plan_values<'py>(
    py: Python<'py>,
    problem: &PlanProblem,
    plan: &Plan,
) -> PyResult<Bound<'py, PyDict>> {
    let replay = &plan.replay;
    let all = PyDict::new(py);
    all.set_item("status", plan.status.name())?;
    all.set_item("reason", &plan.reason)?;
    all.set_item("cost", replay.cost)?;
    all.set_item("effort", replay.effort)?;
    all.set_item("residual", replay.residual)?;
    all.set_item("controls", list(py, replay.controls.clone())?)?;
    let names: Vec<_> = problem.variables().iter().map(|of| problem.name_of(of)).collect();
    all.set_item("names", names)?;
    let steps = problem.steps();
    let columns = PyDict::new(py);
    for (control, of) in problem.controls().iter().enumerate() {
        for (component, name) in of.kind.components().iter().enumerate() {
            let at = |step| {
                let knot = problem.knot(control, step);
                problem.numbers(control, knot, &replay.controls).0[component]
            };
            let column = list(py, (0..steps).map(at).collect())?;
            columns.set_item(format!("{}.{name}", of.name), column)?;
        }
    }
    all.set_item("columns", columns)?;
    let mut wrenches = Vec::new();
    for wrench in replay.wrenches.iter().flatten() {
        wrenches.extend_from_slice(wrench.force.as_slice());
        wrenches.extend_from_slice(wrench.torque.as_slice());
    }
    let bodies = problem.scene().bodies.len();
    all.set_item("wrenches", shaped(py, wrenches, &[steps, bodies, 6])?)?;
    all.set_item("starts", states_array(py, &replay.states[0])?)?;
    let misses = replay.misses.iter();
    let misses: Vec<_> =
        misses.map(|miss| (&miss.name, miss.by, miss.tolerance, miss.unit, miss.after)).collect();
    all.set_item("misses", misses)?;
    let mut stages = Vec::new();
    for stage in &plan.stages {
        let of = PyDict::new(py);
        of.set_item("name", stage.name)?;
        of.set_item("iterations", stage.iterations)?;
        of.set_item("runs", stage.runs)?;
        of.set_item("message", &stage.message)?;
        of.set_item("cost", stage.cost)?;
        of.set_item("kept", stage.kept)?;
        stages.push(of);
    }
    all.set_item("stages", stages)?;
    let scene = problem.scene();
    let modes = replay.modes.iter().map(|modes| {
        let of = |of: &tumble_plan::ContactMode| {
            let key = &of.key;
            (
                scene.bodies[key.body].clone(),
                scene.partner(key.partner).to_owned(),
                key.point,
                of.mode.name(),
            )
        };
        modes.iter().map(of).collect::<Vec<_>>()
    });
    all.set_item("modes", modes.collect::<Vec<_>>())?;
    let found = problem.scene_of(replay).map_err(in_python)?;
    all.set_item("model", found.model_text().map_err(in_python)?)?;
    Ok(all)
}
