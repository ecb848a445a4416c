//! Rigid body: mass, inertia and collision geometry. Its motion is its [`State`](super::State), and
//! its surroundings are the [`World`](crate::world::World).
//!
//! The geometry is a list of [pieces](Piece): rounded convex hulls in the body frame. Contacts with
//! a plane depend on their corners only, which are the contact points of the body. A body can also
//! consist of points alone, which touch planes only.

use crate::error::{Error, all_in_range, in_range};
use crate::geometry::{ContactPoint, MassProperties, Piece, Smooth};
use nalgebra::{Matrix3, Vector3};

/// Rigid body with its collision geometry. Immutable after its checks.
#[derive(Debug, Clone, PartialEq)]
pub struct RigidBody {
    matter: BodyInertia,
    contact_points: Vec<ContactPoint>,
    pieces: Vec<Piece>,
    /// Index of the contact point of each piece's first vertex.
    first_points: Vec<usize>,
    reach: f64,
}

/// Mass properties of a body.
#[derive(Debug, Clone, PartialEq)]
struct BodyInertia {
    mass: f64,
    inertia: Matrix3<f64>,
    inertia_inverse: Matrix3<f64>,
    specific_inertia: Matrix3<f64>,
    specific_inertia_inverse: Matrix3<f64>,
    isotropic: bool,
}

/// Reach of a point mass (m), which has no size of its own.
const REACH_OF_A_POINT: f64 = 1.0;

/// Largest number of contact points.
const MOST_CONTACT_POINTS: usize = 1000;

/// Largest ratio of two principal moments.
const MOST_APART: f64 = 1e6;
/// Smallest and largest principal moment, in units of mass times length². Beyond them, steps lose
/// too many digits to be solved.
const LEAST_MOMENT: f64 = 1e-6;
const LARGEST_MOMENT: f64 = 1e6;

impl RigidBody {
    /// Creates a body from its mass properties and contact points. `mass` is in kg. `inertia` is in
    /// kg m², body frame, about the centre of mass. `contact_points` are in m, body frame, relative
    /// to the centre of mass.
    ///
    /// The points touch planes only. A single point at the centre of mass is a point mass, whose
    /// inertia has no effect.
    ///
    /// # Errors
    /// - If the mass is outside 1e-9…1e9 kg.
    /// - If the inertia matrix is not symmetric positive definite, or its principal moments differ
    ///   by more than a factor of 1e6.
    /// - If a principal moment is inconsistent with mass and contact points (see below).
    /// - If the number of contact points is not 1 to 1000, or one is farther than 1e4 m from the
    ///   centre of mass.
    /// - If there are several points and all are at the centre of mass.
    ///
    /// A force F at the distance a from an axis accelerates the point by (1/m + a²/I) F. If the
    /// first term is 10⁻⁶ of the second or less, doubles keep too few of its digits to solve a
    /// step. In the opposite case, points that are close to each other become indistinguishable to
    /// the solver. Each principal moment I_k must therefore satisfy
    ///
    /// ```text
    /// 10⁻⁶ m a_k² ≤ I_k ≤ 10⁶ m (a₁² + a₂² + a₃²)
    /// ```
    ///
    /// where a_k is the largest distance of a contact point from the k-th principal axis, including
    /// its radius. Solid boxes of every size are far inside this range; the tutorial's cube has I =
    /// 5·10⁻⁴ m a².
    pub fn new(
        mass: f64,
        inertia: Matrix3<f64>,
        contact_points: &[Vector3<f64>],
    ) -> Result<Self, Error> {
        let points = contact_points.iter().map(|&point| ContactPoint::rounded(point, 0.0));
        Self::with_points(mass, inertia, points.collect())
    }

