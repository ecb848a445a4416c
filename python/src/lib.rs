//! The compiled part of the Python package `tumble`: scenes, simulations, recordings and rollouts,
//! with numpy arrays as input and output. Convenience functions are in `python/python/tumble`.

mod arrays;
mod constants;
mod contacts;
mod coordinates;
mod errors;
mod gradient;
mod last_step;
mod live;
mod owned;
mod pictures;
mod plan;
mod problem;
mod query;
mod reading;
mod recording;
mod robot;
mod rollout;
mod run_files;
mod running;
mod scene;
mod simulation;
mod stepping;
mod watch;

use pyo3::prelude::*;
use std::ffi::OsString;

/// Runs the command line `tumble` with its arguments, whose first is the name of the program. Returns the
/// exit code.
#[pyfunction]
fn command_line(py: Python<'_>, arguments: Vec<OsString>) -> u8 {
    py.detach(|| tumble_cli::run(&arguments))
}

/// The compiled part of tumble.
#[pymodule]
#[pyo3(name = "_tumble")]
fn tumble_module(module: &Bound<'_, PyModule>) -> PyResult<()> {
    module.add("__version__", env!("CARGO_PKG_VERSION"))?;
    module.add("has_ipopt", cfg!(feature = "ipopt"))?;
    let statuses = tumble_core::step::StepStatus::ALL.map(|status| status.name());
    module.add("STATUSES", statuses)?;
    module.add("SCENE_HEAD", tumble_scene::written::HEAD)?;
    let parameters = tumble::rollout::Constant::ALL.map(|parameter| parameter.name());
    module.add("PARAMETERS", parameters)?;
    module.add("RESIDUAL_PARTS", recording::RESIDUAL_PARTS)?;
    module.add("TumbleError", module.py().get_type::<errors::TumbleError>())?;
    module.add_class::<scene::PyScene>()?;
    module.add_class::<live::PyLive>()?;
    module.add_class::<simulation::PySimulation>()?;
    module.add_function(wrap_pyfunction!(stepping::step_all, module)?)?;
    module.add_class::<robot::PyRobot>()?;
    module.add_class::<recording::PyRecording>()?;
    module.add_class::<problem::CoreProblem>()?;
    module.add_function(wrap_pyfunction!(gradient::jacobian, module)?)?;
    module.add_function(wrap_pyfunction!(gradient::vjp, module)?)?;
    module.add_class::<contacts::ContactColumns>()?;
    module.add_function(wrap_pyfunction!(errors::name_hint, module)?)?;
    module.add_function(wrap_pyfunction!(constants::constant_numbers, module)?)?;
    module.add_function(wrap_pyfunction!(run_files::listed_files, module)?)?;
    module.add_function(wrap_pyfunction!(scene::remedy, module)?)?;
    module.add_function(wrap_pyfunction!(command_line, module)?)?;
    module.add_function(wrap_pyfunction!(plan::plan, module)?)?;
    module.add_function(wrap_pyfunction!(rollout::rollout, module)?)?;
    module.add_function(wrap_pyfunction!(rollout::rollout_gradients, module)?)?;
    module.add_function(wrap_pyfunction!(rollout::parameter_shape, module)?)
}
