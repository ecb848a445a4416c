//! Solver settings in run.json.

use crate::solver_choice::{SolverChoice, SolverTable};
use serde::{Deserialize, Serialize};
use serde_json::json;
use tumble_core::world::World;
use tumble_model::failure::Failure;
use tumble_model::fields::named;

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

    /// Solver with these settings; `None` for a floating body.
    ///
    /// # Errors
    /// Settings that no solver has.
    pub fn choice(&self) -> Result<Option<SolverChoice>, Failure> {
        if self.name == "rk4" {
            return Ok(None);
        }
        let table = match &self.preset {
            Some(preset) => json!({ "preset": preset }),
            None => json!({
                "name": self.name,
                "detection": self.detection,
                "on_failure": self.on_failure,
                "tolerance": self.tol,
                "max_iterations": self.max_iter,
                "residual": self.residual,
            }),
        };
        let table: Result<SolverTable, _> = serde_path_to_error::deserialize(table);
        let table = table.map_err(|error| {
            let path = format!("solver.{}", error.path());
            Failure::Input(named(&path, &error.inner().to_string()))
        })?;
        SolverChoice::new(&table).map(Some)
    }
}
