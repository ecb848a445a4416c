//! A quick bound on how far two pieces are apart.

use super::pair::{Hint, PiecePair, PlacedPiece};

/// A bound from below on the [`separation`](super::separation()) of two pieces, m: from balls around
/// them, and along the axis that `hint` remembers, which is exact while the same features face each
/// other.
#[must_use]
pub fn bound(a: PlacedPiece<'_>, b: PlacedPiece<'_>, hint: &Hint) -> f64 {
    let pair = PiecePair::new(a, b);
    pair.quick_gap(hint) - pair.radii()
}
