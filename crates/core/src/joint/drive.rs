//! What acts on an axis of a joint that is not locked.

use super::graph::{ForceSum, Graph};
use crate::error::{Error, in_range};

/// One of the six axes of a joint.
#[derive(Debug, Clone, Copy, PartialEq)]
#[cfg_attr(feature = "save", derive(serde::Serialize, serde::Deserialize))]
pub enum Axis {
    /// Its coordinate is zero.
    Locked,
    /// It moves, under a drive.
    Free(Drive),
}

/// What acts along a free axis, at any rate: the sum of all of these. Lengths in m and forces in N along
/// an axis, rad and N m about one.
#[derive(Debug, Clone, Copy, PartialEq)]
#[cfg_attr(any(feature = "save", feature = "serde"), derive(serde::Serialize, serde::Deserialize))]
#[cfg_attr(any(feature = "save", feature = "serde"), serde(default))]
pub struct Drive {
    /// The range of the coordinate. Its ends are hard stops without a bounce.
    pub limits: Option<[f64; 2]>,
    /// Dry friction: it holds up to this force, and takes as much where the axis moves.
    pub friction: f64,
    /// k of a spring towards `rest`, N/m or N m/rad.
    pub stiffness: f64,
    /// The coordinate at which the spring is slack.
    pub rest: f64,
    /// Viscous damping, N s/m or N m s/rad.
    pub damping: f64,
    /// A force in the direction of the axis, on A.
    pub force: f64,
    /// The inertia of what turns with a motor, at the axis, kg or kg m²: it resists changes of the
    /// axis' speed alone.
    pub armature: f64,
    /// A motor.
    pub motor: Option<Motor>,
}

/// A motor on an axis, with all the force that it has.
#[derive(Debug, Clone, Copy, PartialEq)]
#[cfg_attr(any(feature = "save", feature = "serde"), derive(serde::Serialize, serde::Deserialize))]
#[cfg_attr(any(feature = "save", feature = "serde"), serde(rename_all = "lowercase"))]
pub enum Motor {
    /// It holds a speed, m/s or rad/s, with up to this force.
    Speed {
        /// The speed that it holds.
        target: f64,
        /// N or N m.
        most: f64,
    },
    /// It pulls to a coordinate with a stiffness and a damping, with up to this force.
    Position {
        /// The coordinate that it pulls to.
        target: f64,
        /// N/m or N m/rad.
        stiffness: f64,
        /// N s/m or N m s/rad.
        damping: f64,
        /// N or N m.
        most: f64,
    },
    /// It pulls to a speed with a damping, with up to this force.
    Damper {
        /// The speed that it pulls to, m/s or rad/s.
        target: f64,
        /// N s/m or N m s/rad.
        damping: f64,
        /// N or N m.
        most: f64,
    },
}

impl Motor {
    /// The same with another target, m/s and rad/s, or m and rad.
    #[must_use]
    pub fn to(self, target: f64) -> Self {
        match self {
            Self::Speed { most, .. } => Self::Speed { target, most },
            Self::Position { stiffness, damping, most, .. } => {
                Self::Position { target, stiffness, damping, most }
            }
            Self::Damper { damping, most, .. } => Self::Damper { target, damping, most },
        }
    }
}

impl Default for Drive {
    fn default() -> Self {
        Self::NONE
    }
}

impl Drive {
    /// Nothing.
    pub const NONE: Self = Self {
        limits: None,
        friction: 0.0,
        stiffness: 0.0,
        rest: 0.0,
        damping: 0.0,
        force: 0.0,
        armature: 0.0,
        motor: None,
    };

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
        for (field, value) in [("rest of a joint", self.rest), ("force of a joint", self.force)] {
            in_range(field, value, -MOST, MOST, "-1e12 to 1e12")?;
        }
        if let Some([low, high]) = self.limits {
            in_range("lower limit of a joint", low, -MOST, MOST, "-1e12 to 1e12")?;
            in_range("upper limit of a joint", high, low, MOST, "the lower limit to 1e12")?;
        }
        match self.motor {
            None => {}
            Some(Motor::Speed { target, most }) => {
                in_range("speed of a motor", target, -1e6, 1e6, "-1e6 to 1e6")?;
                in_range("most force of a motor", most, 0.0, MOST, "0 to 1e12")?;
            }
            Some(Motor::Position { target, stiffness, damping, most }) => {
                in_range("position of a motor", target, -1e6, 1e6, "-1e6 to 1e6")?;
                in_range("stiffness of a motor", stiffness, 0.0, MOST, "0 to 1e12")?;
                in_range("damping of a motor", damping, 0.0, MOST, "0 to 1e12")?;
                in_range("most force of a motor", most, 0.0, MOST, "0 to 1e12")?;
            }
            Some(Motor::Damper { target, damping, most }) => {
                in_range("speed of a motor", target, -1e6, 1e6, "-1e6 to 1e6")?;
                in_range("damping of a motor", damping, 0.0, MOST, "0 to 1e12")?;
                in_range("most force of a motor", most, 0.0, MOST, "0 to 1e12")?;
            }
        }
        Ok(())
    }
}

