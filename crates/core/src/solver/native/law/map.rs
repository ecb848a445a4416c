//! The natural map (N4), and the pieces that it has.

/// The natural map whose zero is sought.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(in super::super) struct NaturalMap {
    /// ε in û = u + ε D p̂ (N6).
    pub(in super::super) compliance: f64,
    /// Factor on ρ_t. The natural map has the same zeros for every one; a large one tells
    /// the directions of slips that are slow against the impulses.
    pub(in super::super) sharpness: f64,
    /// A contact within this relative margin of its cone counts as sticking.
    pub(in super::super) stick_margin: f64,
}

impl NaturalMap {
    /// No compliance.
    pub(in super::super) const EXACT: Self = Self::with_compliance(0.0);

    pub(in super::super) const fn with_compliance(compliance: f64) -> Self {
        Self { compliance, sharpness: 1.0, stick_margin: 0.0 }
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
