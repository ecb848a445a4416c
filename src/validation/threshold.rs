//! A threshold between two motions, found by halving.

use super::quantity::{Label, exactly};
use super::{Quantity, Unsuitable};

/// A threshold that was found, and how well.
pub(super) struct Threshold {
    pub value: f64,
    /// Half of what is left between what does not topple and what does, and the larger slack
    /// of these two runs: each of them may be on the wrong side by its own.
    pub slack: f64,
}

impl Threshold {
    /// What was found, beside what it must be.
    pub fn beside(&self, label: Label, exact: f64) -> Quantity {
        exactly(label, self.value, exact, self.slack)
    }

    /// Near `expected`; see [`Self::find`].
    pub fn near(
        expected: f64,
        resolution: f64,
        topples: impl FnMut(f64) -> Result<(bool, f64), Unsuitable>,
    ) -> Result<Self, Unsuitable> {
        let bracket = (BRACKET.0 * expected, BRACKET.1 * expected);
        Self::find(bracket, resolution, topples)
    }

    /// Halves `low`…`high` until it is within `resolution`, or within the slack of its ends.
    /// `topples` says whether a run does, and within what slack of the threshold it might as
    /// well not have. An end that is on the wrong side is taken for the threshold.
    pub fn find(
        (mut low, mut high): (f64, f64),
        resolution: f64,
        mut topples: impl FnMut(f64) -> Result<(bool, f64), Unsuitable>,
    ) -> Result<Self, Unsuitable> {
        let (over, mut low_slack) = topples(low)?;
        if over {
            return Ok(Self { value: low, slack: low_slack });
        }
        let (over, mut high_slack) = topples(high)?;
        if !over {
            return Ok(Self { value: high, slack: high_slack });
        }
        while 0.5 * (high - low) > low_slack.max(high_slack).max(resolution) {
            let middle = 0.5 * (low + high);
            let (over, slack) = topples(middle)?;
            if over {
                (high, high_slack) = (middle, slack);
            } else {
                (low, low_slack) = (middle, slack);
            }
        }
        let slack = 0.5 * (high - low) + low_slack.max(high_slack);
        Ok(Self { value: 0.5 * (low + high), slack })
    }
}

/// Thresholds are looked for between these shares of what they must be; not in even parts,
/// lest the middle stands on the brink.
const BRACKET: (f64, f64) = (0.998, 1.0021);
