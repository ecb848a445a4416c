//! Drives: the forces along a free axis of a joint.

use super::friction_curve::{Friction, FrictionCurve};
use super::graph::{ForceSum, Graph};
use crate::error::{Error, in_range};
use nalgebra::Vector3;

/// Rate up to which an axis has its static friction (m/s or rad/s).
const STICK_RATE: f64 = 1e-6;

/// One of the six axes of a joint.
// Most axes with numbers are those of robots, and an allocation each would cost more than the room.
#[allow(clippy::large_enum_variant)]
#[derive(Debug, Clone, Copy, PartialEq)]
#[cfg_attr(feature = "save", derive(serde::Serialize, serde::Deserialize))]
pub enum Axis {
    /// Locked axis: its coordinate is zero.
    Locked,
    /// Free axis with a drive.
    Free(Drive),
}

/// Drive of a free axis: the sum of the forces below. Units are m and N for linear axes, rad and N
/// m for angular ones.
#[derive(Debug, Clone, Copy, PartialEq)]
#[cfg_attr(any(feature = "save", feature = "serde"), derive(serde::Serialize, serde::Deserialize))]
#[cfg_attr(any(feature = "save", feature = "serde"), serde(default))]
pub struct Drive {
    /// Range of the coordinate (m or rad). Its ends are hard stops.
    pub limits: Option<[f64; 2]>,
    /// Coefficient of restitution e of the stops, 0 to 1: an axis that comes to a stop at the rate c leaves
    /// it at the rate e c.
    pub restitution: f64,
    /// Dry friction (N or N m): the largest holding force, and the constant resistance of a moving
    /// axis.
    pub friction: f64,
    /// Dry friction of an axis that rests (N or N m), at least `friction`: one whose rate was at most
    /// 10⁻⁶ m/s or rad/s in the step before.
    pub static_friction: Option<f64>,
    /// Factor of `friction` over the speed.
    pub friction_curve: Option<FrictionCurve>,
    /// Stiffness k of a spring (N/m or N m/rad).
    pub stiffness: f64,
    /// Rest position of the spring (m or rad).
    pub rest: f64,
    /// Viscous damping (N s/m or N m s/rad).
    pub damping: f64,
    /// Constant force on A along the axis (N or N m).
    pub force: f64,
    /// Armature: inertia of the rotor, reflected to the axis (kg or kg m²). It resists changes of
    /// the axis speed only.
    pub armature: f64,
    /// Motor, if any.
    pub motor: Option<Motor>,
}

/// Motor on an axis, with a force limit.
#[derive(Debug, Clone, Copy, PartialEq)]
#[cfg_attr(any(feature = "save", feature = "serde"), derive(serde::Serialize, serde::Deserialize))]
#[cfg_attr(any(feature = "save", feature = "serde"), serde(rename_all = "lowercase"))]
pub enum Motor {
    /// Velocity motor: holds a speed exactly, up to its force limit.
    Speed {
        /// Target speed (m/s or rad/s).
        target: f64,
        /// Force limit (N or N m).
        max_force: f64,
    },
    /// PD motor: drives the coordinate to a target with a stiffness and a damping.
    Position {
        /// Target coordinate (m or rad).
        target: f64,
        /// Stiffness (N/m or N m/rad).
        stiffness: f64,
        /// Damping (N s/m or N m s/rad).
        damping: f64,
        /// Force limit (N or N m).
        max_force: f64,
    },
    /// Damping motor: drives the speed to a target with a damping.
    Damper {
        /// Target speed (m/s or rad/s).
        target: f64,
        /// Damping (N s/m or N m s/rad).
        damping: f64,
        /// Force limit (N or N m).
        max_force: f64,
    },
}

impl Motor {
    /// Copy of this motor with another target (m/s or rad/s, m or rad).
    #[must_use]
    pub fn to(self, target: f64) -> Self {
        match self {
            Self::Speed { max_force, .. } => Self::Speed { target, max_force },
            Self::Position { stiffness, damping, max_force, .. } => {
                Self::Position { target, stiffness, damping, max_force }
            }
            Self::Damper { damping, max_force, .. } => Self::Damper { target, damping, max_force },
        }
    }
}

impl Default for Drive {
    fn default() -> Self {
        Self::NONE
    }
}

impl Drive {
    /// Drive without forces and limits.
    pub const NONE: Self = Self {
        limits: None,
        restitution: 0.0,
        friction: 0.0,
        static_friction: None,
        friction_curve: None,
        stiffness: 0.0,
        rest: 0.0,
        damping: 0.0,
        force: 0.0,
        armature: 0.0,
        motor: None,
    };

