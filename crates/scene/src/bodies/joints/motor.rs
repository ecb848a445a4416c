//! Motor tables and their conversion to the model.

use serde::Deserialize;
use tumble_core::joint::Motor;
use tumble_model::joint::JointModel;

#[derive(Deserialize)]
#[serde(
    deny_unknown_fields,
    expecting = "{ joint = \"…\", speed = …, max_force = … } or { joint = \"…\", position = …, \
                 stiffness = …, … }"
)]
pub struct MotorEntry {
    pub(super) joint: String,
    pub(super) axis: Option<String>,
    pub(super) speed: Option<f64>,
    pub(super) position: Option<f64>,
    pub(super) stiffness: Option<f64>,
    pub(super) damping: Option<f64>,
    pub(super) max_force: f64,
}

impl MotorEntry {
    /// Name of the joint as an addition to error messages.
    pub fn error_suffix(&self) -> String {
        format!(" ({})", self.joint)
    }

    pub(super) fn motor(&self) -> Result<Motor, String> {
        let Self { speed, position, stiffness, damping, max_force, .. } = *self;
        MotorFields { speed, position, stiffness, damping, max_force }.motor()
    }

    /// Index of the motor's drive in the joint.
    pub(super) fn place(&self, joint: &JointModel) -> Result<usize, String> {
        if joint.kind.driven().is_empty() {
            return Err(format!(
                "joint: {:?} is {}; a motor needs a joint that turns about an axis or slides along \
                 one",
                joint.name,
                joint.kind.name()
            ));
        }
        joint.driven_place(self.axis.as_deref()).map_err(|why| format!("axis: {why}"))
    }
}

/// Control law of a motor, on any axis.
#[derive(Deserialize)]
#[serde(
    deny_unknown_fields,
    expecting = "{ speed = …, max_force = … } or { position = …, stiffness = …, max_force = … }"
)]
pub struct MotorFields {
    speed: Option<f64>,
    position: Option<f64>,
    stiffness: Option<f64>,
    damping: Option<f64>,
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
