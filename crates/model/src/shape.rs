//! Shapes as scenario files and run.json say them, and the bodies that they make.

use nalgebra::{Matrix3, Quaternion, UnitQuaternion, Vector3, Vector4};
use serde::{Deserialize, Serialize};
use tumble_core::error::{Error, in_range};
use tumble_core::geometry::mesh::Mesh;
use tumble_core::geometry::{MassProperties, Piece};
use tumble_core::joint::JointFrame;
use tumble_core::mechanics::RigidBody;
use tumble_core::mechanics::body::solid_box_inertia;
use tumble_core::mechanics::quaternion::rotation;

/// The shape of a body, in a frame of its own.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum ModelShape {
    /// Convex pieces.
    Pieces(Vec<PlacedForm>),
    /// Points, m, that touch planes and nothing else.
    Points(Vec<[f64; 3]>),
}

/// A convex piece somewhere.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct PlacedForm {
    /// What it is.
    pub form: ModelForm,
    /// Where it is.
    pub place: ModelPlace,
}

/// Where something is, in the frame that it is placed in.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct ModelPlace {
    /// m.
    pub position: [f64; 3],
    /// Unit quaternion w, x, y, z, own frame → frame.
    pub attitude: [f64; 4],
}

/// A convex form about its own origin, lengths in m.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum ModelForm {
    /// A box.
    Box {
        /// m.
        sides: [f64; 3],
    },
    /// A ball.
    Sphere {
        /// m.
        radius: f64,
    },
    /// Along z; `length` between the centres of its ends.
    Capsule {
        /// m.
        length: f64,
        /// m.
        radius: f64,
    },
    /// The convex hull of points, rounded.
    Hull {
        /// m.
        points: Vec<[f64; 3]>,
        /// m.
        radius: f64,
    },
    /// A convex mesh, rounded; triangles counter-clockwise seen from outside.
    Mesh {
        /// m.
        vertices: Vec<[f64; 3]>,
        /// Indices of vertices.
        triangles: Vec<[usize; 3]>,
        /// m.
        radius: f64,
    },
}

/// Refuses sides of a box (m) that are none, in the words of who wrote them.
///
/// # Errors
/// A side that is not positive.
pub fn check_sides(sides: &[f64; 3]) -> Result<(), Error> {
    let field = "side of the box (m)";
    sides.iter().try_for_each(|side| in_range(field, *side, 2e-6, 2e4, "2e-6 to 2e4").map(drop))
}

impl ModelForm {
    fn piece(&self) -> Result<Piece, Error> {
        match self {
            Self::Box { sides } => {
                check_sides(sides)?;
                let piece = Piece::cuboid(0.5 * Vector3::from(*sides));
                piece.map_err(|error| match error {
                    Error::Shape { why, .. } => Error::Shape { shape: "the box", why },
                    other => other,
                })
            }
            Self::Sphere { radius } => Piece::sphere(*radius),
            Self::Capsule { length, radius } => {
                in_range("length of the capsule (m)", *length, 2e-6, 2e4, "2e-6 to 2e4")?;
                Piece::capsule(0.5 * length, *radius)
            }
            Self::Hull { points, radius } => {
                let points: Vec<_> = points.iter().copied().map(Vector3::from).collect();
                Piece::hull(&points, *radius)
            }
            Self::Mesh { vertices, triangles, radius } => {
                let vertices = vertices.iter().copied().map(Vector3::from).collect();
                Piece::mesh(&Mesh::new(vertices, triangles.clone())?, *radius)
            }
        }
    }

    /// The name of its field.
    pub fn field(&self) -> &'static str {
        match self {
            Self::Box { .. } => "box",
            Self::Sphere { .. } => "sphere",
            Self::Capsule { .. } => "capsule",
            Self::Hull { .. } => "hull",
            Self::Mesh { .. } => "mesh",
        }
    }
}

impl ModelPlace {
    /// As the frame of a joint.
    #[must_use]
    pub fn frame(&self) -> JointFrame {
        JointFrame { anchor: self.position.into(), attitude: self.attitude.into() }
    }

    /// That of a frame of a joint.
    #[must_use]
    pub fn of(frame: &JointFrame) -> Self {
        Self { position: frame.anchor.into(), attitude: frame.attitude.into() }
    }

    /// Where frame and own frame are the same.
    pub const ORIGIN: Self = Self { position: [0.0; 3], attitude: [1.0, 0.0, 0.0, 0.0] };