    /// Creates a body without pieces from contact points with radii.
    fn with_points(
        mass: f64,
        inertia: Matrix3<f64>,
        points: Vec<ContactPoint>,
    ) -> Result<Self, Error> {
        in_range("mass (kg)", mass, 1e-9, 1e9, "1e-9 to 1e9")?;
        let inertia_inverse = checked_inverse(&inertia)?;
        if !(1..=MOST_CONTACT_POINTS).contains(&points.len()) {
            return Err(Error::Count {
                field: "contact points",
                count: points.len(),
                allowed: "1 to 1000",
            });
        }
        all_in_range(
            "contact point coordinate (m)",
            points.iter().flat_map(|point| &point.position),
            -1e4,
            1e4,
            "-1e4 to 1e4",
        )?;
        // ℓ: the largest coordinate plus radius. A point mass has one by definition.
        let extents = points.iter().map(|point| point.position.abs() + point.half_extents());
        let reach = extents.map(|extents| extents.max()).fold(0.0, f64::max);
        let reach = match reach {
            0.0 if points.len() == 1 => REACH_OF_A_POINT,
            _ => {
                let field = "farthest contact point coordinate (m)";
                in_range(field, reach, 1e-6, 1e4, "1e-6 to 1e4")?
            }
        };
        check_moments(mass, &inertia, &points)?;
        // Inertia per unit mass, Î = I/m.
        let specific_inertia = inertia / mass;
        let sphere = Matrix3::from_diagonal_element(specific_inertia[(0, 0)]);
        let matter = BodyInertia {
            mass,
            inertia,
            inertia_inverse,
            isotropic: specific_inertia == sphere,
            specific_inertia,
            specific_inertia_inverse: inertia_inverse * mass,
        };
        Ok(Self {
            matter,
            contact_points: points,
            pieces: Vec::new(),
            first_points: Vec::new(),
            reach,
        })
    }

    /// Creates a body with `mass` (kg), `inertia` (kg m², body frame, about the centre of mass) and
    /// `pieces` (body frame, relative to the centre of mass). Its contact points are the corners and
    /// the ellipsoids of the pieces, in their order.
    ///
    /// # Errors
    /// Same as [`RigidBody::new`].
    pub fn from_pieces(
        mass: f64,
        inertia: Matrix3<f64>,
        pieces: Vec<Piece>,
    ) -> Result<Self, Error> {
        let (mut points, mut first_points) = (Vec::new(), Vec::new());
        for piece in &pieces {
            first_points.push(points.len());
            points.extend(piece.contact_points());
        }
        Ok(Self { pieces, first_points, ..Self::with_points(mass, inertia, points)? })
    }

    /// Creates a body of uniform density from `pieces` in any frame, which must not overlap. Also
    /// returns the centre of mass in that frame (m), which becomes the origin of the body frame.
    ///
    /// # Errors
    /// If there is no piece; otherwise same as [`RigidBody::new`].
    pub fn solid(mass: f64, pieces: &[Piece]) -> Result<(Self, Vector3<f64>), Error> {
        let properties = MassProperties::from_pieces(pieces)?;
        let moved = pieces.iter().map(|p| p.moved_by(&Matrix3::identity(), &-properties.centre));
        let inertia = properties.inertia * (mass / properties.volume);
        // Symmetrises rounding errors.
        let inertia = 0.5 * (inertia + inertia.transpose());
        let body = Self::from_pieces(mass, inertia, moved.collect::<Result<_, _>>()?)?;
        Ok((body, properties.centre))
    }

    /// Returns this body with another `mass` (kg) and `inertia` (kg m², body frame, about the
    /// centre of mass).
    ///
    /// # Errors
    /// Same as [`RigidBody::new`].
    pub fn with_mass(&self, mass: f64, inertia: Matrix3<f64>) -> Result<Self, Error> {
        let points = self.contact_points.clone();
        let Self { matter, .. } = Self::with_points(mass, inertia, points)?;
        Ok(Self { matter, ..self.clone() })
    }

