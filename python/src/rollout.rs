//! Batches of rollouts.

use crate::arrays::numbers;
use crate::errors::{of_step, refused};
use crate::scene::Scene;
use crate::watch::Watched;
use numpy::{Element, PyReadonlyArrayDyn, PyReadwriteArrayDyn};
use pyo3::exceptions::PyKeyboardInterrupt;
use pyo3::prelude::*;
use std::num::NonZeroUsize;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, AtomicU64};
use tumble::error::Error;
use tumble::rollout::{Batch, Constant, Outputs, RolloutError, Varied, Watch, roll_out};
use tumble::world::World;

/// Fewer steps than this, times bodies, are done by the calling thread, which is faster.
const FEW_STEPS: usize = 2000;

/// How many steps ended in each way; of each rollout, how many took a part of their restitution; of
/// every step that failed or was wild: rollout, step, status, residual (m/s).
type Report = (Vec<u64>, Vec<u64>, Vec<(usize, usize, &'static str, f64)>);

/// Simulates `rollouts` rollouts of `steps` steps and fills the arrays that are given.
#[pyfunction]
#[pyo3(signature = (
    scene, rollouts, steps, starts, controls, motors, joint_forces, parameters, threads, states, ends, forces,
    residuals, statuses, progress
))]
#[allow(clippy::too_many_arguments)]
pub fn rollout(
    py: Python<'_>,
    scene: PyRef<'_, Scene>,
    rollouts: usize,
    steps: usize,
    starts: PyReadonlyArrayDyn<'_, f64>,
    controls: Option<PyReadonlyArrayDyn<'_, f64>>,
    motors: Option<PyReadonlyArrayDyn<'_, f64>>,
    joint_forces: Option<PyReadonlyArrayDyn<'_, f64>>,
    parameters: Vec<(String, PyReadonlyArrayDyn<'_, f64>)>,
    threads: usize,
    mut states: Option<PyReadwriteArrayDyn<'_, f64>>,
    mut ends: Option<PyReadwriteArrayDyn<'_, f64>>,
    mut forces: Option<PyReadwriteArrayDyn<'_, f64>>,
    mut residuals: Option<PyReadwriteArrayDyn<'_, f64>>,
    mut statuses: Option<PyReadwriteArrayDyn<'_, u8>>,
    progress: Option<Bound<'_, PyAny>>,
) -> PyResult<Report> {
    let content = Arc::clone(&scene.content);
    let threads = NonZeroUsize::new(threads).ok_or_else(|| refused("threads: 1 or more"))?;
    let mut varied = Vec::new();
    for (name, values) in &parameters {
        varied.push(Varied { constant: parameter(name)?, values: numbers(name, values)? });
    }
    let motion = |world: &World| content.motion(world);
    let batch = Batch {
        world: &content.world,
        motion: &motion,
        loads: &content.loads,
        courses: &content.courses,
        index: content.start_index,
        rollouts,
        steps,
        starts: numbers("initial_states", &starts)?,
        controls: controls.as_ref().map_or(Ok(&[][..]), |array| numbers("controls", array))?,
        motors: motors.as_ref().map_or(Ok(&[][..]), |array| numbers("motors", array))?,
        joint_forces: joint_forces
            .as_ref()
            .map_or(Ok(&[][..]), |array| numbers("joint_forces", array))?,
        parameters: &varied,
    };
    let outputs = Outputs {
        states: memory(&mut states)?,
        ends: memory(&mut ends)?,
        forces: memory(&mut forces)?,
        residuals: memory(&mut residuals)?,
        statuses: memory(&mut statuses)?,
    };
    let (interrupt, done) = (Arc::new(AtomicBool::new(false)), AtomicU64::new(0));
    let watch = Watch { interrupt: Some(&interrupt), done: Some(&done) };
    let work = || roll_out(&batch, outputs, threads, watch);
    let total = rollouts.saturating_mul(steps);
    let is_small = total.saturating_mul(content.world.bodies().len()) <= FEW_STEPS;
    let report = if is_small && content.solver() != "ipopt" && progress.is_none() {
        py.detach(work)
    } else {
        let progress = progress.as_ref();
        Watched { interrupt: &interrupt, done: &done, total: total as u64, progress }
            .run(py, work)?
    };
    let report = report.map_err(|error| match error {
        RolloutError { rollout: None, error } => of_step(&error),
        RolloutError { error: Error::Interrupted, .. } => PyKeyboardInterrupt::new_err(()),
        in_rollout => refused(in_rollout),
    })?;
    let unsolved = report.unsolved.iter();
    let unsolved = unsolved.map(|u| (u.rollout, u.step, u.status.name(), u.residual)).collect();
    let tempered = report.each.iter().map(|rollout| rollout.tempered).collect();
    Ok((report.all.statuses.to_vec(), tempered, unsolved))
}

/// The shape of a parameter's values for one rollout of a scene.
#[pyfunction]
#[pyo3(signature = (name, scene))]
pub fn parameter_shape(name: &str, scene: PyRef<'_, Scene>) -> PyResult<Vec<usize>> {
    Ok(parameter(name)?.shape(&scene.content.world))
}

fn parameter(name: &str) -> PyResult<Constant> {
    let found = Constant::ALL.into_iter().find(|parameter| parameter.name() == name);
    found.ok_or_else(|| {
        let names = Constant::ALL.map(Constant::name).join(", ");
        refused(format!("parameters: {name:?} is none; there are {names}"))
    })
}

/// The memory of an output array; none of one that is not wanted.
fn memory<'a, T: Element>(
    array: &'a mut Option<PyReadwriteArrayDyn<'_, T>>,
) -> PyResult<&'a mut [T]> {
    match array {
        None => Ok(&mut []),
        Some(array) => {
            array.as_slice_mut().map_err(|_| refused("out: arrays in C order are needed"))
        }
    }
}
