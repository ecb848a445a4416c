//! The rigid body: mass, inertia and the shape that can touch something. How it moves is
//! its [`State`](super::State); with a ground to fall on it is a part of a
//! [`World`](crate::world::World).
//!
//! The shape is a list of [pieces](Piece), rounded convex hulls in the body's frame. Against a
//! plane their corners are all there is to know, and these are the body's contact points; a body
//! may also be given by points alone, which then touch planes and nothing else.

use crate::error::{Error, all_in_range, in_range};
use crate::geometry::{MassProperties, Piece};
use nalgebra::{Matrix3, Vector3};

/// A rigid body with its shape. Immutable once checked.
#[derive(Debug, Clone, PartialEq)]
pub struct RigidBody {
    matter: Matter,
    contact_points: Vec<ContactPoint>,
    pieces: Vec<Piece>,
    /// For each piece, the contact point that is its first vertex.
    first_points: Vec<usize>,
    friction: Option<f64>,
    restitution: Option<f64>,
    reach: f64,
}

/// What of a body resists a change of its motion.
#[derive(Debug, Clone, PartialEq)]
struct Matter {
    mass: f64,
    inertia: Matrix3<f64>,
    inertia_inverse: Matrix3<f64>,
    specific_inertia: Matrix3<f64>,
    specific_inertia_inverse: Matrix3<f64>,
    isotropic: bool,
}

/// One point of a body that can touch something.
#[derive(Debug, Clone, PartialEq)]
pub struct ContactPoint {
    /// c, m, body frame.
    pub position: Vector3<f64>,
    /// ρ, m: the radius by which the body is rounded there.
    pub radius: f64,
}

/// A point mass has no length of its own; m.
const REACH_OF_A_POINT: f64 = 1.0;

/// More contact points than this are taken for a mistake.
const MOST_CONTACT_POINTS: usize = 1000;

/// The largest ratio of two principal moments.
const MOST_APART: f64 = 1e6;
/// Principal moments in units of mass times length². With cubes of 2 m and 1 kg no step of 6000 of
/// the native solver failed at 10⁻⁶, at 10⁻⁷ five did, at 10⁻¹⁰ most; up to 10¹⁰ none did, but a
/// thin needle's steps fail at 10⁸.
const LEAST_MOMENT: f64 = 1e-6;
const LARGEST_MOMENT: f64 = 1e6;

