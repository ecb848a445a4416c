//! Stretch of the spin before the Cayley map (eq. 8e of `docs/formulation.md`).
//!
//! The Cayley map of a = ½ h ω rotates by 2 atan(½ h |ω|). With a = ½ h γ ω it rotates by h |ω|, if
//! γ = tan x/x with x = ½ h |ω|. γ is the series of this function in s = x²,
//!
//! ```text
//! γ(s) = 1 + s/3 + 2 s²/15 + 17 s³/315,   s = ¼ h² ω·ω                         (8e)
//! ```
//!
//! The series has no poles, so that rotations by more than half a turn have one spin. Its angle is
//! right to 2·10⁻¹⁰ at 0.2 rad a step, and to 10⁻⁶ at 0.6 rad.

/// Value and derivatives of a function of s.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Curve {
    /// Value.
    pub value: f64,
    /// First derivative.
    pub slope: f64,
    /// Second derivative.
    pub bend: f64,
}

/// The functions γ, α and β of one rotation.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Stretch {
    /// s = ¼ h² ω·ω.
    pub s: f64,
    /// γ of the attitude.
    pub gamma: Curve,
    /// Third derivative of γ.
    gamma_twist: f64,
}

impl Stretch {
    /// Functions at `s`.
    #[inline]
    pub fn new(s: f64) -> Self {
        Self {
            s,
            gamma: Curve {
                value: 1.0 + s * (1.0 / 3.0 + s * (2.0 / 15.0 + s * (17.0 / 315.0))),
                slope: 1.0 / 3.0 + s * (4.0 / 15.0 + s * (17.0 / 105.0)),
                bend: 4.0 / 15.0 + s * (34.0 / 105.0),
            },
            gamma_twist: 34.0 / 105.0,
        }
    }

    /// γ = 1 at `s`, the tutorial's rotation.
    pub fn none(s: f64) -> Self {
        Self { s, gamma: Curve { value: 1.0, slope: 0.0, bend: 0.0 }, gamma_twist: 0.0 }
    }

    /// Functions at the s with s γ² = `square`, by Newton's method from above: s γ² is convex, and at
    /// least s and s³/9.
    pub fn inverse(square: f64) -> Self {
        let mut now = Self::new(square.min(libm::cbrt(9.0 * square)));
        loop {
            let gamma = now.gamma.value;
            let s = now.s - (now.s * gamma * gamma - square) / (gamma * now.along());
            let falls = s < now.s;
            if !falls {
                return now;
            }
            now = Self::new(s);
        }
    }

    /// γ + 2 s γ′: derivative of the half angle's tangent x γ with respect to x.
    #[inline]
    pub fn along(&self) -> f64 {
        self.gamma.value + 2.0 * self.s * self.gamma.slope
    }

    /// α and β of the momentum (34):
    ///
    /// ```text
    /// α = 1/γ,   β = (γ³ − 2 γ′)/(γ (γ + 2 s γ′))
    /// ```
    #[inline]
    pub fn momentum_factors(&self) -> [Curve; 2] {
        let Self { s, gamma: Curve { value: g, slope, bend }, gamma_twist: twist } = *self;
        let value = 1.0 / g;
        let first = -slope * value * value;
        let alpha = Curve {
            value,
            slope: first,
            bend: -bend * value * value - 2.0 * first * slope * value,
        };
        let along = [self.along(), 3.0 * slope + 2.0 * s * bend, 5.0 * bend + 2.0 * s * twist];
        let over = [
            g * g * g - 2.0 * slope,
            3.0 * g * g * slope - 2.0 * bend,
            6.0 * g * slope * slope + 3.0 * g * g * bend - 2.0 * twist,
        ];
        let under = [
            g * along[0],
            slope * along[0] + g * along[1],
            bend * along[0] + 2.0 * slope * along[1] + g * along[2],
        ];
        let part = 1.0 / under[0];
        let value = over[0] * part;
        let slope = (over[1] - value * under[1]) * part;
        let bend = (over[2] - 2.0 * slope * under[1] - value * under[2]) * part;
        [alpha, Curve { value, slope, bend }]
    }
}

#[cfg(test)]
#[path = "tests/stretch.rs"]
mod tests;
