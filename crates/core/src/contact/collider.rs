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

/// A collider: one piece of a body, a fixed piece of the world, or a triangle or plane of a terrain.
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
    pub(crate) fn from_piece(piece: &Piece) -> Self {
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

impl PieceExtent {
    /// Sizes of a triangle of a terrain, which does not move.
    pub(crate) fn from_triangle(piece: &Piece) -> Self {
        Self { size: size(piece), arm: 0.0, inner: 0.0 }
    }
}

/// All colliders of a world but terrains: the pieces of the bodies in order, then the fixed pieces.
pub(crate) fn colliders_of(world: &World) -> impl Iterator<Item = Collider> + '_ {
    let of_body = |(index, body): (usize, &RigidBody)| {
        let owner = PieceOwner::Body(index);
        (0..body.pieces().len()).map(move |piece| Collider { owner, piece })
    };
    let fixed = (0..world.fixed().len()).map(PieceOwner::Fixed);
    let fixed = fixed.map(|owner| Collider { owner, piece: 0 });
    world.bodies().iter().enumerate().flat_map(of_body).chain(fixed)
}

/// Numbered colliders of a world: those of [`colliders_of`], then the pieces of the terrains.
#[derive(Debug, Clone, Default)]
pub(crate) struct Colliders {
    list: Vec<Collider>,
    /// Number of the first piece of each terrain, and the number after the last.
    terrains: Vec<usize>,
    /// Number of fixed pieces.
    fixed: usize,
}

impl Colliders {
    pub(crate) fn new(world: &World) -> Self {
        let list: Vec<_> = colliders_of(world).collect();
        let mut next = list.len();
        let mut terrains = Vec::new();
        for terrain in world.terrains() {
            terrains.push(next);
            next += terrain.piece_count();
        }
        terrains.push(next);
        Self { list, terrains, fixed: world.fixed().len() }
    }

    /// Becomes a copy of `other` in its own memory.
    pub(crate) fn copy_from(&mut self, other: &Self) {
        self.list.clone_from(&other.list);
        self.terrains.clone_from(&other.terrains);
        self.fixed = other.fixed;
    }

    pub(crate) fn clear(&mut self) {
        self.list.clear();
        self.terrains.clear();
    }

    /// The colliders that are not triangles.
    pub(crate) fn list(&self) -> &[Collider] {
        &self.list
    }

    /// Number of colliders, with all pieces of terrains.
    #[cfg(feature = "save")]
    pub(crate) fn collider_count(&self) -> usize {
        self.terrains.last().copied().unwrap_or(0)
    }

    /// True if these are the colliders of `world`.
    pub(crate) fn are_of(&self, world: &World) -> bool {
        let counts = self.terrains.windows(2).map(|two| two[1] - two[0]);
        colliders_of(world).eq(self.list.iter().copied())
            && world.terrains().iter().map(|terrain| terrain.piece_count()).eq(counts)
    }

    /// Index and first number of each terrain as a fixed collider.
    pub(crate) fn terrains(&self) -> impl Iterator<Item = (usize, usize)> {
        let starts = &self.terrains[..self.terrains.len().saturating_sub(1)];
        starts.iter().enumerate().map(|(index, first)| (self.fixed + index, *first))
    }

    #[inline]
    pub(crate) fn has_terrains(&self) -> bool {
        self.terrains.len() > 1
    }

    /// Number of the piece `piece` of the fixed collider `index`. `None` if it does not exist.
    pub(crate) fn number_of_fixed(&self, index: usize, piece: usize) -> Option<usize> {
        let Some(terrain) = index.checked_sub(self.fixed) else {
            return (piece == 0).then_some(self.list.len() - self.fixed + index);
        };
        let number = self.terrains.get(terrain)? + piece;
        (number < *self.terrains.get(terrain + 1)?).then_some(number)
    }

    /// Collider `number`.
    #[inline]
    pub(crate) fn at(&self, number: usize) -> Collider {
        match self.list.get(number) {
            Some(collider) => *collider,
            None => self.triangle(number),
        }
    }

    fn triangle(&self, number: usize) -> Collider {
        let terrain = self.terrains.partition_point(|first| *first <= number) - 1;
        let owner = PieceOwner::Fixed(self.fixed + terrain);
        Collider { owner, piece: number - self.terrains[terrain] }
    }
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
        PieceOwner::Fixed(index) => (fixed(world, index, collider.piece), &FIXED),
    }
}

/// Piece of a fixed collider that exists.
fn fixed(world: &World, index: usize, number: usize) -> &Piece {
    world.fixed_piece(index, number).expect("the broad phase lists pieces that exist")
}

/// Pose of fixed pieces.
const FIXED: Pose = Pose { position: Vector3::new(0.0, 0.0, 0.0), rotation: IDENTITY };
const IDENTITY: Matrix3<f64> = Matrix3::new(1.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0);
