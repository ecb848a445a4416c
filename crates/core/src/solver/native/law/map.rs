//! The natural map (N4), and the pieces that it has.

/// The natural map whose zero is sought.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(in super::super) struct NaturalMap {
    /// ε in û = u + ε D p̂ (N6).
    pub(in super::super) compliance: f64,
}

impl NaturalMap {
    /// No compliance.
    pub(in super::super) const EXACT: Self = Self::with_compliance(0.0);

    pub(in super::super) const fn with_compliance(compliance: f64) -> Self {
        Self { compliance }
    }
}

/// The piece of the natural map that a coupling is on.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum MapPiece {
    /// No impulse.
    Open,
    /// It presses, and its point does not slip.
    Stick,
    /// It presses, and its friction is on the edge of the cone.
    Slip,
    /// Of the rows of a joint, which straight piece of its graph each is on.
    Axes([u8; 3]),
}
