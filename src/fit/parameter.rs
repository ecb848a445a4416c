//! The numbers that a fit may look for, and values of them.

use crate::world::{Constant, World};

/// A number that may be looked for: a constant of the world as [one number](Constant::one_number), or one of its numbers.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Parameter {
    /// Which constant.
    pub constant: Constant,
    /// Which of its [numbers](Constant::of); `None` for all of them together.
    pub number: Option<usize>,
}

impl From<Constant> for Parameter {
    fn from(constant: Constant) -> Self {
        Self { constant, number: None }
    }
}

impl Parameter {
    /// Its value in `world`: the constant's one number, or this one of its numbers, in the constant's unit; NaN of one
    /// that is not there.
    #[must_use]
    pub fn of(self, world: &World) -> f64 {
        match self.number {
            None => self.constant.one_number(world),
            Some(number) => self.constant.of(world).get(number).copied().unwrap_or(f64::NAN),
        }
    }

    /// Its name: that of the constant, with the place of the number, `joint_damping[1]`.
    #[must_use]
    pub fn name(self) -> String {
        match self.number {
            None => self.constant.name().to_owned(),
            Some(number) => format!("{}[{number}]", self.constant.name()),
        }
    }
}

/// Values of parameters; of others those of the scene hold.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct ParameterValues(Vec<(Parameter, f64)>);

impl ParameterValues {
    /// The value of a parameter; NaN of one that has none here.
    #[must_use]
    pub fn get(&self, parameter: impl Into<Parameter>) -> f64 {
        let parameter = parameter.into();
        let known = self.0.iter().find(|(known, _)| *known == parameter);
        known.map_or(f64::NAN, |(_, value)| *value)
    }

    /// These, but for one parameter.
    #[must_use]
    pub fn with(mut self, parameter: impl Into<Parameter>, value: f64) -> Self {
        let parameter = parameter.into();
        match self.0.iter_mut().find(|(known, _)| *known == parameter) {
            Some((_, known)) => *known = value,
            None => self.0.push((parameter, value)),
        }
        self
    }

    /// A constant that has a value as a whole, and others of its numbers, which then contradict each other.
    #[must_use]
    pub fn contradicted(&self) -> Option<Constant> {
        let whole = self.0.iter().filter(|(parameter, _)| parameter.number.is_none());
        let is_divided = |constant: Constant| {
            let of = |known: &Parameter| known.constant == constant && known.number.is_some();
            self.0.iter().any(|(known, _)| of(known))
        };
        whole.map(|(parameter, _)| parameter.constant).find(|constant| is_divided(*constant))
    }

    /// All of them, in the order in which they were first given.
    #[must_use]
    pub fn all(&self) -> &[(Parameter, f64)] {
        &self.0
    }

    /// The numbers of every constant that has a value here, in `world`: its own ones but for these.
    pub(super) fn numbers(&self, world: &World) -> Vec<(Constant, Vec<f64>)> {
        let mut all: Vec<(Constant, Vec<f64>)> = Vec::new();
        for &(Parameter { constant, number }, value) in &self.0 {
            let Some(number) = number else {
                all.push((constant, constant.from_one_number(world, value)));
                continue;
            };
            let known = all.iter().position(|(known, _)| *known == constant);
            let place = known.unwrap_or_else(|| {
                all.push((constant, constant.of(world)));
                all.len() - 1
            });
            if let Some(one) = all[place].1.get_mut(number) {
                *one = value;
            }
        }
        all
    }
}
