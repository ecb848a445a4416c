//! Sensitivity of the active linear piece of an axis' force law.
//!
//! Equation numbers are those of `docs/gradients.md`.

use super::drive::Pull;
use super::{Axis, AxisStart, Drive, Motor};

/// Differentials of the quantities that determine the force law of an axis in a step.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub(crate) struct AxisChange {
    /// Differential of x_k (m or rad); `rate` is the one of (x_k − x_{k−1})/h (m/s or rad/s).
    pub(crate) coordinate: f64,
    pub(crate) rate: f64,
    /// Differential δh (s).
    pub(crate) time_step: f64,
    /// Differentials of the fields of [`Drive`].
    pub(crate) friction: f64,
    pub(crate) stiffness: f64,
    pub(crate) rest: f64,
    pub(crate) damping: f64,
    pub(crate) force: f64,
    pub(crate) armature: f64,
    pub(crate) restitution: f64,
    pub(crate) limits: [f64; 2],
    /// Differentials of the fields of [`Motor`].
    pub(crate) target: f64,
    pub(crate) motor_stiffness: f64,
    pub(crate) motor_damping: f64,
    pub(crate) max_force: f64,
}

/// Point on the graph of an axis: the speed u, and a flag of vertical pieces.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct GraphPlace {
    pub(crate) u: f64,
    pub(crate) is_vertical: bool,
}

/// Differential of a piece, in the scaled speed u and impulse p of [`Axis::graph`].
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) enum PieceChange {
    /// Vertical piece u = u₀: δu₀.
    Speed(f64),
    /// Line p = v − s u: δv and δs.
    Line(f64, f64),
}

impl Axis {
    /// Smallest change of the speed (m/s) at which changes of the initial coordinate become
    /// one-sided, for an axis that is held at a speed.
    pub(crate) fn stop_margin(
        &self,
        start: &AxisStart,
        time_step: f64,
        length: f64,
        at: GraphPlace,
    ) -> f64 {
        match self {
            Self::Free(drive) if at.is_vertical => {
                drive.stop_margin(at.u, start, length, time_step)
            }
            _ => f64::INFINITY,
        }
    }

