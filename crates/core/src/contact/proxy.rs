//! The pieces of a world, and where they are.

use super::Partner;
use crate::geometry::Piece;
use crate::mechanics::{Pose, RigidBody};
use crate::world::World;
use nalgebra::{Matrix3, Vector3};

/// Whose a piece is.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum PieceOwner {
    Body(usize),
    Fixed(usize),
}

impl PieceOwner {
    pub(super) fn partner(self) -> Partner {
        match self {
            Self::Body(index) => Partner::Body(index),
            Self::Fixed(index) => Partner::Fixed(index),
        }
    }
}

/// A piece of the world.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) struct Proxy {
    pub(super) owner: PieceOwner,
    pub(super) piece: usize,
}

/// What of a piece says how its body's motion moves it.
#[derive(Debug, Clone, Copy)]
pub(super) struct PieceExtent {
    /// ℓ, m: the reach of the piece from its own middle.
    pub(super) size: f64,
    /// m: the largest distance of its core from the body's centre of mass.
    pub(super) arm: f64,
    /// m: the radius of the largest ball about its middle that is inside it.
    pub(super) inner: f64,
}

impl PieceExtent {
    pub(super) fn of(piece: &Piece) -> Self {
        let core = piece.core();
        let arm = core.vertices().iter().map(Vector3::norm).fold(0.0, f64::max);
        let depth = core.faces().iter().map(|face| face.offset - face.normal.dot(core.centre()));
        let depth = depth.fold(f64::INFINITY, f64::min);
        let depth = if depth.is_finite() { depth } else { 0.0 };
        Self { size: size(piece), arm, inner: depth + piece.radius() }
    }
}

/// The pieces of a world: those of its bodies, in their order, then what is fixed.
pub(super) fn proxies_of(world: &World) -> impl Iterator<Item = Proxy> + '_ {
    let of_body = |(index, body): (usize, &RigidBody)| {
        let owner = PieceOwner::Body(index);
        (0..body.pieces().len()).map(move |piece| Proxy { owner, piece })
    };
    let fixed = (0..world.fixed().len()).map(PieceOwner::Fixed);
    let fixed = fixed.map(|owner| Proxy { owner, piece: 0 });
    world.bodies().iter().enumerate().flat_map(of_body).chain(fixed)
}

/// ℓ, m: the reach of a piece from its own middle.
pub(super) fn size(piece: &Piece) -> f64 {
    piece.core().reach() + piece.radius()
}

/// A piece and where its owner is.
pub(super) fn placed<'a>(
    world: &'a World,
    poses: &'a [Pose],
    proxy: Proxy,
) -> (&'a Piece, &'a Pose) {
    match proxy.owner {
        PieceOwner::Body(index) => (&world.bodies()[index].pieces()[proxy.piece], &poses[index]),
        PieceOwner::Fixed(index) => (&world.fixed()[index].piece, &FIXED),
    }
}

/// Where something fixed is.
const FIXED: Pose = Pose { position: Vector3::new(0.0, 0.0, 0.0), rotation: IDENTITY };
const IDENTITY: Matrix3<f64> = Matrix3::new(1.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0);
