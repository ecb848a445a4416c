//! The rigid body: mass, inertia and the shape that can touch something. How it moves is
//! its [`State`](super::State); with a ground to fall on it is a part of a
//! [`World`](crate::world::World).
//!
//! The shape is a list of [pieces](Piece), rounded convex hulls in the body's frame. Against a
//! plane their corners are all there is to know, and these are the body's contact points; a body
//! may also be given by points alone, which then touch planes and nothing else.

use super::quaternion::rotated_point_forms;
use crate::error::{Error, in_range};
use crate::geometry::{MassProperties, Piece};
use nalgebra::{Matrix3, Matrix4, Vector3};

/// A rigid body with its shape. Immutable once checked.
#[derive(Debug, Clone, PartialEq)]
pub struct RigidBody {
    mass: f64,
    inertia: Matrix3<f64>,
    inertia_inverse: Matrix3<f64>,
    specific_inertia: Matrix3<f64>,
    specific_inertia_inverse: Matrix3<f64>,
    contact_points: Vec<ContactPoint>,
    pieces: Vec<Piece>,
    /// For each piece, the contact point that is its first vertex.
    first_points: Vec<usize>,
    friction: Option<f64>,
    reach: f64,
    isotropic: bool,
}

/// One point of a body that can touch something.
#[derive(Debug, Clone, PartialEq)]
pub struct ContactPoint {
    /// c, m, body frame.
    pub position: Vector3<f64>,
    /// Q_x, Q_y, Q_z of eq. 3, m: (A(q) c)_k = ½ qᵀ Q_k q.
    pub forms: [Matrix4<f64>; 3],
    /// ρ, m: the radius by which the body is rounded there.
    pub radius: f64,
}

/// A point mass has no length of its own; m.
const REACH_OF_A_POINT: f64 = 1.0;

/// More contact points than this are taken for a mistake.
const MOST_CONTACT_POINTS: usize = 1000;

impl RigidBody {
    /// A body of `mass` (kg), `inertia` (kg m², body frame, about the centre of mass)
    /// and contact points (m, body frame, from the centre of mass), which touch planes and nothing
    /// else. One point in the centre of mass is a point mass; its inertia has no effect.
    ///
    /// # Errors
    /// A mass outside 1e-9…1e9 kg; an inertia matrix that is not symmetric and
    /// positive definite with principal moments within 1e-12…1e12 kg m² and a ratio
    /// of at most 1e6; no contact point or more than 1000, or one farther than 1e4 m
    /// from the centre of mass, or several all in the centre of mass.
    pub fn new(
        mass: f64,
        inertia: Matrix3<f64>,
        contact_points: &[Vector3<f64>],
    ) -> Result<Self, Error> {
        let points: Vec<_> = contact_points.iter().map(|&point| (point, 0.0)).collect();
        Self::with_points(mass, inertia, &points)
    }

    /// The body without pieces, of contact points with radii.
    fn with_points(
        mass: f64,
        inertia: Matrix3<f64>,
        points: &[(Vector3<f64>, f64)],
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
        for &coordinate in points.iter().flat_map(|(point, _)| point) {
            in_range("contact point coordinate (m)", coordinate, -1e4, 1e4, "-1e4 to 1e4")?;
        }
        let reach = points.iter().map(|(c, radius)| c.amax() + radius).fold(0.0, f64::max);
        let reach = match points {
            [(point, 0.0)] if *point == Vector3::zeros() => REACH_OF_A_POINT,
            _ => {
                let field = "farthest contact point coordinate (m)";
                in_range(field, reach, 1e-6, 1e4, "1e-6 to 1e4")?
            }
        };
        let contact_points = points
            .iter()
            .map(|&(position, radius)| ContactPoint {
                position,
                forms: rotated_point_forms(&position),
                radius,
            })
            .collect();
        let specific_inertia = inertia / mass;
        let sphere = Matrix3::from_diagonal_element(specific_inertia[(0, 0)]);
        Ok(Self {
            mass,
            inertia,
            inertia_inverse,
            isotropic: specific_inertia == sphere,
            specific_inertia,
            specific_inertia_inverse: inertia_inverse * mass,
            contact_points,
            pieces: Vec::new(),
            first_points: Vec::new(),
            friction: None,
            reach,
        })
    }

