//! What a search is to look for, and how.

use super::error::FitError;
use super::loss::Loss;
use super::model::{Constant, ParameterValues};

/// A parameter that is looked for.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Sought {
    /// Which.
    pub parameter: Constant,
    /// Where it may lie.
    pub bounds: [f64; 2],
}

/// What a search does.
#[derive(Debug, Clone, PartialEq)]
pub struct Plan {
    /// What is looked for; the rest keeps the values of the start.
    pub sought: Vec<Sought>,
    /// What is made least.
    pub loss: Loss,
    /// Evaluations of all tosses.
    pub evaluations: usize,
    /// Rounds, each with a new population and its share of the evaluations.
    pub rounds: usize,
    /// Gauss–Newton steps that are tried from the best values on; 0 for none.
    pub polish: usize,
    /// Of what is drawn.
    pub seed: u32,
}

impl Plan {
    /// The number of points of a generation, λ = 4 + ⌊3 ln n⌋.
    pub(super) fn population(&self) -> usize {
        4 + (3.0 * (self.sought.len() as f64).ln()) as usize
    }

    /// Checks the plan for a start from `start`.
    ///
    /// # Errors
    /// Nothing to look for, or twice the same; bounds that are none, or do not hold the start; no
    /// rounds, or fewer evaluations than three generations a round.
    pub fn check(&self, start: &ParameterValues) -> Result<(), FitError> {
        let refused = |why: String| Err(FitError::Request(why));
        if self.sought.is_empty() {
            return refused("no parameter to look for is named".to_owned());
        }
        for (index, Sought { parameter, bounds: [low, high] }) in self.sought.iter().enumerate() {
            let name = parameter.name();
            super::model::sought(name).map_err(FitError::Request)?;
            if self.sought[..index].iter().any(|other| other.parameter == *parameter) {
                return refused(format!("{name} is named twice"));
            }
            if !(low.is_finite() && high.is_finite() && low < high) {
                return refused(format!("{name}: {low} to {high} are no bounds"));
            }
            let value = start.get(*parameter);
            if !(low..=high).contains(&&value) {
                return refused(format!(
                    "{name} starts at {value}, outside of its bounds, {low} to {high}"
                ));
            }
        }
        if self.rounds == 0 {
            return refused("0 rounds are none; 1 or more are needed".to_owned());
        }
        let least = self.rounds.saturating_mul(3 * self.population()).saturating_add(1);
        if self.evaluations < least {
            return refused(format!(
                "{} evaluations in {} rounds are too few; {least} or more are needed",
                self.evaluations, self.rounds,
            ));
        }
        Ok(())
    }
}