    /// Dry friction of negative (`is_positive` = false) or positive rates in a step with this `rate` in the
    /// step before (m/s or rad/s). An axis that does not go on in this direction has stopped in between.
    pub(super) fn friction_at(&self, rate: f64, is_positive: bool) -> Friction {
        let goes_on = if is_positive { rate > STICK_RATE } else { rate < -STICK_RATE };
        match (&self.friction_curve, self.static_friction) {
            (Some(curve), _) => curve.friction(self.friction, rate.abs(), goes_on),
            (None, Some(friction)) if !goes_on => Friction::constant(friction, true),
            _ => Friction::constant(self.friction, false),
        }
    }

    /// Largest dry friction of an axis at rest (N or N m).
    pub fn holding_friction(&self) -> f64 {
        let factor = self.friction_curve.as_ref().map_or(1.0, FrictionCurve::at_rest);
        self.static_friction.unwrap_or(self.friction * factor)
    }

    /// Speeds u at the lower and the upper stop in a step of `time_step` (s) from `start`. Each has the index of
    /// the limit that the axis just reaches, or `None` if it bounces off (J25). An axis bounces if it may come to
    /// the stop under its own forces and gravity.
    pub(super) fn stops(
        &self,
        start: &AxisStart,
        time_step: f64,
        length: f64,
    ) -> Option<[(f64, Option<usize>); 2]> {
        let [low, high] = self.limits?.map(|limit| length * (limit - start.coordinate) / time_step);
        let reached = [(low, Some(0)), (high, Some(1))];
        let [faster, closer] = self.approach([low, high], start, time_step, length);
        let left = -self.restitution * length * start.arrival;
        Some(if faster <= 0.0 || closer < 0.0 {
            reached
        } else if start.arrival < 0.0 && left > low {
            [if left < high { (left, None) } else { reached[1] }, reached[1]]
        } else if start.arrival > 0.0 && left < high {
            [reached[0], if left > low { (left, None) } else { reached[0] }]
        } else {
            reached
        })
    }

    /// Excess of the speed over that from which the axis bounces, and of the speed to which forces may change it
    /// over that of the stop ahead (m/s). An axis with restitution bounces if neither is negative.
    fn approach(
        &self,
        [low, high]: [f64; 2],
        start: &AxisStart,
        time_step: f64,
        length: f64,
    ) -> [f64; 2] {
        if self.restitution == 0.0 {
            return [f64::NEG_INFINITY; 2];
        }
        let came = length * start.arrival;
        // An impulse p over ℓ changes u by ℓ² p/I.
        let response = length * length * start.inverse_inertia;
        let pushed = response * self.forces(start, time_step, length, 1.0).beside(came, true);
        let beyond = if came < 0.0 { low - came - pushed } else { came + pushed - high };
        let faster = length * (start.arrival.abs() - start.rebound_rate);
        [faster, beyond + length * start.fall]
    }

    /// Forces of [`Axis::graph`] besides its stops.
    fn forces(&self, start: &AxisStart, time_step: f64, length: f64, unit: f64) -> ForceSum {
        let coordinate = start.coordinate;
        // For an angular axis, the torque is divided by the length.
        let of_step = time_step / (unit * length);
        // Forces act over κ h (37), and impulses are over M ℓ.
        let to_impulse = start.kick * of_step;
        let mut sum = ForceSum::constant((self.force + start.push) * to_impulse);
        // f = k (rest − x − h σ ẋ + h σ' ẋ⁻) − d (τ ẋ + τ' ẋ⁻), with ẋ = u/length.
        let pull = |stiffness: f64, damping: f64, target: f64| {
            let Pull { after, before } = Pull::new(start, stiffness, damping, time_step);
            let slope =
                (stiffness * time_step * after[0] + damping * after[1]) * to_impulse / length;
            let known = (stiffness * time_step * before[0] - damping * before[1]) * start.rate;
            (slope, (stiffness * (target - coordinate) + known) * to_impulse)
        };
        let (slope, at_zero) = pull(self.stiffness, self.damping, self.rest);
        sum.add_line(at_zero, slope);
        if self.armature > 0.0 {
            // f = −I ((x⁺ − x_k) − (x_k − x_{k−1}))/h²                            (J8)
            let inertia = self.armature / time_step * of_step;
            sum.add_line(inertia * start.rate, inertia / length);
        }
        // Dry friction (J24): a damper, and a jump at zero rate around the mean of both directions
        let sides = [false, true].map(|is_positive| self.friction_at(start.rate, is_positive));
        if sides[1].slope > 0.0 {
            let (slope, at_zero) = pull(0.0, sides[1].slope, 0.0);
            sum.add_line(at_zero, slope);
        }
        let [below, above] = sides.map(|friction| friction.limit);
        if below != above {
            sum.add_line(0.5 * (below - above) * to_impulse, 0.0);
        }
        if below + above > 0.0 {
            sum.add_jump(0.0, 0.5 * (below + above) * to_impulse);
        }
        // Motors act within their largest force.
        match self.motor {
            None => {}
            Some(Motor::Speed { target, max_force }) => {
                sum.add_jump(target * length, max_force * to_impulse);
            }
            Some(Motor::Position { target, stiffness, damping, max_force }) => {
                let (slope, at_zero) = pull(stiffness, damping, target);
                sum.add_ramp(at_zero, slope, max_force * to_impulse);
            }
            Some(Motor::Damper { target, damping, max_force }) => {
                let (slope, at_zero) = pull(0.0, damping, 0.0);
                sum.add_ramp(
                    at_zero + damping * target * to_impulse,
                    slope,
                    max_force * to_impulse,
                );
            }
        }
        sum
    }

