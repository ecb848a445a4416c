//! Motor tables and their conversion to the model.

use serde::{Deserialize, Serialize};
use tumble_core::joint::Motor;
use tumble_model::joint::JointKind;

#[derive(Debug, Clone, Serialize, Deserialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
#[serde(
    deny_unknown_fields,
    expecting = "{ joint = \"…\", speed = …, max_force = … } or { joint = \"…\", position = …, \
                 stiffness = …, … }"
)]
pub struct MotorEntry {
    /// Name of the joint.
    pub joint: String,
    /// Axis of a joint with several.
    axis: Option<String>,
    /// Target speed (m/s or rad/s).
    speed: Option<f64>,
    /// Target coordinate (m or rad).
    position: Option<f64>,
    /// Stiffness towards the target coordinate (N/m or N m/rad).
    stiffness: Option<f64>,
    /// Damping (N s/m or N m s/rad).
    damping: Option<f64>,
    /// Largest force or torque (N or N m); for a joint of a robot file the default is that of the file.
    max_force: Option<f64>,
}

impl MotorEntry {
    /// Name of the joint as an addition to error messages.
    pub fn error_suffix(&self) -> String {
        format!(" ({})", self.joint)
    }

    /// Entry of `motor` on an axis of a joint; without a name, on the only one.
    pub fn exact(joint: &str, axis: Option<&str>, motor: &Motor) -> Self {
        let MotorFields { speed, position, stiffness, damping, max_force } = motor.into();
        let (joint, axis) = (joint.to_owned(), axis.map(str::to_owned));
        Self { joint, axis, speed, position, stiffness, damping, max_force: Some(max_force) }
    }

    /// This entry for the joint `name`, with the force limit `effort` (N or N m) of its file unless it has
    /// its own.
    pub fn on(&self, name: &str, effort: Option<f64>) -> Self {
        let max_force = self.max_force.or(effort);
        Self { joint: name.to_owned(), max_force, ..self.clone() }
    }

    /// Motor in the form of the core.
    pub fn motor(&self) -> Result<Motor, String> {
        let Self { speed, position, stiffness, damping, .. } = *self;
        let max_force =
            self.max_force.ok_or("max_force: required; the joint has no limit in a file")?;
        MotorFields { speed, position, stiffness, damping, max_force }.motor()
    }

    /// Index of the motor's drive in the joint `name` of this kind.
    pub fn place(&self, kind: JointKind, name: &str) -> Result<usize, String> {
        if kind.driven().is_empty() {
            return Err(format!(
                "joint: {name:?} is {}; a motor needs a joint that turns about an axis or slides along \
                 one",
                kind.name()
            ));
        }
        kind.driven_place(name, self.axis.as_deref()).map_err(|why| format!("axis: {why}"))
    }
}

/// Control law of a motor, on any axis.
#[derive(Debug, Clone, Serialize, Deserialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
#[serde(
    deny_unknown_fields,
    expecting = "{ speed = …, max_force = … } or { position = …, stiffness = …, max_force = … }"
)]
pub struct MotorFields {
    /// Target speed (m/s or rad/s).
    speed: Option<f64>,
    /// Target coordinate (m or rad).
    position: Option<f64>,
    /// Stiffness towards the target coordinate (N/m or N m/rad).
    stiffness: Option<f64>,
    /// Damping (N s/m or N m s/rad).
    damping: Option<f64>,
    /// Largest force or torque (N or N m).
    max_force: f64,
}

impl MotorFields {
    /// Motor in the form of the core.
    pub fn motor(&self) -> Result<Motor, String> {
        let max_force = self.max_force;
        match (self.speed, self.position) {
            (Some(_), Some(_)) => {
                Err("speed: only one of `speed` and `position` can be given".to_owned())
            }
            (None, None) => Err("speed: `speed` or `position` is needed".to_owned()),
            (Some(target), None) => {
                if self.stiffness.is_some() {
                    return Err("stiffness has no meaning with `speed`; leave it out".to_owned());
                }
                Ok(match self.damping {
                    None => Motor::Speed { target, max_force },
                    Some(damping) => Motor::Damper { target, damping, max_force },
                })
            }
            (None, Some(target)) => {
                let Some(stiffness) = self.stiffness else {
                    return Err("stiffness: required with `position`".to_owned());
                };
                let damping = self.damping.unwrap_or(0.0);
                Ok(Motor::Position { target, stiffness, damping, max_force })
            }
        }
    }
}

impl From<&Motor> for MotorFields {
    fn from(motor: &Motor) -> Self {
        let (speed, position, stiffness, damping, max_force) = match *motor {
            Motor::Speed { target, max_force } => (Some(target), None, None, None, max_force),
            Motor::Damper { target, damping, max_force } => {
                (Some(target), None, None, Some(damping), max_force)
            }
            Motor::Position { target, stiffness, damping, max_force } => {
                (None, Some(target), Some(stiffness), Some(damping), max_force)
            }
        };
        Self { speed, position, stiffness, damping, max_force }
    }
}
