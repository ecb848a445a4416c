//! Everything around the library: arguments, files, the terminal.

mod args;
mod describe;
mod gif;
mod inspect;
mod job;
mod output;
mod plot;
mod run_file;
mod scenario;
mod settings;
mod simulate;
mod source;
mod validate;
mod values;
mod verify;
mod view;

use args::{Cli, Command};
use clap::Parser;
use clap::error::ErrorKind;
use std::fmt;
use std::path::Path;
use std::process::ExitCode;

/// How a command ended well.
pub enum Outcome {
    /// All is as it should be.
    Done,
    /// Finished, but some step did not converge.
    Unconverged,
    /// Ctrl-C: what was computed is written.
    Interrupted,
    /// `verify` found that the file's certificates are not those of its steps, or `validate`
    /// that a quantity is off.
    Mismatch,
}

impl Outcome {
    pub fn exit_code(&self) -> ExitCode {
        match self {
            Self::Done => ExitCode::SUCCESS,
            Self::Mismatch => ExitCode::from(1),
            Self::Unconverged => ExitCode::from(3),
            Self::Interrupted => ExitCode::from(130),
        }
    }
}

/// Why a command ended early: one sentence.
#[derive(Debug)]
pub enum Failure {
    /// The user can mend it: exit code 2.
    Input(String),
    /// Anything else: exit code 1.
    Other(String),
}

impl Failure {
    pub fn exit_code(&self) -> ExitCode {
        match self {
            Self::Input(_) => ExitCode::from(2),
            Self::Other(_) => ExitCode::from(1),
        }
    }
}

impl Failure {
    /// The same, with the file whose fault it is.
    pub fn in_file(self, path: &Path) -> Self {
        match self {
            Self::Input(sentence) => Self::Input(format!("{}: {sentence}", path.display())),
            Self::Other(_) => self,
        }
    }
}

impl fmt::Display for Failure {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let (Self::Input(sentence) | Self::Other(sentence)) = self;
        // A file's own words may hold line breaks; the sentence is one line.
        let line: String = sentence.chars().map(|c| if c.is_control() { ' ' } else { c }).collect();
        f.write_str(&line)
    }
}

/// The model refuses a value: say which flag or field sets it.
impl From<tumble::error::Error> for Failure {
    fn from(error: tumble::error::Error) -> Self {
        match args::flag_behind(&error) {
            Some(flag) => Self::Input(format!("{flag}: {error}")),
            None => Self::Input(error.to_string()),
        }
    }
}

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
