//! Merging of parts whose common hull is nearly convex, or of which there are too many.

use crate::MOST_CORNERS;
use crate::reduced::reduced;
use crate::settings::DecompositionSettings;
use nalgebra::Vector3;
use std::collections::BTreeMap;
use tumble_core::error::Error;
use tumble_core::geometry::{MassProperties, Piece};

/// Distance of bounding boxes that touch, relative to the size of the mesh.
const NEAR: f64 = 1e-6;

/// Hull of one or several parts.
struct Merged {
    piece: Piece,
    /// Sum of the volumes of the parts (m³).
    filled: f64,
    /// Bounding box (m).
    low: Vector3<f64>,
    high: Vector3<f64>,
}

/// Two pieces that can be merged, by number.
struct Pair {
    numbers: [usize; 2],
    union: Merged,
    /// Volume of the union's hull beyond its parts (m³).
    excess: f64,
}

/// Merges the two pieces with the smallest excess volume while there are more than the settings
/// allow, or while that excess is within the allowed concavity. `whole` is the hull of the mesh.
///
/// Pieces that touch are merged first.
pub fn merged(
    parts: Vec<Piece>,
    whole: &Piece,
    settings: &DecompositionSettings,
) -> Result<Vec<Piece>, Error> {
    let allowed = settings.concavity * MassProperties::from_piece(whole).volume;
    let near = NEAR * whole.core().reach();
    let part = |piece: Piece| Merged::new(MassProperties::from_piece(&piece).volume, piece);
    let mut pieces: BTreeMap<usize, Merged> = parts.into_iter().map(part).enumerate().collect();
    let mut pairs = Vec::new();
    for (&second, piece) in &pieces {
        for (&first, other) in pieces.range(..second).filter(|(_, other)| piece.meets(other, near))
        {
            pairs.push(Pair::new([first, second], other, piece)?);
        }
    }
    let mut next = pieces.len();
    loop {
        let too_many = pieces.len() > settings.pieces as usize;
        if too_many && pairs.is_empty() {
            for (&second, piece) in &pieces {
                for (&first, other) in pieces.range(..second) {
                    pairs.push(Pair::new([first, second], other, piece)?);
                }
            }
        }
        let best = pairs.iter().enumerate().min_by(|a, b| a.1.excess.total_cmp(&b.1.excess));
        let Some((best, pair)) = best else { break };
        if !too_many && pair.excess > allowed {
            break;
        }
        let Pair { numbers, union, .. } = pairs.swap_remove(best);
        pairs.retain(|pair| !pair.numbers.iter().any(|number| numbers.contains(number)));
        numbers.iter().for_each(|number| drop(pieces.remove(number)));
        for (&first, other) in pieces.iter().filter(|(_, other)| union.meets(other, near)) {
            pairs.push(Pair::new([first, next], other, &union)?);
        }
        pieces.insert(next, union);
        next += 1;
    }
    Ok(pieces.into_values().map(|merged| merged.piece).collect())
}

impl Merged {
    fn new(filled: f64, piece: Piece) -> Self {
        let corners = piece.core().vertices();
        let low = corners.iter().copied().reduce(|a, b| a.inf(&b)).unwrap_or_default();
        let high = corners.iter().copied().reduce(|a, b| a.sup(&b)).unwrap_or_default();
        Self { piece, filled, low, high }
    }

    /// True if the bounding boxes are at most `near` apart (m).
    fn meets(&self, other: &Self, near: f64) -> bool {
        let gap = (self.low - other.high).sup(&(other.low - self.high));
        gap.max() <= near
    }
}

impl Pair {
    fn new(numbers: [usize; 2], a: &Merged, b: &Merged) -> Result<Self, Error> {
        let corners = |merged: &Merged| merged.piece.core().vertices().to_vec();
        let both: Vec<Vector3<f64>> = [corners(a), corners(b)].concat();
        let (piece, _) = reduced(&both, MOST_CORNERS)?;
        let filled = a.filled + b.filled;
        let excess = MassProperties::from_piece(&piece).volume - filled;
        Ok(Self { numbers, union: Merged::new(filled, piece), excess })
    }
}
