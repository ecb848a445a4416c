//! Derivatives of a step and of a run.

use crate::arrays::{Array, Numbers, numbers, shaped, states_array, to_states, to_wrenches};
use crate::errors::{refused, step_error};
use crate::scene::PyScene;
use pyo3::prelude::*;
use tumble_core::derivative::StateChange;
use tumble_core::error::Error;
use tumble_core::mechanics::{State, Wrench};
use tumble_core::simulation::{Checkpoints, Run, Simulation, StepRecord};
use tumble_core::solver::native::{Smoothing, StepChange, StepDerivative};
use tumble_core::world::Constant;
use tumble_scene::scene::Scene as Content;

/// Results of a derivative call:
///
/// - end states (N, 13);
/// - derivatives with respect to states, wrenches and each constant;
/// - margin and feature margin, m/s;
/// - numbers of steps: not converged, with unknown features, with kept force distributions, with
///   partial restitution, with impacts whose times are left out;
/// - steps of both margins, for a run.
type GradientArrays<'py> = (Array<'py>, Vec<Array<'py>>, [f64; 2], [u64; 5], [u64; 2]);

/// Creates a simulation of the scene from `states` at step `start_index`.
fn begin(content: &Content, states: Vec<State>, start_index: u64) -> PyResult<Simulation<'static>> {
    let motion = content.motion(&content.world).map_err(refused)?;
    let simulation = content.simulation_from(states, start_index, motion);
    simulation.map_err(|error| refused(error.display(content)))
}

/// World constant with this name. `others` are further names that are allowed here.
pub fn constant_of(field: &str, name: &str, others: &str) -> PyResult<Constant> {
    Constant::from_name(name).ok_or_else(|| {
        let all = Constant::ALL.map(Constant::name).join(", ");
        refused(format!("{field}: {name:?} is unknown; use {others}{all}"))
    })
}

/// World constants with these names.
pub fn constants_of(names: &[String]) -> PyResult<Vec<Constant>> {
    names.iter().map(|name| constant_of("by", name, "states, wrenches, ")).collect()
}

/// Smoothing with this name and size.
pub fn smoothing_of(given: Option<(String, f64)>) -> PyResult<Option<Smoothing>> {
    match given {
        None => Ok(None),
        Some((name, size)) if name == "compliance" => Ok(Some(Smoothing::Compliance(size))),
        Some((name, size)) if name == "central_path" => Ok(Some(Smoothing::CentralPath(size))),
        Some((name, _)) => Err(refused(format!("{name}: compliance or central_path is needed"))),
    }
}

/// Jacobian of one step.
#[pyfunction]
pub fn jacobian<'py>(
    py: Python<'py>,
    scene: PyRef<'_, PyScene>,
    states: Numbers<'_>,
    index: Option<u64>,
    pushes: Option<Numbers<'_>>,
    by: Vec<String>,
    smoothing: Option<(String, f64)>,
) -> PyResult<GradientArrays<'py>> {
    let (content, constants) = (&scene.content, constants_of(&by)?);
    let (world, bodies) = (&content.world, content.world.bodies().len());
    // Refuses constants that cannot be set.
    if !constants.is_empty() {
        let values = constants.iter().map(|constant| constant.values(world)).collect::<Vec<_>>();
        let values: Vec<_> =
            constants.iter().copied().zip(values.iter().map(Vec::as_slice)).collect();
        world.with_constants(&values).map_err(|error| step_error(&error))?;
    }
    let index = index.unwrap_or(content.start_index);
    let mut simulation = begin(content, to_states("states", &states)?, index)?;
    simulation.use_middle_velocities();
    if let Some(pushes) = &pushes {
        for (body, wrench) in to_wrenches(numbers("wrenches", pushes)?).enumerate() {
            simulation.set_wrench(body, wrench).map_err(|error| step_error(&error))?;
        }
    }
    let smoothing = smoothing_of(smoothing)?;
    let derivative = smoothing.map_or(Ok(StepDerivative::new()), StepDerivative::smoothed);
    let mut derivative = derivative.map_err(|error| step_error(&error))?;
    let mut record = StepRecord::new();
    simulation.step(&mut record).map_err(|error| step_error(&error))?;
    simulation.linearise(&record, &mut derivative).map_err(|error| step_error(&error))?;
    let mut end = Vec::new();
    let width = StateChange::LEN * bodies;
    let mut by_states = vec![0.0; width * width];
    let mut blocks = Vec::new();
    for body in 0..bodies {
        derivative.jacobian_wrt_state(body, &mut blocks).map_err(|error| step_error(&error))?;
        for (of, block) in blocks.iter().enumerate() {
            for (row, numbers) in block.row_iter().enumerate() {
                let first = (StateChange::LEN * of + row) * width + StateChange::LEN * body;
                let to = by_states[first..first + StateChange::LEN].iter_mut();
                to.zip(numbers.iter()).for_each(|(to, number)| *to = *number);
            }
        }
    }
    // Writes one column of the array per unit change.
    let mut columns = |count: usize, change: &dyn Fn(usize) -> Change| -> PyResult<Vec<f64>> {
        let rows = StateChange::LEN * bodies;
        let mut all = vec![0.0; rows * count];
        for column in 0..count {
            let Change { wrenches, numbers } = change(column);
            let constants: Vec<_> =
                numbers.iter().map(|(constant, numbers)| (*constant, &numbers[..])).collect();
            let change = StepChange { states: &[], wrenches: &wrenches, constants: &constants };
            derivative.jvp(&change, &mut end).map_err(|error| step_error(&error))?;
            let numbers = end.iter().flat_map(StateChange::to_array);
            for (row, number) in numbers.enumerate() {
                all[row * count + column] = number;
            }
        }
        Ok(all)
    };
    let unit = |length: usize, place: usize| {
        let mut numbers = vec![0.0; length];
        numbers[place] = 1.0;
        numbers
    };
    let by_wrenches = columns(6 * bodies, &|place| {
        let wrenches = to_wrenches(&unit(6 * bodies, place)).collect();
        Change { wrenches, ..Change::default() }
    })?;
    let mut arrays = vec![
        shaped(py, by_states, &[bodies, 12, bodies, 12])?,
        shaped(py, by_wrenches, &[bodies, 12, bodies, 6])?,
    ];
    for constant in constants {
        let width = constant.width(world);
        let found = columns(width, &|place| Change {
            numbers: vec![(constant, unit(width, place))],
            ..Change::default()
        })?;
        let shape: Vec<_> = [bodies, 12].into_iter().chain(constant.shape(world)).collect();
        arrays.push(shaped(py, found, &shape)?);
    }
    let unsolved = matches!(record.status().name(), "failed" | "substepped" | "wild");
    let counts = [
        u64::from(unsolved),
        derivative.unknown() as u64,
        u64::from(derivative.keeps_shares()),
        u64::from(record.restitution_share() < 1.0),
        0,
    ];
    let margins = [derivative.margin(), derivative.feature_margin()];
    Ok((states_array(py, record.next_states())?, arrays, margins, counts, [0, 0]))
}

