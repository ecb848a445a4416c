//! What a number is differentiated by.

use crate::outcome::Failure;
use tumble_core::world::Constant;
use tumble_scene::label::unit;

/// What a number is differentiated by.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Argument {
    /// Three numbers of the start, from this place among the twelve of a state's change.
    Start(&'static str, &'static str, usize),
    /// Three numbers of a wrench that acts through all steps, from this place.
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
    /// Its word.
    pub fn name(&self) -> &'static str {
        match self {
            Self::Start(name, ..) | Self::Push(name, ..) => name,
            Self::Constant(constant) => constant.name(),
        }
    }

    /// Its unit; none of a factor.
    pub fn unit(&self) -> &'static str {
        match self {
            Self::Start(_, unit, _) | Self::Push(_, unit, _) => unit,
            Self::Constant(constant) => unit(*constant),
        }
    }

    /// The constant that it is.
    pub fn constant(&self) -> Option<Constant> {
        match self {
            Self::Constant(constant) => Some(*constant),
            _ => None,
        }
    }
}

/// The arguments of `flag` by these words.
pub fn arguments(flag: &str, words: &[String]) -> Result<Vec<Argument>, Failure> {
    let of_word = |word: &String| {
        let own = ARGUMENTS.into_iter().find(|argument| argument.name() == word);
        own.or_else(|| Constant::of_name(word).map(Argument::Constant)).ok_or_else(|| {
            let own = ARGUMENTS.iter().map(Argument::name);
            let all: Vec<_> = own.chain(Constant::ALL.map(Constant::name)).collect();
            Failure::Input(format!("{flag}: {word:?} is none; there are {}", all.join(", ")))
        })
    };
    words.iter().map(of_word).collect()
}