    /// Creates a box with a contact point at every corner and with the half sides `half_sides` (m).
    /// The order of the corners is (−,−,−), (+,−,−), (−,+,−), (+,+,−), (−,−,+), …; x changes
    /// fastest.
    ///
    /// # Errors
    /// If a half side is outside 1e-6…1e4 m; otherwise same as [`RigidBody::new`].
    pub fn with_box_corners(
        mass: f64,
        inertia: Matrix3<f64>,
        half_sides: Vector3<f64>,
    ) -> Result<Self, Error> {
        all_in_range("half side of the box (m)", &half_sides, 1e-6, 1e4, "1e-6 to 1e4")?;
        match Piece::cuboid(half_sides) {
            Ok(piece) => Self::from_pieces(mass, inertia, vec![piece]),
            // The box is too thin for a piece; its corners can still touch planes.
            Err(_) => Self::new(mass, inertia, &box_corners(&half_sides)),
        }
    }

    /// Creates a solid box of uniform density with the half sides `half_sides` (m). Its contact
    /// points are ordered as in [`RigidBody::with_box_corners`].
    ///
    /// # Errors
    /// Same as [`RigidBody::with_box_corners`].
    pub fn solid_box(mass: f64, half_sides: Vector3<f64>) -> Result<Self, Error> {
        Self::with_box_corners(mass, solid_box_inertia(mass, &half_sides), half_sides)
    }

    /// Copy without pieces, which does not touch other bodies.
    pub(crate) fn without_shape(&self) -> Self {
        Self { pieces: Vec::new(), ..self.clone() }
    }

    /// Mass m (kg).
    pub fn mass(&self) -> f64 {
        self.matter.mass
    }

    /// Inertia I (kg m²), body frame.
    pub fn inertia(&self) -> &Matrix3<f64> {
        &self.matter.inertia
    }

    /// Inverse inertia I⁻¹ (1/(kg m²)), body frame.
    pub fn inertia_inverse(&self) -> &Matrix3<f64> {
        &self.matter.inertia_inverse
    }

    /// Inertia per mass Î = I/m (m²), body frame.
    pub fn specific_inertia(&self) -> &Matrix3<f64> {
        &self.matter.specific_inertia
    }

    /// Inverse inertia per mass Î⁻¹ = m I⁻¹ (1/m²), body frame.
    pub fn specific_inertia_inverse(&self) -> &Matrix3<f64> {
        &self.matter.specific_inertia_inverse
    }

    /// True if all principal moments are equal, so that the spin is constant in free motion.
    pub fn is_isotropic(&self) -> bool {
        self.matter.isotropic
    }

    /// Contact points, in the order of all per-contact arrays.
    pub fn contact_points(&self) -> &[ContactPoint] {
        &self.contact_points
    }

    /// Pieces of the collision geometry, body frame; empty for bodies made of points.
    pub fn pieces(&self) -> &[Piece] {
        &self.pieces
    }

    /// Index of the contact point at vertex `vertex` of piece `piece`. An ellipsoid has one contact
    /// point for all vertices of its core.
    ///
    /// # Panics
    /// If the piece does not exist.
    pub fn point_of(&self, piece: usize, vertex: usize) -> usize {
        let is_one = matches!(self.pieces[piece].smooth(), Some(Smooth::Ellipsoid(_)));
        self.first_points[piece] + if is_one { 0 } else { vertex }
    }

    /// Index of the first contact point of ellipsoid `one` of the smooth piece `piece`.
    ///
    /// # Panics
    /// If the piece does not exist.
    pub fn ellipsoid_point(&self, piece: usize, one: usize) -> usize {
        let vertices = match self.pieces[piece].smooth() {
            Some(Smooth::Ellipsoid(_)) => 0,
            _ => self.pieces[piece].core().vertices().len(),
        };
        self.first_points[piece] + vertices + 2 * one
    }

    /// Reach ℓ (m): the largest |coordinate| of a contact point plus its radius. The certificate
    /// converts angles to distances with it. It is 1 m for a point mass.
    pub fn reach(&self) -> f64 {
        self.reach
    }
}

