//! What acts along the coordinates of joints: one force each, under one law.
//!
//! ```text
//! u + c f − u* − a + b = 0,   0 ≤ a ⊥ f − f_low ≥ 0,   0 ≤ b ⊥ f_high − f ≥ 0                  (eq. 36)
//! ```
//!
//! with u the speed of a coordinate, or of the sum of two. What is locked has u* − u = g/h alone, a gear too; a spring, a
//! damper and an armature are together one compliance c; dry friction and a motor that holds a speed have both bounds,
//! and a motor that pulls to a position a compliance besides; a stop has one bound, zero. Products are those of the other
//! complementarities of the program: `s_a − a (f − f_low) ≥ 0` with s_a² in the objective.

use crate::joint::{Drive, Motor};
use nalgebra::Vector3;

/// A law (36).
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Law {
    /// u*, m/s.
    pub(super) target: f64,
    /// c, m/s a N.
    pub(super) yields: f64,
    /// f_low and f_high, N.
    pub(super) low: Option<f64>,
    pub(super) high: Option<f64>,
}

impl Law {
    /// Without bounds: a coordinate is where the speed `target` (m/s) takes it.
    pub(super) fn held(target: f64) -> Self {
        Self { target, yields: 0.0, low: None, high: None }
    }

    /// Whether it has neither bounds nor compliance.
    pub(super) fn is_held(&self) -> bool {
        self.yields == 0.0 && self.bounds() == 0
    }

    /// Between −`most` and `most` (N), of which more than `far` is no bound.
    fn within(target: f64, yields: f64, most: f64, far: f64) -> Self {
        let bound = (most < far).then_some(most);
        Self { target, yields, low: bound.map(|most| -most), high: bound }
    }

    /// The force that goes with the speed `u` (m/s), if it is one alone for all within `near` (m/s) of it.
    pub(super) fn force_at(&self, u: f64, near: f64) -> Option<f64> {
        let (low, high) =
            (self.low.unwrap_or(f64::NEG_INFINITY), self.high.unwrap_or(f64::INFINITY));
        let missed = self.target - u;
        if self.yields > 0.0 {
            return Some((missed / self.yields).clamp(low, high));
        }
        match missed {
            slower if slower > near && self.high.is_some() => Some(high),
            faster if faster < -near && self.low.is_some() => Some(low),
            _ => None,
        }
    }

    /// f, or the bound that it is beyond.
    pub(super) fn clamped(&self, force: f64) -> f64 {
        let above = self.low.map_or(force, |low| force.max(low));
        self.high.map_or(above, |high| above.min(high))
    }

    /// How many variables it has: f, and of each bound the part of the speed beside it and the slack.
    pub(super) fn variables(&self) -> usize {
        1 + 2 * self.bounds()
    }

    /// How many rows: the equation, and the product of each bound.
    pub(super) fn rows(&self) -> usize {
        1 + self.bounds()
    }

    fn bounds(&self) -> usize {
        usize::from(self.low.is_some()) + usize::from(self.high.is_some())
    }
}

/// An axis that is free, at step k.
#[derive(Debug, Clone, Copy)]
pub(super) struct Start {
    /// x_k and (x_k − x_{k−1})/h, m or rad.
    pub(super) coordinate: f64,
    pub(super) rate: f64,
    /// h, s.
    pub(super) time_step: f64,
    /// What makes lengths of the coordinate: 1, or ℓ in m.
    pub(super) length: f64,
}

/// The force (N, that of a turn over ℓ) which is the same at any speed, `push` (N, N m) among it, and the laws of what
/// acts besides. Stops and bounds that only a speed of `far` (m/s), or a force that makes one of
/// `mass` (kg), would meet are none.
pub(super) fn laws(
    drive: &Drive,
    push: f64,
    start: &Start,
    (far, mass): (f64, f64),
) -> (f64, Vec<Law>) {
    let Start { coordinate: x, rate, time_step: h, length } = *start;
    let strong = far * mass / h;
    let mut laws = Vec::new();
    // f = v − s u of a stiffness and a damping.
    let line = |stiffness: f64, damping: f64, target: f64| {
        (stiffness * (target - x) / length, (stiffness * h + damping) / (length * length))
    };
    let (mut value, mut slope) = line(drive.stiffness, drive.damping, drive.rest);
    value += drive.armature * rate / (h * length);
    slope += drive.armature / (h * length * length);
    if slope > 0.0 {
        laws.push(Law { yields: slope.recip(), ..Law::held(value / slope) });
    }
    if drive.friction > 0.0 {
        laws.push(Law::within(0.0, 0.0, drive.friction / length, strong));
    }
    match drive.motor {
        Some(Motor::Speed { target, most }) if most > 0.0 => {
            laws.push(Law::within(target * length, 0.0, most / length, strong));
        }
        Some(Motor::Position { target, stiffness, damping, most }) if most > 0.0 => {
            let (value, slope) = line(stiffness, damping, target);
            if slope > 0.0 {
                laws.push(Law::within(value / slope, slope.recip(), most / length, strong));
            }
        }
        Some(Motor::Damper { target, damping, most }) if most > 0.0 && damping > 0.0 => {
            let yields = length * length / damping;
            laws.push(Law::within(target * length, yields, most / length, strong));
        }
        _ => {}
    }
    if let Some([low, high]) = drive.limits {
        let stops = [low, high].map(|stop| length * (stop - x) / h);
        let none = Law::held(0.0);
        if -stops[0] < far {
            laws.push(Law { target: stops[0], low: Some(0.0), ..none });
        }
        if stops[1] < far {
            laws.push(Law { target: stops[1], high: Some(0.0), ..none });
        }
    }
    ((drive.force + push) / length, laws)
}

/// A force along one coordinate or along two, with its law.
#[derive(Debug, Clone)]
pub(super) struct Bond {
    /// The coordinates and their weights w: u = Σ w g/h.
    pub(super) along: Vec<(usize, f64)>,
    pub(super) law: Law,
    /// Its variables: f, then of each bound the speed beside it and the slack; its rows: the equation, then the
    /// products.
    pub(super) variable: usize,
    pub(super) row: usize,
    /// What it does to its bodies.
    pub(super) acts: Vec<Act>,
}

/// What a force of 1 N does to a body of the program.
#[derive(Debug, Clone)]
pub(super) struct Act {
    pub(super) body: usize,
    /// ∂v⁺, m/s.
    pub(super) velocity: Vector3<f64>,
    /// ∂ω⁺, rad/s.
    pub(super) spin: Vector3<f64>,
}

/// One of the bounds of a bond: where its variables and its row are.
#[derive(Debug, Clone, Copy)]
pub(super) struct Bound {
    /// 1 of the lower one, a; −1 of the higher one, b: −a + b = −Σ sign · beside.
    pub(super) sign: f64,
    /// f_low or f_high, N.
    pub(super) at: f64,
    /// a or b.
    pub(super) beside: usize,
    /// s_a or s_b.
    pub(super) slack: usize,
    pub(super) row: usize,
}

impl Bound {
    /// f − f_low or f_high − f.
    pub(super) fn room(&self, force: f64) -> f64 {
        self.sign * (force - self.at)
    }
}

impl Bond {
    pub(super) fn bounds(&self) -> impl Iterator<Item = Bound> + '_ {
        let low = self.law.low.map(|at| (1.0, at));
        let high = self.law.high.map(|at| (-1.0, at));
        low.into_iter().chain(high).enumerate().map(|(number, (sign, at))| {
            let beside = self.variable + 1 + 2 * number;
            Bound { sign, at, beside, slack: beside + 1, row: self.row + 1 + number }
        })
    }
}
