//! Pieces: convex cores rounded by a radius, and smooth shapes.

use super::ContactPoint;
use super::mesh::Mesh;
use super::smooth::{self, Smooth};
use super::support::highest;
use super::{Ellipsoid, Hull};
use crate::error::{Error, all_in_range, in_range};
use nalgebra::{Matrix3, Vector3};

/// All points within a radius of a convex core (m, body frame): a sphere (core a point), a capsule
/// (core a segment), a box or another polyhedron (radius 0), or a rounded polyhedron.
///
/// A piece can also have a [smooth shape](Smooth), which touches planes and other pieces. The core
/// is then inscribed in it, and its flat ends stand on the corners of the core.
#[derive(Debug, Clone, PartialEq)]
pub struct Piece {
    core: Hull,
    radius: f64,
    smooth: Option<Smooth>,
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
        Ok(Self::from_core(Hull::point(Vector3::zeros())?, radius))
    }

    pub(super) fn from_core(core: Hull, radius: f64) -> Self {
        Self { core, radius, smooth: None }
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
        Ok(Self::from_core(Hull::segment(-end, end)?, radius))
    }

    /// The convex hull of points (m) rounded by `radius` (m), see [`Hull::from_points`].
    ///
    /// # Errors
    /// Those of [`Hull::from_points`]; a radius outside 0…1e4 m.
    pub fn hull(points: &[Vector3<f64>], radius: f64) -> Result<Self, Error> {
        in_range("radius of the hull (m)", radius, 0.0, 1e4, "0 to 1e4")?;
        Ok(Self::from_core(Hull::from_points(points)?, radius))
    }

    /// A convex mesh rounded by `radius` (m).
    ///
    /// # Errors
    /// Those of [`Mesh::hull`]; a radius outside 0…1e4 m.
    pub fn mesh(mesh: &Mesh, radius: f64) -> Result<Self, Error> {
        in_range("radius of the mesh (m)", radius, 0.0, 1e4, "0 to 1e4")?;
        Ok(Self::from_core(mesh.hull()?, radius))
    }

    /// A cylinder about the origin along z, with `half_length` and `radius` in m. Its core is the
    /// inscribed prism with `sides` sides. A flat end stands on the corners of the core.
    ///
    /// # Errors
    /// A half length or radius outside 1e-6…1e4 m, or one below 1e-5 of the other; a number of
    /// sides outside 3…128.
    pub fn cylinder(half_length: f64, radius: f64, sides: usize) -> Result<Self, Error> {
        let (smooth, corners) = smooth::cylinder(half_length, radius, sides)?;
        Ok(Self { smooth: Some(smooth), ..Self::hull(&corners, 0.0)? })
    }

    /// A cone about the origin along z. Its base has `radius` (m) and the height −`half_height`
    /// (m), its apex the height `half_height`. Its core is the inscribed pyramid with `sides`
    /// sides.
    ///
    /// # Errors
    /// Those of [`Piece::cylinder`].
    pub fn cone(half_height: f64, radius: f64, sides: usize) -> Result<Self, Error> {
        let (smooth, corners) = smooth::cone(half_height, radius, sides)?;
        Ok(Self { smooth: Some(smooth), ..Self::hull(&corners, 0.0)? })
    }

    /// An ellipsoid about the origin with its `half_axes` (m) along x, y and z. Its core is an
    /// inscribed rounded hull with `sides`/2 meridians.
    ///
    /// # Errors
    /// A half axis outside 1e-6…1e4 m, or one below 1e-3 of the longest; a number of sides outside
    /// 3…128.
    pub fn ellipsoid(half_axes: Vector3<f64>, sides: usize) -> Result<Self, Error> {
        let core = smooth::ellipsoid(&half_axes, sides)?;
        if core.corners.is_empty() {
            return Self::sphere(core.radius);
        }
        let axes = Matrix3::from_diagonal(&half_axes);
        let smooth = Smooth::Ellipsoid(Ellipsoid { centre: Vector3::zeros(), axes });
        Ok(Self { smooth: Some(smooth), ..Self::hull(&core.corners, core.radius)? })
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
        Ok(Self {
            core: self.core.moved_by(rotation, translation),
            radius: self.radius,
            smooth: self.smooth.map(|smooth| smooth.moved_by(rotation, translation)),
        })
    }

    /// This piece with a core and a smooth shape that are scaled about the origin by `factor`, and
    /// with another `radius` (m).
    pub(crate) fn scaled(&self, factor: f64, radius: f64) -> Result<Self, Error> {
        let vertices: Vec<_> = self.core.vertices().iter().map(|v| v * factor).collect();
        let core = match vertices[..] {
            [at] => Hull::point(at)?,
            [from, to] => Hull::segment(from, to)?,
            _ => Hull::from_points(&vertices)?,
        };
        Ok(Self { core, radius, smooth: self.smooth.map(|smooth| smooth.scaled(factor)) })
    }

    /// The core: the piece before it is rounded.
    pub fn core(&self) -> &Hull {
        &self.core
    }

    /// Radius of the rounding (m).
    pub fn radius(&self) -> f64 {
        self.radius
    }

    /// The smooth shape, if it has one.
    pub fn smooth(&self) -> Option<&Smooth> {
        self.smooth.as_ref()
    }

    /// True if the piece is rounded or has a smooth shape.
    pub(crate) fn is_curved(&self) -> bool {
        self.radius > 0.0 || self.smooth.is_some()
    }

    /// The point that is farthest along the unit vector `n` (m).
    pub(crate) fn farthest(&self, n: &Vector3<f64>) -> Vector3<f64> {
        match &self.smooth {
            Some(smooth) => smooth.farthest(n),
            None => self.core.vertices()[highest(self.core.vertices(), n).0] + n * self.radius,
        }
    }

    /// Radius of a ball about the core's centre that contains the piece (m).
    pub(crate) fn bounding_radius(&self) -> f64 {
        match &self.smooth {
            Some(Smooth::Ellipsoid(one)) => {
                (one.centre - self.core.centre()).norm() + one.longest()
            }
            _ => self.core.reach() + self.radius,
        }
    }

    /// The points that can touch a plane: the vertices of the core with its radius, and two for each
    /// ellipsoid of a smooth shape. An ellipsoid alone has no vertices.
    pub(crate) fn contact_points(&self) -> impl Iterator<Item = ContactPoint> + '_ {
        let vertices = match self.smooth {
            Some(Smooth::Ellipsoid(_)) => &[],
            _ => self.core.vertices(),
        };
        let of_vertex = |&vertex: &Vector3<f64>| ContactPoint::rounded(vertex, self.radius);
        let ellipsoids = self.smooth.as_ref().map_or(&[][..], Smooth::ellipsoids);
        vertices
            .iter()
            .map(of_vertex)
            .chain(ellipsoids.iter().flat_map(ContactPoint::from_ellipsoid))
    }
}
