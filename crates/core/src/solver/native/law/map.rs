//! Natural map of a contact or joint law, and its pieces.
//!
//! The natural map is a function of the motion u and the impulse p̂ of a coupling (both in m/s).
//! It is zero exactly where u and p̂ obey the law. It is piecewise smooth, and Newton's method
//! works on its pieces. Equation numbers refer to `docs/native-solver.md`.

/// Parameters of the natural map (N4). The law itself is [`CouplingLaw`](super::CouplingLaw).
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct NaturalMap {
    /// Compliance ε. The law holds for û = u + ε D p̂ instead of u (N6), which makes the impulses
    /// unique. D is the identity, except at contacts that can roll.
    pub(crate) compliance: f64,
    /// Factor on ρ_t of contacts. Maps with different factors have the same zeros but other pieces:
    /// a larger factor lets the velocity decide between sticking and slipping, not the impulse.
    pub(crate) tangential_factor: f64,
}

impl NaturalMap {
    /// Map without compliance: the law itself.
    pub(crate) const EXACT: Self = Self::with_compliance(0.0);

    pub(crate) const fn with_compliance(compliance: f64) -> Self {
        Self { compliance, tangential_factor: 1.0 }
    }
}

/// Piece of the natural map at the values of a coupling.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum MapPiece {
    /// Open contact without impulse.
    Open,
    /// Loaded contact without slip.
    Stick,
    /// Loaded contact with its friction on the boundary of the cone.
    Slip,
    /// Joint rows, each with the index of the straight piece of its graph of impulse against speed.
    Axes([u8; 3]),
    /// Moment of a loaded contact.
    Moment {
        /// True if the tangential part is at the limit of rolling resistance.
        rolls: bool,
        /// Sign of a normal part at the limit of torsional friction, otherwise 0.
        spins: i8,
    },
}
