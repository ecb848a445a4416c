//! Features of two pieces in contact.

/// One of the two pieces of a pair.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash)]
#[cfg_attr(feature = "save", derive(serde::Serialize, serde::Deserialize))]
pub enum PieceSide {
    /// The first.
    A,
    /// The second.
    B,
}

impl PieceSide {
    /// Returns a pair as it is for A, and swapped for B.
    pub(super) fn ordered<T>(self, [first, second]: [T; 2]) -> [T; 2] {
        match self {
            Self::A => [first, second],
            Self::B => [second, first],
        }
    }
}

/// Identity of a contact point between two pieces. It stays the same while the same features touch,
/// under any motion.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash)]
#[cfg_attr(feature = "save", derive(serde::Serialize, serde::Deserialize))]
pub enum Feature {
    /// A vertex of the piece on this side against the other piece.
    Vertex(PieceSide, u32),
    /// An edge of A and an edge of B.
    Edges(u32, u32),
    /// A vertex of A and a vertex of B, with pieces of equal radius.
    Vertices(u32, u32),
    /// A vertex or edge of A and a vertex or edge of B, at least one of them rounded. The distance
    /// of these features has a closed form at every pose.
    Round(CorePart, CorePart),
    /// An ellipsoid of the smooth shape on this side, by its index, against a face of the other
    /// piece.
    Ellipsoid(PieceSide, u32),
}

/// A vertex or an edge of a core.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash)]
#[cfg_attr(feature = "save", derive(serde::Serialize, serde::Deserialize))]
pub enum CorePart {
    /// Vertex with this index.
    Vertex(u32),
    /// Edge with this index.
    Edge(u32),
    /// Lateral surface of a cylinder or a cone.
    Lateral,
    /// End of a cylinder: its rim.
    End(u32),
}
