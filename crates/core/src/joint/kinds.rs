//! Named joint types.

use super::{Axis, Drive, Joint, JointFrame, Middle};
use nalgebra::Vector3;

impl Joint {
    /// Joint between `body` and `other` (`None` for the world) with six free axes; a basis for
    /// [`Joint::with_axes`].
    pub fn between(body: usize, other: Option<usize>, frames: [JointFrame; 2]) -> Self {
        let free = [Axis::Free(Drive::NONE); 3];
        Self {
            body,
            other,
            frames,
            linear: free,
            angular: free,
            middle: None,
            length: None,
            collides: false,
            push: [Vector3::zeros(); 2],
            kick: 1.0,
            fall: Vector3::zeros(),
            rebound_rates: [0.0; 2],
            falls: [0.0; 2],
            moves: false,
            inverse_inertias: [[0.0; 3]; 2],
            is_middle: false,
        }
    }

    /// Ball joint without limits: the anchors coincide and the rotation is free, or under drives
    /// about all three axes ([`TurnKind::Driven`](super::TurnKind::Driven)).
    pub fn spherical(body: usize, other: Option<usize>, frames: [JointFrame; 2]) -> Self {
        let linear = [Axis::Locked; 3];
        Self { linear, ..Self::between(body, other, frames) }
    }

    /// Ball joint with limits. The angle between the z axes is at most `cone` (rad, 0.01 to 3.1).
    /// The twist has the drive `twist` (rad, N m). It is the rotation about z that remains after
    /// swinging A's z axis back to B's by the smallest rotation.
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

    /// Universal (Cardan) joint: A rotates about the x axis of its frame and the y axis of B's,
    /// which stay orthogonal. [`Joint::with_drive`] drives its angles
    /// [`JointAxis::Angular`](super::JointAxis::Angular) 0 and 1.
    pub fn universal(body: usize, other: Option<usize>, frames: [JointFrame; 2]) -> Self {
        let free = Axis::Free(Drive::NONE);
        Self { angular: [free, free, Axis::Locked], ..Self::spherical(body, other, frames) }
    }

    /// Gimbal: three intersecting hinges in series. The first is about y of B's frame and the last
    /// about x of A's. The middle one is about an axis z orthogonal to both.
    ///
    /// The angles α, β, γ about x, y, z have the `drives` in this order (rad, N m). The rotation of
    /// A's frame relative to B's is `q_y(β) ⊗ q_z(γ) ⊗ q_x(α)`. At γ = ±π/2 the first and the last
    /// axis coincide (gimbal lock). A simulation cannot start there, and drives should avoid it.
    pub fn gimbal(
        body: usize,
        other: Option<usize>,
        frames: [JointFrame; 2],
        drives: [Drive; 3],
    ) -> Self {
        let angular = drives.map(Axis::Free);
        Self { angular, middle: Some(Middle::STRAIGHT), ..Self::spherical(body, other, frames) }
    }

    /// Returns this joint, which must be free about all three axes, as a [gimbal](Joint::gimbal)
    /// with this middle axis.
    #[must_use]
    pub fn with_middle(self, middle: Middle) -> Self {
        Self { middle: Some(middle), ..self }
    }

    /// Hinge: rotation about the common z axis only, with `drive` (rad, N m).
    pub fn revolute(
        body: usize,
        other: Option<usize>,
        frames: [JointFrame; 2],
        drive: Drive,
    ) -> Self {
        let angular = [Axis::Locked, Axis::Locked, Axis::Free(drive)];
        Self { angular, ..Self::spherical(body, other, frames) }
    }

    /// Slide: A's anchor moves along the common z axis only, with `drive` (m, N).
    pub fn prismatic(
        body: usize,
        other: Option<usize>,
        frames: [JointFrame; 2],
        drive: Drive,
    ) -> Self {
        let linear = [Axis::Locked, Axis::Locked, Axis::Free(drive)];
        Self { linear, ..Self::fixed(body, other, frames) }
    }

    /// Cylindrical joint: translation along the common z axis with the first drive (m, N), and
    /// rotation about it with the second (rad, N m).
    pub fn cylindrical(
        body: usize,
        other: Option<usize>,
        frames: [JointFrame; 2],
        drives: [Drive; 2],
    ) -> Self {
        let linear = [Axis::Locked, Axis::Locked, Axis::Free(drives[0])];
        Self { linear, ..Self::revolute(body, other, frames, drives[1]) }
    }

    /// Planar joint: A's anchor stays in B's x-y plane, and A rotates about the common z axis only.
    pub fn planar(body: usize, other: Option<usize>, frames: [JointFrame; 2]) -> Self {
        let free = Axis::Free(Drive::NONE);
        let linear = [free, free, Axis::Locked];
        Self { linear, ..Self::revolute(body, other, frames, Drive::NONE) }
    }

    /// Fixed joint: both frames coincide.
    pub fn fixed(body: usize, other: Option<usize>, frames: [JointFrame; 2]) -> Self {
        let locked = [Axis::Locked; 3];
        Self { linear: locked, angular: locked, ..Self::between(body, other, frames) }
    }
}
