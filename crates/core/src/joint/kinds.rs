//! The joints that there are by name.

use super::{Axis, Drive, Joint, JointFrame, Middle};
use nalgebra::Vector3;

impl Joint {
    /// A joint of body `body` with `other`, `None` for the world, with all axes free: a start for
    /// [`Joint::with_axes`].
    #[must_use]
    pub fn between(body: usize, other: Option<usize>, frames: [JointFrame; 2]) -> Self {
        let free = [Axis::Free(Drive::NONE); 3];
        let (linear, angular) = (free, free);
        let push = [Vector3::zeros(); 2];
        let (middle, length, collides, moves) = (None, None, false, false);
        Self { body, other, frames, linear, angular, middle, length, collides, push, moves }
    }

    /// Both anchors in one place; the bodies turn freely about it, or under drives of all three axes
    /// ([`Turning::Driven`](super::TurnKind::Driven)).
    #[must_use]
    pub fn spherical(body: usize, other: Option<usize>, frames: [JointFrame; 2]) -> Self {
        let linear = [Axis::Locked; 3];
        Self { linear, ..Self::between(body, other, frames) }
    }

    /// A ball joint whose z axes stay within the angle `cone` (rad, 0.01 to 3.1) of each other, and which turns about
    /// them under `twist` (rad, N m). The twist is the turn about z that is left when A's z axis is swung back to
    /// B's the shortest way.
    #[must_use]
    pub fn ball(
        body: usize,
        other: Option<usize>,
        frames: [JointFrame; 2],
        cone: f64,
        twist: Drive,
    ) -> Self {
        let angular = [Axis::cone(cone), Axis::Free(Drive::NONE), Axis::Free(twist)];
        Self { angular, ..Self::spherical(body, other, frames) }
    }

    /// A universal joint, as of a cardan shaft: A turns about the x axis of its frame and the y axis of B's, which cross
    /// at a right angle. [`Joint::with_drive`] drives its angles, [`JointAxis::Angular`](super::JointAxis::Angular) 0 and 1.
    #[must_use]
    pub fn universal(body: usize, other: Option<usize>, frames: [JointFrame; 2]) -> Self {
        let free = Axis::Free(Drive::NONE);
        Self { angular: [free, free, Axis::Locked], ..Self::spherical(body, other, frames) }
    }

    /// A gimbal: three hinges in one place, of which the first is about y of B's frame, the last about x of A's, and
    /// the middle one about an axis z that the first carries and that is square to both. Of the angles α, β, γ about x, y
    /// and z, under the `drives` in this order (rad, N m), A's frame is turned by
    /// `q_y(β) ⊗ q_z(γ) ⊗ q_x(α)` against B's. Where γ is a quarter turn the first and the last axis
    /// are one, and α and β are not told apart: a simulation cannot start there, and drives should keep it away.
    #[must_use]
    pub fn gimbal(
        body: usize,
        other: Option<usize>,
        frames: [JointFrame; 2],
        drives: [Drive; 3],
    ) -> Self {
        let angular = drives.map(Axis::Free);
        Self { angular, middle: Some(Middle::STRAIGHT), ..Self::spherical(body, other, frames) }
    }

    /// This joint, whose turn is free about all three axes, as a [gimbal](Joint::gimbal) with this middle axis.
    #[must_use]
    pub fn with_middle(self, middle: Middle) -> Self {
        Self { middle: Some(middle), ..self }
    }

    /// A hinge: they turn about the common z axis alone, under `drive` (rad, N m).
    #[must_use]
    pub fn revolute(
        body: usize,
        other: Option<usize>,
        frames: [JointFrame; 2],
        drive: Drive,
    ) -> Self {
        let angular = [Axis::Locked, Axis::Locked, Axis::Free(drive)];
        Self { angular, ..Self::spherical(body, other, frames) }
    }

    /// A slide: A's anchor moves along the common z axis alone, under `drive` (m, N).
    #[must_use]
    pub fn prismatic(
        body: usize,
        other: Option<usize>,
        frames: [JointFrame; 2],
        drive: Drive,
    ) -> Self {
        let linear = [Axis::Locked, Axis::Locked, Axis::Free(drive)];
        Self { linear, ..Self::fixed(body, other, frames) }
    }

    /// Slides along the common z axis under the first drive (m, N) and turns about it under the second
    /// (rad, N m).
    #[must_use]
    pub fn cylindrical(
        body: usize,
        other: Option<usize>,
        frames: [JointFrame; 2],
        drives: [Drive; 2],
    ) -> Self {
        let linear = [Axis::Locked, Axis::Locked, Axis::Free(drives[0])];
        Self { linear, ..Self::revolute(body, other, frames, drives[1]) }
    }

    /// A's anchor stays in the plane of B's x and y axes, and A turns about the common z axis alone.
    #[must_use]
    pub fn planar(body: usize, other: Option<usize>, frames: [JointFrame; 2]) -> Self {
        let free = Axis::Free(Drive::NONE);
        let linear = [free, free, Axis::Locked];
        Self { linear, ..Self::revolute(body, other, frames, Drive::NONE) }
    }

    /// Both frames in one: the bodies move as one.
    #[must_use]
    pub fn fixed(body: usize, other: Option<usize>, frames: [JointFrame; 2]) -> Self {
        let locked = [Axis::Locked; 3];
        Self { linear: locked, angular: locked, ..Self::between(body, other, frames) }
    }
}
