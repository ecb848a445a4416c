//! Natural map (N4) and its pieces.

/// Natural map whose zero is computed.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(in super::super) struct NaturalMap {
    /// ε in û = u + ε D p̂ (N6).
    pub(in super::super) compliance: f64,
}

impl NaturalMap {
    /// Map without compliance.
    pub(in super::super) const EXACT: Self = Self::with_compliance(0.0);

    pub(in super::super) const fn with_compliance(compliance: f64) -> Self {
        Self { compliance }
    }
}

/// Piece of the natural map that a coupling is on.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum MapPiece {
    /// No impulse.
    Open,
    /// Loaded contact without slip.
    Stick,
    /// Loaded contact with its friction on the boundary of the cone.
    Slip,
    /// Index of the straight graph piece of each joint row.
    Axes([u8; 3]),
}
