//! Arguments of the commands that read a file.

use super::shared::AnimationArgs;
use super::simulate::SetupArgs;
use crate::values;
use clap::Args;
use clap::builder::{PathBufValueParser, TypedValueParser};
use std::path::PathBuf;
use tumble_scene::settings::RobotSettings;
use tumble_view::animation::View;

/// Parser of a table or the directory of a run.
fn table() -> impl TypedValueParser<Value = PathBuf> {
    PathBufValueParser::new().map(values::table)
}

#[derive(Debug, Args)]
pub struct GifArgs {
    /// A table of a run, or its directory.
    ///
    /// Its parameters are read from run.json in the same directory.
    #[arg(value_name = "FILE.csv|DIR", value_parser = table())]
    pub file: PathBuf,
    /// Directory for animation.gif, created if missing, or a file name that ends in .gif, or in .mp4
    /// or .webm with the program ffmpeg [default: directory of FILE.csv].
    #[arg(short, long, value_name = "DIR|FILE")]
    pub out: Option<PathBuf>,
    #[command(flatten)]
    pub animation: AnimationArgs,
    /// Print no progress bar and no summary.
    #[arg(short, long)]
    pub quiet: bool,
}

#[derive(Debug, Args)]
pub struct PlotArgs {
    /// A table of a run, or its directory.
    ///
    /// Its parameters are read from run.json in the same directory.
    #[arg(value_name = "FILE.csv|DIR", value_parser = table())]
    pub file: PathBuf,
    /// Directory for the pictures; created if missing [default: directory of FILE.csv].
    #[arg(short, long, value_name = "DIR")]
    pub out: Option<PathBuf>,
    /// Body to plot: a name or a number from 0 [default: the first that moves].
    #[arg(long, value_name = "NAME|INDEX", allow_hyphen_values = true)]
    pub body: Option<String>,
}

#[derive(Debug, Args)]
#[command(after_help = "\
Each line has the mean of the steps and the largest resultant. A force on the first body is in the world
frame, that of a joint along the axes of its second frame. A body has the sum of its pieces, a fixed object a\nline for each piece.

Example: tumble forces out --from 0.5 --csv > forces.csv")]
pub struct ForcesArgs {
    /// A table of a run, or its directory.
    ///
    /// Its parameters are read from run.json in the same directory.
    #[arg(value_name = "FILE.csv|DIR", value_parser = table())]
    pub file: PathBuf,
    /// First time of a step, s [default: the start].
    #[arg(long, value_name = "S", value_parser = values::number, allow_hyphen_values = true)]
    pub from: Option<f64>,
    /// Last time of a step, s [default: the end].
    #[arg(long, value_name = "S", value_parser = values::number, allow_hyphen_values = true)]
    pub to: Option<f64>,
    /// Print the table as CSV with all digits.
    #[arg(long)]
    pub csv: bool,
}

#[derive(Debug, Args)]
pub struct ViewArgs {
    /// A table of a run, or its directory; two runs are compared.
    ///
    /// The parameters of each are read from run.json in the same directory.
    #[arg(value_name = "FILE.csv|DIR", num_args = 1..=2, required = true, value_parser = table())]
    pub files: Vec<PathBuf>,
    /// Directory for view.html, created if missing, or a file name that ends in .html, with --png in .png
    /// [default: directory of the first file].
    #[arg(short, long, value_name = "DIR|FILE")]
    pub out: Option<PathBuf>,
    /// Open the page in the browser.
    #[arg(long)]
    pub open: bool,
    /// Write a still picture of one run instead, view.png or the file name of --out.
    #[arg(long, conflicts_with = "open")]
    pub png: bool,
    /// Time of the picture, s; the nearest row is drawn [default: the start].
    #[arg(long, value_name = "S", value_parser = values::number, allow_hyphen_values = true, requires = "png")]
    pub at: Option<f64>,
    /// Width and height of the picture, pixels [default: 800].
    #[arg(long, value_name = "PIXELS", value_parser = values::whole::<u16>(100, 2000), allow_hyphen_values = true, requires = "png")]
    pub size: Option<u16>,
    /// Camera angles of the picture as for tumble gif.
    #[arg(long, value_name = "AZIMUTH,ELEVATION", value_parser = values::view, allow_hyphen_values = true, requires = "png")]
    pub camera: Option<View>,
    /// Print no summary.
    #[arg(short, long)]
    pub quiet: bool,
}

