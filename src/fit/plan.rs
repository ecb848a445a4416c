//! What a search is to look for, and how.

use super::error::FitError;
use super::loss::Loss;
use super::model::Constant;
use super::parameter::{Parameter, ParameterValues};

/// A parameter that is looked for.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Sought {
    /// Which.
    pub parameter: Parameter,
    /// Where it may lie.
    pub bounds: [f64; 2],
}

impl Sought {
    /// How far around a found value the loss is looked at: as far as it is smooth. It is sharpest in the friction of the world.
    pub(super) fn usual_reach(&self, value: f64) -> f64 {
        self.share(0.1 * value.max(0.05))
    }

    /// The first step of a search, where nothing is known but the bounds: a sixth of their distance, and no more than a
    /// fifth of the friction at the `start`.
    pub(super) fn usual_step(&self, start: f64) -> f64 {
        self.share(0.2 * start.max(0.05))
    }

    /// A sixth of the bounds' distance, of the friction no more than `most`.
    fn share(&self, most: f64) -> f64 {
        let share = (self.bounds[1] - self.bounds[0]) / 6.0;
        if self.parameter == Constant::Friction.into() { share.min(most) } else { share }
    }
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
            let is_twice = |other: &Sought| {
                let (other, one) = (other.parameter, *parameter);
                let overlaps = other.number.is_none() || one.number.is_none();
                other.constant == one.constant && (overlaps || other.number == one.number)
            };
            if self.sought[..index].iter().any(is_twice) {
                return refused(format!("{name} is named twice"));
            }
            if start.get(*parameter).is_nan() {
                return refused(format!("{name} has no value to start from"));
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