    /// This place, seen from where `outer` is seen from.
    pub fn within(&self, outer: &Self) -> Self {
        let [ours, theirs] = [self, outer].map(Self::quaternion);
        let position =
            Vector3::from(outer.position) + outer.rotation() * Vector3::from(self.position);
        let turned = if ours == Quaternion::identity() { theirs } else { theirs * ours };
        let [x, y, z, w] = *turned.as_vector().as_ref();
        Self { position: position.into(), attitude: [w, x, y, z] }
    }

    /// Own frame → frame.
    pub fn rotation(&self) -> Matrix3<f64> {
        rotation(&Vector4::from(self.attitude))
    }

    fn quaternion(&self) -> Quaternion<f64> {
        let [w, x, y, z] = self.attitude;
        Quaternion::new(w, x, y, z)
    }

    /// The turn about `axis` by `degrees`.
    pub fn turn(axis: Vector3<f64>, degrees: f64) -> [f64; 4] {
        let axis = nalgebra::Unit::new_normalize(axis);
        let q = UnitQuaternion::from_axis_angle(&axis, degrees.to_radians());
        [q.w, q.i, q.j, q.k]
    }
}

impl PlacedForm {
    /// The piece, in the frame that it is placed in.
    ///
    /// # Errors
    /// What the library refuses of a shape.
    pub fn piece(&self) -> Result<Piece, Error> {
        let piece = self.form.piece()?;
        if self.place == ModelPlace::ORIGIN {
            return Ok(piece);
        }
        piece.moved_by(&self.place.rotation(), &self.place.position.into())
    }
}

/// What a shape of uniform density has, of a mass of 1 kg.
pub struct SolidModel {
    /// m³.
    pub volume: f64,
    /// The centre of mass, m, in the frame of the shape.
    pub centre: Vector3<f64>,
    /// About the centre of mass, m².
    pub specific_inertia: Matrix3<f64>,
}

impl ModelShape {
    /// The pieces, in the shape's frame; none of a shape of points.
    pub fn pieces(&self) -> Result<Vec<Piece>, Error> {
        match self {
            Self::Pieces(pieces) => pieces.iter().map(PlacedForm::piece).collect(),
            Self::Points(_) => Ok(Vec::new()),
        }
    }

    /// Volume, centre and inertia, the pieces taken as disjoint; `None` of points.
    pub fn solid(&self) -> Result<Option<SolidModel>, Error> {
        let Self::Pieces(placed) = self else { return Ok(None) };
        let properties = MassProperties::of_all(&self.pieces()?)?;
        let (volume, mut centre) = (properties.volume, properties.centre);
        let mut specific_inertia = properties.inertia / volume;
        // The two halves of a sum may differ in their last bits.
        specific_inertia = 0.5 * (specific_inertia + specific_inertia.transpose());
        if let [PlacedForm { form, place: ModelPlace::ORIGIN }] = &placed[..] {
            // What symmetry says, without rounding.
            match form {
                ModelForm::Box { sides } => {
                    specific_inertia = solid_box_inertia(1.0, &(0.5 * Vector3::from(*sides)));
                    centre = Vector3::zeros();
                }
                ModelForm::Sphere { .. } | ModelForm::Capsule { .. } => centre = Vector3::zeros(),
                ModelForm::Hull { .. } | ModelForm::Mesh { .. } => {}
            }
        }
        Ok(Some(SolidModel { volume, centre, specific_inertia }))
    }

    /// The body of this shape with its centre of mass at `centre` (m, the shape's frame) and
    /// `inertia` about it (kg m²).
    pub fn body(
        &self,
        mass: f64,
        inertia: Matrix3<f64>,
        centre: &Vector3<f64>,
    ) -> Result<RigidBody, Error> {
        match self {
            Self::Pieces(_) => {
                let mut pieces = self.pieces()?;
                if *centre != Vector3::zeros() {
                    let moved = |piece: &Piece| piece.moved_by(&Matrix3::identity(), &-centre);
                    pieces = pieces.iter().map(moved).collect::<Result<_, _>>()?;
                }
                RigidBody::of_pieces(mass, inertia, pieces)
            }
            Self::Points(points) => {
                let points: Vec<_> = points.iter().copied().map(Vector3::from).collect();
                RigidBody::new(mass, inertia, &points)
            }
        }
    }
}