#[derive(Debug, Args)]
#[command(
    after_help = "Exit codes: 0 every row holds; 1 a row does not, or any other error; 2 bad input."
)]
pub struct VerifyArgs {
    /// A table of a run, or its directory.
    ///
    /// Its parameters are read from run.json in the same directory.
    ///
    /// The tables states, steps and contacts are needed, also joints and gears if the scene has any,
    /// and ends with --every.
    #[arg(value_name = "FILE.csv|DIR", value_parser = table())]
    pub file: PathBuf,
    /// Number of steps to print, the worst first.
    #[arg(long, value_name = "N", value_parser = values::whole::<usize>(0, 10_000_000), default_value = "5", allow_hyphen_values = true)]
    pub worst: usize,
    /// Print no report; the exit code is the result.
    #[arg(short, long)]
    pub quiet: bool,
}

#[derive(Debug, Args)]
pub struct ConvertArgs {
    /// Robot (URDF, SDF or MJCF), scenario of several bodies with or without robots, or closed mesh (.obj
    /// or .stl).
    #[arg(value_name = "FILE")]
    pub file: PathBuf,
    /// Scenario file to write: bodies, joints and motors with all numbers. A mesh becomes one body of
    /// convex pieces.
    #[arg(value_name = "OUT.toml")]
    pub out: PathBuf,
    #[command(flatten)]
    pub robot: RobotSettings,
    /// Print no summary.
    #[arg(short, long)]
    pub quiet: bool,
    #[command(flatten, next_help_heading = "Mesh")]
    pub mesh: MeshArgs,
}

/// Settings for the conversion of a mesh.
#[derive(Debug, Args)]
pub struct MeshArgs {
    /// Maximum number of convex pieces, 1 to 32 [default: 32].
    #[arg(long, value_name = "N")]
    pub pieces: Option<u32>,
    /// Number of voxels along the longest side, 16 to 128 [default: 64].
    #[arg(long, value_name = "N")]
    pub resolution: Option<u32>,
    /// Volume by which a piece may exceed its parts, relative to the convex hull of the mesh, 0 to 1
    /// [default: 0.002].
    #[arg(long, value_name = "FRACTION", value_parser = values::number, allow_hyphen_values = true)]
    pub concavity: Option<f64>,
    /// Metres per unit of the file, 1e-6 to 1e6 [default: 1].
    #[arg(long, value_name = "M", value_parser = values::number, allow_hyphen_values = true)]
    pub scale: Option<f64>,
    /// Density, kg/m³, 1e-6 to 1e9 [default: 1000].
    #[arg(long, value_name = "KG/M³", value_parser = values::number, allow_hyphen_values = true)]
    pub density: Option<f64>,
}

#[derive(Debug, Args)]
pub struct NewArgs {
    /// Name of the scene: NAME.toml is written, which must not exist.
    #[arg(value_name = "NAME")]
    pub name: PathBuf,
}

#[derive(Debug, Args)]
#[command(
    after_help = "Exit codes: 0 the scene is valid; 2 it is not; 3 it is, but one of the first \
                        steps is failed or wild; 1 any other error."
)]
pub struct CheckArgs {
    #[command(flatten)]
    pub setup: SetupArgs,
}

#[derive(Debug, Args)]
#[command(after_help = "Example for bash: tumble completions bash > \
                        ~/.local/share/bash-completion/completions/tumble")]
pub struct CompletionsArgs {
    /// Shell of the script.
    #[arg(value_enum)]
    pub shell: clap_complete::Shell,
}