    /// Differential of the piece with the point `at`, in a step of `time_step` (s) from `start`.
    /// `length` and `unit` are those of [`Axis::graph`]. The terms of the sum are
    ///
    /// ```text
    /// stop          u₀ = ℓ (x* − x)/h
    /// spring        s = (k h σ + d τ) c/ℓ,   v = (k (x* − x) + (k h σ' − d τ') ẋ_k) c,   c = h/(M ℓ)
    /// armature      s = I/(M ℓ²),   v = I ẋ_k/(M ℓ)
    /// stop with a bounce   u₀ = −ℓ e ẋ_k
    /// friction, velocity motor   u₀ = 0 or ℓ times its target,   v = ± f c               (G10)
    /// ```
    pub(crate) fn piece_change(
        &self,
        start: &AxisStart,
        time_step: f64,
        length: f64,
        unit: f64,
        at: GraphPlace,
        change: &AxisChange,
    ) -> PieceChange {
        let Self::Free(drive) = self else { return PieceChange::Speed(0.0) };
        let GraphPlace { u, is_vertical } = at;
        let (h, x) = (time_step, start.coordinate);
        let longer = change.time_step / h;
        if is_vertical {
            return PieceChange::Speed(drive.corner_change(u, start, length, h, change));
        }
        // c = κ h/(M ℓ). Its change by h is in `longer`.
        let to_impulse = start.kick * h / (unit * length);
        let mut value = change.force + (drive.force + start.push) * longer;
        let mut slope = 0.0;
        // Differentials of (k (x* − x) + (k h σ' − d τ') ẋ_k) c and of (k h σ + d τ) c/ℓ, divided by c.
        let rate = start.rate;
        let pull = |k: f64, d: f64| Pull::new(start, k, d, h);
        let mut projection = |(k, d, target): (f64, f64, f64),
                              (dk, dd, dtarget): (f64, f64, f64)| {
            let Pull { after: [s, t], before: [s_before, t_before] } = pull(k, d);
            value += dk * (target - x) + k * (dtarget - change.coordinate + (target - x) * longer);
            value += (dk * h * s_before - dd * t_before) * rate
                + (k * h * s_before - d * t_before) * change.rate
                + (2.0 * k * h * s_before - d * t_before) * rate * longer;
            slope += (dk * h * s + dd * t + (2.0 * k * h * s + d * t) * longer) / length;
        };
        let spring = (drive.stiffness, drive.damping, drive.rest);
        // Spring and damper.
        projection(spring, (change.stiffness, change.damping, change.rest));
        let mut held = 0.0;
        let side = |is_left: bool| if is_left { 1.0 } else { -1.0 };
        // Dry friction (J24) on this side of the rest. The static one is no argument of derivatives.
        let friction = drive.friction_at(start.rate, u >= 0.0);
        let faster = change.rate * rate.signum();
        let [limit, steeper] = [0, 1]
            .map(|k| friction.by_friction[k] * change.friction + friction.by_speed[k] * faster);
        if friction.slope > 0.0 || steeper != 0.0 {
            projection((0.0, friction.slope, 0.0), (0.0, steeper, 0.0));
        }
        held += side(u < 0.0) * (limit + friction.limit * longer);
        // A motor within its largest force is a spring or damper, otherwise a constant force.
        match drive.motor {
            None => {}
            Some(Motor::Speed { target, max_force }) => {
                held += side(u < target * length) * (change.max_force + max_force * longer);
            }
            Some(Motor::Position { target, stiffness, damping, max_force }) => {
                let Pull { after: [s, t], before: [s_before, t_before] } = pull(stiffness, damping);
                let projections = stiffness * (target - x)
                    + (stiffness * h * s_before - damping * t_before) * rate
                    - (stiffness * h * s + damping * t) * u / length;
                if projections.abs() > max_force {
                    held += projections.signum() * (change.max_force + max_force * longer);
                } else {
                    let by = (change.motor_stiffness, change.motor_damping, change.target);
                    projection((stiffness, damping, target), by);
                }
            }
            Some(Motor::Damper { target, damping, max_force }) => {
                let Pull { after: [_, t], before: [_, t_before] } = pull(0.0, damping);
                let projections = damping * (target - t * u / length - t_before * rate);
                if projections.abs() > max_force {
                    held += projections.signum() * (change.max_force + max_force * longer);
                } else {
                    // A damping motor is a damper plus the constant force of its target speed.
                    held +=
                        change.motor_damping * target + damping * (change.target + target * longer);
                    projection((0.0, damping, 0.0), (0.0, change.motor_damping, 0.0));
                }
            }
        }
        let armature = drive.armature * change.rate + change.armature * start.rate;
        PieceChange::Line(
            (value + held) * to_impulse + armature / (unit * length),
            slope * to_impulse + change.armature / (unit * length * length),
        )
    }
}

impl Drive {
    /// Smallest change of the speed u (m/s) of a held axis by which its nearest stop meets its dry
    /// friction or velocity motor. Infinite without both.
    fn stop_margin(&self, u: f64, start: &AxisStart, length: f64, h: f64) -> f64 {
        let friction = self.rubs().then_some(0.0);
        let motor = match self.motor {
            Some(Motor::Speed { target, .. }) => Some(target * length),
            _ => None,
        };
        let nearest = |all: &mut dyn Iterator<Item = f64>| {
            all.map(|at| (at - u).abs()).fold(f64::INFINITY, f64::min)
        };
        let mut stops = self.stops(start, h, length).into_iter().flatten().map(|(at, _)| at);
        nearest(&mut stops).max(nearest(&mut friction.into_iter().chain(motor)))
    }

    /// Differential δu₀ of the stop, friction or motor at the speed u.
    fn corner_change(
        &self,
        u: f64,
        start: &AxisStart,
        length: f64,
        h: f64,
        change: &AxisChange,
    ) -> f64 {
        // Selects the one with the nearest speed.
        let stops = self.stops(start, h, length).into_iter().flatten();
        let stop = stops.map(|(at, limit)| {
            let change = match limit {
                Some(k) => {
                    length * (change.limits[k] - change.coordinate) / h - at * change.time_step / h
                }
                None => {
                    -length * (self.restitution * change.rate + change.restitution * start.arrival)
                }
            };
            (at, change)
        });
        let friction = self.rubs().then_some((0.0, 0.0));
        let motor = match self.motor {
            Some(Motor::Speed { target, .. }) => Some((target * length, change.target * length)),
            _ => None,
        };
        let all = stop.chain(friction).chain(motor);
        let nearest = all.min_by(|(a, _), (b, _)| (a - u).abs().total_cmp(&(b - u).abs()));
        nearest.map_or(0.0, |(_, change)| change)
    }
}
