//! Contact partners and contact laws.

use nalgebra::Vector3;
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
    /// h a/m_A (m/s): share of the pair's [adhesion](crate::contact::adhesion), as an impulse over the mass of A.
    pub adhesion: f64,
}

/// Friction of a surface that depends on the direction.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct FrictionAxis {
    /// Unit vector in the frame of `body`; `None` for the frame of the owner, the world for fixed geometry.
    pub direction: Vector3<f64>,
    /// The other body.
    pub body: Option<usize>,
    /// Coefficient along the axis, over the one across it.
    pub factor: f64,
}

/// Motion of a surface over its owner, in the body frame, or the world frame for fixed geometry.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
#[cfg_attr(feature = "save", derive(serde::Serialize, serde::Deserialize))]
pub struct SurfaceMotion {
    /// Velocity (m/s).
    pub velocity: Vector3<f64>,
    /// Angular velocity about the centre (rad/s).
    pub spin: Vector3<f64>,
    /// Centre of the spin (m).
    pub centre: Vector3<f64>,
}

/// Coefficient of contact laws that the world, bodies, fixed geometry and pairs can have.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, PartialOrd, Ord)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[cfg_attr(feature = "serde", serde(rename_all = "snake_case"))]
pub enum Coefficient {
    /// μ: friction.
    Friction,
    /// e: [restitution](crate::contact::restitution).
    Restitution,
    /// μ of contacts that do not slip at the start of the step.
    StaticFriction,
    /// μ_r (m): resistance to turning about axes in the tangent plane.
    RollingFriction,
    /// μ_s (m): resistance to turning about the normal.
    TorsionalFriction,
    /// F (N): largest pull of a pair that touches.
    Adhesion,
}

impl Coefficient {
    /// All coefficients.
    pub const ALL: [Self; 6] = [
        Self::Friction,
        Self::Restitution,
        Self::StaticFriction,
        Self::RollingFriction,
        Self::TorsionalFriction,
        Self::Adhesion,
    ];

    /// Name in files and in arrays.
    pub fn name(self) -> &'static str {
        match self {
            Self::Friction => "friction",
            Self::Restitution => "restitution",
            Self::StaticFriction => "static_friction",
            Self::RollingFriction => "rolling_friction",
            Self::TorsionalFriction => "torsional_friction",
            Self::Adhesion => "adhesion",
        }
    }

    /// Name in error messages, with the unit.
    pub fn quantity(self) -> &'static str {
        match self {
            Self::Friction => "coefficient of friction",
            Self::Restitution => "coefficient of restitution",
            Self::StaticFriction => "coefficient of static friction",
            Self::RollingFriction => "coefficient of rolling friction (m)",
            Self::TorsionalFriction => "coefficient of torsional friction (m)",
            Self::Adhesion => "adhesion (N)",
        }
    }

    /// Largest value.
    pub fn largest(self) -> f64 {
        match self {
            Self::Adhesion => 1e9,
            Self::Restitution => 1.0,
            _ => 10.0,
        }
    }

    /// Coefficient of a pair of owners with the numbers `a` and `b`: their geometric mean, and the larger
    /// one for moments and adhesion.
    pub fn combined(self, a: f64, b: f64) -> f64 {
        match self {
            Self::RollingFriction | Self::TorsionalFriction | Self::Adhesion => {
                if b > a {
                    b
                } else {
                    a
                }
            }
            // The root of a square would have another rounding.
            _ if a == b => a,
            _ => (a * b).sqrt(),
        }
    }

    /// Coefficient with this name in error messages.
    pub fn from_quantity(quantity: &str) -> Option<Self> {
        Self::ALL.into_iter().find(|of| of.quantity() == quantity)
    }
}

/// Coefficients of the moment of a contact: its limits per newton of normal force.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
#[cfg_attr(feature = "save", derive(serde::Serialize, serde::Deserialize))]
pub struct TurningFriction {
    /// Coefficient of rolling friction μ_r (m): limit of the moment in the tangent plane.
    pub rolling: f64,
    /// Coefficient of torsional friction μ_s (m): limit of the moment about the normal.
    pub torsional: f64,
}

impl TurningFriction {
    /// No moment.
    pub const NONE: Self = Self { rolling: 0.0, torsional: 0.0 };

    /// True if a coefficient is positive.
    pub fn acts(&self) -> bool {
        self.rolling > 0.0 || self.torsional > 0.0
    }
}
