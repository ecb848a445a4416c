//! Gears as run.json has them.

use serde::{Deserialize, Serialize};
use tumble_core::joint::{Drive, Gear, GearAxis, JointAxis};

/// A gear of the model: the coordinate of the first joint is `ratio` times that of the second and `offset`, or a drive acts on
/// what it is more than that.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct GearModel {
    /// Indices of `joints`.
    pub joints: [usize; 2],
    /// Of each the axis: 0, 1, 2 along x, y, z and 3, 4, 5 about them.
    pub axes: [usize; 2],
    /// In the unit of the first coordinate over that of the second.
    pub ratio: f64,
    /// m or rad.
    pub offset: f64,
    /// What acts in place of the tie, in the units of the first coordinate.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub drive: Option<Drive>,
}

impl GearModel {
    /// The gear.
    #[must_use]
    pub fn gear(&self) -> Gear {
        let axis = |k: usize| GearAxis {
            joint: self.joints[k],
            axis: match self.axes[k] {
                axis @ 0..3 => JointAxis::Linear(axis),
                axis => JointAxis::Angular(axis - 3),
            },
        };
        let gear = Gear::new(axis(0), axis(1), self.ratio, self.offset);
        self.drive.map_or(gear, |drive| gear.with_drive(drive))
    }
}
