//! Gears between joints of a model.

use tumble_core::joint::{Drive, Gear, GearAxis, JointAxis};

/// Gear between two joint coordinates: q₀ = r q₁ + c with `ratio` r and `offset` c.
///
/// With a `drive` the equation is not a constraint: the drive acts on q₀ − r q₁ − c.
#[derive(Debug, Clone, PartialEq)]
pub struct GearModel {
    /// Indices into `joints`.
    pub joints: [usize; 2],
    /// Axis of each joint: 0, 1, 2 are translations along x, y, z; 3, 4, 5 are rotations about
    /// them.
    pub axes: [usize; 2],
    /// Ratio r, unit of the first coordinate per unit of the second.
    pub ratio: f64,
    /// Offset c (m or rad, unit of the first coordinate).
    pub offset: f64,
    /// Drive that replaces the constraint, in the units of the first coordinate.
    pub drive: Option<Drive>,
}

impl GearModel {
    /// Gear in the form of the core.
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