    /// A body of `mass` (kg), `inertia` (kg m², body frame, about the centre of mass) and `pieces`
    /// (body frame, from the centre of mass). Its contact points are the corners of the pieces, in
    /// their order.
    ///
    /// # Errors
    /// As [`RigidBody::new`].
    pub fn of_pieces(mass: f64, inertia: Matrix3<f64>, pieces: Vec<Piece>) -> Result<Self, Error> {
        let (mut points, mut first_points) = (Vec::new(), Vec::new());
        for piece in &pieces {
            first_points.push(points.len());
            let corners = piece.core().vertices().iter();
            points.extend(corners.map(|&corner| (corner, piece.radius())));
        }
        Ok(Self { pieces, first_points, ..Self::with_points(mass, inertia, &points)? })
    }

    /// A body of uniform density whose `pieces`, which must not overlap, are given in any frame; with
    /// its centre of mass in that frame (m), which is the origin of the body's own.
    ///
    /// # Errors
    /// No piece; as [`RigidBody::new`].
    pub fn solid(mass: f64, pieces: &[Piece]) -> Result<(Self, Vector3<f64>), Error> {
        let properties = MassProperties::of_all(pieces)?;
        let moved = pieces.iter().map(|p| p.moved_by(&Matrix3::identity(), &-properties.centre));
        let inertia = properties.inertia * (mass / properties.volume);
        // The two halves of a sum may differ in their last bits.
        let inertia = 0.5 * (inertia + inertia.transpose());
        let body = Self::of_pieces(mass, inertia, moved.collect::<Result<_, _>>()?)?;
        Ok((body, properties.centre))
    }

    /// This body with a coefficient of friction of its own in place of the
    /// [world's](crate::world::World::friction).
    ///
    /// # Errors
    /// A coefficient outside 0…10.
    pub fn with_friction(self, friction: f64) -> Result<Self, Error> {
        in_range("coefficient of friction", friction, 0.0, 10.0, "0 to 10")?;
        Ok(Self { friction: Some(friction), ..self })
    }

    /// A box with a contact point in every corner. `half_sides` in m; corners in the
    /// order (−,−,−), (+,−,−), (−,+,−), (+,+,−), (−,−,+), …: x changes fastest.
    ///
    /// # Errors
    /// As [`RigidBody::new`], and a half side outside 1e-6…1e4 m.
    pub fn with_box_corners(
        mass: f64,
        inertia: Matrix3<f64>,
        half_sides: Vector3<f64>,
    ) -> Result<Self, Error> {
        for &half_side in &half_sides {
            in_range("half side of the box (m)", half_side, 1e-6, 1e4, "1e-6 to 1e4")?;
        }
        match Piece::cuboid(half_sides) {
            Ok(piece) => Self::of_pieces(mass, inertia, vec![piece]),
            // Thinner than a piece may be: its corners can touch planes all the same.
            Err(_) => Self::new(mass, inertia, &box_corners(&half_sides)),
        }
    }

    /// A solid box of equal density with a contact point in every corner, in the order of
    /// [`RigidBody::with_box_corners`]. `half_sides` in m.
    ///
    /// # Errors
    /// As [`RigidBody::with_box_corners`].
    pub fn solid_box(mass: f64, half_sides: Vector3<f64>) -> Result<Self, Error> {
        Self::with_box_corners(mass, solid_box_inertia(mass, &half_sides), half_sides)
    }

    /// m, kg.
    #[must_use]
    pub fn mass(&self) -> f64 {
        self.mass
    }

    /// I, kg m², body frame.
    #[must_use]
    pub fn inertia(&self) -> &Matrix3<f64> {
        &self.inertia
    }

    /// I⁻¹, 1/(kg m²), body frame.
    #[must_use]
    pub fn inertia_inverse(&self) -> &Matrix3<f64> {
        &self.inertia_inverse
    }

    /// Î = I/m, m²: the inertia of a unit of mass.
    #[must_use]
    pub fn specific_inertia(&self) -> &Matrix3<f64> {
        &self.specific_inertia
    }

    /// Î⁻¹ = m I⁻¹, 1/m².
    #[must_use]
    pub fn specific_inertia_inverse(&self) -> &Matrix3<f64> {
        &self.specific_inertia_inverse
    }

    /// Whether all principal moments are equal, so that no spin changes by itself.
    #[must_use]
    pub fn is_isotropic(&self) -> bool {
        self.isotropic
    }

    /// The contact points, in the order of all per-contact arrays.
    #[must_use]
    pub fn contact_points(&self) -> &[ContactPoint] {
        &self.contact_points
    }

