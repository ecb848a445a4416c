//! Identity of contacts from step to step.

use super::{Contact, Partner};
use crate::geometry::Feature;
#[cfg(feature = "save")]
use crate::world::World;

/// Identity of the touching features of two pieces.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, PartialOrd, Ord)]
#[cfg_attr(feature = "save", derive(serde::Serialize, serde::Deserialize))]
pub struct PairFeatures {
    /// Indices of the piece of A and the piece of B in their
    /// [pieces](crate::mechanics::RigidBody::pieces); 0 for a fixed piece, and the number of the
    /// triangle for a terrain.
    pub pieces: (usize, usize),
    /// The features. Their sides A and B follow the order of the bodies, not of the contact: A is
    /// the body with the lower index, and a fixed piece is B.
    pub feature: Feature,
    /// Number of the plane among those that a step found for these features; 0 for the first.
    pub plane: u32,
}

/// Identity of a contact. It stays the same from step to step, so that the last forces can be
/// reused.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, PartialOrd, Ord)]
#[cfg_attr(feature = "save", derive(serde::Serialize, serde::Deserialize))]
pub struct ContactKey {
    /// Body A, an index of [`World::bodies`](crate::world::World::bodies). It owns the point,
    /// except for a corner of a fixed piece in a face of the body.
    pub body: usize,
    /// Index of A's touching [contact point](crate::mechanics::RigidBody::contact_points). An edge
    /// that touches between its ends uses its first end. A face that touches uses the first point of
    /// its piece.
    pub point: usize,
    /// Partner B: a body, a fixed piece or the ground.
    pub partner: Partner,
    /// Touching pieces and features; `None` for the ground.
    pub pair: Option<PairFeatures>,
}

impl ContactKey {
    /// Indices of the touching bodies; one if the partner is not a body.
    pub fn bodies(&self) -> impl Iterator<Item = usize> + Clone + use<> {
        std::iter::once(self.body).chain(self.partner.body())
    }

    /// True if `world` has the bodies, contact point, partner and pieces of this key.
    #[cfg(feature = "save")]
    pub(crate) fn is_of(&self, world: &World) -> bool {
        let bodies = world.bodies();
        let Some(a) = bodies.get(self.body) else { return false };
        let pieces = match self.partner {
            Partner::Ground => world.ground().map(|_| 1),
            Partner::Fixed(index) => match world.terrain(index) {
                Some(terrain) => Some(terrain.count()),
                None => world.fixed().get(index).map(|_| 1),
            },
            Partner::Body(index) => bodies.get(index).map(|body| body.pieces().len()),
        };
        let has = |pair: PairFeatures| {
            pair.pieces.0 < a.pieces().len() && pieces.is_some_and(|count| pair.pieces.1 < count)
        };
        self.point < a.contact_points().len() && pieces.is_some() && self.pair.is_none_or(has)
    }
}

impl AsRef<ContactKey> for Contact {
    fn as_ref(&self) -> &ContactKey {
        &self.key
    }
}
