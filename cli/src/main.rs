//! The command line of tumble. See `tumble --help`.
//!
//! Exit codes: 0 done; 2 bad input; 3 finished, but some step did not converge; 130 interrupted; 1
//! anything else.

#![forbid(unsafe_code)]

mod args;
mod checkpoint;
mod continued;
mod convert;
mod describe;
mod directory;
mod exported;
mod file_names;
mod film;
mod gif;
mod gradient;
mod input;
mod inspect;
mod outcome;
mod output;
mod pages;
mod pictures;
mod plan;
mod plot;
mod recording;
mod run;
mod scenario;
mod scene;
mod signals;
mod simulate;
mod solve;
mod table_file;
mod validate;
mod values;
mod verify;
mod view;
mod writer;

use args::{Cli, Command};
use clap::error::ErrorKind;
use clap::{CommandFactory, Parser};
use outcome::{Failure, Outcome};
use std::ffi::OsStr;
use std::io::Write;
use std::process::ExitCode;

fn main() -> ExitCode {
    match run() {
        Ok(outcome) => outcome.exit_code(),
        Err(failure) => {
            // Standard error may be closed; the exit code remains correct.
            let _ = writeln!(std::io::stderr(), "tumble: {failure}");
            outcome::exit_code(&failure)
        }
    }
}

/// Parses the arguments and runs their command.
fn run() -> Result<Outcome, Failure> {
    let cli = match Cli::try_parse() {
        Ok(cli) => cli,
        Err(error) => return usage_error(&error),
    };
    match cli.command {
        None => simulate::run(&cli.simulate),
        Some(Command::Verify(args)) => verify::run(&args),
        Some(Command::Convert(args)) => convert::run(&args),
        Some(Command::Gif(args)) => gif::run(&args),
        Some(Command::Plot(args)) => plot::run(&args),
        Some(Command::View(args)) => view::run(&args),
        Some(Command::Inspect(args)) => inspect::run(&args),
        Some(Command::Gradient(args)) => gradient::run(&args),
        Some(Command::Plan(args)) => plan::run(&args),
        Some(Command::Validate(args)) => validate::run(&args),
        Some(Command::Solve(args)) => solve::run(&args),
    }
}

/// Prints help and version to standard output, and turns a usage error into one sentence.
fn usage_error(error: &clap::Error) -> Result<Outcome, Failure> {
    if matches!(error.kind(), ErrorKind::DisplayHelp | ErrorKind::DisplayVersion) {
        output::say(&error.render().to_string())?;
        return Ok(Outcome::Done);
    }
    if let Some(sentence) = flag_without_value() {
        return Err(Failure::Input(sentence));
    }
    let text = error.render().to_string();
    let first = text.split("\n\n").next().unwrap_or_default();
    let sentence = first.split_whitespace().collect::<Vec<_>>().join(" ");
    let sentence = sentence.strip_prefix("error: ").unwrap_or(&sentence);
    Err(Failure::Input(format!("{sentence} (see tumble --help)")))
}

/// Finds a flag without its value. Values may begin with a minus, so such a flag takes the next
/// flag as its value, and the later error would be misleading.
fn flag_without_value() -> Option<String> {
    let command = Cli::command();
    let arguments: Vec<_> = std::env::args_os().skip(1).collect();
    let within = arguments.first().and_then(|first| command.find_subcommand(first));
    let flags = within.unwrap_or(&command);
    let flag = |text: &OsStr| {
        let name = text.to_str()?.strip_prefix("--")?.split('=').next()?;
        flags.get_arguments().find(|argument| argument.get_long() == Some(name))
    };
    arguments.windows(2).find_map(|pair| {
        let [first, next] = pair else { return None };
        // `--name=value` has its value.
        let lacks = flag(first)?.get_action().takes_values() && !is_assignment(first);
        let [first, next] = [first, next].map(|text| text.to_string_lossy());
        (lacks && flag(OsStr::new(&*next)).is_some())
            .then(|| format!("{first} needs a value, and {next} follows (see tumble --help)"))
    })
}

fn is_assignment(argument: &OsStr) -> bool {
    argument.to_string_lossy().contains('=')
}