impl RigidBody {
    /// A body of `mass` (kg), `inertia` (kg m², body frame, about the centre of mass)
    /// and contact points (m, body frame, from the centre of mass), which touch planes and nothing
    /// else. One point in the centre of mass is a point mass; its inertia has no effect.
    ///
    /// # Errors
    /// A mass outside 1e-9…1e9 kg; an inertia matrix that is not symmetric and positive
    /// definite, or whose principal moments differ by more than a factor of 1e6, or do not fit
    /// mass and contact points (below); no contact point or more than 1000, or one farther than
    /// 1e4 m from the centre of mass, or several all in the centre of mass.
    ///
    /// A force F at the distance a from an axis makes the point faster by (1/m + a²/I) F a second.
    /// Where the first term is 10⁻⁶ of the second or less, doubles keep too few of its digits for
    /// a step to be solved; the other way round points that are close to each other become one to
    /// the solver. So each principal moment I_k must obey
    ///
    /// ```text
    /// 10⁻⁶ m a_k² ≤ I_k ≤ 10⁶ m (a₁² + a₂² + a₃²)
    /// ```
    ///
    /// with a_k the largest distance of a contact point from the k-th principal axis, its radius
    /// included. Solid boxes
    /// of every size are far inside; the tutorial's cube has I = 5·10⁻⁴ m a².
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
        all_in_range(
            "contact point coordinate (m)",
            points.iter().flat_map(|(point, _)| point),
            -1e4,
            1e4,
            "-1e4 to 1e4",
        )?;
        let reach = points.iter().map(|(c, radius)| c.amax() + radius).fold(0.0, f64::max);
        let reach = match points {
            [(point, 0.0)] if *point == Vector3::zeros() => REACH_OF_A_POINT,
            _ => {
                let field = "farthest contact point coordinate (m)";
                in_range(field, reach, 1e-6, 1e4, "1e-6 to 1e4")?
            }
        };
        check_moments(mass, &inertia, points)?;
        let contact_points =
            points.iter().map(|&(position, radius)| ContactPoint { position, radius }).collect();
        let specific_inertia = inertia / mass;
        let sphere = Matrix3::from_diagonal_element(specific_inertia[(0, 0)]);
        let matter = Matter {
            mass,
            inertia,
            inertia_inverse,
            isotropic: specific_inertia == sphere,
            specific_inertia,
            specific_inertia_inverse: inertia_inverse * mass,
        };
        Ok(Self {
            matter,
            contact_points,
            pieces: Vec::new(),
            first_points: Vec::new(),
            friction: None,
            restitution: None,
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

    /// This shape with another `mass` (kg) and `inertia` (kg m², body frame, about the centre of
    /// mass).
    ///
    /// # Errors
    /// As [`RigidBody::new`].
    pub fn with_mass(&self, mass: f64, inertia: Matrix3<f64>) -> Result<Self, Error> {
        let points = self.contact_points.iter().map(|point| (point.position, point.radius));
        let points: Vec<_> = points.collect();
        let Self { matter, .. } = Self::with_points(mass, inertia, &points)?;
        Ok(Self { matter, ..self.clone() })
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

    /// This body with a coefficient of restitution of its own in place of the
    /// [world's](crate::world::World::restitution).
    ///
    /// # Errors
    /// A coefficient outside 0…1.
    pub fn with_restitution(self, restitution: f64) -> Result<Self, Error> {
        in_range("coefficient of restitution", restitution, 0.0, 1.0, "0 to 1")?;
        Ok(Self { restitution: Some(restitution), ..self })
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
        all_in_range("half side of the box (m)", &half_sides, 1e-6, 1e4, "1e-6 to 1e4")?;
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

    /// The body without pieces, which meets no other.
    pub(crate) fn without_shape(&self) -> Self {
        Self { pieces: Vec::new(), ..self.clone() }
    }

    /// m, kg.
    #[must_use]
    pub fn mass(&self) -> f64 {
        self.matter.mass
    }

    /// I, kg m², body frame.
    #[must_use]
    pub fn inertia(&self) -> &Matrix3<f64> {
        &self.matter.inertia
    }

    /// I⁻¹, 1/(kg m²), body frame.
    #[must_use]
    pub fn inertia_inverse(&self) -> &Matrix3<f64> {
        &self.matter.inertia_inverse
    }

    /// Î = I/m, m²: the inertia of a unit of mass.
    #[must_use]
    pub fn specific_inertia(&self) -> &Matrix3<f64> {
        &self.matter.specific_inertia
    }

    /// Î⁻¹ = m I⁻¹, 1/m².
    #[must_use]
    pub fn specific_inertia_inverse(&self) -> &Matrix3<f64> {
        &self.matter.specific_inertia_inverse
    }

    /// Whether all principal moments are equal, so that no spin changes by itself.
    #[must_use]
    pub fn is_isotropic(&self) -> bool {
        self.matter.isotropic
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

    /// The body's own coefficient of restitution, if it has one.
    #[must_use]
    pub fn restitution(&self) -> Option<f64> {
        self.restitution
    }

    /// ℓ, m: the largest |coordinate| of a contact point and its radius, the length by which the
    /// certificate turns angles into distances; 1 m for a point mass, which has none.
    #[must_use]
    pub fn reach(&self) -> f64 {
        self.reach
    }
}

/// The corners of a box with these half sides, m, about its middle, x changing fastest.
#[must_use]
pub fn box_corners(half_sides: &Vector3<f64>) -> [Vector3<f64>; 8] {
    let sign = |corner: usize, axis: usize| if corner >> axis & 1 == 1 { 1.0 } else { -1.0 };
    std::array::from_fn(|corner| Vector3::from_fn(|axis, _| sign(corner, axis) * half_sides[axis]))
}

impl RigidBody {
    /// The same body in other units of `mass` (kg) and `length` (m), without its pieces: what
    /// touches planes.
    pub(crate) fn in_units(&self, mass: f64, length: f64) -> Self {
        let area = length * length;
        let moment = mass * area;
        let contact_points = self.contact_points.iter().map(|point| {
            let position = point.position / length;
            let radius = point.radius / length;
            ContactPoint { position, radius }
        });
        let own = &self.matter;
        Self {
            matter: Matter {
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
            friction: self.friction,
            restitution: self.restitution,
            reach: self.reach / length,
        }
    }
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
    let (least, largest) = (moments.min(), moments.max());
    if least <= 0.0 {
        return Err(Error::Inertia("is not positive definite: a principal moment is 0 or less"));
    }
    if largest > MOST_APART * least {
        return Err(Error::MomentsApart { least, largest });
    }
    inertia.try_inverse().ok_or(Error::Inertia("cannot be inverted"))
}

/// Principal moments of inertia within the range that [`RigidBody::new`] describes.
fn check_moments(
    mass: f64,
    inertia: &Matrix3<f64>,
    points: &[(Vector3<f64>, f64)],
) -> Result<(), Error> {
    let axes = inertia.symmetric_eigen();
    let squares: [f64; 3] = std::array::from_fn(|k| {
        let axis = axes.eigenvectors.column(k);
        let arm = |(point, radius): &(Vector3<f64>, f64)| point.cross(&axis).norm() + radius;
        points.iter().map(arm).fold(0.0, f64::max).powi(2)
    });
    let sum = squares.iter().sum::<f64>();
    // Nothing turns a point mass.
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

    /// Whatever the size, only what mass, inertia and points are to each other counts: the same
    /// body in other units is taken or refused as well.
    #[test]
    fn the_range_of_the_inertia_scales_with_the_body() {
        for (mass, length) in [(1e-6, 5e-4), (1.0, 1.0), (1e9, 50.0), (1e-9, 1e4), (1e9, 1e-5)] {
            let half_sides = Vector3::new(0.2, 0.5, 1.0) * length;
            assert!(RigidBody::solid_box(mass, half_sides).is_ok(), "{mass} {length}");
            for (part, fits) in [(1e-7, false), (1e-5, true), (1e5, true), (1e7, false)] {
                let inertia = Matrix3::from_diagonal_element(part * mass * length * length);
                let body = RigidBody::with_box_corners(mass, inertia, half_sides);
                assert_eq!(body.is_ok(), fits, "{mass} {length} {part}: {body:?}");
            }
        }
        // A rod's own inertia about its length is small, and so are the arms of its corners.
        let rod = Vector3::new(0.5, 0.5e-3, 0.5e-3);
        assert!(RigidBody::solid_box(1.0, rod).is_ok());
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
        assert!(cube(1.0, unit * 1e-6).contains("1e-6 kg m²; allowed with this mass"));
        assert!(cube(1e-9, unit).contains("2.0e-15 to 6.0e-3"));
        let needle = Matrix3::from_diagonal(&Vector3::new(1e-7, 1.0, 1.0));
        assert!(cube(1.0, needle).contains("ratio of at most 1e6"));
        assert!(RigidBody::new(1.0, unit, &[]).is_err());
        assert!(RigidBody::new(1.0, unit, &[Vector3::zeros(); 2]).is_err());
        assert!(RigidBody::new(1.0, unit, &[Vector3::zeros()]).is_ok(), "a point mass");
    }
}
