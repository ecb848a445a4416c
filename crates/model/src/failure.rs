//! Errors of input, settings and files.

use super::shown;
use std::fmt;
use std::path::Path;
use tumble_core::error::Error;
use tumble_core::world::Coefficient;

/// Reason of a failure, as one sentence.
#[derive(Debug)]
pub enum Failure {
    /// Invalid input that the user can correct.
    Input(String),
    /// Invalid value of a field of the scene, or of an option.
    Setting {
        /// Path of the field, as in a scenario file.
        name: String,
        /// Description of the fault.
        why: String,
    },
    /// Anything else.
    Other(String),
}

impl Failure {
    /// Failure of the field `name`.
    pub fn setting(name: &str, why: impl fmt::Display) -> Self {
        Self::Setting { name: name.to_owned(), why: why.to_string() }
    }

    /// Failure of the field `name`, which has no effect with `place`.
    pub fn idle(name: &str, place: &str) -> Self {
        Self::setting(name, format!("it has no meaning with {place}; leave it out"))
    }

    /// Rejects the first given of `fields`, which have no effect with `place`.
    ///
    /// # Errors
    /// A given field.
    pub fn refuse_idle(place: &str, fields: &[(&str, bool)]) -> Result<(), Self> {
        let given = fields.iter().find(|(_, given)| *given);
        given.map_or(Ok(()), |(name, _)| Err(Self::idle(name, place)))
    }

    /// Adds the name of the file to the message.
    pub fn in_file(self, path: &Path) -> Self {
        match self {
            Self::Other(_) => self,
            _ => Self::Input(format!("{}: {self}", shown::path(path))),
        }
    }

    /// This failure with the table `outer` around its field.
    pub fn within(self, outer: &str) -> Self {
        match self {
            Self::Setting { name, why } => Self::Setting { name: format!("{outer}.{name}"), why },
            other => other,
        }
    }

    /// This failure as one of a flag, if it is about an option.
    pub fn as_flag(self) -> Self {
        match self {
            Self::Setting { name, why } => Self::Input(format!("--{name}: {why}")),
            other => other,
        }
    }
}

impl fmt::Display for Failure {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let sentence = match self {
            Self::Input(sentence) | Self::Other(sentence) => sentence.clone(),
            Self::Setting { name, why } => format!("{name}: {why}"),
        };
        f.write_str(&shown::line(&sentence))
    }
}

/// Maps an error of the core to the field that causes it.
impl From<Error> for Failure {
    fn from(error: Error) -> Self {
        let of_ground = |field: &str| {
            let own = ["friction", "restitution", "stick_speed", "rebound_speed"].contains(&field);
            own || Coefficient::ALL.iter().any(|of| of.name() == field)
        };
        match field_of(&error) {
            Some(field) if of_ground(field) => Self::setting(&format!("ground.{field}"), &error),
            Some(field) => Self::setting(field, &error),
            None => Self::Input(error.to_string()),
        }
    }
}

/// Field whose value causes an error of the core, without the table that has it.
pub fn field_of(error: &Error) -> Option<&'static str> {
    let field = match error {
        Error::Inertia(_) | Error::MomentsApart { .. } | Error::Moment { .. } => "inertia",
        Error::StartBelowGround { .. } => "position",
        Error::Shape { shape: "the box", .. } => "box",
        Error::Shape { shape: "the hull", .. } => "hull",
        Error::Shape { shape: "the mesh", .. } => "mesh",
        Error::OutOfRange { field, .. } | Error::Count { field, .. } => match *field {
            "time step (s)" => "time_step",
            "gravity (m/s²)" => "gravity",
            "coefficient of friction" => "friction",
            "stick speed (m/s)" => "stick_speed",
            "coefficient of restitution" => "restitution",
            "rebound speed (m/s)" => "rebound_speed",
            "normal of the plane" | "length of the plane's normal" | "offset of the plane (m)" => {
                "ground"
            }
            "mass (kg)" => "mass",
            "side of the box (m)" => "box",
            "radius of the sphere (m)" => "sphere",
            "length of the capsule (m)" | "radius of the capsule (m)" => "capsule",
            "length of the cylinder (m)" | "radius of the cylinder (m)" => "cylinder",
            "height of the cone (m)" | "radius of the cone (m)" => "cone",
            "half axis of the ellipsoid (m)"
            | "shortest half axis of the ellipsoid, relative to the longest" => "ellipsoid",
            "sides of a smooth piece's core" => "sides",
            "radius of the hull (m)" | "radius of the mesh (m)" => "radius",
            "points of the hull" | "vertices of the hull" | "largest extent of the hull (m)" => {
                "hull"
            }
            "contact points"
            | "contact point coordinate (m)"
            | "farthest contact point coordinate (m)" => "points",
            "position (m)" | "position of the piece (m)" => "position",
            "norm of the attitude quaternion" => "attitude",
            "velocity (m/s)" => "velocity",
            "spin (rad/s)" => "spin",
            "load (N, N m)" | "time of the load (s)" => "load",
            "point of the load (m)" => "load.at",
            other => Coefficient::from_quantity(other)?.name(),
        },
        _ => return None,
    };
    Some(field)
}
