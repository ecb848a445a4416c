//! Colliders: the pieces of a world and their poses.

use super::Partner;
use crate::geometry::{Piece, Smooth};
use crate::mechanics::{Pose, RigidBody};
use crate::world::World;
use nalgebra::{Matrix3, Vector3};

/// Owner of a piece: a body or a fixed piece, by index.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum PieceOwner {
    Body(usize),
    Fixed(usize),
}

impl PieceOwner {
    pub(crate) fn partner(self) -> Partner {
        match self {
            Self::Body(index) => Partner::Body(index),
            Self::Fixed(index) => Partner::Fixed(index),
        }
    }
}

/// A collider: one piece of a body or a fixed piece of the world.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) struct Collider {
    pub(crate) owner: PieceOwner,
    pub(crate) piece: usize,
}

/// Sizes of a piece that bound its motion with its body.
#[derive(Debug, Clone, Copy)]
pub(crate) struct PieceExtent {
    /// ℓ: reach of the piece from its own centre (m).
    pub(crate) size: f64,
    /// Bound on the distance of its core and its smooth shape from the body's centre of mass (m).
    pub(crate) arm: f64,
    /// Radius of the largest ball about its centre inside the piece (m).
    pub(crate) inner: f64,
}

impl PieceExtent {
    pub(crate) fn of(piece: &Piece) -> Self {
        let core = piece.core();
        let arm = core.vertices().iter().map(Vector3::norm).fold(0.0, f64::max);
        let smooth = piece.smooth().map_or(&[][..], Smooth::ellipsoids);
        let farthest = smooth.iter().map(|one| one.centre.norm() + one.longest());
        let arm = farthest.fold(arm, f64::max);
        let depth = core.faces().iter().map(|face| face.offset - face.normal.dot(core.centre()));
        let depth = depth.fold(f64::INFINITY, f64::min);
        let depth = if depth.is_finite() { depth } else { 0.0 };
        Self { size: size(piece), arm, inner: depth + piece.radius() }
    }
}

/// All colliders of a world: the pieces of the bodies in order, then the fixed pieces.
pub(crate) fn colliders_of(world: &World) -> impl Iterator<Item = Collider> + '_ {
    let of_body = |(index, body): (usize, &RigidBody)| {
        let owner = PieceOwner::Body(index);
        (0..body.pieces().len()).map(move |piece| Collider { owner, piece })
    };
    let fixed = (0..world.fixed().len()).map(PieceOwner::Fixed);
    let fixed = fixed.map(|owner| Collider { owner, piece: 0 });
    world.bodies().iter().enumerate().flat_map(of_body).chain(fixed)
}

/// ℓ: reach of a piece from its own centre (m).
pub(crate) fn size(piece: &Piece) -> f64 {
    piece.core().reach() + piece.radius()
}

/// A collider's piece and the pose of its owner.
pub(crate) fn placed<'a>(
    world: &'a World,
    poses: &'a [Pose],
    collider: Collider,
) -> (&'a Piece, &'a Pose) {
    match collider.owner {
        PieceOwner::Body(index) => (&world.bodies()[index].pieces()[collider.piece], &poses[index]),
        PieceOwner::Fixed(index) => (&world.fixed()[index].piece, &FIXED),
    }
}

/// Pose of fixed pieces.
const FIXED: Pose = Pose { position: Vector3::new(0.0, 0.0, 0.0), rotation: IDENTITY };
const IDENTITY: Matrix3<f64> = Matrix3::new(1.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0);
