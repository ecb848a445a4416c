//! Shapes as files have them, and the core's pieces and bodies made of them.

use crate::colour::Colour;
use nalgebra::{Matrix3, Quaternion, Vector3, Vector4};
use serde::{Deserialize, Serialize};
use tumble_core::error::{Error, in_range};
use tumble_core::geometry::mesh::Mesh;
use tumble_core::geometry::{MassProperties, Piece};
use tumble_core::joint::JointFrame;
use tumble_core::mechanics::RigidBody;
use tumble_core::mechanics::body::solid_box_inertia;
use tumble_core::mechanics::quaternion::rotation;

/// Collision shape of a body, in its own frame.
#[derive(Debug, Clone, PartialEq)]
pub enum ModelShape {
    /// Convex pieces.
    Pieces(Vec<PlacedForm>),
    /// Contact points (m). They touch planes only.
    Points(Vec<[f64; 3]>),
}

/// Convex piece with its place.
#[derive(Debug, Clone, PartialEq)]
pub struct PlacedForm {
    /// Form of the piece.
    pub form: ModelForm,
    /// Place of the piece.
    pub place: ModelPlace,
}

/// Position and attitude of an object in an outer frame.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct ModelPlace {
    /// Position (m).
    pub position: [f64; 3],
    /// Unit quaternion w, x, y, z, own frame → outer frame.
    pub attitude: [f64; 4],
}

/// Convex form in its own frame.
#[derive(Debug, Clone, PartialEq)]
pub enum ModelForm {
    /// Box centred at the origin.
    Box {
        /// Side lengths (m).
        sides: [f64; 3],
    },
    /// Ball centred at the origin.
    Sphere {
        /// Radius (m).
        radius: f64,
    },
    /// Capsule along z, centred at the origin.
    Capsule {
        /// Distance between the centres of its end caps (m).
        length: f64,
        /// Radius (m).
        radius: f64,
    },
    /// Cylinder along z, centred at the origin.
    Cylinder {
        /// Length (m).
        length: f64,
        /// Radius (m).
        radius: f64,
        /// Number of sides of the prism that other pieces touch.
        sides: usize,
    },
    /// Cone along z. The origin is halfway between its base and its apex, which is above.
    Cone {
        /// Height (m).
        height: f64,
        /// Radius of the base (m).
        radius: f64,
        /// Number of sides of the pyramid that other pieces touch.
        sides: usize,
    },
    /// Ellipsoid centred at the origin.
    Ellipsoid {
        /// Half axes along x, y and z (m).
        half_axes: [f64; 3],
        /// Twice the number of meridians of the rounded hull that other pieces touch.
        sides: usize,
    },
    /// Rounded convex hull of points.
    Hull {
        /// Points (m).
        points: Vec<[f64; 3]>,
        /// Rounding radius (m).
        radius: f64,
    },
    /// Rounded convex mesh; triangles are counter-clockwise seen from outside.
    Mesh {
        /// Vertices (m).
        vertices: Vec<[f64; 3]>,
        /// Triangles, as indices into `vertices`.
        triangles: Vec<[usize; 3]>,
        /// Rounding radius (m).
        radius: f64,
        /// Colour in pictures; default from the body.
        colour: Option<Colour>,
    },
}

/// Checks the side lengths of a box (m).
///
/// # Errors
/// A length out of range; the message uses the terms of the file.
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
            Self::Cylinder { length, radius, sides } => {
                in_range("length of the cylinder (m)", *length, 2e-6, 2e4, "2e-6 to 2e4")?;
                Piece::cylinder(0.5 * length, *radius, *sides)
            }
            Self::Cone { height, radius, sides } => {
                in_range("height of the cone (m)", *height, 2e-6, 2e4, "2e-6 to 2e4")?;
                Piece::cone(0.5 * height, *radius, *sides)
            }
            Self::Ellipsoid { half_axes, sides } => {
                Piece::ellipsoid(Vector3::from(*half_axes), *sides)
            }
            Self::Hull { points, radius } => {
                let points: Vec<_> = points.iter().copied().map(Vector3::from).collect();
                Piece::hull(&points, *radius)
            }
            Self::Mesh { vertices, triangles, radius, .. } => {
                let vertices = vertices.iter().copied().map(Vector3::from).collect();
                Piece::mesh(&Mesh::new(vertices, triangles.clone())?, *radius)
            }
        }
    }

    /// Name of the field in files.
    pub fn field(&self) -> &'static str {
        match self {
            Self::Box { .. } => "box",
            Self::Sphere { .. } => "sphere",
            Self::Capsule { .. } => "capsule",
            Self::Cylinder { .. } => "cylinder",
            Self::Cone { .. } => "cone",
            Self::Ellipsoid { .. } => "ellipsoid",
            Self::Hull { .. } => "hull",
            Self::Mesh { .. } => "mesh",
        }
    }
}

