//! Dry friction of a joint axis that depends on its speed.
//!
//! The friction of an axis with the rate ẋ is F φ(|ẋ|), F being its `friction` and φ a curve of straight
//! segments. A step takes the segment at the rate r of the step before. With f = F φ(|r|) and the slope
//! s = F φ'(|r|) of a rising segment, the force is
//!
//! ```text
//! −σ (f − s |r|) − s (τ ẋ⁺ + τ' r),   σ = sign ẋ⁺,                        (J24)
//! ```
//!
//! with τ and τ' of a damper. At ẋ⁺ = r it is −σ f. On a falling segment s = 0, because a force that
//! grows with the speed would allow several solutions. Where f < s |r|, s is f/|r| instead.

use crate::error::{Error, in_range};

/// Largest number of points.
const MOST: usize = 8;

/// Factor of dry friction over the speed: straight lines between points, and constant after the last one.
#[derive(Debug, Clone, Copy, PartialEq)]
#[cfg_attr(any(feature = "save", feature = "serde"), derive(serde::Serialize, serde::Deserialize))]
#[cfg_attr(
    any(feature = "save", feature = "serde"),
    serde(try_from = "Vec<[f64; 2]>", into = "Vec<[f64; 2]>")
)]
pub struct FrictionCurve {
    points: [[f64; 2]; MOST],
    count: usize,
}

/// Dry friction of an axis in one direction, in a step: `limit` + `slope` |ẋ|.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Friction {
    /// f − s |r| (N or N m).
    pub limit: f64,
    /// s (N s/m or N m s/rad).
    pub slope: f64,
    /// Derivatives of both with respect to F, and to |r|.
    pub by_friction: [f64; 2],
    pub by_speed: [f64; 2],
}

impl Friction {
    /// The same friction at every speed. `is_static` is true if it does not depend on F.
    pub fn constant(limit: f64, is_static: bool) -> Self {
        let by_friction = [if is_static { 0.0 } else { 1.0 }, 0.0];
        Self { limit, slope: 0.0, by_friction, by_speed: [0.0; 2] }
    }
}

impl FrictionCurve {
    /// Curve through `points`, each a speed (m/s or rad/s) and a factor.
    ///
    /// # Errors
    /// Unless there are 2 to 8 points with increasing speeds from 0 up to 1e6, and factors from 0 to 1e6.
    pub fn new(points: &[[f64; 2]]) -> Result<Self, Error> {
        let count = points.len();
        if !(2..=MOST).contains(&count) {
            let allowed = "2 to 8";
            return Err(Error::Count { field: "points of a friction curve", count, allowed });
        }
        let mut curve = Self { points: [[0.0; 2]; MOST], count };
        let allowed = "0 at the first point, then increasing up to 1e6";
        let mut least = 0.0;
        for (place, [speed, factor]) in points.iter().enumerate() {
            let most = if place == 0 { 0.0 } else { 1e6 };
            in_range("speed of a friction curve", *speed, least, most, allowed)?;
            in_range("factor of a friction curve", *factor, 0.0, 1e6, "0 to 1e6")?;
            curve.points[place] = [*speed, *factor];
            least = speed.next_up();
        }
        Ok(curve)
    }

    /// The points, each a speed (m/s or rad/s) and a factor.
    pub fn points(&self) -> &[[f64; 2]] {
        &self.points[..self.count]
    }

    /// φ and φ' at `speed`.
    fn at(&self, speed: f64) -> (f64, f64) {
        let points = self.points();
        let after = points.partition_point(|[known, _]| *known <= speed);
        let Some(&[to, end]) = points.get(after) else { return (points[after - 1][1], 0.0) };
        let [from, start] = points[after - 1];
        let slope = (end - start) / (to - from);
        (start + slope * (speed - from), slope)
    }

    /// Factor of an axis at rest.
    pub(super) fn at_rest(&self) -> f64 {
        self.points[0][1]
    }

    /// Friction (J24) of an axis with `friction` F and the `speed` |r|, in its direction if it `goes_on`,
    /// otherwise in the other one, in which it starts from rest.
    pub(super) fn friction(&self, friction: f64, speed: f64, goes_on: bool) -> Friction {
        let (factor, steeper) = self.at(speed);
        // Factor of the limit and slope, and the derivatives of both by the speed.
        let ([limit, slope], by_speed) = if steeper <= 0.0 {
            ([factor, 0.0], [steeper, 0.0])
        } else if factor >= steeper * speed {
            ([factor - steeper * speed, steeper], [0.0, 0.0])
        } else {
            ([0.0, factor / speed], [0.0, (steeper - factor / speed) / speed])
        };
        let (limit, limit_by_speed) =
            if goes_on { (limit, by_speed[0]) } else { (self.at_rest(), 0.0) };
        Friction {
            limit: friction * limit,
            slope: friction * slope,
            by_friction: [limit, slope],
            by_speed: [friction * limit_by_speed, friction * by_speed[1]],
        }
    }
}

impl TryFrom<Vec<[f64; 2]>> for FrictionCurve {
    type Error = Error;

    fn try_from(points: Vec<[f64; 2]>) -> Result<Self, Error> {
        Self::new(&points)
    }
}

impl From<FrictionCurve> for Vec<[f64; 2]> {
    fn from(curve: FrictionCurve) -> Self {
        curve.points().to_vec()
    }
}