    /// True if the axis bounces off a stop in a step of `time_step` (s) from `start`.
    pub(crate) fn bounces(&self, start: &AxisStart, time_step: f64) -> bool {
        let stops = self.stops(start, time_step, 1.0);
        stops.is_some_and(|stops| stops.map(|(_, limit)| limit) != [Some(0), Some(1)])
    }

    /// Drive of an interval whose drive changed from `before`: forces, targets and force limits act with
    /// `share` of the present value and the rest of the one before. A target speed acts at once.
    pub(crate) fn after(self, before: &Self, share: f64) -> Self {
        let mean = |now: f64, before: f64| now * share + before * (1.0 - share);
        let motor = match (self.motor, before.motor) {
            (
                Some(Motor::Position { target, stiffness, damping, max_force }),
                Some(Motor::Position { target: past, stiffness: k, damping: d, max_force: most }),
            ) if [k, d] == [stiffness, damping] => Some(Motor::Position {
                target: mean(target, past),
                stiffness,
                damping,
                max_force: mean(max_force, most),
            }),
            (
                Some(Motor::Damper { target, damping, max_force }),
                Some(Motor::Damper { target: past, damping: d, max_force: most }),
            ) if d == damping => Some(Motor::Damper {
                target: mean(target, past),
                damping,
                max_force: mean(max_force, most),
            }),
            (motor, _) => motor,
        };
        Self { force: mean(self.force, before.force), motor, ..self }
    }

    /// True if it has neither forces nor limits.
    fn is_idle(&self) -> bool {
        let Self { restitution, friction, stiffness, rest, damping, force, armature, .. } = *self;
        let has_options = self.limits.is_some()
            || self.static_friction.is_some()
            || self.friction_curve.is_some()
            || self.motor.is_some();
        let numbers = [restitution, friction, stiffness, rest, damping, force, armature];
        !has_options && numbers == [0.0; 7]
    }

    /// True if it has dry friction.
    pub(crate) fn rubs(&self) -> bool {
        self.friction.max(self.holding_friction()) > 0.0
    }

    fn check(&self) -> Result<(), Error> {
        const MOST: f64 = 1e12;
        for (field, value) in [
            ("friction of a joint", self.friction),
            ("stiffness of a joint", self.stiffness),
            ("damping of a joint", self.damping),
            ("armature of a joint", self.armature),
        ] {
            in_range(field, value, 0.0, MOST, "0 to 1e12")?;
        }
        in_range("restitution of a joint", self.restitution, 0.0, 1.0, "0 to 1")?;
        if self.static_friction.is_some() && self.friction_curve.is_some() {
            return Err(Error::Unsupported {
                what: "static friction of a joint with a friction curve",
                why: "the curve has the friction at rest as its first point",
            });
        }
        if let Some(friction) = self.static_friction {
            let allowed = "the friction of the joint to 1e12";
            in_range("static friction of a joint", friction, self.friction, MOST, allowed)?;
        }
        for (field, value) in [("rest of a joint", self.rest), ("force of a joint", self.force)] {
            in_range(field, value, -MOST, MOST, "-1e12 to 1e12")?;
        }
        if let Some([low, high]) = self.limits {
            in_range("lower limit of a joint", low, -MOST, MOST, "-1e12 to 1e12")?;
            in_range("upper limit of a joint", high, low, MOST, "the lower limit to 1e12")?;
        }
        let Some(motor) = self.motor else { return Ok(()) };
        let (field, target, gains, force) = match motor {
            Motor::Speed { target, max_force } => ("speed of a motor", target, [0.0; 2], max_force),
            Motor::Position { target, stiffness, damping, max_force } => {
                ("position of a motor", target, [stiffness, damping], max_force)
            }
            Motor::Damper { target, damping, max_force } => {
                ("speed of a motor", target, [0.0, damping], max_force)
            }
        };
        in_range(field, target, -1e6, 1e6, "-1e6 to 1e6")?;
        for (field, value) in [
            ("stiffness of a motor", gains[0]),
            ("damping of a motor", gains[1]),
            ("largest force of a motor (max_force)", force),
        ] {
            in_range(field, value, 0.0, MOST, "0 to 1e12")?;
        }
        Ok(())
    }
}

