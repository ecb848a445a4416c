//! `tumble completions`: prints a completion script.

use super::args::{Cli, CompletionsArgs};
use super::outcome::{Failure, Outcome};
use super::output;
use clap::CommandFactory;

/// Prints the script for the shell.
pub fn run(args: &CompletionsArgs) -> Result<Outcome, Failure> {
    let mut script = Vec::new();
    clap_complete::generate(args.shell, &mut Cli::command(), "tumble", &mut script);
    output::say(&String::from_utf8_lossy(&script))?;
    Ok(Outcome::Done)
}
