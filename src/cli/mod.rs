//! Everything around the library: arguments, files, the terminal.

mod args;
mod choices;
mod describe;
mod film;
mod gif;
mod inspect;
mod job;
mod outcome;
mod output;
mod physics;
mod plot;
mod run;
mod run_file;
mod scenario;
mod settings;
mod signals;
mod simulate;
mod source;
mod validate;
mod values;
mod verify;
mod view;

use args::{Cli, Command};
use clap::Parser;
use clap::error::ErrorKind;
use outcome::{Failure, Outcome};

/// Parses the arguments and runs the command they name.
pub fn run() -> Result<Outcome, Failure> {
    let cli = match Cli::try_parse() {
        Ok(cli) => cli,
        Err(error) => return usage_error(&error),
    };
    match cli.command {
        None => simulate::run(&cli.simulate),
        Some(Command::Verify(args)) => verify::run(&args),
        Some(Command::Gif(args)) => gif::run(&args),
        Some(Command::Plot(args)) => plot::run(&args),
        Some(Command::View(args)) => view::run(&args),
        Some(Command::Inspect(args)) => inspect::run(&args),
        Some(Command::Validate(args)) => validate::run(&args),
    }
}

/// Help and version go to standard output; a usage error becomes one sentence.
fn usage_error(error: &clap::Error) -> Result<Outcome, Failure> {
    if matches!(error.kind(), ErrorKind::DisplayHelp | ErrorKind::DisplayVersion) {
        output::say(&error.render().to_string())?;
        return Ok(Outcome::Done);
    }
    let text = error.render().to_string();
    let first = text.split("\n\n").next().unwrap_or_default();
    let sentence = first.split_whitespace().collect::<Vec<_>>().join(" ");
    let sentence = sentence.strip_prefix("error: ").unwrap_or(&sentence);
    Err(Failure::Input(format!("{sentence} (see tumble --help)")))
}
