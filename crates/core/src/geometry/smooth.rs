//! Smooth convex shapes and their inscribed cores.

use super::Ellipsoid;
use crate::error::{Error, all_in_range, in_range};
use nalgebra::{Matrix3, Vector3};
use std::f64::consts::{PI, TAU};

/// Smooth convex shapes (m, frame of the body).
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Smooth {
    /// Hull of two equal discs with one axis.
    Cylinder([Ellipsoid; 2]),
    /// Hull of a disc and a point on its axis.
    Cone {
        /// The disc.
        base: Ellipsoid,
        /// The point, and its index among the vertices of the core.
        apex: (u32, Vector3<f64>),
    },
    /// One ellipsoid.
    Ellipsoid(Ellipsoid),
}

impl Smooth {
    /// The ellipsoids and discs that span the shape, besides an apex.
    pub fn ellipsoids(&self) -> &[Ellipsoid] {
        match self {
            Self::Cylinder(discs) => discs,
            Self::Cone { base: one, .. } | Self::Ellipsoid(one) => std::slice::from_ref(one),
        }
    }

    /// This shape scaled about the origin.
    pub(super) fn scaled(&self, factor: f64) -> Self {
        let scaled = |one: &Ellipsoid| one.scaled(factor);
        match self {
            Self::Cylinder([from, to]) => Self::Cylinder([scaled(from), scaled(to)]),
            Self::Cone { base, apex: (vertex, apex) } => {
                Self::Cone { base: scaled(base), apex: (*vertex, apex * factor) }
            }
            Self::Ellipsoid(one) => Self::Ellipsoid(scaled(one)),
        }
    }

    /// The apex of a cone (m), and its index among the vertices of the core.
    pub fn apex(&self) -> Option<(u32, Vector3<f64>)> {
        match self {
            Self::Cone { apex, .. } => Some(*apex),
            Self::Cylinder(_) | Self::Ellipsoid(_) => None,
        }
    }

    /// Centres of both ends of a cylinder (m).
    pub fn axis(&self) -> Option<[Vector3<f64>; 2]> {
        match self {
            Self::Cylinder(discs) => Some(discs.map(|disc| disc.centre)),
            Self::Cone { .. } | Self::Ellipsoid(_) => None,
        }
    }

    /// Unit vector along the axis of a cone to its apex, and the sine of the angle between its lateral
    /// surface's normals and the planes across the axis.
    ///
    /// ```text
    /// sin β = R/√(R² + H²)
    /// ```
    pub fn cone(&self) -> Option<(Vector3<f64>, f64)> {
        let Self::Cone { base, apex } = self else { return None };
        let axis = apex.1 - base.centre;
        let radius = base.axes.column(0).norm();
        let height = axis.norm();
        Some((axis / height, radius / (radius * radius + height * height).sqrt()))
    }

    /// Radius of a cylinder (m).
    pub fn radius(&self) -> Option<f64> {
        match self {
            Self::Cylinder([disc, _]) => Some(disc.axes.column(0).norm()),
            Self::Cone { .. } | Self::Ellipsoid(_) => None,
        }
    }

    /// The point of the shape that is farthest along the unit vector `n` (m).
    pub fn farthest(&self, n: &Vector3<f64>) -> Vector3<f64> {
        let (mut best, mut height) = match self.apex() {
            Some((_, apex)) => (apex, n.dot(&apex)),
            None => (Vector3::zeros(), f64::NEG_INFINITY),
        };
        for one in self.ellipsoids() {
            let half = one.half_width(n);
            if n.dot(&one.centre) + half > height {
                (best, height) = (one.centre + one.farthest(n), n.dot(&one.centre) + half);
            }
        }
        best
    }

    /// Largest n·x over the shape for a unit vector `n` (m).
    pub fn extent(&self, n: &Vector3<f64>) -> f64 {
        let of_one = |one: &Ellipsoid| n.dot(&one.centre) + one.half_width(n);
        let ellipsoids = self.ellipsoids().iter().map(of_one);
        let apex = self.apex().map(|(_, apex)| n.dot(&apex));
        ellipsoids.chain(apex).fold(f64::NEG_INFINITY, f64::max)
    }

    /// Points on the surface whose hull is close to the shape (m): `count` on each disc, and
    /// `count` on each of `count`/2 circles of latitude of an ellipsoid.
    pub fn samples(&self, count: usize) -> Vec<Vector3<f64>> {
        let place = |one: &Ellipsoid, y: Vector3<f64>| one.centre + one.axes * y;
        let around =
            |one: &Ellipsoid| -> Vec<_> { rim(1.0, 0.0, count).map(|y| place(one, y)).collect() };
        match self {
            Self::Cylinder(discs) => discs.iter().flat_map(around).collect(),
            Self::Cone { base, apex } => around(base).into_iter().chain([apex.1]).collect(),
            Self::Ellipsoid(one) => on_sphere(count, count / 2).map(|y| place(one, y)).collect(),
        }
    }

