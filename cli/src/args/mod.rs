//! Command-line arguments and their allowed values.

mod files;
mod gradient;
mod plan;
mod shared;
mod simulate;
mod solve;
mod validate;

pub use files::{ConvertArgs, GifArgs, InspectArgs, PlotArgs, VerifyArgs, ViewArgs};
pub use gradient::{GradientArgs, GradientQuantity};
pub use plan::PlanArgs;
pub use shared::{AnimationArgs, PhysicsArgs};
pub use simulate::SimulateArgs;
pub use solve::{Rule, SolveArgs};
pub use validate::{Solvers, ValidateArgs};

use clap::{Parser, Subcommand};
use std::sync::LazyLock;
use tumble::ipopt::VERSION as IPOPT_VERSION;

/// Versions of tumble and of the linked Ipopt.
fn version() -> &'static str {
    static VERSION: LazyLock<String> =
        LazyLock::new(|| format!("{} (Ipopt {IPOPT_VERSION})", env!("CARGO_PKG_VERSION")));
    &VERSION
}

/// Rigid bodies in hard frictional contact: every time step one optimisation problem,
/// solved and certified.
///
/// Without a verb: simulate a scene and write OUT/trajectory.csv, OUT/run.json, and OUT/state.bin to go on
/// from with --continue.
#[derive(Debug, Parser)]
#[command(name = "tumble", version = version(), args_conflicts_with_subcommands = true)]
#[command(after_help = "Exit codes: 0 done; 2 bad input; 3 finished, but some step did not \
    converge; 130 interrupted; 1 anything else.")]
pub struct Cli {
    #[command(subcommand)]
    pub command: Option<Command>,
    #[command(flatten)]
    pub simulate: SimulateArgs,
}

#[derive(Debug, Subcommand)]
pub enum Command {
    /// Recompute the residual of every step of a trajectory from the file alone, and judge every
    /// row by it.
    Verify(VerifyArgs),
    /// Write a robot's file, URDF or MJCF, as a scenario file.
    Convert(ConvertArgs),
    /// Draw a trajectory as an animated GIF.
    Gif(GifArgs),
    /// Draw a trajectory over time: plot and plot-energy, each as .png and .svg.
    Plot(PlotArgs),
    /// Make a page that plays one or two trajectories in any browser: view.html.
    View(ViewArgs),
    /// Evaluate the step's nonlinear program at a point: values and exact derivatives.
    Inspect(InspectArgs),
    /// Differentiate a number of a body at the end of a run, by the start, pushes and constants: OUT/gradient.csv and
    /// gradient.json.
    Gradient(GradientArgs),
    /// Find controls with which a scene ends where it should: OUT/controls.csv, plan.json, and the run that the simulator
    /// makes of them.
    Plan(PlanArgs),
    /// Compare simulations with the closed-form answers of textbook problems: a table, and
    /// OUT/validation.html.
    Validate(ValidateArgs),
    /// Solve contact problems by themselves, from files in Siconos' text form: a table, and the solutions as CSV.
    Solve(SolveArgs),
}

#[cfg(test)]
mod tests {
    use super::*;
    use clap::CommandFactory;

    #[test]
    fn the_definition_is_consistent() {
        Cli::command().debug_assert();
    }
}
