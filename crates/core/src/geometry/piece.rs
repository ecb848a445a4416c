//! Pieces: convex cores rounded by a radius.

use super::Hull;
use super::mesh::Mesh;
use crate::error::{Error, all_in_range, in_range};
use nalgebra::{Matrix3, Vector3};

/// All points within a radius of a convex core (m, body frame): a sphere (core a point), a capsule
/// (core a segment), a box or another polyhedron (radius 0), or a rounded polyhedron.
#[derive(Debug, Clone, PartialEq)]
pub struct Piece {
    core: Hull,
    radius: f64,
}

impl Piece {
    /// A box about the origin, `half_sides` in m. The vertices are ordered (−,−,−), (+,−,−),
    /// (−,+,−), (+,+,−), (−,−,+), …: x changes fastest.
    ///
    /// # Errors
    /// A half side outside 1e-6…1e4 m, or one below 1e-5 of the longest.
    pub fn cuboid(half_sides: Vector3<f64>) -> Result<Self, Error> {
        all_in_range("half side of the box (m)", &half_sides, 1e-6, 1e4, "1e-6 to 1e4")?;
        let sign = |corner: usize, axis: usize| if corner >> axis & 1 == 1 { 1.0 } else { -1.0 };
        let corner = |corner| Vector3::from_fn(|axis, _| sign(corner, axis) * half_sides[axis]);
        let corners: [Vector3<f64>; 8] = std::array::from_fn(corner);
        Self::hull(&corners, 0.0)
    }

    /// A sphere about the origin, radius in m.
    ///
    /// # Errors
    /// A radius outside 1e-6…1e4 m.
    pub fn sphere(radius: f64) -> Result<Self, Error> {
        in_range("radius of the sphere (m)", radius, 1e-6, 1e4, "1e-6 to 1e4")?;
        Ok(Self { core: Hull::point(Vector3::zeros())?, radius })
    }

    /// A capsule about the origin along z: all points within `radius` (m) of the segment from
    /// (0, 0, −`half_length`) to (0, 0, `half_length`) (m).
    ///
    /// # Errors
    /// A half length or radius outside 1e-6…1e4 m.
    pub fn capsule(half_length: f64, radius: f64) -> Result<Self, Error> {
        let allowed = "1e-6 to 1e4";
        in_range("half length of the capsule (m)", half_length, 1e-6, 1e4, allowed)?;
        in_range("radius of the capsule (m)", radius, 1e-6, 1e4, allowed)?;
        let end = Vector3::z() * half_length;
        Ok(Self { core: Hull::segment(-end, end)?, radius })
    }

    /// The convex hull of points (m) rounded by `radius` (m), see [`Hull::from_points`].
    ///
    /// # Errors
    /// Those of [`Hull::from_points`]; a radius outside 0…1e4 m.
    pub fn hull(points: &[Vector3<f64>], radius: f64) -> Result<Self, Error> {
        in_range("radius of the hull (m)", radius, 0.0, 1e4, "0 to 1e4")?;
        Ok(Self { core: Hull::from_points(points)?, radius })
    }

    /// A convex mesh rounded by `radius` (m).
    ///
    /// # Errors
    /// Those of [`Mesh::hull`]; a radius outside 0…1e4 m.
    pub fn mesh(mesh: &Mesh, radius: f64) -> Result<Self, Error> {
        in_range("radius of the mesh (m)", radius, 0.0, 1e4, "0 to 1e4")?;
        Ok(Self { core: mesh.hull()?, radius })
    }

    /// Returns this piece rotated about the origin by `rotation` (a proper rotation matrix) and
    /// then translated by `translation` (m). This places it in its body. The numbering of vertices,
    /// edges and faces is unchanged.
    ///
    /// # Errors
    /// A matrix that is not a rotation to 1e-9; a coordinate of the translation beyond ±1e4 m.
    pub fn moved_by(
        &self,
        rotation: &Matrix3<f64>,
        translation: &Vector3<f64>,
    ) -> Result<Self, Error> {
        let defect = (rotation.tr_mul(rotation) - Matrix3::identity()).amax();
        if !(defect <= 1e-9 && rotation.determinant() > 0.0) {
            let why = "is placed by a matrix that is not a rotation; allowed: AᵀA = 1 to 1e-9 and \
                       det A = 1";
            return Err(Error::Shape { shape: "the piece", why: why.into() });
        }
        all_in_range("position of the piece (m)", translation, -1e4, 1e4, "-1e4 to 1e4")?;
        Ok(Self { core: self.core.moved_by(rotation, translation), radius: self.radius })
    }

    /// The core: the piece before it is rounded.
    #[must_use]
    pub fn core(&self) -> &Hull {
        &self.core
    }

    /// Radius of the rounding (m).
    #[must_use]
    pub fn radius(&self) -> f64 {
        self.radius
    }
}
