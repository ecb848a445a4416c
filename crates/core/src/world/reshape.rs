//! Changes of the size and the radius of bodies.

use crate::error::{Error, in_range};
use crate::geometry::{ContactPoint, Piece};
use crate::mechanics::RigidBody;
use nalgebra::Vector3;

/// Dependence of a body's shape on its size and radius.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) enum Form {
    /// Corners that are apart along each axis, with half the extents a and a radius ρ (m). With the
    /// factor s, a coordinate c becomes
    ///
    /// ```text
    /// s c (s a − ρ)/(s a − s ρ₀)
    /// ```
    ///
    /// with the present radius ρ₀ and the new radius ρ. The half extents become s a.
    Corners { extents: Vector3<f64>, radius: f64 },
    /// A sphere or capsule about the centre of mass: half the length l of the core and the radius
    /// ρ₀ (m). The half length becomes s (l + ρ₀) − ρ, and the radius is s ρ₀ if none is given.
    Round { half: f64, radius: f64 },
    /// A smooth shape. All lengths have the factor s.
    Smooth,
}

/// Change of a shape: its stretch σ, c → (1 + σ) c for a coordinate c, its radius (m), and the relative
/// change of the radii of its features, such as a cylinder's side.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct FormChange {
    pub(crate) stretch: Vector3<f64>,
    pub(crate) radius: f64,
    pub(crate) growth: f64,
}

impl FormChange {
    /// No change.
    pub(crate) fn none() -> Self {
        Self { stretch: Vector3::zeros(), radius: 0.0, growth: 0.0 }
    }
}

impl Form {
    /// Form of `body`.
    ///
    /// # Errors
    /// [`Error::Unsupported`] if the body has several pieces or radii, a capsule or sphere beside its
    /// centre of mass, or no extent along an axis.
    pub(crate) fn from_body(body: &RigidBody) -> Result<Self, Error> {
        let (own, extents) = (radius(body), extents(body));
        let form = match body.pieces() {
            [piece] if piece.smooth().is_some() => Some(Self::Smooth),
            [piece] if piece.core().faces().is_empty() => {
                let core = piece.core();
                let is_central = core.centre().norm() <= 1e-12 * body.reach();
                is_central.then(|| Self::Round { half: core.reach(), radius: own })
            }
            [] | [_] => {
                let is_one = body.contact_points().iter().all(|point| point.radius == own);
                (is_one && extents.min() > own).then_some(Self::Corners { extents, radius: own })
            }
            _ => None,
        };
        let why = "a body cannot change its shape: it is not one convex piece with one radius and \
                   an extent along each axis; leave size and radius out";
        form.ok_or(Error::Unsupported { what: "size and radius", why })
    }

    /// Differential of the shape for the differentials of size and radius.
    ///
    /// ```text
    /// corners  σ = (a δs − δρ)/(a − ρ₀),   round  σ = ((l + ρ₀) δs − δρ)/l,  δρ + ρ₀ δs
    /// ```
    pub(crate) fn change(&self, size: f64, given: f64) -> FormChange {
        if size == 0.0 && given == 0.0 {
            return FormChange::none();
        }
        match *self {
            Self::Corners { extents, radius } => {
                let stretch = extents.map(|a| (a * size - given) / (a - radius));
                FormChange { stretch, radius: given, growth: 0.0 }
            }
            Self::Round { half, radius } => {
                let wider = given + radius * size;
                let longer = (half + radius) * size - wider;
                let stretch = if half > 0.0 { longer / half } else { 0.0 };
                FormChange { stretch: Vector3::repeat(stretch), radius: wider, growth: 0.0 }
            }
            Self::Smooth => {
                FormChange { stretch: Vector3::repeat(size), radius: 0.0, growth: size }
            }
        }
    }

    /// Copy of `body`, which has this form, with another size and radius (m). It keeps its mass,
    /// inertia.
    pub(crate) fn reshaped(
        &self,
        body: &RigidBody,
        size: f64,
        new_radius: Option<f64>,
    ) -> Result<RigidBody, Error> {
        in_range("size, relative to the body's own", size, 0.01, 100.0, "0.01 to 100")?;
        let (mass, inertia) = (body.mass(), *body.inertia());
        let one = |piece: Piece| RigidBody::from_pieces(mass, inertia, vec![piece]);
        // Corners of a rounded box: the outer size scales, and the core is what the radius leaves.
        match *self {
            Self::Corners { extents, radius } => {
                let least = size * extents.min();
                let new_radius = new_radius.unwrap_or(radius);
                in_range("radius (m)", new_radius, 0.0, least, "0 to half the smallest extent")?;
                let outer = size * extents;
                let inner = outer.add_scalar(-size * radius);
                let factor = outer.add_scalar(-new_radius).component_div(&inner) * size;
                let moved = |point: &ContactPoint| point.position.component_mul(&factor);
                let corners: Vec<_> = body.contact_points().iter().map(moved).collect();
                if new_radius > 0.0 || !body.pieces().is_empty() {
                    one(Piece::hull(&corners, new_radius)?)
                } else {
                    RigidBody::new(mass, inertia, &corners)
                }
            }
            // Ball or capsule: the length of the core is what the new radius leaves.
            Self::Round { half, radius } => {
                let new_radius = new_radius.unwrap_or(size * radius);
                let most = size * (half + radius);
                in_range("radius (m)", new_radius, 1e-6, most, "1e-6 to half the length")?;
                let factor = if half > 0.0 { (most - new_radius) / half } else { 1.0 };
                one(body.pieces()[0].scaled(factor, new_radius)?)
            }
            Self::Smooth => {
                if new_radius.is_some_and(|radius| radius != 0.0) {
                    let why = "a cylinder, cone or ellipsoid has no radius of edges and corners; \
                               leave it out";
                    return Err(Error::Unsupported { what: "radius", why });
                }
                let piece = &body.pieces()[0];
                one(piece.scaled(size, piece.radius() * size)?)
            }
        }
    }
}

/// Half extents of a body along its axes (m); for a box, half its sides.
pub fn extents(body: &RigidBody) -> Vector3<f64> {
    let points = body.contact_points().iter();
    let reach = |point: &ContactPoint| point.position.abs() + point.half_extents();
    points.fold(Vector3::zeros(), |most, point| most.sup(&reach(point)))
}

/// Largest radius of a body's points (m).
pub(super) fn radius(body: &RigidBody) -> f64 {
    body.contact_points().iter().map(|point| point.radius).fold(0.0, f64::max)
}