/// One axis of a joint at the start of a step.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub(crate) struct AxisStart {
    /// x_k, m or rad.
    pub(crate) coordinate: f64,
    /// (x_k − x_{k−1})/h, m/s or rad/s, where an armature asks for it.
    pub(crate) rate: f64,
    /// The mean of what pushes over time, N or N m.
    pub(crate) push: f64,
}

impl Axis {
    /// That of the swing of a ball joint which stays within `most` (rad).
    pub(super) fn cone(most: f64) -> Self {
        Self::Free(Drive { limits: Some([0.0, most]), ..Drive::NONE })
    }

    /// Whether it has an armature.
    pub(crate) fn has_armature(&self) -> bool {
        matches!(self, Self::Free(drive) if drive.armature > 0.0)
    }

    /// The range of its coordinate, if it has one.
    pub(super) fn limits(&self) -> Option<[f64; 2]> {
        match self {
            Self::Locked => None,
            Self::Free(drive) => drive.limits,
        }
    }

    /// Whether nothing is said of it.
    pub(crate) fn is_idle(&self) -> bool {
        *self == Self::Free(Drive::NONE)
    }

    pub(super) fn check(&self) -> Result<(), Error> {
        match self {
            Self::Locked => Ok(()),
            Self::Free(drive) => drive.check(),
        }
    }

    /// The law of the axis in a step of `time_step` (s) that begins at `start`, in the
    /// scaled row u = `length` × (change of the coordinate)/h and the impulse p = h f/(`unit` `length`):
    /// what is locked is to make its coordinate zero, which [`Axis::offset`] is for.
    pub(crate) fn graph(&self, start: &AxisStart, time_step: f64, length: f64, unit: f64) -> Graph {
        let Self::Free(drive) = self else { return Graph::locked() };
        if self.is_idle() && start.push == 0.0 {
            return Graph::free();
        }
        let coordinate = start.coordinate;
        // Of a torque, over the length.
        let to_impulse = time_step / (unit * length);
        let speed_at = |target: f64| length * (target - coordinate) / time_step;
        let mut sum = ForceSum::constant((drive.force + start.push) * to_impulse);
        // f = −k (x + h ẋ − rest) − d ẋ, with ẋ = u/length.
        let pull = |stiffness: f64, damping: f64, target: f64| {
            let slope = (stiffness * time_step + damping) * to_impulse / length;
            (slope, stiffness * (target - coordinate) * to_impulse)
        };
        let (slope, at_zero) = pull(drive.stiffness, drive.damping, drive.rest);
        sum.add_line(at_zero, slope);
        if drive.armature > 0.0 {
            // f = −I ((x⁺ − x_k) − (x_k − x_{k−1}))/h²                            (J8)
            let inertia = drive.armature / time_step * to_impulse;
            sum.add_line(inertia * start.rate, inertia / length);
        }
        if drive.friction > 0.0 {
            sum.add_jump(0.0, drive.friction * to_impulse);
        }
        match drive.motor {
            None => {}
            Some(Motor::Speed { target, most }) => {
                sum.add_jump(target * length, most * to_impulse);
            }
            Some(Motor::Position { target, stiffness, damping, most }) => {
                let (slope, at_zero) = pull(stiffness, damping, target);
                sum.add_ramp(at_zero, slope, most * to_impulse);
            }
            Some(Motor::Damper { target, damping, most }) => {
                let slope = damping * to_impulse / length;
                sum.add_ramp(damping * target * to_impulse, slope, most * to_impulse);
            }
        }
        if let Some([low, high]) = drive.limits {
            sum.add_stops(speed_at(low), speed_at(high));
        }
        sum.graph()
    }

    /// The same of an axis that is free; `None` of one that is locked.
    pub(crate) fn free_graph(
        &self,
        start: &AxisStart,
        time_step: f64,
        length: f64,
        unit: f64,
    ) -> Option<Graph> {
        matches!(self, Self::Free(_)).then(|| self.graph(start, time_step, length, unit))
    }

    /// What the row of a locked axis is off by at the step's start, over h.
    pub(crate) fn offset(&self, coordinate: f64, time_step: f64) -> f64 {
        match self {
            Self::Locked => coordinate / time_step,
            Self::Free(_) => 0.0,
        }
    }
}
