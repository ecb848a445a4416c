//! What run.json says of how contact steps were solved.

use super::run_file::SolverSettings;
use tumble::scenario::contact::Contact;

/// All that run.json says of it.
pub fn settings(contact: &Contact) -> SolverSettings {
    let ipopt = contact.ipopt.as_ref();
    SolverSettings {
        name: contact.solver_name().to_owned(),
        formulation: ipopt.map(|(formulation, _)| formulation.name().to_owned()),
        detection: Some(contact.detection.name().to_owned()),
        on_failure: Some(contact.on_failure.name().to_owned()),
        tol: ipopt.map(|(_, options)| options.tolerance),
        max_iter: ipopt.map(|(_, options)| options.max_iterations),
    }
}
