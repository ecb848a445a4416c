//! How far the residuals of a run's steps may take it from what its steps must give.
//!
//! A step whose friction law has the residual δ is one of exact friction at each corner i
//! for a slip and an impulse that are off by no more than δ (formulation.md, section 7,
//! "backward error"): p̂_i = Π(p_i − c_i) and |p_i − p̂_i| ≤ δ. Impulses are per unit mass
//! here, so that they are speeds; G = Σ R_i is all the friction there is, n the number of
//! corners, and W the speed that an impulse makes, in that of a free mass: 1 for a body that
//! moves along, m R²/I for the rim of one that turns.
//!
//! **A body that slips with c.** Where |c| > δ the impulse p_i − c_i lies outside the disc,
//! p̂_i is on its edge, and the direction of p̂_i differs from that of −c by an angle φ with
//! sin φ ≤ δ/|c|. The friction of all corners along the slip is then G to within
//!
//! ```text
//! n δ + G (δ/|c|)²                                                                    (a)
//! ```
//!
//! and across it there is no more than √W n δ + G δ/|c|, where √W ≤ 2 allows for the box to
//! turn about the vertical as well.
//!
//! **A body that is held.** If the impulse that holds it is the share τ < 1 of G, it slips
//! with no more than
//!
//! ```text
//! |c| ≤ δ/√(1 − τ²)                                                                   (b)
//! ```
//!
//! for a faster slip would put every p̂_i on its edge within an angle of sin φ ≤ δ/|c| to
//! −c, and their sum would be at least G √(1 − (δ/|c|)²) > τ G. Positions alone say so,
//! whatever the velocities are. In that step G itself is known to 2 μ δ_n only, the change of
//! the normal speed times μ, which comes to what the share is off by.
//!
//! **Any step**, with the slip c* if it were exact: friction is no more than G + n δ, so that
//! c ≥ c* − W n δ; and a slip above δ has (a), so that c − c* ≤ W (n δ + G (δ/(c − c*))²).
//! Both give
//!
//! ```text
//! |c − c*| ≤ W n δ + (W G δ²)^⅓                                                       (c)
//! ```
//!
//! and across it the lesser of |c| and √W n δ + G δ/|c|, at most √W n δ + √(G δ).
//!
//! A step of friction does not separate two velocities further (it is the proximal map of
//! the friction's power), so that what the steps lack adds up, and is forgotten at a stop.
//!
//! **The normal law** does not add up. A corner that touches stays within h δ_n of the
//! ground, and speeds normal to it within 2 δ_n. The normal impulses of a run add up to
//! weight and the change of normal velocity, so that friction misses no more than
//! μ W 2 δ_n of speed in all, and the way μ W h δ_n.

use super::laboratory::Run;
use super::residual::Residual;

/// Corners of a face.
const CORNERS: f64 = 4.0;

/// A step of a slide as it must be.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct SlideStep {
    /// |c|, m/s: 0 where it is held.
    pub slip: f64,
    /// The share of all friction that it takes to hold the body.
    pub share: f64,
}

/// What slides in a run.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Slider {
    /// W, 1: the speed that an impulse makes, in that of a free mass.
    pub mobility: f64,
    /// μ.
    pub friction: f64,
    /// G: the friction of a step, m/s.
    pub grip: f64,
    /// The height of the centre over the distance of the face's edge from below it: a face
    /// whose corners are off by d leans the centre sideways by that much times d.
    pub lean: f64,
}

/// How far a slide may be off.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct SlideSlack {
    /// The speed after each step, m/s.
    pub speeds: Vec<f64>,
    /// The way after each step, m.
    pub ways: Vec<f64>,
    /// What each step changes the speed by, m/s, but for `lifted`.
    pub changes: Vec<f64>,
    /// The speed that a change of the normal speed makes, m/s: of any number of steps.
    pub lifted: f64,
    /// Across the way, m.
    pub across: f64,
}

