//! Contact keys as text in tables.

use serde::{Deserialize, Serialize};
use std::fmt;
use tumble_core::contact::{ContactKey, PairFeatures, Partner};
use tumble_core::geometry::{CorePart, Feature, PieceSide};

/// Part of a [`ContactKey`] that identifies the features, in its text form.
///
/// - Contact with the ground: the number of the body's contact point, such as `5`.
/// - Contact with a piece: `point.piece.piece.feature.plane`. These are the body's contact point,
///   the piece of the body, the piece of the partner, the feature, and the number of the contact
///   plane.
///
/// In the feature, piece A belongs to the body with the lower index, and piece B to the other body
/// or to the fixed piece. So A can be the partner's piece: `2.0.0.B2.0` with body 1 and partner 0
/// is vertex 2 of body 1.
///
/// | feature | meaning |
/// |---|---|
/// | `A3` | vertex 3 of piece A |
/// | `B3` | vertex 3 of piece B |
/// | `E3x7` | edge 3 of A and edge 7 of B |
/// | `V3x7` | vertex 3 of A and vertex 7 of B |
/// | `Rv3xe7` | vertex 3 of A and edge 7 of B; at least one is rounded |
/// | `Rsxc1` | lateral surface of cylinder A and the rim at end 1 of cylinder B |
/// | `SA1` | ellipsoid or disc 1 of piece A against a plane of B |
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
pub struct KeyText {
    /// Contact point, `point` of the key.
    pub point: usize,
    /// Pair of features, `pair` of the key.
    pub pair: Option<PairFeatures>,
}

impl KeyText {
    /// Text form of a key.
    #[inline]
    pub fn new(key: &ContactKey) -> Self {
        Self { point: key.point, pair: key.pair }
    }

    /// Complete key of a contact between `body` and `partner`.
    pub fn between(self, body: usize, partner: Partner) -> ContactKey {
        ContactKey { body, point: self.point, partner, pair: self.pair }
    }

    /// Parses the text form.
    pub fn parse(text: &str) -> Option<Self> {
        let parts: Vec<&str> = text.split('.').collect();
        match parts[..] {
            [point] => Some(Self { point: point.parse().ok()?, pair: None }),
            [point, first, second, feature, plane] => {
                let pieces = (first.parse().ok()?, second.parse().ok()?);
                let pair = PairFeatures {
                    pieces,
                    feature: feature_of(feature)?,
                    plane: plane.parse().ok()?,
                };
                Some(Self { point: point.parse().ok()?, pair: Some(pair) })
            }
            _ => None,
        }
    }
}

/// Parses the feature of a key.
fn feature_of(text: &str) -> Option<Feature> {
    let number = text.get(1..)?;
    match text.as_bytes().first()? {
        b'A' => Some(Feature::Vertex(PieceSide::A, number.parse().ok()?)),
        b'B' => Some(Feature::Vertex(PieceSide::B, number.parse().ok()?)),
        kind @ (b'E' | b'V') => {
            let (a, b) = number.split_once('x')?;
            let (a, b) = (a.parse().ok()?, b.parse().ok()?);
            Some(if *kind == b'E' { Feature::Edges(a, b) } else { Feature::Vertices(a, b) })
        }
        b'R' => {
            let (a, b) = number.split_once('x')?;
            Some(Feature::Round(part_of(a)?, part_of(b)?))
        }
        b'S' => {
            let one = number.get(1..)?.parse().ok()?;
            match number.as_bytes().first()? {
                b'A' => Some(Feature::Ellipsoid(PieceSide::A, one)),
                b'B' => Some(Feature::Ellipsoid(PieceSide::B, one)),
                _ => None,
            }
        }
        _ => None,
    }
}

fn part_of(text: &str) -> Option<CorePart> {
    if text == "s" {
        return Some(CorePart::Lateral);
    }
    let number = text.get(1..)?.parse().ok()?;
    match text.as_bytes().first()? {
        b'v' => Some(CorePart::Vertex(number)),
        b'e' => Some(CorePart::Edge(number)),
        b'c' => Some(CorePart::End(number)),
        _ => None,
    }
}

fn word(part: CorePart) -> String {
    match part {
        CorePart::Vertex(vertex) => format!("v{vertex}"),
        CorePart::Edge(edge) => format!("e{edge}"),
        CorePart::Lateral => "s".into(),
        CorePart::End(end) => format!("c{end}"),
    }
}

impl fmt::Display for KeyText {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Some(pair) = &self.pair else { return write!(f, "{}", self.point) };
        write!(f, "{}.{}.{}.", self.point, pair.pieces.0, pair.pieces.1)?;
        match pair.feature {
            Feature::Vertex(PieceSide::A, vertex) => write!(f, "A{vertex}")?,
            Feature::Vertex(PieceSide::B, vertex) => write!(f, "B{vertex}")?,
            Feature::Edges(a, b) => write!(f, "E{a}x{b}")?,
            Feature::Vertices(a, b) => write!(f, "V{a}x{b}")?,
            Feature::Round(a, b) => write!(f, "R{}x{}", word(a), word(b))?,
            Feature::Ellipsoid(PieceSide::A, one) => write!(f, "SA{one}")?,
            Feature::Ellipsoid(PieceSide::B, one) => write!(f, "SB{one}")?,
        }
        write!(f, ".{}", pair.plane)
    }
}

#[cfg(test)]
#[path = "tests/key.rs"]
mod tests;
