//! The effect of the steps' residuals on the result of a run.
//!
//! W is the mobility and G the largest friction of a step with n corners. The friction law of a
//! step has the residual δ (docs/validation.md, "Tolerances of a slide"):
//!
//! ```text
//! friction along a slip c   G to within n δ + G (δ/|c|)²              (a)
//! slip while held by τ G    |c| ≤ δ/√(1 − τ²)                         (b)
//! error of any slip         |c − c*| ≤ W n δ + (W G δ²)^⅓             (c)
//! ```

use crate::residual::ResidualCheck;
use crate::runner::{TestRun, largest};

const CORNERS: f64 = 4.0; // Corners of a face

/// The exact values of a step of a slide.
#[derive(Debug, Clone, Copy)]
pub(crate) struct SlideStep {
    pub slip: f64,  // |c|, m/s; 0 for a body that sticks
    pub share: f64, // τ: the force to hold the body, as a share of the largest friction
}

/// A sliding body.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Slider {
    pub mobility: f64, // W, 1
    pub friction: f64, // μ
    pub grip: f64,     // G: the largest friction of a step, m/s
    /// The height of the centre over the half width of the face. A face that is off by d moves the
    /// centre sideways by `lean` d.
    pub lean: f64,
}

/// Tolerances of a slide.
#[derive(Debug, Clone)]
pub(crate) struct SlideTolerance {
    pub speeds: Vec<f64>,  // Speed after each step, m/s
    pub ways: Vec<f64>,    // Distance after each step, m
    pub changes: Vec<f64>, // Speed change in each step without `lifted`, m/s
    pub lifted: f64,       // Speed change by the normal law, m/s, in any number of steps
    pub across: f64,       // Distance across the slide, m
}

impl Slider {
    /// The smallest of (a), (b) and (c) in every step, summed.
    pub fn tolerance(
        &self,
        run: &TestRun,
        steps: impl IntoIterator<Item = SlideStep>,
    ) -> SlideTolerance {
        let (h, w) = (run.time_step, self.mobility);
        let normal = run.largest(|r| r.normal);
        let lifted = self.friction * w * (2.0 * normal + run.largest(|r| r.kinematics));
        let speed_rounding = run.flight_rounding();
        let way_rounding = run.position_rounding() + run.end_time() * speed_rounding;
        let leaning = h * normal * self.lean;
        let (mut off, mut way, mut strayed, mut across) = (0.0, 0.0, 0.0, 0.0);
        let mut found =
            SlideTolerance { speeds: vec![], ways: vec![], changes: vec![], lifted, across };
        for (residual, step) in run.residuals.iter().zip(steps) {
            let push = w * (1.0 + self.friction) * residual.momentum;
            let any = self.any_step_tolerance(residual.friction);
            let mut change = any + push;
            if step.slip > 0.0 {
                change = any.min(self.slip_tolerance(residual.friction, step.slip - off)) + push;
                strayed += self.across(residual.friction, step.slip - off) + push;
                off += change;
                way += h * (off + (1.0 + self.friction) * residual.kinematics);
                across += h * (strayed + residual.kinematics);
            } else {
                let share = step.share + (off + change + lifted) / (w * self.grip);
                let slip = (off + change).min(hold_tolerance(residual.friction, share));
                way += h * slip;
                across += h * slip;
                off = slip + residual.kinematics;
                strayed = off;
            }
            let leant = residual.kinematics + 2.0 * self.lean * normal;
            found.speeds.push(off + lifted + leant + speed_rounding);
            found.ways.push(way + h * normal * self.friction * w + leaning + way_rounding);
            found.changes.push(change + speed_rounding);
        }
        SlideTolerance { across: across + leaning + way_rounding, ..found }
    }

    /// (c)
    fn any_step_tolerance(&self, residual: f64) -> f64 {
        let w = self.mobility;
        w * CORNERS * residual + (w * self.grip * residual * residual).cbrt()
    }

    /// (a)
    fn slip_tolerance(&self, residual: f64, slip: f64) -> f64 {
        if slip <= residual {
            return f64::INFINITY;
        }
        self.mobility * (CORNERS * residual + self.grip * (residual / slip).powi(2))
    }

    /// Across the slip.
    fn across(&self, residual: f64, slip: f64) -> f64 {
        let any = 2.0 * CORNERS * residual + (residual * self.grip).sqrt();
        if slip <= residual {
            return any;
        }
        any.min(2.0 * CORNERS * residual + self.grip * residual / slip)
    }
}

/// (b)
fn hold_tolerance(residual: f64, share: f64) -> f64 {
    if share < 1.0 { residual / (1.0 - share * share).sqrt() } else { f64::INFINITY }
}

impl SlideTolerance {
    /// Speed at the end, m/s.
    pub fn speed(&self) -> f64 {
        self.speeds.last().copied().unwrap_or(0.0)
    }

    /// Distance at the end, m.
    pub fn way(&self) -> f64 {
        self.ways.last().copied().unwrap_or(0.0)
    }
}

impl TestRun {
    /// The largest residual of a step, m/s.
    pub fn largest(&self, part: impl Fn(&ResidualCheck) -> f64) -> f64 {
        largest(self.residuals.iter().map(part))
    }

    /// The sum of the steps' residuals, m/s.
    pub fn sum(&self, part: impl Fn(&ResidualCheck) -> f64) -> f64 {
        self.residuals.iter().map(part).sum()
    }

    /// The distance of a touching corner from the ground, m: h δ_n.
    pub fn seat(&self) -> f64 {
        self.time_step * self.largest(|r| r.normal) + self.position_rounding()
    }

    /// The distance that a sticking body creeps, m: h Σ δ_f.
    pub fn creep(&self) -> f64 {
        self.time_step * self.sum(|r| r.friction)
    }

    /// The error of the velocity of free flight, m/s: Σ δ.
    pub fn flight_speed(&self) -> f64 {
        self.sum(|r| r.momentum) + self.flight_rounding()
    }

    /// The error of the position of free flight, m. It is h Σ (N − k) δ_k for velocities, which
    /// persist, and h Σ δ_k for positions.
    pub fn flight_way(&self) -> f64 {
        let ages = (1..=self.steps()).rev();
        let aged = |(residual, age): (&ResidualCheck, usize)| age as f64 * residual.momentum;
        let fallen: f64 = self.residuals.iter().zip(ages).map(aged).sum();
        let moved = self.sum(|r| r.kinematics);
        let rounding = self.end_time() * self.flight_rounding();
        self.time_step * (fallen + moved) + rounding + self.position_rounding()
    }

    /// Rounding of a speed, m/s.
    pub fn flight_rounding(&self) -> f64 {
        self.rounding(largest(self.all_states().map(|state| state.velocity.amax())))
    }

    /// Rounding of a number of this size by the additions of all steps.
    pub fn rounding(&self, size: f64) -> f64 {
        (self.steps() as f64 + 16.0) * f64::EPSILON * size
    }

    fn position_rounding(&self) -> f64 {
        self.rounding(largest(self.all_states().map(|state| state.position.amax())))
    }
}
