//! Tables `[[gears]]` and their conversion to the model.

use super::joints::{DriveEntry, MotorFields};
use serde::{Deserialize, Serialize};
use tumble_core::joint::{Drive, Gear, GearAxis};
use tumble_model::joint::JointKind;

/// Maximum number of gears of a scene.
pub const MOST_GEARS: usize = 10_000;

#[derive(Debug, Clone, Serialize, Deserialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
#[serde(deny_unknown_fields, expecting = "{ joints = [\"…\", \"…\"], ratio = …, … }")]
pub struct GearEntry {
    /// Names of the follower and of the leader.
    pub joints: Vec<String>,
    /// Axis of each joint.
    axes: Option<Vec<String>>,
    /// Ratio of the coordinates.
    ratio: Option<f64>,
    /// Offset of the first coordinate (m or rad).
    offset: Option<f64>,
    /// Force on the relation instead of the exact one.
    drive: Option<DriveEntry>,
    /// Motor on the relation.
    motor: Option<MotorFields>,
}

impl GearEntry {
    /// Names of the joints as an addition to error messages.
    pub fn error_suffix(&self) -> String {
        format!(" ({})", self.joints.join(", "))
    }

    /// Entry in exact form between the `joints` with these names and axes.
    pub fn exact(joints: [&str; 2], axes: [&str; 2], gear: &Gear) -> Self {
        let drive = gear.drive();
        Self {
            joints: joints.map(str::to_owned).to_vec(),
            axes: Some(axes.map(str::to_owned).to_vec()),
            ratio: Some(gear.ratio()),
            offset: Some(gear.offset()),
            drive: drive.map(DriveEntry::from),
            motor: drive.and_then(|drive| drive.motor).as_ref().map(MotorFields::from),
        }
    }

    /// Gear between two joints. `find` returns the index, the type and the name of a joint.
    pub fn gear(
        &self,
        find: impl Fn(&str) -> Result<(usize, JointKind, String), String>,
    ) -> Result<Gear, String> {
        let [first, second] = &self.joints[..] else {
            return Err("joints: two names are needed, first the joint that follows".to_owned());
        };
        let axes = match self.axes.as_deref() {
            None => [None, None],
            Some([first, second]) => [Some(first.as_str()), Some(second.as_str())],
            Some(_) => return Err("axes: one axis per joint is needed".to_owned()),
        };
        let found = |name: &String, axis: Option<&str>| {
            let (joint, kind, name) = find(name).map_err(|why| format!("joints: {why}"))?;
            let axis = kind.driven_axis(&name, axis).map_err(|why| {
                format!("axes: {why}; a gear needs one axis that turns or slides")
            })?;
            Ok::<_, String>((joint, axis))
        };
        let (first, second) = (found(first, axes[0])?, found(second, axes[1])?);
        let [first, second] = [first, second].map(|(joint, axis)| GearAxis::new(joint, axis));
        let (ratio, offset) = (self.ratio.unwrap_or(1.0), self.offset.unwrap_or(0.0));
        let gear = Gear::new(first, second, ratio, offset);
        Ok(self.drive()?.map_or(gear, |drive| gear.with_drive(drive)))
    }

    /// Drive of a gear without a rigid constraint.
    fn drive(&self) -> Result<Option<Drive>, String> {
        if self.drive.is_some_and(|drive| drive.start.is_some()) {
            return Err(
                "drive.start: it follows from the positions of the joints; leave it out".to_owned()
            );
        }
        let motor = self.motor.as_ref().map(MotorFields::motor).transpose();
        let motor = motor.map_err(|why| format!("motor.{why}"))?;
        let drive = self.drive.as_ref().map(DriveEntry::drive);
        let driven = drive.or(motor.map(|_| Drive::NONE));
        Ok(driven.map(|drive| Drive { motor, ..drive }))
    }
}
