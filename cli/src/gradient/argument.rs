//! Arguments of a derivative.

use crate::outcome::Failure;
use tumble_core::world::Constant;
use tumble_model::nearest;
use tumble_scene::label::unit;

/// Argument of a derivative.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Argument {
    /// Three numbers of the start: name, unit, and first index in the twelve numbers of a state
    /// change.
    Start(&'static str, &'static str, usize),
    /// Three numbers of a wrench during all steps: name, unit, and first index.
    Push(&'static str, &'static str, usize),
    Constant(Constant),
}

const ARGUMENTS: [Argument; 6] = [
    Argument::Start("position", "m", 0),
    Argument::Start("turn", "rad", 3),
    Argument::Start("velocity", "m/s", 6),
    Argument::Start("spin", "rad/s", 9),
    Argument::Push("force", "N", 0),
    Argument::Push("torque", "N m", 3),
];

impl Argument {
    /// Name on the command line.
    pub fn name(&self) -> &'static str {
        match self {
            Self::Start(name, ..) | Self::Push(name, ..) => name,
            Self::Constant(constant) => constant.name(),
        }
    }

    /// Unit; empty for a dimensionless number.
    pub fn unit(&self) -> &'static str {
        match self {
            Self::Start(_, unit, _) | Self::Push(_, unit, _) => unit,
            Self::Constant(constant) => unit(*constant),
        }
    }

    /// World constant of the argument, if it is one.
    pub fn constant(&self) -> Option<Constant> {
        match self {
            Self::Constant(constant) => Some(*constant),
            _ => None,
        }
    }
}

/// Names of all arguments.
fn names() -> Vec<&'static str> {
    let own = ARGUMENTS.iter().map(Argument::name);
    own.chain(Constant::ALL.map(Constant::name)).collect()
}

/// Full help of the flag for arguments, with every name.
pub fn help() -> String {
    let own = |is_start: bool| {
        let of_kind = |argument: &&Argument| matches!(argument, Argument::Start(..)) == is_start;
        let names: Vec<_> = ARGUMENTS.iter().filter(of_kind).map(Argument::name).collect();
        names.join(", ")
    };
    format!(
        "Arguments to differentiate by, separated by commas.\n\n\
         Initial state of the body: {}.\n\
         Constant load on it: {}.\n\
         Constants of the world: {}.",
        own(true),
        own(false),
        Constant::ALL.map(Constant::name).join(", ")
    )
}

/// Parses the arguments of `flag`.
pub fn arguments(flag: &str, words: &[String]) -> Result<Vec<Argument>, Failure> {
    let of_word = |word: &String| {
        let own = ARGUMENTS.into_iter().find(|argument| argument.name() == word);
        own.or_else(|| Constant::of_name(word).map(Argument::Constant)).ok_or_else(|| {
            let all = names();
            let hint = nearest::hint(word, all.iter().copied());
            Failure::Input(format!(
                "{flag}: unknown argument {word:?}{hint} (allowed: {})",
                all.join(", ")
            ))
        })
    };
    words.iter().map(of_word).collect()
}