    /// The pieces of the body's shape, body frame; none where it was made of points.
    #[must_use]
    pub fn pieces(&self) -> &[Piece] {
        &self.pieces
    }

    /// The index of the contact point that is vertex `vertex` of piece `piece`.
    ///
    /// # Panics
    /// If there is no such piece.
    #[must_use]
    pub fn point_of(&self, piece: usize, vertex: usize) -> usize {
        self.first_points[piece] + vertex
    }

    /// The body's own coefficient of friction, if it has one.
    #[must_use]
    pub fn friction(&self) -> Option<f64> {
        self.friction
    }

    /// ℓ, m: the largest |coordinate| of a contact point and its radius, the length by which the
    /// certificate turns angles into distances; 1 m for a point mass, which has none.
    #[must_use]
    pub fn reach(&self) -> f64 {
        self.reach
    }
}

/// The corners of a box, x changing fastest.
fn box_corners(half_sides: &Vector3<f64>) -> [Vector3<f64>; 8] {
    let sign = |corner: usize, axis: usize| if corner >> axis & 1 == 1 { 1.0 } else { -1.0 };
    std::array::from_fn(|corner| Vector3::from_fn(|axis, _| sign(corner, axis) * half_sides[axis]))
}

/// The inertia of a solid box of equal density with `half_sides` (a, b, c) in m:
/// I = m/3 diag(b² + c², a² + c², a² + b²), kg m².
#[must_use]
pub fn solid_box_inertia(mass: f64, half_sides: &Vector3<f64>) -> Matrix3<f64> {
    let squares = half_sides.component_mul(half_sides);
    Matrix3::from_diagonal(&(mass / 3.0 * (Vector3::repeat(squares.sum()) - squares)))
}

/// I⁻¹ of a symmetric positive definite matrix.
fn checked_inverse(inertia: &Matrix3<f64>) -> Result<Matrix3<f64>, Error> {
    if !inertia.iter().all(|entry| entry.is_finite()) {
        return Err(Error::Inertia("has an entry that is not a finite number"));
    }
    if (inertia - inertia.transpose()).amax() > 1e-12 * inertia.amax() {
        return Err(Error::Inertia("is not symmetric"));
    }
    let moments = inertia.symmetric_eigenvalues();
    if moments.min() <= 0.0 {
        return Err(Error::Inertia("is not positive definite: a principal moment is 0 or less"));
    }
    if moments.min() < 1e-12 || moments.max() > 1e12 || moments.max() > 1e6 * moments.min() {
        return Err(Error::Inertia(
            "has principal moments outside 1e-12 to 1e12, or of a ratio above 1e6",
        ));
    }
    inertia.try_inverse().ok_or(Error::Inertia("cannot be inverted"))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn corners_come_with_x_changing_fastest() {
        let half_sides = Vector3::new(1.0, 2.0, 3.0);
        let body = RigidBody::with_box_corners(1.0, Matrix3::identity(), half_sides).unwrap();
        let corners: Vec<_> = body.contact_points().iter().map(|c| c.position).collect();
        assert_eq!(corners[0], Vector3::new(-1.0, -2.0, -3.0));
        assert_eq!(corners[1], Vector3::new(1.0, -2.0, -3.0));
        assert_eq!(corners[2], Vector3::new(-1.0, 2.0, -3.0));
        assert_eq!(corners[7], half_sides);
        assert_eq!(body.reach(), 3.0);
    }

    #[test]
    fn impossible_bodies_are_refused_by_name() {
        let cube = |mass, inertia| {
            RigidBody::with_box_corners(mass, inertia, Vector3::repeat(1.0))
                .unwrap_err()
                .to_string()
        };
        let unit = Matrix3::identity();
        for mass in [0.0, -1.0, f64::NAN, f64::INFINITY] {
            assert!(cube(mass, unit).starts_with("mass (kg) is"), "{mass}");
        }
        let skew = Matrix3::new(1.0, 0.5, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0);
        assert!(cube(1.0, skew).contains("not symmetric"));
        assert!(cube(1.0, -unit).contains("not positive definite"));
        assert!(cube(1.0, unit * f64::NAN).contains("finite"));
        assert!(RigidBody::new(1.0, unit, &[]).is_err());
        assert!(RigidBody::new(1.0, unit, &[Vector3::zeros(); 2]).is_err());
        assert!(RigidBody::new(1.0, unit, &[Vector3::zeros()]).is_ok(), "a point mass");
    }
}
