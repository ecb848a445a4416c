//! Solver settings in run.json.

use crate::solver_choice::SolverChoice;
use serde::{Deserialize, Serialize};
use tumble_core::world::World;
use tumble_model::failure::Failure;

/// Solver of the steps and its settings.
#[derive(Debug, Serialize, Deserialize)]
#[serde(expecting = "an object with the solver's name and settings")]
pub struct SolverSettings {
    /// Name: `native`, `ipopt` or `rk4`.
    pub name: String,
    /// Preset of the other fields, if one was used.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub preset: Option<String>,
    /// Criterion for candidate points; null without contact.
    pub detection: Option<String>,
    /// Action for unsolved steps; null without contact.
    pub on_failure: Option<String>,
    /// Tolerance of Ipopt; null for other solvers.
    pub tol: Option<f64>,
    /// Maximum number of Ipopt's iterations; null for other solvers.
    pub max_iter: Option<u32>,
    /// Requested residual of the native solver, m/s at speed scale 1; absent for the default.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub residual: Option<f64>,
    /// Largest residual of a solved contact step (m/s), as the solver guarantees it; absent in old
    /// files.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub accepted_residual_m_s: Option<f64>,
}

impl SolverSettings {
    /// Settings of a solver choice for `world`; of free motion for `None`.
    ///
    /// # Errors
    /// A solver that does not support the world.
    pub fn new(contact: Option<&SolverChoice>, world: &World) -> Result<Self, Failure> {
        let limits = contact.and_then(SolverChoice::limits);
        let solver = contact.map(|contact| contact.solver(world)).transpose()?;
        Ok(Self {
            name: contact.map_or("rk4", SolverChoice::solver_name).to_owned(),
            preset: contact.and_then(|contact| Some(contact.preset?.name().to_owned())),
            detection: contact.map(|contact| contact.detection.name().to_owned()),
            on_failure: contact.map(|contact| contact.on_failure.name().to_owned()),
            tol: limits.map(|(tolerance, _)| tolerance),
            max_iter: limits.map(|(_, iterations)| iterations),
            residual: contact.and_then(SolverChoice::residual),
            accepted_residual_m_s: Some(solver.map_or(0.0, |solver| solver.accepted_residual())),
        })
    }
}
