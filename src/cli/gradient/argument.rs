//! What a number is differentiated by.

use crate::cli::outcome::Failure;
use tumble::scenario::label::unit;
use tumble::world::Constant;

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

/// One number of an argument, over a range.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Range {
    pub argument: Argument,
    pub component: usize,
    pub from: f64,
    pub to: f64,
}

impl Range {
    /// `force.x=0..20`, `friction=0.1..0.6`: a number by x, y, z or its index where there are several.
    pub fn of(text: &str) -> Result<Self, Failure> {
        let wanted = "an argument and its range is needed, as friction=0.1..0.6 or force.x=0..20";
        let refused = || Failure::Input(format!("--sweep {text}: {wanted}"));
        let (name, range) = text.split_once('=').ok_or_else(refused)?;
        let (word, part) = name.split_once('.').map_or((name, None), |(w, p)| (w, Some(p)));
        let component = match part {
            None => 0,
            Some("x") => 0,
            Some("y") => 1,
            Some("z") => 2,
            Some(index) => index.parse().map_err(|_| refused())?,
        };
        let (from, to) = range.split_once("..").ok_or_else(refused)?;
        let number = |text: &str| text.parse().ok().filter(|x: &f64| x.is_finite());
        let (from, to) = (number(from).ok_or_else(refused)?, number(to).ok_or_else(refused)?);
        let argument = arguments("--sweep", &[word.to_owned()])?[0];
        let several = !matches!(argument, Argument::Constant(_));
        if from >= to || (several && (part.is_none() || component > 2)) {
            return Err(refused());
        }
        Ok(Self { argument, component, from, to })
    }

    /// Its name with the component and the unit.
    pub fn described(&self) -> String {
        let (name, unit) = (self.argument.name(), self.argument.unit());
        let part = match self.argument {
            Argument::Constant(_) if self.component == 0 => String::new(),
            Argument::Constant(_) => format!(" {}", self.component),
            _ => format!(" {}", ["x", "y", "z"][self.component]),
        };
        let per = if unit.is_empty() { String::new() } else { format!(" ({unit})") };
        format!("{name}{part}{per}")
    }
}