impl ModelPlace {
    /// Place as the frame of a joint.
    pub fn frame(&self) -> JointFrame {
        JointFrame { anchor: self.position.into(), attitude: self.attitude.into() }
    }

    /// Place of the frame of a joint.
    pub fn from_frame(frame: &JointFrame) -> Self {
        Self { position: frame.anchor.into(), attitude: frame.attitude.into() }
    }

    /// Identity: both frames coincide.
    pub const ORIGIN: Self = Self { position: [0.0; 3], attitude: [1.0, 0.0, 0.0, 0.0] };

    /// This place composed with `outer`: the result is in the frame in which `outer` is given.
    pub fn within(&self, outer: &Self) -> Self {
        let [ours, theirs] = [self, outer].map(Self::quaternion);
        let position =
            Vector3::from(outer.position) + outer.rotation() * Vector3::from(self.position);
        let turned = if ours == Quaternion::identity() { theirs } else { theirs * ours };
        let [x, y, z, w] = *turned.as_vector().as_ref();
        Self { position: position.into(), attitude: [w, x, y, z] }
    }

    /// Rotation matrix, own frame → outer frame.
    pub fn rotation(&self) -> Matrix3<f64> {
        rotation(&Vector4::from(self.attitude))
    }

    fn quaternion(&self) -> Quaternion<f64> {
        let [w, x, y, z] = self.attitude;
        Quaternion::new(w, x, y, z)
    }

    /// Unit quaternion w, x, y, z of the rotation about `axis` by `degrees`.
    pub fn turn(axis: Vector3<f64>, degrees: f64) -> [f64; 4] {
        let axis = nalgebra::Unit::new_normalize(axis);
        let (sine, cosine) = libm::sincos(0.5 * degrees.to_radians());
        [cosine, sine * axis[0], sine * axis[1], sine * axis[2]]
    }
}

impl PlacedForm {
    /// Piece in the outer frame.
    ///
    /// # Errors
    /// The errors of the core for an invalid shape.
    pub fn piece(&self) -> Result<Piece, Error> {
        let piece = self.form.piece()?;
        if self.place == ModelPlace::ORIGIN {
            return Ok(piece);
        }
        piece.moved_by(&self.place.rotation(), &self.place.position.into())
    }
}

/// Mass properties of a solid of uniform density and a mass of 1 kg.
pub struct SolidModel {
    /// Volume (m³).
    pub volume: f64,
    /// Centre of mass in the shape's frame (m).
    pub centre: Vector3<f64>,
    /// Inertia about the centre of mass per unit mass (m²).
    pub specific_inertia: Matrix3<f64>,
}

impl SolidModel {
    /// Solid with these properties.
    pub fn from_properties(properties: &MassProperties) -> Self {
        let (volume, centre) = (properties.volume, properties.centre);
        let inertia = properties.inertia / volume;
        // Restores the symmetry lost by rounding.
        let specific_inertia = 0.5 * (inertia + inertia.transpose());
        Self { volume, centre, specific_inertia }
    }
}

impl ModelShape {
    /// Pieces in the shape's frame; empty for points.
    pub fn pieces(&self) -> Result<Vec<Piece>, Error> {
        match self {
            Self::Pieces(pieces) => pieces.iter().map(PlacedForm::piece).collect(),
            Self::Points(_) => Ok(Vec::new()),
        }
    }

    /// Mass properties, with the pieces taken as disjoint; `None` for points.
    pub fn solid(&self) -> Result<Option<SolidModel>, Error> {
        let Self::Pieces(placed) = self else { return Ok(None) };
        let mut solid = SolidModel::from_properties(&MassProperties::from_pieces(&self.pieces()?)?);
        if let [PlacedForm { form, place: ModelPlace::ORIGIN }] = &placed[..] {
            // Exact values known by symmetry.
            match form {
                ModelForm::Box { sides } => {
                    solid.specific_inertia = solid_box_inertia(1.0, &(0.5 * Vector3::from(*sides)));
                    solid.centre = Vector3::zeros();
                }
                ModelForm::Sphere { .. }
                | ModelForm::Capsule { .. }
                | ModelForm::Cylinder { .. }
                | ModelForm::Ellipsoid { .. } => solid.centre = Vector3::zeros(),
                ModelForm::Cone { .. } | ModelForm::Hull { .. } | ModelForm::Mesh { .. } => {}
            }
        }
        Ok(Some(solid))
    }

    /// Rigid body of this shape with `mass` (kg).
    ///
    /// `centre` is the centre of mass in the shape's frame (m), `inertia` the tensor about it (kg
    /// m²).
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
                RigidBody::from_pieces(mass, inertia, pieces)
            }
            Self::Points(points) => {
                let points: Vec<_> = points.iter().copied().map(Vector3::from).collect();
                RigidBody::new(mass, inertia, &points)
            }
        }
    }
}
