//! The inputs of a problem: numbers with a unit, a default and a range.

use crate::Refusal;

/// A number that a problem may depend on.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Input {
    /// m, kg.
    Mass,
    /// μ.
    Friction,
    /// e.
    Restitution,
    /// g, m/s², downwards.
    Gravity,
    /// Slope of the ground, degrees.
    Slope,
    /// Speed at the start, in a unit of the problem.
    Speed,
}

impl Input {
    /// Name, and the smallest and largest value.
    fn facts(self) -> (&'static str, [f64; 2]) {
        match self {
            Self::Mass => ("mass", [1e-3, 1e6]),
            Self::Friction => ("mu", [1e-3, 10.0]),
            Self::Restitution => ("restitution", [0.0, 1.0]),
            Self::Gravity => ("gravity", [1e-2, 1e3]),
            Self::Slope => ("slope", [0.0, 80.0]),
            Self::Speed => ("speed", [1e-2, 1e2]),
        }
    }
}

/// The inputs of a problem with their values.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct TestInputs {
    values: Vec<(Input, f64)>,
    /// h, s.
    pub time_step: f64,
}

impl TestInputs {
    /// These values.
    pub fn new(time_step: f64, values: &[(Input, f64)]) -> Self {
        Self { values: values.to_vec(), time_step }
    }

    /// The inputs and their values.
    pub fn values(&self) -> &[(Input, f64)] {
        &self.values
    }

    /// Sets `input` if the problem depends on it.
    pub fn set(&mut self, input: Input, value: f64) {
        self.values.iter_mut().filter(|(name, _)| *name == input).for_each(|old| old.1 = value);
    }

    /// The values of `inputs`; refused where one is missing or out of its range.
    pub(crate) fn all<const N: usize>(&self, inputs: [Input; N]) -> Result<[f64; N], Refusal> {
        let mut values = [0.0; N];
        for (value, input) in values.iter_mut().zip(inputs) {
            let (name, [low, high]) = input.facts();
            let found = self.values.iter().find(|(known, _)| *known == input);
            let found = found.ok_or_else(|| Refusal::Motion(format!("{name} is not given")))?.1;
            let why = format!("{name} is {found:?}; allowed: {low} to {high}");
            Refusal::when(!(low..=high).contains(&found), why)?;
            *value = found;
        }
        Ok(values)
    }
}
