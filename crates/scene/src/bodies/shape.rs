//! Convex pieces and shapes of bodies in exact form, and the core's pieces and bodies made of them.

use super::entries::{AttitudeEntry, MeshValue, PieceEntry, SurfaceTable, plain};
use super::place::Place;
use nalgebra::{Matrix3, Vector3};
use tumble_core::error::{Error, in_range};
use tumble_core::geometry::mesh::Mesh;
use tumble_core::geometry::smooth::USUAL_SIDES;
use tumble_core::geometry::{MassProperties, Piece};
use tumble_core::mechanics::RigidBody;
use tumble_core::mechanics::body::solid_box_inertia;
use tumble_model::fields::Exactly;

/// Collision shape of a body, in its own frame.
#[derive(Debug, Clone, PartialEq)]
pub enum BodyShape {
    /// Convex pieces.
    Pieces(Vec<PieceEntry>),
    /// Contact points (m). They touch planes only.
    Points(Vec<[f64; 3]>),
}

impl PieceEntry {
    /// Names of the given forms.
    pub fn forms(&self) -> Vec<&'static str> {
        let given = [
            ("box", self.cuboid.is_some()),
            ("sphere", self.sphere.is_some()),
            ("capsule", self.capsule.is_some()),
            ("cylinder", self.cylinder.is_some()),
            ("cone", self.cone.is_some()),
            ("ellipsoid", self.ellipsoid.is_some()),
            ("hull", self.hull.is_some()),
            ("mesh", self.mesh.is_some()),
        ];
        given.into_iter().filter(|(_, given)| *given).map(|(form, _)| form).collect()
    }

    /// Name of its form.
    pub fn field(&self) -> &'static str {
        self.forms().first().copied().unwrap_or("shape")
    }

    /// Place.
    pub fn place(&self) -> Place {
        let attitude = match self.attitude.as_ref().map(AttitudeEntry::quaternion) {
            Some(Ok(Some(quaternion))) => quaternion,
            _ => Place::ORIGIN.attitude,
        };
        Place { position: self.position.unwrap_or_default().0, attitude }
    }

    /// This piece at another place.
    pub fn placed_at(self, place: &Place) -> Self {
        let (position, attitude) = match *place {
            Place::ORIGIN => (None, None),
            Place { position, attitude } => {
                (Some(Exactly(position)), Some(AttitudeEntry::exact(attitude)))
            }
        };
        Self { position, attitude, ..self }
    }

    /// Piece with a hull of these points (m).
    pub fn from_hull(points: impl IntoIterator<Item = [f64; 3]>) -> Self {
        let hull = Some(points.into_iter().map(Exactly).collect());
        Self { hull, ..Self::default() }
    }

    /// Triangles, and where they are, of a part of a look that need not be convex.
    pub fn look_surface(&self) -> Option<&SurfaceTable> {
        self.surface.as_ref()
    }

    /// Piece in the outer frame.
    ///
    /// # Errors
    /// The errors of the core for an invalid form.
    pub fn piece(&self) -> Result<Piece, Error> {
        let piece = self.form()?;
        let place = self.place();
        if place == Place::ORIGIN {
            return Ok(piece);
        }
        piece.moved_by(&place.rotation(), &place.position.into())
    }

    /// Piece in its own frame.
    fn form(&self) -> Result<Piece, Error> {
        let length = |field, length| in_range(field, length, 2e-6, 2e4, "2e-6 to 2e4");
        let (radius, sides) = (self.radius.unwrap_or(0.0), self.sides.unwrap_or(USUAL_SIDES));
        if let Some(cuboid) = &self.cuboid {
            let sides = cuboid.vector();
            for side in &sides {
                length("side of the box (m)", *side)?;
            }
            Piece::cuboid(0.5 * sides).map_err(|error| match error {
                Error::Shape { why, .. } => Error::Shape { shape: "the box", why },
                other => other,
            })
        } else if let Some(radius) = self.sphere {
            Piece::sphere(radius)
        } else if let Some(tube) = self.capsule {
            length("length of the capsule (m)", tube.length)?;
            Piece::capsule(0.5 * tube.length, tube.radius)
        } else if let Some(tube) = self.cylinder {
            length("length of the cylinder (m)", tube.length)?;
            Piece::cylinder(0.5 * tube.length, tube.radius, sides)
        } else if let Some(cone) = self.cone {
            length("height of the cone (m)", cone.height)?;
            Piece::cone(0.5 * cone.height, cone.radius, sides)
        } else if let Some(half_axes) = self.ellipsoid {
            Piece::ellipsoid(half_axes.0.into(), sides)
        } else if let Some(MeshValue::Own(surface)) = &self.mesh {
            let vertices = plain(&surface.vertices).into_iter().map(Vector3::from).collect();
            let triangles = surface.triangles.iter().map(|three| three.0).collect();
            Piece::mesh(&Mesh::new(vertices, triangles)?, radius)
        } else {
            let points = plain(self.hull.as_deref().unwrap_or_default());
            Piece::hull(&points.into_iter().map(Vector3::from).collect::<Vec<_>>(), radius)
        }
    }
}

/// Mass properties of a solid of uniform density and a mass of 1 kg.
pub struct SpecificSolid {
    /// Volume (m³).
    pub volume: f64,
    /// Centre of mass in the shape's frame (m).
    pub centre: Vector3<f64>,
    /// Inertia about the centre of mass per unit mass (m²).
    pub specific_inertia: Matrix3<f64>,
}

impl SpecificSolid {
    /// Solid with these properties.
    pub fn from_properties(properties: &MassProperties) -> Self {
        let (volume, centre) = (properties.volume, properties.centre);
        let inertia = properties.inertia / volume;
        // Restores the symmetry lost by rounding.
        let specific_inertia = 0.5 * (inertia + inertia.transpose());
        Self { volume, centre, specific_inertia }
    }
}

impl BodyShape {
    /// Pieces in the shape's frame; empty for points.
    pub fn pieces(&self) -> Result<Vec<Piece>, Error> {
        match self {
            Self::Pieces(pieces) => pieces.iter().map(PieceEntry::piece).collect(),
            Self::Points(_) => Ok(Vec::new()),
        }
    }

    /// Mass properties, with the pieces taken as disjoint; `None` for points.
    pub fn solid(&self) -> Result<Option<SpecificSolid>, Error> {
        let Self::Pieces(placed) = self else { return Ok(None) };
        let properties = MassProperties::from_pieces(&self.pieces()?)?;
        let mut solid = SpecificSolid::from_properties(&properties);
        // Exact values known by symmetry.
        if let [piece] = &placed[..]
            && piece.place() == Place::ORIGIN
        {
            if let Some(sides) = &piece.cuboid {
                solid.specific_inertia = solid_box_inertia(1.0, &(0.5 * sides.vector()));
            }
            if !["cone", "hull", "mesh"].contains(&piece.field()) {
                solid.centre = Vector3::zeros();
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
