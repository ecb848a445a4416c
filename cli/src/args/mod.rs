//! Command-line arguments and their allowed values.

mod field_flags;
mod field_values;
mod files;
mod plan;
mod shared;
mod simulate;
mod stands;

pub use field_values::FieldValues;
pub use files::{
    CheckArgs, CompletionsArgs, ConvertArgs, ForcesArgs, GifArgs, MeshArgs, NewArgs, PlotArgs,
    VerifyArgs, ViewArgs,
};
pub use plan::PlanArgs;
pub use shared::AnimationArgs;
pub use simulate::{PictureArgs, SetupArgs, SimulateArgs};
pub use stands::StandsArgs;

use clap::{Parser, Subcommand};
use std::sync::LazyLock;
use tumble_scene::solver_choice::IPOPT_VERSION;

/// Versions of tumble and of the linked Ipopt.
fn version() -> &'static str {
    static VERSION: LazyLock<String> = LazyLock::new(|| match IPOPT_VERSION {
        "" => format!("{} (without Ipopt)", env!("CARGO_PKG_VERSION")),
        _ => format!("{} (Ipopt {IPOPT_VERSION})", env!("CARGO_PKG_VERSION")),
    });
    &VERSION
}

/// Simulate rigid bodies in hard frictional contact. Every step is solved and certified.
#[derive(Debug, Parser)]
#[command(name = "tumble", version = version(), args_conflicts_with_subcommands = true)]
#[command(override_usage = "tumble <COMMAND> [OPTIONS]\n       tumble <SCENE.toml> [OPTIONS]")]
#[command(mut_args = |argument| argument.hide(true))]
#[command(after_help = EXAMPLES)]
pub struct Cli {
    #[command(subcommand)]
    pub command: Option<Command>,
    #[command(flatten)]
    pub simulate: SimulateArgs,
}

const EXAMPLES: &str = "\
Examples:
  tumble new tower                write tower.toml, a commented scene
  tumble run tower.toml --html    simulate it, write tables and a page to out/
  tumble verify out/states.csv    recompute every residual from the tables
  tumble --steps 1000 --seed 42   the tutorial's cube with Ipopt; options as for run

Exit codes: 0 done; 2 bad input; 3 a step is failed or wild; 130 interrupted; 1 any other error.";

const SCHEMA_EXAMPLE: &str = "\
Example: tumble schema > scene.schema.json
A scene names it in its first line: #:schema ./scene.schema.json";

#[derive(Debug, Subcommand)]
pub enum Command {
    /// Simulate a scenario file, a robot or the tutorial's cube.
    ///
    /// Writes tables, OUT/run.json, and OUT/state.bin for --continue.
    Run(Box<SimulateArgs>),
    /// Write a commented scenario file that runs.
    New(NewArgs),
    /// Check a scene without writing: bodies, joints, overlaps, time step.
    Check(Box<CheckArgs>),
    /// Judge whether a scene can stand, by how much, and where it is weak.
    Stands(Box<StandsArgs>),
    /// Recompute the residual of every step from the tables of a run.
    Verify(VerifyArgs),
    /// Print the forces between bodies and in joints, over a time of a run.
    Forces(ForcesArgs),
    /// Write a page that plays one or two runs in a browser.
    View(ViewArgs),
    /// Plot a run over time, as PNG and SVG.
    Plot(PlotArgs),
    /// Draw a run as an animated GIF, or as a video.
    Gif(GifArgs),
    /// Convert a robot, URDF, SDF or MJCF, or a mesh to a scenario file.
    Convert(ConvertArgs),
    /// Find controls that bring a scene to its targets.
    ///
    /// Writes OUT/controls.csv, OUT/plan.json and the simulated run.
    Plan(PlanArgs),
    /// Print the JSON Schema of scenario files, by which an editor completes and checks them.
    #[command(after_help = SCHEMA_EXAMPLE)]
    Schema,
    /// Print a completion script for a shell.
    Completions(CompletionsArgs),
}

#[cfg(test)]
mod tests;