    /// This shape rotated about the origin and then translated (m).
    pub(super) fn moved_by(&self, rotation: &Matrix3<f64>, translation: &Vector3<f64>) -> Self {
        let moved = |one: &Ellipsoid| one.moved_by(rotation, translation);
        match self {
            Self::Cylinder([from, to]) => Self::Cylinder([moved(from), moved(to)]),
            Self::Cone { base, apex: (vertex, apex) } => {
                let apex = (*vertex, rotation * apex + translation);
                Self::Cone { base: moved(base), apex }
            }
            Self::Ellipsoid(one) => Self::Ellipsoid(moved(one)),
        }
    }
}

/// Usual number of sides of the core of a smooth piece.
pub const USUAL_SIDES: usize = 24;

/// Corners of an inscribed hull (m) and its rounding radius (m).
pub(super) struct Inscribed {
    pub corners: Vec<Vector3<f64>>,
    pub radius: f64,
}

/// Cylinder about the origin along z, and the corners of the inscribed prism.
pub(super) fn cylinder(
    half_length: f64,
    radius: f64,
    sides: usize,
) -> Result<(Smooth, Vec<Vector3<f64>>), Error> {
    in_range("half length of the cylinder (m)", half_length, 1e-6, 1e4, "1e-6 to 1e4")?;
    in_range("radius of the cylinder (m)", radius, 1e-6, 1e4, "1e-6 to 1e4")?;
    check_sides(sides)?;
    let ends = [-half_length, half_length];
    let corners = ends.iter().flat_map(|end| rim(radius, *end, sides)).collect();
    let disc = |end: f64| Ellipsoid::disc(Vector3::z() * end, &Vector3::z(), radius);
    Ok((Smooth::Cylinder(ends.map(disc)), corners))
}

/// Cone about the origin along z, and the corners of the inscribed pyramid.
pub(super) fn cone(
    half_height: f64,
    radius: f64,
    sides: usize,
) -> Result<(Smooth, Vec<Vector3<f64>>), Error> {
    in_range("half height of the cone (m)", half_height, 1e-6, 1e4, "1e-6 to 1e4")?;
    in_range("radius of the cone (m)", radius, 1e-6, 1e4, "1e-6 to 1e4")?;
    check_sides(sides)?;
    let apex = Vector3::z() * half_height;
    let corners = rim(radius, -half_height, sides).chain([apex]).collect();
    let base = Ellipsoid::disc(-apex, &Vector3::z(), radius);
    Ok((Smooth::Cone { base, apex: (sides as u32, apex) }, corners))
}

/// Hull inscribed in an ellipsoid; without corners for a sphere.
///
/// The rounding radius is the smallest radius of curvature, r = c²/a with the smallest and the
/// largest half axes c ≤ a. All points of the surface are within r of a convex core. The hull spans
/// the points of this core
///
/// ```text
/// D s − r n,   n = D⁻¹ s/|D⁻¹ s|,
/// ```
///
/// with the diagonal matrix D of the half axes and unit vectors s at the poles and on meridians.
pub(super) fn ellipsoid(half_axes: &Vector3<f64>, sides: usize) -> Result<Inscribed, Error> {
    all_in_range("half axis of the ellipsoid (m)", half_axes, 1e-6, 1e4, "1e-6 to 1e4")?;
    check_sides(sides)?;
    let (least, most) = (half_axes.min(), half_axes.max());
    let field = "shortest half axis of the ellipsoid, relative to the longest";
    in_range(field, least / most, 1e-3, 1.0, "0.001 to 1")?;
    if least >= most * (1.0 - 1e-6) {
        return Ok(Inscribed { corners: Vec::new(), radius: most });
    }
    let radius = least * least / most;
    let meridians = (sides / 2).max(3);
    let directions = on_sphere(meridians, (meridians / 2).max(2));
    let corner = |s: Vector3<f64>| {
        half_axes.component_mul(&s) - s.component_div(half_axes).normalize() * radius
    };
    Ok(Inscribed { corners: directions.map(corner).collect(), radius })
}

/// Points on the unit sphere: the poles, and points on `meridians` that divide them into `parts`.
fn on_sphere(meridians: usize, parts: usize) -> impl Iterator<Item = Vector3<f64>> {
    let on_ring = move |ring: usize| {
        let (across, height) = libm::sincos(PI * ring as f64 / parts as f64);
        rim(across, height, meridians)
    };
    (1..parts).flat_map(on_ring).chain([Vector3::z(), -Vector3::z()])
}

/// Points on a circle about z: `sides` points with `radius` (m) at `height` (m).
fn rim(radius: f64, height: f64, sides: usize) -> impl Iterator<Item = Vector3<f64>> {
    (0..sides).map(move |side| {
        let (sine, cosine) = libm::sincos(TAU * side as f64 / sides as f64);
        Vector3::new(radius * cosine, radius * sine, height)
    })
}

fn check_sides(sides: usize) -> Result<(), Error> {
    if (3..=128).contains(&sides) {
        Ok(())
    } else {
        Err(Error::Count {
            field: "sides of a smooth piece's core",
            count: sides,
            allowed: "3 to 128",
        })
    }
}
