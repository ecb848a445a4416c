//! Bisection for the threshold between two motions.

use crate::Refusal;
use crate::quantity::{QuantityLabel, TestQuantity, equal};
use crate::runner::{Runner, Setup, TestRun};

/// A threshold.
pub(crate) struct Threshold {
    pub value: f64,
    /// Half of the last bracket, and the larger tolerance of its two runs: either may be on the
    /// wrong side by as much.
    pub tolerance: f64,
}

pub(crate) const RESOLUTION: f64 = 1e-6; // The resolution of thresholds, as a share of them
/// The speed of a moving body, as a share of the speed in free fall.
pub(crate) const MOVING: f64 = 1e-8;

/// The search starts between these shares of the expected value. They are not symmetric, so
/// that no run stands exactly at the threshold.
const BRACKET: [f64; 2] = [0.998, 1.0021];

impl Threshold {
    /// The quantity of the threshold.
    pub fn equals(&self, label: QuantityLabel, exact: f64) -> TestQuantity {
        equal(label, self.value, exact, self.tolerance)
    }

    /// Searches near `expected`; see [`Self::find`].
    pub fn near(
        expected: f64,
        resolution: f64,
        over: impl FnMut(f64) -> Result<(bool, f64), Refusal>,
    ) -> Result<Self, Refusal> {
        Self::find(BRACKET.map(|share| share * expected), resolution, over)
    }

    /// The threshold near `expected` above which the bodies of a setup stay at rest.
    pub fn at_rest(
        runner: &mut Runner<'_>,
        expected: f64,
        setup: impl Fn(f64) -> Result<Setup, Refusal>,
        tolerance: impl Fn(&TestRun) -> f64,
    ) -> Result<Self, Refusal> {
        Self::near(expected, RESOLUTION * expected, |value| {
            let setup = setup(value)?;
            let run = runner.run(&setup)?;
            let moving = MOVING * setup.gravity * setup.duration;
            Ok((run.fastest_at_end() <= moving, tolerance(&run)))
        })
    }

    /// Bisects `low`…`high` until the half width is within `resolution` or a tolerance. `over` runs
    /// a value and returns true above the threshold, together with the tolerance. If both ends are
    /// on one side, the threshold is the nearer end.
    pub fn find(
        [mut low, mut high]: [f64; 2],
        resolution: f64,
        mut over: impl FnMut(f64) -> Result<(bool, f64), Refusal>,
    ) -> Result<Self, Refusal> {
        let (is_over, mut low_tolerance) = over(low)?;
        if is_over {
            return Ok(Self { value: low, tolerance: low_tolerance });
        }
        let (is_over, mut high_tolerance) = over(high)?;
        if !is_over {
            return Ok(Self { value: high, tolerance: high_tolerance });
        }
        while 0.5 * (high - low) > low_tolerance.max(high_tolerance).max(resolution) {
            let middle = 0.5 * (low + high);
            match over(middle)? {
                (true, tolerance) => (high, high_tolerance) = (middle, tolerance),
                (false, tolerance) => (low, low_tolerance) = (middle, tolerance),
            }
        }
        let tolerance = 0.5 * (high - low) + low_tolerance.max(high_tolerance);
        Ok(Self { value: 0.5 * (low + high), tolerance })
    }
}
