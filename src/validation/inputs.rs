//! The numbers a problem depends on.

use super::Unsuitable;

/// A number that a problem may depend on.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub enum Input {
    /// m, kg.
    Mass,
    /// μ.
    Friction,
    /// e.
    Restitution,
    /// g, m/s², downwards.
    Gravity,
    /// Of the ground, degrees.
    Slope,
    /// At the start: m/s, rad/s for a spin, or a share of a critical one, as the problem
    /// says.
    Speed,
}

impl Input {
    /// All of them.
    pub const ALL: [Self; 6] =
        [Self::Mass, Self::Friction, Self::Restitution, Self::Gravity, Self::Slope, Self::Speed];

    /// The word of the command line.
    #[must_use]
    pub fn name(self) -> &'static str {
        self.told().0
    }

    /// Its unit; what a speed is one of, the problem says ([`Problem::unit`]).
    ///
    /// [`Problem::unit`]: super::Problem::unit
    #[must_use]
    pub fn unit(self) -> &'static str {
        self.told().1
    }

    /// Its word, its unit, and the least and the most that a problem can be posed with.
    fn told(self) -> (&'static str, &'static str, (f64, f64)) {
        match self {
            Self::Mass => ("mass", "kg", (1e-3, 1e6)),
            Self::Friction => ("mu", "", (1e-3, 10.0)),
            Self::Restitution => ("restitution", "", (0.0, 1.0)),
            Self::Gravity => ("gravity", "m/s²", (1e-2, 1e3)),
            Self::Slope => ("slope", "°", (0.0, 80.0)),
            Self::Speed => ("speed", "m/s", (1e-2, 1e2)),
        }
    }
}

/// The usual gravity.
pub(super) const EARTH: (Input, f64) = (Input::Gravity, 9.81);

/// Inputs and their values; an input that is not in it means nothing to the problem.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Inputs {
    values: Vec<(Input, f64)>,
    /// h, s.
    pub time_step: f64,
}

impl Inputs {
    /// These values.
    #[must_use]
    pub fn new(time_step: f64, values: &[(Input, f64)]) -> Self {
        Self { values: values.to_vec(), time_step }
    }

    /// The inputs and their values.
    #[must_use]
    pub fn values(&self) -> &[(Input, f64)] {
        &self.values
    }

    /// Whether the problem depends on `input`.
    #[must_use]
    pub fn has(&self, input: Input) -> bool {
        self.values.iter().any(|(name, _)| *name == input)
    }

    /// Sets `input` where the problem depends on it.
    pub fn set(&mut self, input: Input, value: f64) {
        for (name, old) in &mut self.values {
            if *name == input {
                *old = value;
            }
        }
    }

    /// The values of `inputs`, as [`Inputs::get`] has them.
    pub(super) fn all<const N: usize>(&self, inputs: [Input; N]) -> Result<[f64; N], Unsuitable> {
        let mut values = [0.0; N];
        for (value, input) in values.iter_mut().zip(inputs) {
            *value = self.get(input)?;
        }
        Ok(values)
    }

    /// The value of `input`.
    ///
    /// # Errors
    /// A value out of range; an input that the problem does not depend on.
    pub(super) fn get(&self, input: Input) -> Result<f64, Unsuitable> {
        let (_, _, (low, high)) = input.told();
        let found = self.values.iter().find(|(name, _)| *name == input);
        match found {
            Some(&(_, value)) if (low..=high).contains(&value) => Ok(value),
            Some((_, value)) => Err(Unsuitable::Motion(format!(
                "{} is {value:?}; allowed is {low} to {high}",
                input.name()
            ))),
            None => Err(Unsuitable::Motion(format!("{} is not given", input.name()))),
        }
    }
}