/// Corners of a box with these half sides (m), relative to its centre; x changes fastest.
pub fn box_corners(half_sides: &Vector3<f64>) -> [Vector3<f64>; 8] {
    let sign = |corner: usize, axis: usize| if corner >> axis & 1 == 1 { 1.0 } else { -1.0 };
    std::array::from_fn(|corner| Vector3::from_fn(|axis, _| sign(corner, axis) * half_sides[axis]))
}

impl RigidBody {
    /// Copy in units of `mass` (kg) and `length` (m), without pieces; it touches planes only.
    pub(crate) fn in_units(&self, mass: f64, length: f64) -> Self {
        let area = length * length;
        let moment = mass * area;
        let contact_points = self.contact_points.iter().map(|point| {
            let position = point.position / length;
            let radius = point.radius / length;
            let ellipsoid = point.ellipsoid.as_ref().map(|axes| Box::new(**axes / length));
            ContactPoint { position, radius, ellipsoid, is_second: point.is_second }
        });
        let own = &self.matter;
        Self {
            matter: BodyInertia {
                mass: own.mass / mass,
                inertia: own.inertia / moment,
                inertia_inverse: own.inertia_inverse * moment,
                specific_inertia: own.specific_inertia / area,
                specific_inertia_inverse: own.specific_inertia_inverse * area,
                isotropic: own.isotropic,
            },
            contact_points: contact_points.collect(),
            pieces: Vec::new(),
            first_points: Vec::new(),
            reach: self.reach / length,
        }
    }
}

/// Inertia of a solid box of uniform density with the half sides (a, b, c) (m): I = m/3 diag(b² +
/// c², a² + c², a² + b²) (kg m²).
pub fn solid_box_inertia(mass: f64, half_sides: &Vector3<f64>) -> Matrix3<f64> {
    let squares = half_sides.component_mul(half_sides);
    Matrix3::from_diagonal(&(mass / 3.0 * (Vector3::repeat(squares.sum()) - squares)))
}

/// Inverse of a symmetric positive definite inertia matrix, after checks.
fn checked_inverse(inertia: &Matrix3<f64>) -> Result<Matrix3<f64>, Error> {
    if !inertia.iter().all(|entry| entry.is_finite()) {
        return Err(Error::Inertia("has an entry that is not a finite number"));
    }
    if (inertia - inertia.transpose()).amax() > 1e-12 * inertia.amax() {
        return Err(Error::Inertia("is not symmetric"));
    }
    let moments = inertia.symmetric_eigenvalues();
    let (least, largest) = (moments.min(), moments.max());
    if least <= 0.0 {
        return Err(Error::Inertia("is not positive definite: a principal moment is 0 or less"));
    }
    if largest > MOST_APART * least {
        return Err(Error::MomentsApart { least, largest });
    }
    inertia.try_inverse().ok_or(Error::Inertia("cannot be inverted"))
}

/// Checks that the principal moments of inertia are in the range of [`RigidBody::new`].
fn check_moments(mass: f64, inertia: &Matrix3<f64>, points: &[ContactPoint]) -> Result<(), Error> {
    let axes = inertia.symmetric_eigen();
    let squares: [f64; 3] = std::array::from_fn(|k| {
        let axis = axes.eigenvectors.column(k);
        let arm = |point: &ContactPoint| point.position.cross(&axis).norm() + point.size();
        points.iter().map(arm).fold(0.0, f64::max).powi(2)
    });
    let sum = squares.iter().sum::<f64>();
    // A point mass has no rotation.
    if sum == 0.0 {
        return Ok(());
    }
    let most = LARGEST_MOMENT * mass * sum;
    for (&moment, square) in axes.eigenvalues.iter().zip(squares) {
        let least = LEAST_MOMENT * mass * square;
        if !(least..=most).contains(&moment) {
            return Err(Error::Moment { moment, least, most });
        }
    }
    Ok(())
}

#[cfg(test)]
#[path = "tests/body.rs"]
mod tests;
