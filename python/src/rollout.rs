//! Batches of rollouts.

use crate::arrays::{Array, Numbers, numbers, shaped};
use crate::errors::{refused, step_error};
use crate::gradient::{constant_of, constants_of, smoothing_of};
use crate::scene::PyScene;
use crate::watch::Watched;
use numpy::{Element, PyReadwriteArrayDyn};
use pyo3::exceptions::PyKeyboardInterrupt;
use pyo3::prelude::*;
use std::num::NonZeroUsize;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, AtomicU64};
use tumble::rollout::{
    Batch, By, Constant, Cotangents, Noted, RolloutError, RolloutOutputs, RolloutWatch, Varied,
    gradients, roll_out,
};
use tumble_core::error::Error;
use tumble_core::world::World;

/// Number of steps times bodies up to which the calling thread does the work, which is faster.
const FEW_STEPS: usize = 2000;

/// Report of a batch:
///
/// - number of steps with each status;
/// - number of steps with partial restitution of each rollout;
/// - rollout, step, status and residual (m/s) of every failed or wild step.
type PyReport = (Vec<u64>, Vec<u64>, Vec<(usize, usize, &'static str, f64)>);

/// Input of a batch: scene, rollouts, steps, starts, controls, motors, joint forces, and constants
/// by name.
#[derive(FromPyObject)]
pub struct RolloutInputs<'py>(
    PyRef<'py, PyScene>,
    usize,
    usize,
    Numbers<'py>,
    Option<Numbers<'py>>,
    Option<Numbers<'py>>,
    Option<Numbers<'py>>,
    Vec<(String, Numbers<'py>)>,
);

/// Runs `work` on the batch of `inputs` and reports to `progress`.
fn on_batch<T: Send>(
    py: Python<'_>,
    inputs: &RolloutInputs<'_>,
    progress: Option<&Bound<'_, PyAny>>,
    work: impl FnOnce(&Batch<'_>, RolloutWatch<'_>) -> Result<T, RolloutError> + Send,
) -> PyResult<T> {
    let RolloutInputs(scene, rollouts, steps, starts, controls, motors, joint_forces, parameters) =
        inputs;
    let content = Arc::clone(&scene.content);
    let mut varied = Vec::new();
    for (name, values) in parameters {
        varied.push(Varied { constant: parameter(name)?, values: numbers(name, values)? });
    }
    fn or_none<'a>(name: &str, array: &'a Option<Numbers<'_>>) -> PyResult<&'a [f64]> {
        array.as_ref().map_or(Ok(&[][..]), |array| numbers(name, array))
    }
    let motion = |world: &World| content.motion(world);
    let batch = Batch {
        world: &content.world,
        motion: &motion,
        loads: &content.loads,
        courses: &content.courses,
        index: content.start_index,
        rollouts: *rollouts,
        steps: *steps,
        starts: numbers("initial_states", starts)?,
        controls: or_none("controls", controls)?,
        motors: or_none("motors", motors)?,
        joint_forces: or_none("joint_forces", joint_forces)?,
        parameters: &varied,
    };
    let (interrupt, done) = (Arc::new(AtomicBool::new(false)), AtomicU64::new(0));
    let watch = RolloutWatch { interrupt: Some(&interrupt), done: Some(&done) };
    let work = || work(&batch, watch);
    let total = rollouts.saturating_mul(*steps);
    let is_small = total.saturating_mul(content.world.bodies().len()) <= FEW_STEPS;
    let found = if is_small && content.solver() != "ipopt" && progress.is_none() {
        py.detach(work)
    } else {
        Watched { interrupt: &interrupt, done: &done, total: total as u64, progress }
            .run(py, work)?
    };
    found.map_err(|error| match error {
        RolloutError { rollout: None, error } => step_error(&error),
        RolloutError { error: Error::Interrupted, .. } => PyKeyboardInterrupt::new_err(()),
        RolloutError { rollout: Some(index), error } => {
            refused(format!("rollout {index}: {}", error.display(&*content)))
        }
    })
}

fn thread_count(threads: usize) -> PyResult<NonZeroUsize> {
    NonZeroUsize::new(threads).ok_or_else(|| refused("threads: 1 or more are needed"))
}

/// Simulates the batch of `inputs` and fills the output arrays.
#[pyfunction]
#[allow(clippy::too_many_arguments)]
pub fn rollout(
    py: Python<'_>,
    inputs: RolloutInputs<'_>,
    threads: usize,
    mut states: Option<PyReadwriteArrayDyn<'_, f64>>,
    mut ends: Option<PyReadwriteArrayDyn<'_, f64>>,
    mut forces: Option<PyReadwriteArrayDyn<'_, f64>>,
    mut residuals: Option<PyReadwriteArrayDyn<'_, f64>>,
    mut statuses: Option<PyReadwriteArrayDyn<'_, u8>>,
    progress: Option<Bound<'_, PyAny>>,
) -> PyResult<PyReport> {
    let outputs = RolloutOutputs {
        states: memory(&mut states)?,
        ends: memory(&mut ends)?,
        forces: memory(&mut forces)?,
        residuals: memory(&mut residuals)?,
        statuses: memory(&mut statuses)?,
    };
    let threads = thread_count(threads)?;
    let report = on_batch(py, &inputs, progress.as_ref(), |batch, watch| {
        roll_out(batch, outputs, threads, watch)
    })?;
    let unsolved = report.unsolved.iter();
    let unsolved = unsolved.map(|u| (u.rollout, u.step, u.status.name(), u.residual)).collect();
    let tempered = report.each.iter().map(|rollout| rollout.tempered).collect();
    Ok((report.all.statuses.to_vec(), tempered, unsolved))
}

/// Derivatives with respect to starts (B, N, 12), wrenches (B, T, N, 6), motors (B, T, M), joint
/// forces (B, T, D) and constants. Motors and joint forces have one only if they are given. Then for
/// each rollout: both margins (m/s), the steps of both, and four numbers of steps. These count
/// steps that did not converge, have unknown features, kept force distributions, or partial
/// restitution.
type Derivatives<'py> = (Vec<Array<'py>>, Vec<([f64; 2], [u64; 2], [u64; 5])>);

/// Derivatives of the losses of a batch's rollouts. `cotangents` are the derivatives of the losses
/// with respect to the states after each step, (B or 1, T, N, 12), or to the end states.
#[pyfunction]
pub fn rollout_gradients<'py>(
    py: Python<'py>,
    inputs: RolloutInputs<'_>,
    threads: usize,
    cotangents: Numbers<'_>,
    of_ends: bool,
    by: Vec<String>,
    smoothing: Option<(String, f64)>,
) -> PyResult<Derivatives<'py>> {
    let (constants, smoothing) = (constants_of(&by)?, smoothing_of(smoothing)?);
    let (threads, numbers) = (thread_count(threads)?, numbers("gradients", &cotangents)?);
    let cotangents = if of_ends { Cotangents::Ends(numbers) } else { Cotangents::States(numbers) };
    let found = on_batch(py, &inputs, None, |batch, watch| {
        gradients(batch, cotangents, By { constants: &constants, smoothing }, threads, watch)
    })?;
    let (world, rollouts, steps) = (&inputs.0.content.world, inputs.1, inputs.2);
    let bodies = world.bodies().len();
    let mut arrays = vec![
        shaped(py, found.starts, &[rollouts, bodies, 12])?,
        shaped(py, found.controls, &[rollouts, steps, bodies, 6])?,
    ];
    for (given, numbers) in [(&inputs.5, found.motors), (&inputs.6, found.joint_forces)] {
        if given.is_some() {
            let width = numbers.len() / (rollouts * steps);
            arrays.push(shaped(py, numbers, &[rollouts, steps, width])?);
        }
    }
    for (constant, numbers) in constants.iter().zip(found.constants) {
        let shape: Vec<_> = std::iter::once(rollouts).chain(constant.shape(world)).collect();
        arrays.push(shaped(py, numbers, &shape)?);
    }
    let noted = found.noted.iter().map(|noted| {
        let Noted { margin, feature_margin, unsolved, unknown, kept, limited, untimed } = *noted;
        let (margins, at) = ([margin.0, feature_margin.0], [margin.1, feature_margin.1]);
        (margins, at, [unsolved, unknown, kept, limited, untimed])
    });
    Ok((arrays, noted.collect()))
}

/// Shape of a parameter's values for one rollout of a scene.
#[pyfunction]
pub fn parameter_shape(name: &str, scene: PyRef<'_, PyScene>) -> PyResult<Vec<usize>> {
    Ok(parameter(name)?.shape(&scene.content.world))
}

pub fn parameter(name: &str) -> PyResult<Constant> {
    constant_of("parameters", name, "")
}

/// Memory of an output array; empty for None.
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
