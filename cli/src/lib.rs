//! The command line of tumble as a function, for its program and for the Python package. See `tumble --help`.
//!
//! Exit codes: 0 done; 2 bad input; 3 finished, but some step did not converge; 130 interrupted; 1
//! anything else.

#![forbid(unsafe_code)]

mod args;
mod check;
mod checkpoint;
mod completions;
mod continued;
mod convert;
mod converted_mesh;
mod describe;
mod directory;
mod exported;
mod file_names;
mod film;
mod forces;
mod gif;
mod input;
mod live;
mod new_scene;
mod outcome;
mod output;
mod pages;
mod pictures;
mod plan;
mod plot;
mod recording;
mod results;
mod run;
mod scenario;
mod scene;
mod schema;
mod signals;
mod simulate;
mod stands;
mod sweep;
mod table_file;
mod usage;
mod values;
mod verify;
mod video;
mod view;
mod writer;

use args::Command;
use outcome::{Failure, Outcome};
use std::ffi::OsString;

/// Runs the command in `arguments`, whose first is the name of the program, and returns its exit code.
pub fn run(arguments: &[OsString]) -> u8 {
    match run_command(arguments) {
        Ok(outcome) => outcome.exit_code(),
        Err(failure) => {
            output::complain(&failure);
            outcome::exit_code(&failure)
        }
    }
}

/// Parses the arguments and runs their command.
fn run_command(arguments: &[OsString]) -> Result<Outcome, Failure> {
    let Some(cli) = usage::parse(arguments)? else { return Ok(Outcome::Done) };
    match cli.command {
        None => simulated(&cli.simulate),
        Some(Command::Run(args)) => simulated(&args),
        Some(Command::New(args)) => new_scene::run(&args),
        Some(Command::Check(args)) => check::run(&args),
        Some(Command::Stands(args)) => stands::run(&args),
        Some(Command::Verify(args)) => verify::run(&args),
        Some(Command::Convert(args)) => convert::run(&args),
        Some(Command::Forces(args)) => forces::run(&args),
        Some(Command::Gif(args)) => gif::run(&args),
        Some(Command::Plot(args)) => plot::run(&args),
        Some(Command::View(args)) => view::run(&args),
        Some(Command::Plan(args)) => plan::run(&args),
        Some(Command::Schema) => schema::run(),
        Some(Command::Completions(args)) => completions::run(&args),
    }
}

/// Runs a scene once, or for each value of a range.
fn simulated(args: &args::SimulateArgs) -> Result<Outcome, Failure> {
    if args.setup.is_sweep() { sweep::run(args) } else { simulate::run(args) }
}
