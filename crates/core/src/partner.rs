//! Contact partners and contact laws.

use std::fmt::{self, Display, Formatter};

/// Object that a body touches.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, PartialOrd, Ord)]
#[cfg_attr(feature = "save", derive(serde::Serialize, serde::Deserialize))]
pub enum Partner {
    /// The fixed ground.
    Ground,
    /// The fixed collider of this index: a piece of [`World::fixed`](crate::world::World::fixed), or
    /// one of the [terrains](crate::world::World::terrains), which are numbered after them.
    Fixed(usize),
    /// The body of this index in [`World::bodies`](crate::world::World::bodies).
    Body(usize),
}

impl Partner {
    /// Index of the body; `None` for the ground and for fixed pieces.
    #[must_use]
    #[inline]
    pub fn body(self) -> Option<usize> {
        if let Self::Body(index) = self { Some(index) } else { None }
    }
}

impl Display for Partner {
    fn fmt(&self, out: &mut Formatter<'_>) -> fmt::Result {
        match self {
            Self::Ground => out.write_str("the ground"),
            Self::Fixed(index) => write!(out, "fixed piece {index}"),
            Self::Body(index) => write!(out, "body {index}"),
        }
    }
}

/// Coefficients of one contact.
#[derive(Debug, Clone, Copy, PartialEq)]
#[cfg_attr(feature = "save", derive(serde::Serialize, serde::Deserialize))]
pub struct ContactLaw {
    /// Coefficient of friction μ of the step: the static one of a [contact that
    /// sticks](crate::contact::Contact::set_friction).
    pub friction: f64,
    /// Static coefficient, if it is above the kinetic one.
    pub static_friction: Option<f64>,
    /// Coefficient of [restitution](crate::contact::restitution) e.
    pub restitution: f64,
}
