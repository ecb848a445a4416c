//! Error messages of the core with the fields of the file.

use tumble_core::error::Error;
use tumble_core::world::Coefficient;

/// Error message that begins with the responsible field.
pub fn field_of(error: &Error) -> String {
    let field = match error {
        Error::Inertia(_) | Error::MomentsApart { .. } | Error::Moment { .. } => "inertia",
        Error::Shape { shape: "the box", .. } => "box",
        Error::Shape { shape: "the hull", .. } => "hull",
        Error::Shape { shape: "the mesh", .. } => "mesh",
        Error::OutOfRange { field, .. } | Error::Count { field, .. } => match *field {
            "mass (kg)" => "mass",
            "coefficient of friction" => "friction",
            "coefficient of restitution" => "restitution",
            "side of the box (m)" => "box",
            "radius of the sphere (m)" => "sphere",
            "length of the capsule (m)" | "radius of the capsule (m)" => "capsule",
            "length of the cylinder (m)" | "radius of the cylinder (m)" => "cylinder",
            "height of the cone (m)" | "radius of the cone (m)" => "cone",
            "half axis of the ellipsoid (m)"
            | "shortest half axis of the ellipsoid, relative to the longest" => "ellipsoid",
            "sides of a smooth piece's core" => "sides",
            "radius of the hull (m)" | "radius of the mesh (m)" => "radius",
            "points of the hull" | "vertices of the hull" => "hull",
            "largest extent of the hull (m)" => "hull",
            "contact points" | "contact point coordinate (m)" => "points",
            "position (m)" | "position of the piece (m)" => "position",
            "norm of the attitude quaternion" => "attitude",
            "velocity (m/s)" => "velocity",
            "spin (rad/s)" => "spin",
            other => Coefficient::from_quantity(other).map_or("shape", Coefficient::name),
        },
        _ => "shape",
    };
    format!("{field}: {error}")
}
