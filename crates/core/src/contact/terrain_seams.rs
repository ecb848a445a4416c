//! Seams of a terrain: triangles in one plane share their contacts.

use super::collider::{Collider, PieceOwner, size};
use super::{Contact, Partner};
use crate::world::World;

/// Difference of places below which two contacts are one, as a fraction of the body's reach.
const SAME_PLACE: f64 = 1e-7;
/// Angle below which two normals are one (rad).
const SAME_NORMAL: f64 = 1e-6;
/// Distance of a triangle from a plane below which it lies in it, as a fraction of its size.
const IN_PLANE: f64 = 1e-6;

/// True if a collider is a triangle of a terrain.
#[inline]
pub(super) fn is_triangle(world: &World, collider: Collider) -> bool {
    matches!(collider.owner, PieceOwner::Fixed(index) if index >= world.fixed().len())
}

/// True if `known` is between the same piece of a body and the same terrain as `contact`, at the
/// same place and with the same normal.
pub(super) fn same_contact(world: &World, known: &Contact, contact: &Contact) -> bool {
    let (key, other) = (&contact.key, &known.key);
    let (Some(pair), Some(known_pair)) = (key.pair, other.pair) else { return false };
    let is_of_pair =
        (key.body, key.partner, pair.pieces.0) == (other.body, other.partner, known_pair.pieces.0);
    if !is_of_pair || !matches!(key.partner, Partner::Fixed(index) if index >= world.fixed().len())
    {
        return false;
    }
    let near = SAME_PLACE * world.bodies()[key.body].reach();
    (contact.lever - known.lever).norm() <= near
        && (contact.gap - known.gap).abs() <= near
        && (contact.normal() - known.normal()).norm() <= SAME_NORMAL
}

/// True if `contact` is a plane in which the triangle `b` of a terrain lies, against a piece `a`.
pub(super) fn is_coplanar(world: &World, contact: &Contact, a: Collider, b: Collider) -> bool {
    let PieceOwner::Fixed(index) = b.owner else { return false };
    let key = &contact.key;
    let is_of_pair = (Partner::Body(key.body), key.partner, key.pair.map(|pair| pair.pieces.0))
        == (a.owner.partner(), b.owner.partner(), Some(a.piece));
    let Some(piece) = world.fixed_piece(index, b.piece).filter(|_| is_of_pair) else {
        return false;
    };
    let (normal, near) = (contact.normal(), IN_PLANE * size(piece));
    let height = |vertex| normal.dot(vertex) - contact.features.offset;
    contact.features.curved.is_none()
        && piece.core().vertices().iter().all(|vertex| height(vertex).abs() <= near)
}