/// A change of a step's wrenches and constants.
#[derive(Default)]
struct Change {
    wrenches: Vec<Wrench>,
    numbers: Vec<(Constant, Vec<f64>)>,
}

/// Product of the transposed derivative of a run with derivatives with respect to its end.
#[pyfunction]
#[allow(clippy::too_many_arguments)]
pub fn vjp<'py>(
    py: Python<'py>,
    scene: PyRef<'_, PyScene>,
    states: Numbers<'_>,
    index: Option<u64>,
    controls: Option<Numbers<'_>>,
    steps: u64,
    by_end: Numbers<'_>,
    by: Vec<String>,
    smoothing: Option<(String, f64)>,
    impact_times: bool,
) -> PyResult<GradientArrays<'py>> {
    let smoothing = smoothing_of(smoothing)?;
    let (content, constants) = (&scene.content, constants_of(&by)?);
    let (world, bodies) = (&content.world, content.world.bodies().len());
    let start = to_states("states", &states)?;
    let pushes = controls.as_ref().map(|controls| numbers("controls", controls)).transpose()?;
    let by_end: Vec<StateChange> = numbers("cotangents", &by_end)?
        .chunks_exact(12)
        .map(|twelve| StateChange::from_array(&std::array::from_fn(|k| twelve[k])))
        .collect();
    let start_index = index.unwrap_or(content.start_index);
    let mut simulation = begin(content, start, start_index)?;
    let work = || {
        let mut before = |simulation: &mut Simulation<'_>| {
            let Some(pushes) = pushes else { return Ok(()) };
            let step = (simulation.index() - start_index) as usize;
            let now = &pushes[6 * bodies * step..][..6 * bodies];
            to_wrenches(now).enumerate().try_for_each(|(body, w)| simulation.set_wrench(body, w))
        };
        let mut by_states = |k: u64, _: &[State]| (k == steps).then(|| by_end.clone());
        let mut run = Run {
            steps,
            before: &mut before,
            by_states: &mut by_states,
            constants: &constants,
            inputs: &[],
            checkpoints: Checkpoints::default(),
            smoothing,
            has_impact_times: impact_times,
        };
        let found = simulation.gradient(&mut run)?;
        Ok((found, simulation.states().to_vec()))
    };
    let (found, ends) = py.detach(work).map_err(|error: Error| step_error(&error))?;
    let by_states = found.states.iter().flat_map(StateChange::to_array).collect();
    let by_wrenches = found.wrenches.iter().flatten();
    let six = |w: &Wrench| {
        let (f, t) = (w.force, w.torque);
        [f[0], f[1], f[2], t[0], t[1], t[2]]
    };
    let by_wrenches = by_wrenches.flat_map(six).collect();
    let mut arrays = vec![
        shaped(py, by_states, &[bodies, 12])?,
        shaped(py, by_wrenches, &[steps as usize, bodies, 6])?,
    ];
    for (constant, numbers) in constants.iter().zip(found.constants) {
        arrays.push(shaped(py, numbers, &constant.shape(world))?);
    }
    let margins = [found.margin.0, found.feature_margin.0];
    let counts = [found.unsolved, found.unknown, found.kept, found.limited, found.untimed];
    let at = [found.margin.1, found.feature_margin.1];
    Ok((states_array(py, &ends)?, arrays, margins, counts, at))
}
