//! The arguments of `tumble fit`.

use crate::cli::values;
use clap::{Args, ValueEnum};
use std::num::NonZeroUsize;
use std::path::PathBuf;
use tumble::fit::{Constant, Loss};

#[derive(Debug, Args)]
#[command(allow_negative_numbers = true)]
#[command(
    after_help = "Parameters of one body that is thrown on a ground: friction, restitution, inertia and size (as multiples of the \
    scene's), radius (of edges and corners, m), gravity (m/s²), ground (how far it is moved along \
    its normal, m).\n\nOf several bodies, of joints, and where something is fixed: every constant that `tumble gradient` knows, as a multiple \
    of the scene's (`joint_damping`), or that of one body, joint, motor or pair by its name (`joint_damping:elbow`, `mass:bob`, \
    `gravity:z`), in its own unit.\n\nExit codes: 0 done; 2 bad input; 3 some step did not converge; 130 \
    interrupted: the same command goes on from there; 1 anything else."
)]
pub struct FitArgs {
    /// The scenario (TOML, see scenarios/README.md), or a robot's file: one body and the ground, or several bodies with all that
    /// ties, drives and pulls them. Its start, steps and time step are not used.
    #[arg(value_name = "SCENE")]
    pub scene: PathBuf,
    /// Recordings: a table (.csv, .csv.gz), of one body also a tensor (.pt), or a folder of such files. Of several bodies: states.csv
    /// of a run or a table like it, the folder of a run, or a folder of such.
    #[arg(value_name = "DATA")]
    pub data: PathBuf,
    /// The parameters to look for, with commas between them, or `none`: to score the values as they
    /// are.
    #[arg(long, value_name = "NAMES", default_value = "friction,restitution",
        value_parser = parameters)]
    pub parameters: Parameters,
    /// A value in place of the scene's: where the search starts, or, of a parameter that is not
    /// looked for, what it stays at. May be given several times.
    #[arg(long, value_name = "NAME=VALUE", value_parser = setting)]
    pub set: Vec<(String, f64)>,
    /// Where a parameter is looked for [default: friction 0.02:1, restitution 0:0.6, size 0.9:1.1, radius 0 to 0.3 times
    /// the least half extent, gravity and ground 10 % to both sides, other multiples 0.5:2, one that is named with what it is of
    /// from a third to three times its own]. May be given several times.
    #[arg(long, value_name = "NAME=LOW:HIGH", value_parser = bounds)]
    pub bounds: Vec<(String, [f64; 2])>,
    /// Steps of the simulation for each frame of the recordings, 1 to 1000.
    #[arg(long, value_name = "N", default_value = "10",
        value_parser = clap::value_parser!(u16).range(1..=1000))]
    pub substeps: u16,
    /// Frames a second of recordings that do not say (.pt), 1 to 100000.
    #[arg(long, value_name = "HZ", default_value = "148", value_parser = values::rate)]
    pub rate: f64,
    /// What is made least: the mean of a bounded error of each toss, or of the error itself.
    #[arg(long, value_enum, default_value = "robust")]
    pub loss: LossName,
    /// Simulations of all tosses in a search.
    #[arg(long, value_name = "N", default_value = "250", value_parser = values::count)]
    pub evaluations: usize,
    /// Searches after each other, each from the best values so far; all but the last with half the
    /// substeps.
    #[arg(long, value_name = "N", default_value = "2", value_parser = values::count)]
    pub rounds: usize,
    /// Gauss–Newton steps, by the derivatives of all simulated steps, that are tried from the best values
    /// on, each kept where the loss is less; with them the covariance that they say; 0 for none.
    #[arg(long, value_name = "N", default_value = "10", value_parser = values::count)]
    pub polish: usize,
    /// Values around the found ones that are simulated for the uncertainty; 0 for none [default: 60 of one body that is
    /// thrown; none of several, of which the slopes say more].
    #[arg(long, value_name = "N", value_parser = values::count)]
    pub neighbours: Option<usize>,
    /// Parts of the tosses that are kept back in turn, the parameters fitted anew without them; 0
    /// for none.
    #[arg(long, value_name = "N", default_value = "0", value_parser = values::count)]
    pub folds: usize,
    /// Starts within the noise of the recordings, 0.035 mm and 0.02° a frame, that every toss is
    /// simulated from with the found values, to see what its error is made of; 0 for none.
    #[arg(long, value_name = "N", default_value = "0", value_parser = values::count)]
    pub ensemble: usize,
    /// Of what is drawn: search, neighbours, folds, ensemble.
    #[arg(long, default_value = "1", value_parser = values::seed)]
    pub seed: u32,
    /// Threads; the result does not depend on them [default: one a core].
    #[arg(long, value_name = "N", value_parser = values::threads, allow_hyphen_values = true)]
    pub threads: Option<NonZeroUsize>,
    /// Directory for fit.json, tosses.csv, fitted.toml and fit.html, made if it is not there.
    #[arg(long, value_name = "DIR", default_value = "out")]
    pub out: PathBuf,
    /// No progress bar and no summary.
    #[arg(long)]
    pub quiet: bool,
}

/// What is looked for.
#[derive(Debug, Clone)]
pub struct Parameters(pub Vec<String>);

#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum)]
pub enum LossName {
    Robust,
    Mean,
}

impl From<LossName> for Loss {
    fn from(name: LossName) -> Self {
        match name {
            LossName::Robust => Self::Robust,
            LossName::Mean => Self::Mean,
        }
    }
}

fn parameters(text: &str) -> Result<Parameters, String> {
    if text.trim() == "none" {
        return Ok(Parameters(Vec::new()));
    }
    // A comma may be part of a name: `joint_damping:wrist, about x`.
    let begins = |part: &str| Constant::of_name(part.split(':').next().unwrap_or("").trim());
    let mut names: Vec<String> = Vec::new();
    for part in text.split(',') {
        match names.last_mut().filter(|name| name.contains(':') && begins(part).is_none()) {
            Some(name) => *name += &format!(",{part}"),
            None => names.push(part.to_owned()),
        }
    }
    Ok(Parameters(names.iter().map(|name| name.trim().to_owned()).collect()))
}

fn setting(text: &str) -> Result<(String, f64), String> {
    let (name, value) = text.rsplit_once('=').ok_or("NAME=VALUE is needed")?;
    Ok((name.trim().to_owned(), values::number(value)?))
}

fn bounds(text: &str) -> Result<(String, [f64; 2]), String> {
    let needed = "NAME=LOW:HIGH is needed";
    let (name, range) = text.rsplit_once('=').ok_or(needed)?;
    let (low, high) = range.split_once(':').ok_or(needed)?;
    let bounds = [values::number(low)?, values::number(high)?];
    if bounds[0] >= bounds[1] {
        return Err(format!("{low} is not below {high}; NAME=LOW:HIGH is needed"));
    }
    Ok((name.trim().to_owned(), bounds))
}