/// State of a joint axis at the start of a step.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct AxisStart {
    /// Coordinate x_k (m or rad).
    pub(crate) coordinate: f64,
    /// Rate (x_k − x_{k−1})/h (m/s or rad/s), if the [joint needs it](super::Joint::needs_rates).
    pub(crate) rate: f64,
    /// Rate before an impact (m/s or rad/s): with the fall that velocities lack (eq. 37).
    pub(crate) arrival: f64,
    /// Rate up to which the axis does not bounce off its stops (m/s or rad/s).
    pub(crate) rebound_rate: f64,
    /// Largest change of the rate by gravity in the step (m/s or rad/s).
    pub(crate) fall: f64,
    /// Inverse inertia of both bodies along or about the axis (1/kg or 1/(kg m²)).
    pub(crate) inverse_inertia: f64,
    /// True if springs and dampers may act at the [middle](Pull).
    pub(crate) is_middle: bool,
    /// Mean of the time-dependent load over the step (N or N m).
    pub(crate) push: f64,
    /// Time over which the forces of the drive act, in lengths of the step (eq. 37).
    pub(crate) kick: f64,
}

impl Default for AxisStart {
    fn default() -> Self {
        Self {
            coordinate: 0.0,
            rate: 0.0,
            arrival: 0.0,
            rebound_rate: 0.0,
            fall: 0.0,
            inverse_inertia: 0.0,
            is_middle: false,
            push: 0.0,
            kick: 1.0,
        }
    }
}

/// Time at which a spring and a damper of a step act:
///
/// ```text
/// f = k (x* − x − h σ ẋ⁺ + h σ' ẋ⁻) − d (τ ẋ⁺ + τ' ẋ⁻)
/// ```
///
/// At the end of the step, as in the implicit Euler method, σ = τ = 1 and σ' = τ' = 0. With
/// [`Integrator::Leapfrog`](crate::world::Integrator::Leapfrog), forces of a step act at its start,
/// the middle between the velocities ẋ⁻ and ẋ⁺. Then σ = σ' = ¼ and τ = τ' = ½: x is the mean of
/// (x_{k−1} + x_k)/2 and (x_k + x_{k+1})/2, of second order and stable for any stiffness. Stiff springs
/// and dampers act at the end, which damps their vibration.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Pull {
    /// σ and τ.
    pub after: [f64; 2],
    /// σ' and τ'.
    pub before: [f64; 2],
}

impl Pull {
    /// Largest (k h + d) h/I of springs and dampers at the middle, with the inertia I of both bodies
    /// about the axis. Without a damper it is (h ω)².
    const STIFF: f64 = 0.25;

    /// Time at which a spring of `stiffness` with `damping` acts on the axis at `start`, in a step of
    /// `time_step` (s).
    pub(super) fn new(start: &AxisStart, stiffness: f64, damping: f64, time_step: f64) -> Self {
        let is_soft = || {
            let kick = time_step * start.kick;
            (stiffness * time_step + damping) * kick * start.inverse_inertia <= Self::STIFF
        };
        if start.is_middle && is_soft() {
            Self { after: [0.25, 0.5], before: [0.25, 0.5] }
        } else {
            Self { after: [1.0, 1.0], before: [0.0, 0.0] }
        }
    }
}

impl Axis {
    /// True if it has a spring or a damper, of its own or of a motor.
    pub(crate) fn pulls(&self) -> bool {
        matches!(self, Self::Free(drive) if drive.stiffness > 0.0 || drive.damping > 0.0
            || matches!(drive.motor, Some(Motor::Position { .. } | Motor::Damper { .. })))
    }

    /// Swing axis of a ball joint with the cone angle `largest` (rad).
    pub(super) fn cone(largest: f64) -> Self {
        Self::Free(Drive { limits: Some([0.0, largest]), ..Drive::NONE })
    }

