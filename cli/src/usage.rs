//! Parsing of the command line. Usage errors become one sentence.

use super::args::Cli;
use super::outcome::Failure;
use super::output;
use clap::error::{ContextKind, ContextValue, ErrorKind};
use clap::{CommandFactory, FromArgMatches};
use std::ffi::{OsStr, OsString};
use std::path::Path;
use tumble_model::nearest;

/// Arguments of the command line. `None` if help or version was printed instead.
pub fn parse(arguments: &[OsString]) -> Result<Option<Cli>, Failure> {
    let mut command = Cli::command();
    if arguments.len() <= 1 {
        output::say(&command.render_help().ansi().to_string())?;
        return Ok(None);
    }
    if let Some(sentence) = unknown_command(&command, &arguments[1]) {
        return Err(Failure::Input(sentence));
    }
    let parsed = command.try_get_matches_from_mut(arguments);
    match parsed.and_then(|matches| Cli::from_arg_matches(&matches)) {
        Ok(cli) => Ok(Some(cli)),
        Err(error) if is_help(&error) => {
            output::say(&error.render().ansi().to_string())?;
            Ok(None)
        }
        Err(error) => Err(Failure::Input(sentence(&error, &command, &arguments[1..]))),
    }
}

fn is_help(error: &clap::Error) -> bool {
    matches!(error.kind(), ErrorKind::DisplayHelp | ErrorKind::DisplayVersion)
}

/// Sentence about a first argument that is neither a command nor a scene.
///
/// A scene is a path: it has a dot or a slash, or exists.
fn unknown_command(command: &clap::Command, first: &OsStr) -> Option<String> {
    let word = first.to_str()?;
    let is_path = word.contains(['.', '/', '\\']) || Path::new(word).exists();
    if word.starts_with('-') || is_path || command.find_subcommand(word).is_some() || word == "help"
    {
        return None;
    }
    if word == "audit" {
        return Some("tumble audit is in the Python package: pip install ./python, then python -m tumble audit".into());
    }
    let hint = nearest::hint(word, command.get_subcommands().map(clap::Command::get_name));
    Some(format!("{word:?} is neither a command nor a file{hint} (see tumble --help)"))
}

/// One sentence for a usage error: fault, remedy and the help that lists what is allowed.
fn sentence(error: &clap::Error, command: &clap::Command, arguments: &[OsString]) -> String {
    let subcommand = arguments.first().and_then(|first| command.find_subcommand(first));
    let help = subcommand.map_or_else(
        || "tumble run --help".to_owned(),
        |subcommand| format!("tumble {} --help", subcommand.get_name()),
    );
    let flags = subcommand.unwrap_or(command);
    let found = flag_without_value(flags, arguments)
        .or_else(|| separate_numbers(flags, arguments))
        .or_else(|| late_command(error, command, arguments));
    if let Some(sentence) = found {
        return format!("{sentence} (see {help})");
    }
    let text = error.render().to_string();
    let first = text.split("\n\n").next().unwrap_or_default();
    let line = first.split_whitespace().collect::<Vec<_>>().join(" ");
    let line = line.strip_prefix("error: ").unwrap_or(&line);
    format!("{line}{} (see {help})", suggestion(error))
}

/// Clap's suggestion for a misspelt name or value, as the end of a sentence.
fn suggestion(error: &clap::Error) -> String {
    let kinds =
        [ContextKind::SuggestedSubcommand, ContextKind::SuggestedArg, ContextKind::SuggestedValue];
    let name = kinds.into_iter().find_map(|kind| match error.get(kind)? {
        ContextValue::String(name) => Some(name),
        ContextValue::Strings(names) => names.first(),
        _ => None,
    });
    name.map_or_else(String::new, |name| format!("; did you mean `{name}`?"))
}

/// Argument of `command` that `text` sets, with or without a value after `=`.
fn flag<'a>(command: &'a clap::Command, text: &OsStr) -> Option<&'a clap::Arg> {
    let name = text.to_str()?.strip_prefix("--")?.split('=').next()?;
    command.get_arguments().find(|argument| argument.get_long() == Some(name))
}

/// Finds a flag without its value. Values may begin with a minus, so such a flag takes the next
/// flag as its value, and the later error would be misleading.
fn flag_without_value(command: &clap::Command, arguments: &[OsString]) -> Option<String> {
    arguments.windows(2).find_map(|pair| {
        let [first, next] = pair else { return None };
        // `--name=value` has its value.
        let is_assigned = first.to_string_lossy().contains('=');
        let lacks = flag(command, first)?.get_action().takes_values() && !is_assigned;
        let [shown, follows] = [first, next].map(|text| text.to_string_lossy());
        (lacks && flag(command, next).is_some())
            .then(|| format!("{shown} needs a value, and {follows} follows"))
    })
}

/// Finds a command after options, such as `--quiet verify states.csv`. A word after an option with a
/// value is that value.
fn late_command(
    error: &clap::Error,
    command: &clap::Command,
    arguments: &[OsString],
) -> Option<String> {
    if error.kind() != ErrorKind::ArgumentConflict {
        return None;
    }
    let takes_next = |word: &OsString| {
        let is_assigned = word.to_string_lossy().contains('=');
        !is_assigned && flag(command, word).is_some_and(|flag| flag.get_action().takes_values())
    };
    let is_late =
        |pair: &&[OsString]| command.find_subcommand(&pair[1]).is_some() && !takes_next(&pair[0]);
    let late = &arguments.windows(2).find(is_late)?[1];
    let [first, late] = [arguments.first()?, late].map(|word| word.to_string_lossy());
    first.starts_with('-').then(|| {
        format!("{first} is before the command {late}; write tumble {late}, then its options")
    })
}

/// Finds a vector written with spaces, such as `--gravity 0 0 1`.
fn separate_numbers(command: &clap::Command, arguments: &[OsString]) -> Option<String> {
    // A number, or several joined by commas, without a comma at the end.
    let numbers = |text: &OsString| {
        let text = text.to_str()?.trim_end_matches(',').to_owned();
        text.split(',').all(|part| part.parse::<f64>().is_ok()).then_some(text)
    };
    arguments.iter().enumerate().find_map(|(index, name)| {
        let argument = flag(command, name)?;
        let takes_vector = argument.get_value_names()?.iter().any(|name| name.contains(','));
        let numbers: Vec<_> = arguments[index + 1..].iter().map_while(numbers).collect();
        let shown = name.to_string_lossy();
        (takes_vector && numbers.len() > 1).then(|| {
            format!(
                "{shown} {}: numbers are joined by commas; write {shown} {}",
                numbers.join(" "),
                numbers.join(",")
            )
        })
    })
}

#[cfg(test)]
#[path = "tests/usage.rs"]
mod tests;
