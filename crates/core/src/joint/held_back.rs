//! Joints and gears of an interval that removes only a share of their errors.
//!
//! A problem moves a locked axis from its error ε at the start to 0, with the speed ε/h. In an interval
//! shorter than the usual length, the frames of its joints are moved by what is left:
//!
//! ```text
//! ε⁺ = (1 − s) ε                                                         (eq. 41a)
//! ```
//!
//! Limits that are passed move in the same way, and so does the offset of a gear.

use super::{Axis, Drive, Gear, Joint, JointFrame, TurnKind};
use crate::mechanics::State;
use crate::mechanics::quaternion::{product, rotation};
use nalgebra::{Vector3, Vector4};

/// Frames, limits and offsets before they were moved.
#[derive(Debug, Clone)]
pub(crate) struct HeldBack {
    joints: Vec<(JointFrame, [Axis; 3], [Axis; 3])>,
    gears: Vec<(f64, Axis)>,
}

impl HeldBack {
    /// Moves the frames, limits and offsets of `joints` and `gears` for an interval from `states` that
    /// removes the `share` of errors. `angles` are those of the joints (rad).
    pub fn new(
        joints: &mut [Joint],
        gears: &mut [Gear],
        states: &[State],
        angles: &[Vector3<f64>],
        share: f64,
    ) -> Self {
        let before = |joint: &Joint| (joint.frames[1], joint.linear, joint.angular);
        let of_gear = |gear: &Gear| (gear.offset, gear.law);
        let kept = Self {
            joints: joints.iter().map(before).collect(),
            gears: gears.iter().map(of_gear).collect(),
        };
        for gear in &mut *gears {
            let off = (1.0 - share) * gear.error(joints, states, angles);
            match &mut gear.law {
                Axis::Locked => gear.offset += off,
                Axis::Free(drive) => move_limits(drive, off),
            }
        }
        for (joint, angles) in joints.iter_mut().zip(angles) {
            joint.hold_back(states, angles, 1.0 - share);
        }
        kept
    }

    /// Moves everything back, but frames that follow a prescribed motion.
    pub fn release(self, joints: &mut [Joint], gears: &mut [Gear]) {
        for (joint, (frame, linear, angular)) in joints.iter_mut().zip(self.joints) {
            if !joint.moves {
                joint.frames[1] = frame;
            }
            (joint.linear, joint.angular) = (linear, angular);
        }
        for (gear, (offset, law)) in gears.iter_mut().zip(self.gears) {
            (gear.offset, gear.law) = (offset, law);
        }
    }
}

/// Moves the limit that is passed by `off`, which is negative below the lower one.
fn move_limits(drive: &mut Drive, off: f64) {
    if let Some([low, high]) = &mut drive.limits {
        (*low, *high) = (*low + off.min(0.0), *high + off.max(0.0));
    }
}

impl Joint {
    /// Moves the frame of B and the limits by the share `left` of the errors at `states`.
    fn hold_back(&mut self, states: &[State], angles: &Vector3<f64>, left: f64) {
        let Some(at) = self.coordinates(states) else { return };
        let coordinates = [at.place, *angles];
        for (axes, values) in [&mut self.linear, &mut self.angular].into_iter().zip(coordinates) {
            for (axis, value) in axes.iter_mut().zip(&values) {
                if let Axis::Free(drive) = axis
                    && let Some([low, high]) = drive.limits
                {
                    move_limits(drive, left * (value - value.clamp(low, high)));
                }
            }
        }
        if self.moves {
            return;
        }
        let turn = rotation(&at.turn);
        // Rotations of B by which the errors vanish, to first order, in its frame.
        let by = match self.turning() {
            TurnKind::Locked => self.turns(&at, angles),
            TurnKind::Hinge => Vector3::z().cross(&turn.column(2)),
            TurnKind::Universal => {
                let x = turn.column(0);
                -x.y * Vector3::y().cross(&x)
            }
            TurnKind::Free | TurnKind::Driven | TurnKind::Ball | TurnKind::Gimbal => {
                Vector3::zeros()
            }
        };
        let [x, y, z]: [f64; 3] = (0.5 * left * by).into();
        let frame = &mut self.frames[1];
        frame.attitude = product(&frame.attitude, &Vector4::new(1.0, x, y, z)).normalize();
        // The anchor follows in the turned frame, in which a slide has other coordinates.
        let Some(turned) = self.coordinates(states) else { return };
        let linear = &self.linear;
        let locked = |k: usize| if linear[k] == Axis::Locked { 1.0 } else { 0.0 };
        let off =
            Vector3::from_fn(|k, _| locked(k) * (turned.place[k] - (1.0 - left) * at.place[k]));
        let frame = &mut self.frames[1];
        frame.anchor += rotation(&frame.attitude) * off;
    }
}

#[cfg(test)]
#[path = "tests/held_back.rs"]
mod tests;