    /// True if its law depends on the rate before the step.
    pub(super) fn needs_rate(&self) -> bool {
        let needs = |drive: &Drive| {
            let Drive { armature, restitution, static_friction, friction_curve, .. } = drive;
            *armature > 0.0
                || *restitution > 0.0
                || static_friction.is_some()
                || friction_curve.is_some()
        };
        matches!(self, Self::Free(drive) if needs(drive))
    }

    /// True if its forces can do work. Stops, dry friction and damping only take energy.
    fn is_active(&self) -> bool {
        let passive = |drive: &Drive| {
            let Drive { stiffness, force, armature, motor, .. } = drive;
            motor.is_none() && [*stiffness, *force, *armature] == [0.0; 3]
        };
        matches!(self, Self::Free(drive) if !passive(drive))
    }

    /// Flags of three axes whose forces, with the time-dependent `push`, can do work.
    pub(crate) fn active(axes: &[Self; 3], push: &Vector3<f64>) -> [bool; 3] {
        [0, 1, 2].map(|k| axes[k].is_active() || push[k] != 0.0)
    }

    /// Axis with the same limits and no force.
    pub(super) fn without_drive(&self) -> Self {
        match self {
            Self::Locked => Self::Locked,
            Self::Free(drive) => Self::Free(Drive { limits: drive.limits, ..Drive::NONE }),
        }
    }

    /// Range of the coordinate, if limited.
    pub(super) fn limits(&self) -> Option<[f64; 2]> {
        match self {
            Self::Locked => None,
            Self::Free(drive) => drive.limits,
        }
    }

    /// True if the axis is free without any drive.
    pub(crate) fn is_idle(&self) -> bool {
        matches!(self, Self::Free(drive) if drive.is_idle())
    }

    pub(super) fn check(&self) -> Result<(), Error> {
        match self {
            Self::Locked => Ok(()),
            Self::Free(drive) => drive.check(),
        }
    }

    /// Force law of the axis in a step of `time_step` (s) that starts at `start`.
    ///
    /// The law relates the scaled speed u = `length` × (change of the coordinate)/h to the impulse
    /// p = h f/(`unit` `length`). For a locked axis it is u = 0; [`Axis::offset`] adds its position
    /// error.
    pub(crate) fn graph(&self, start: &AxisStart, time_step: f64, length: f64, unit: f64) -> Graph {
        let Self::Free(drive) = self else { return Graph::locked() };
        if self.is_idle() && start.push == 0.0 {
            return Graph::free();
        }
        let mut sum = drive.forces(start, time_step, length, unit);
        // Stops: u between the speeds that reach the limits in the step, or leave them after an impact.
        if let Some([(low, _), (high, _)]) = drive.stops(start, time_step, length) {
            sum.add_stops(low, high);
        }
        sum.graph()
    }

    /// Distance of the step from a change between bouncing and not bouncing (m/s), as
    /// [`Contact::bounce_margin`](crate::contact::Contact::bounce_margin).
    pub(crate) fn bounce_margin(&self, start: &AxisStart, time_step: f64, length: f64) -> f64 {
        let Self::Free(drive @ Drive { limits: Some(limits), .. }) = self else {
            return f64::INFINITY;
        };
        let stops = limits.map(|limit| length * (limit - start.coordinate) / time_step);
        let [faster, closer] = drive.approach(stops, start, time_step, length);
        match faster.min(closer) {
            least if least > 0.0 => least,
            _ => (-faster).max(-closer),
        }
    }

    /// Share of dry friction in its limit, −1 to 1, with the `force` of a step in which the axis rests (N or N m), and
    /// the limit (N or N m); `None` at a stop or without dry friction.
    pub(crate) fn at_rest(
        &self,
        start: &AxisStart,
        time_step: f64,
        force: f64,
    ) -> Option<(f64, f64)> {
        let [high, low] = self.graph(start, time_step, 1.0, 1.0).jump_at_zero()?;
        let most = 0.5 * (high - low);
        let share = (force * time_step - 0.5 * (high + low)) / most;
        Some((share.clamp(-1.0, 1.0), most / time_step))
    }

    /// Force law of a free axis as in [`Axis::graph`]; `None` if the axis is locked.
    pub(crate) fn free_graph(
        &self,
        start: &AxisStart,
        time_step: f64,
        length: f64,
        unit: f64,
    ) -> Option<Graph> {
        matches!(self, Self::Free(_)).then(|| self.graph(start, time_step, length, unit))
    }

    /// Position error of a locked axis at the start of the step, divided by h.
    pub(crate) fn offset(&self, coordinate: f64, time_step: f64) -> f64 {
        match self {
            Self::Locked => coordinate / time_step,
            Self::Free(_) => 0.0,
        }
    }
}
