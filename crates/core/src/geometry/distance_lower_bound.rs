//! A cheap lower bound on the distance of two pieces.

use super::hint::Hint;
use super::pair::{PiecePair, PlacedPiece};

/// Lower bound on the [`signed_distance`](super::signed_distance) of two pieces (m).
///
/// It is the larger of two bounds: the gap of the bounding balls and the gap along the axis stored
/// in `hint`. The second is exact while the same features face each other.
pub fn distance_lower_bound(a: PlacedPiece<'_>, b: PlacedPiece<'_>, hint: &Hint) -> f64 {
    let pair = PiecePair::new(a, b);
    pair.quick_gap(hint) - pair.radii()
}