impl Slider {
    /// (a), (b) or (c), whichever is the least, step by step.
    pub fn slack(&self, run: &Run, steps: impl IntoIterator<Item = SlideStep>) -> SlideSlack {
        let (h, w) = (run.time_step, self.mobility);
        let normal = run.largest(|residual| residual.normal);
        let lifted =
            self.friction * w * (2.0 * normal + run.largest(|residual| residual.kinematics));
        let speed_rounding = run.rounding(run.fastest());
        let way_rounding = run.position_rounding() + run.time(run.steps()) * speed_rounding;
        let leaning = h * normal * self.lean;
        let (mut off, mut way, mut strayed, mut across) = (0.0, 0.0, 0.0, 0.0);
        let mut slack =
            SlideSlack { speeds: vec![], ways: vec![], changes: vec![], lifted, across };
        for (residual, step) in run.residuals.iter().zip(steps) {
            let push = w * (1.0 + self.friction) * residual.momentum;
            let any = self.of_any_step(residual.friction);
            let mut change = any + push;
            if step.slip > 0.0 {
                change = any.min(self.of_slip(residual.friction, step.slip - off)) + push;
                strayed += self.across(residual.friction, step.slip - off) + push;
                off += change;
                way += h * (off + (1.0 + self.friction) * residual.kinematics);
                across += h * (strayed + residual.kinematics);
            } else {
                // All the friction there is may be less by what the normal speed changes.
                let share = step.share + (off + change + lifted) / (w * self.grip);
                let slip = (off + change).min(of_hold(residual.friction, share));
                way += h * slip;
                across += h * slip;
                off = slip + residual.kinematics;
                strayed = off;
            }
            let leant = residual.kinematics + 2.0 * self.lean * normal;
            slack.speeds.push(off + lifted + leant + speed_rounding);
            slack.ways.push(way + h * normal * self.friction * w + leaning + way_rounding);
            slack.changes.push(change + speed_rounding);
        }
        SlideSlack { across: across + leaning + way_rounding, ..slack }
    }

    /// (c)
    fn of_any_step(&self, residual: f64) -> f64 {
        let w = self.mobility;
        w * CORNERS * residual + (w * self.grip * residual * residual).cbrt()
    }

    /// (a)
    fn of_slip(&self, residual: f64, slip: f64) -> f64 {
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
fn of_hold(residual: f64, share: f64) -> f64 {
    if share < 1.0 { residual / (1.0 - share * share).sqrt() } else { f64::INFINITY }
}

impl SlideSlack {
    /// The speed at the end, m/s.
    pub fn speed(&self) -> f64 {
        self.speeds.last().copied().unwrap_or(0.0)
    }

    /// The way at the end, m.
    pub fn way(&self) -> f64 {
        self.ways.last().copied().unwrap_or(0.0)
    }
}

impl Run {
    /// The largest of its steps' residuals, m/s.
    pub(super) fn largest(&self, part: impl Fn(&Residual) -> f64) -> f64 {
        self.residuals.iter().map(part).fold(0.0, f64::max)
    }

    /// The sum of its steps' residuals, m/s.
    pub(super) fn sum(&self, part: impl Fn(&Residual) -> f64) -> f64 {
        self.residuals.iter().map(part).sum()
    }

    /// How far a touching corner may be from the ground, m: h δ_n.
    pub(super) fn seat(&self) -> f64 {
        self.time_step * self.largest(|residual| residual.normal) + self.position_rounding()
    }

    /// How far what is held may creep, m: h Σ δ_f.
    pub(super) fn creep(&self) -> f64 {
        self.time_step * self.sum(|residual| residual.friction)
    }

    /// How far the velocity of a free flight may be off, m/s: Σ δ.
    pub(super) fn flight_speed_slack(&self) -> f64 {
        self.sum(|residual| residual.momentum) + self.rounding(self.fastest())
    }

    /// How far a free flight may be off, m: what a velocity lacks is missing ever after, and
    /// what a position lacks but once, h Σ (N − k) δ_k + h Σ δ_k.
    pub(super) fn flight_way_slack(&self) -> f64 {
        let ages = (1..=self.steps()).rev();
        let aged = |(residual, age): (&Residual, usize)| age as f64 * residual.momentum;
        let fallen: f64 = self.residuals.iter().zip(ages).map(aged).sum();
        let moved = self.sum(|residual| residual.kinematics);
        let rounding = self.time(self.steps()) * self.rounding(self.fastest());
        self.time_step * (fallen + moved) + rounding + self.position_rounding()
    }

    /// What rounding may do to a speed, m/s.
    pub(super) fn flight_rounding(&self) -> f64 {
        self.rounding(self.fastest())
    }

    /// What the additions of all steps may do to the last digits of a number of this size.
    pub(super) fn rounding(&self, size: f64) -> f64 {
        (self.steps() as f64 + 16.0) * f64::EPSILON * size
    }

    fn fastest(&self) -> f64 {
        self.all_states().map(|state| state.velocity.amax()).fold(0.0, f64::max)
    }

    fn position_rounding(&self) -> f64 {
        let largest = self.all_states().map(|state| state.position.amax()).fold(0.0, f64::max);
        self.rounding(largest)
    }
}

/// When a speed that falls linearly comes to an end, s: the line through the last two
/// `speeds` (of the start and after each step) of at least a hundredth of the first,
/// followed to zero. Where the first step stops it, the line is that of this step.
pub(super) fn stop_time(speeds: &[f64], h: f64) -> f64 {
    let last = speeds.iter().rposition(|&speed| speed > 0.01 * speeds[0]).unwrap_or(0);
    let first = last.saturating_sub(1);
    match speeds.get(first + 1) {
        Some(next) => h * (first as f64 + speeds[first] / (speeds[first] - next)),
        None => f64::NAN,
    }
}
