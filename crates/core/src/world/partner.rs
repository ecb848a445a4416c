//! What bodies touch, and by which constants.

use std::fmt::{self, Display, Formatter};

/// What a body touches.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, PartialOrd, Ord)]
#[cfg_attr(feature = "save", derive(serde::Serialize, serde::Deserialize))]
pub enum Partner {
    /// The fixed ground.
    Ground,
    /// The fixed piece of this index in [`World::fixed`](crate::world::World::fixed).
    Fixed(usize),
    /// The body of this index in [`World::bodies`](crate::world::World::bodies).
    Body(usize),
}

impl Partner {
    /// The index of a body; none of what is fixed.
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

/// The constants of the law at one contact.
#[derive(Debug, Clone, Copy, PartialEq)]
#[cfg_attr(feature = "save", derive(serde::Serialize, serde::Deserialize))]
pub struct ContactLaw {
    /// μ, coefficient of friction.
    pub friction: f64,
    /// e, coefficient of [restitution](crate::contact::restitution).
    pub restitution: f64,
}
