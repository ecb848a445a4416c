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

/// Simulate rigid bodies in hard frictional contact. Every time step is one optimisation problem,
/// solved and certified.
///
/// Without a command, tumble simulates a scene. It writes OUT/trajectory.csv, OUT/run.json, and
/// OUT/state.bin for --continue.
#[derive(Debug, Parser)]
#[command(name = "tumble", version = version(), args_conflicts_with_subcommands = true)]
#[command(
    after_help = "Exit codes: 0 done; 2 bad input; 3 finished, but a step did not converge; 130 \
                  interrupted; 1 any other error."
)]
pub struct Cli {
    #[command(subcommand)]
    pub command: Option<Command>,
    #[command(flatten)]
    pub simulate: SimulateArgs,
}

#[derive(Debug, Subcommand)]
pub enum Command {
    /// Verify every step of a trajectory: recompute its residual from the file alone.
    Verify(VerifyArgs),
    /// Convert a robot, URDF or MJCF, to a scenario file.
    Convert(ConvertArgs),
    /// Draw a trajectory as an animated GIF.
    Gif(GifArgs),
    /// Plot a trajectory over time: plot and plot-energy, each as .png and .svg.
    Plot(PlotArgs),
    /// Write view.html, a page that plays one or two trajectories in a browser.
    View(ViewArgs),
    /// Evaluate the step's nonlinear program at a point: values and exact derivatives.
    Inspect(InspectArgs),
    /// Differentiate a quantity at the end of a run by initial state, loads and constants. Writes
    /// OUT/gradient.csv and OUT/gradient.json.
    Gradient(GradientArgs),
    /// Find controls that bring a scene to its targets. Writes OUT/controls.csv, OUT/plan.json and
    /// the simulated run.
    Plan(PlanArgs),
    /// Compare simulations with closed-form solutions of textbook problems. Prints a table and
    /// writes OUT/validation.html.
    Validate(ValidateArgs),
    /// Solve contact problems from files in Siconos' text format. Prints a table and writes the
    /// solutions as CSV.
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
