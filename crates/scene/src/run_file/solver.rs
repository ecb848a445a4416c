//! The solver's settings in run.json.

use crate::solver_choice::SolverChoice;
use serde::{Deserialize, Serialize};
use tumble_core::world::World;
use tumble_model::failure::Failure;

/// Who solved the steps, and how.
#[derive(Debug, Serialize, Deserialize)]
#[serde(expecting = "an object with the solver's name and settings")]
pub struct SolverSettings {
    /// `native`, `ipopt` or `rk4`.
    pub name: String,
    /// What all of the others were said by, if a preset was.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub preset: Option<String>,
    /// Of Ipopt's program; null for others.
    #[serde(default)]
    pub formulation: Option<String>,
    /// Which points were candidates; null without contact.
    pub detection: Option<String>,
    /// What happened with a step that failed; null without contact.
    pub on_failure: Option<String>,
    /// Ipopt's tolerance; null for others.
    pub tol: Option<f64>,
    /// Ipopt's most iterations; null for others.
    pub max_iter: Option<u32>,
    /// What the native solver was asked to solve to, m/s at the speed scale 1, where it was not the usual.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub residual: Option<f64>,
    /// The residual that a contact step may have that counts as solved, m/s: what the solver
    /// promises. A file of before it was written has none.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub accepted_residual_m_s: Option<f64>,
}

impl SolverSettings {
    /// Those of a choice for `world`; of free motion without one.
    ///
    /// # Errors
    /// A solver that is not made for the world.
    pub fn of(contact: Option<&SolverChoice>, world: &World) -> Result<Self, Failure> {
        let program = contact.and_then(SolverChoice::program);
        let solver = contact.map(|contact| contact.solver(world)).transpose()?;
        Ok(Self {
            name: contact.map_or("rk4", SolverChoice::solver_name).to_owned(),
            preset: contact.and_then(|contact| Some(contact.preset?.name().to_owned())),
            formulation: program.map(|(name, ..)| name.to_owned()),
            detection: contact.map(|contact| contact.detection.name().to_owned()),
            on_failure: contact.map(|contact| contact.on_failure.name().to_owned()),
            tol: program.map(|(_, tolerance, _)| tolerance),
            max_iter: program.map(|(.., iterations)| iterations),
            residual: contact.and_then(SolverChoice::residual),
            accepted_residual_m_s: Some(solver.map_or(0.0, |solver| solver.accepted_residual())),
        })
    }
}
