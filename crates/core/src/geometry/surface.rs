//! The surface of a piece near a point: the tangent cone of the piece there.
//!
//! Near a point x of its surface, a convex piece is the cone of the half-spaces of the faces at x,
//!
//! ```text
//! T = { w : m·w ≤ 0 for all outward normals m at x }
//! ```
//!
//! A curved surface counts as its tangent plane. A facet of a terrain has both normals, and at its
//! border also the outward normals in its plane.

use super::facet;
use super::hull::span;
use super::segment::closest_on_segment;
use super::{Ellipsoid, Hull, Piece, Smooth};
use nalgebra::{Matrix3, Vector3};
use std::f64::consts::TAU;

/// Number of normals by which the tip of a cone is represented.
const NORMALS_AT_TIP: u32 = 8;

impl Piece {
    /// Writes the outward unit normals of the surfaces within the distance `within` (m) of `point`
    /// to `normals` (all in the body frame).
    ///
    /// There are none deep inside the piece. Returns false if the point is outside by more than
    /// `within`.
    pub(crate) fn surface_at(
        &self,
        point: &Vector3<f64>,
        within: f64,
        normals: &mut Vec<Vector3<f64>>,
    ) -> bool {
        normals.clear();
        self.all_surfaces(point, within, |height, normal| {
            if height >= -within {
                normals.push(normal);
            }
            height <= within
        })
    }

    /// Largest height of a point above the surfaces of the piece (m, body frame): a lower bound of its
    /// distance, exact above a face. Negative inside.
    pub(crate) fn height_of(&self, point: &Vector3<f64>) -> f64 {
        let mut highest = f64::NEG_INFINITY;
        self.all_surfaces(point, 0.0, |height, _| {
            highest = f64::max(highest, height);
            true
        });
        highest
    }

    /// True if `visit` holds for the height (m) of `point` above each surface and the normal there.
    /// Stops at the first for which it does not. Points closer than `near` (m) to the tip of a cone are
    /// at the tip.
    pub(crate) fn all_surfaces(
        &self,
        point: &Vector3<f64>,
        near: f64,
        mut visit: impl FnMut(f64, Vector3<f64>) -> bool,
    ) -> bool {
        match self.smooth() {
            // Rounded hull: the distance from the core less the radius.
            None if self.radius() > 0.0 => match outside(self.core(), point) {
                Some(offset) => offset
                    .try_normalize(0.0)
                    .is_none_or(|normal| visit(offset.norm() - self.radius(), normal)),
                None => true,
            },
            None => {
                // Polyhedron: its faces, and the sides of a hull without volume.
                let mut faces = self.core().faces().iter();
                faces.all(|face| visit(face.normal.dot(point) - face.offset, face.normal))
                    && facet::borders(self.core())
                        .all(|(from, out)| visit(out.dot(&(point - from)), out))
            }
            Some(Smooth::Cylinder([from, to])) => {
                // Cylinder: two ends and the lateral surface.
                let axis = (to.centre - from.centre).normalize();
                let across = (point - from.centre) - axis * axis.dot(&(point - from.centre));
                let radius = from.axes.column(0).norm();
                visit(-axis.dot(&(point - from.centre)), -axis)
                    && visit(axis.dot(&(point - to.centre)), axis)
                    && across
                        .try_normalize(0.0)
                        .is_none_or(|normal| visit(across.norm() - radius, normal))
            }
            Some(Smooth::Cone { base, apex: (_, apex) }) => {
                // Cone: the base, and the lateral surface with the normal cos α out + sin α axis.
                let (axis, sine) = self.smooth().and_then(Smooth::cone).unwrap_or_default();
                let cosine = (1.0 - sine * sine).sqrt();
                let offset_vector = point - apex;
                let across = offset_vector - axis * axis.dot(&offset_vector);
                if !visit(-axis.dot(&(point - base.centre)), -axis) {
                    return false;
                }
                let mut lateral = |out: Vector3<f64>| {
                    let normal = out * cosine + axis * sine;
                    visit(normal.dot(&offset_vector), normal)
                };
                if across.norm() > near {
                    return lateral(across.normalize());
                }
                // All directions are normal at the tip; a few evenly spaced ones stand for them.
                let first = base.axes.column(0).normalize();
                let second = axis.cross(&first);
                (0..NORMALS_AT_TIP).all(|at| {
                    let turn = TAU * f64::from(at) / f64::from(NORMALS_AT_TIP);
                    let (sine, cosine) = libm::sincos(turn);
                    lateral(first * cosine + second * sine)
                })
            }
            Some(Smooth::Ellipsoid(one)) => {
                let (height, normal) = above(one, point);
                visit(height, normal)
            }
        }
    }
}

/// Height of a point above an ellipsoid to first order (m), and the normal there.
///
/// With y = S⁻¹ (x − c) the surface is |y| = 1, and the gradient of |y| is S⁻ᵀ y/|y|.
fn above(one: &Ellipsoid, point: &Vector3<f64>) -> (f64, Vector3<f64>) {
    let y = one.coordinates(point);
    let squares =
        Matrix3::from_diagonal(&Vector3::from_fn(|at, _| 1.0 / one.axes.column(at).norm_squared()));
    let gradient = one.axes * (squares * y);
    match gradient.try_normalize(0.0) {
        Some(normal) => (y.norm() * (y.norm() - 1.0) / gradient.norm(), normal),
        None => (-one.size(), Vector3::z()),
    }
}

/// Shortest vector from a core to a point outside it (m). `None` for a point inside a polyhedron.
fn outside(core: &Hull, point: &Vector3<f64>) -> Option<Vector3<f64>> {
    let above = |face: &super::hull::Face| face.normal.dot(point) - face.offset;
    if !core.faces().is_empty() && core.faces().iter().all(|face| above(face) <= 0.0) {
        return None;
    }
    let mut best = core.vertices()[0];
    let mut keep = |other: Vector3<f64>| {
        if (point - other).norm_squared() < (point - best).norm_squared() {
            best = other;
        }
    };
    for edge in core.edges() {
        let (from, along) = span(core.vertices(), edge);
        keep(closest_on_segment(point, &from, &along));
    }
    for (index, face) in core.faces().iter().enumerate() {
        if above(face) > 0.0 && core.is_over(index, point, 0.0) {
            keep(point - face.normal * above(face));
        }
    }
    Some(point - best)
}

#[cfg(test)]
#[path = "tests/surface.rs"]
mod tests;
