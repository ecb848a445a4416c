//! Tables of a scenario file that become settings.

use crate::choices::{
    Attitude, BodyShape, DetectionName, Inertia, OnFailure, Preset, SolverName, StartFrame,
};
use crate::settings::Settings;
use nalgebra::{Matrix3, Vector3};
use serde::Deserialize;
use tumble_core::error::Error;
use tumble_core::mechanics::load::Polyline;
use tumble_core::world::Plane;
use tumble_model::fields::matrix;
use tumble_model::fields::{Exactly, Numbers};

#[derive(Deserialize)]
#[serde(expecting = "a table [body]")]
#[serde(deny_unknown_fields)]
pub struct BodyTable {
    #[serde(rename = "box")]
    sides: Option<Sides>,
    points: Option<Vec<Numbers<3>>>,
    point_mass: Option<bool>,
    mass: f64,
    inertia: Option<InertiaValue>,
}

#[derive(Deserialize)]
#[serde(untagged, expecting = "one number (a cube) or three are needed")]
pub enum Sides {
    Cube(f64),
    Box(Numbers<3>),
}

#[derive(Deserialize)]
#[serde(
    untagged,
    expecting = "\"solid\", one number, three (diagonal) or a 3 × 3 matrix are needed"
)]
pub enum InertiaValue {
    Word(SolidInertia),
    Moment(f64),
    Diagonal(Numbers<3>),
    Rows(Exactly<Numbers<3>, 3>),
}

#[derive(Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum SolidInertia {
    Solid,
}

#[derive(Deserialize)]
#[serde(expecting = "a table [ground]")]
#[serde(deny_unknown_fields)]
pub struct GroundTable {
    friction: f64,
    restitution: Option<f64>,
    rebound_speed: Option<f64>,
    slope: Option<f64>,
    normal: Option<Numbers<3>>,
    offset: Option<f64>,
    none: Option<bool>,
}

#[derive(Deserialize)]
#[serde(expecting = "a table [start]")]
#[serde(deny_unknown_fields)]
pub struct StartTable {
    position: Numbers<3>,
    attitude: Option<AttitudeValue>,
    velocity: Option<Numbers<3>>,
    spin: Option<Numbers<3>>,
    frame: Option<StartFrame>,
}

#[derive(Deserialize)]
#[serde(untagged, expecting = "\"random\" or four numbers (w, x, y, z) are needed")]
enum AttitudeValue {
    Word(Random),
    Quaternion(Numbers<4>),
}

#[derive(Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum Random {
    Random,
}

#[derive(Deserialize)]
#[serde(expecting = "a table [load]")]
#[serde(deny_unknown_fields)]
pub struct LoadTable {
    force: Option<LoadValue>,
    torque: Option<LoadValue>,
    at: Option<Numbers<3>>,
}

#[derive(Deserialize)]
#[serde(untagged, expecting = "three numbers, or a list of knots [t, x, y, z], are needed")]
pub enum LoadValue {
    Constant(Numbers<3>),
    Knots(Vec<Numbers<4>>),
}

#[derive(Deserialize)]
#[serde(expecting = "a table [solver]")]
#[serde(deny_unknown_fields)]
pub struct SolverTable {
    name: Option<SolverName>,
    preset: Option<Preset>,
    detection: Option<DetectionName>,
    tolerance: Option<f64>,
    max_iterations: Option<u32>,
    residual: Option<f64>,
    on_failure: Option<OnFailure>,
}

fn vector(numbers: Numbers<3>) -> Vector3<f64> {
    numbers.0.into()
}

impl Sides {
    pub fn vector(self) -> Vector3<f64> {
        match self {
            Self::Cube(side) => Vector3::repeat(side),
            Self::Box(sides) => vector(sides),
        }
    }
}

impl InertiaValue {
    /// Inertia tensor, if it is given in numbers.
    pub fn matrix(&self) -> Option<Matrix3<f64>> {
        match self {
            Self::Word(SolidInertia::Solid) => None,
            Self::Moment(moment) => Some(Matrix3::from_diagonal_element(*moment)),
            Self::Diagonal(moments) => Some(Matrix3::from_diagonal(&vector(*moments))),
            Self::Rows(rows) => Some(matrix(rows)),
        }
    }
}

impl StartTable {
    /// True if the start is given in the frame of the ground.
    pub fn is_in_ground(&self) -> bool {
        self.frame == Some(StartFrame::Ground)
    }

    pub fn set(self, settings: &mut Settings) -> Result<(), String> {
        settings.position = Some(vector(self.position));
        settings.attitude = Some(match self.attitude {
            None => Attitude::Given([1.0, 0.0, 0.0, 0.0].into()),
            Some(AttitudeValue::Word(Random::Random)) => Attitude::Random,
            Some(AttitudeValue::Quaternion(quaternion)) => Attitude::given(quaternion.0.into())
                .map_err(|why| format!("start.attitude: {why}"))?,
        });
        settings.velocity = Some(self.velocity.map_or(Vector3::zeros(), vector));
        settings.spin = Some(self.spin.map_or(Vector3::zeros(), vector));
        settings.frame = self.frame;
        Ok(())
    }
}

impl BodyTable {
    pub fn set(self, settings: &mut Settings) -> Result<(), String> {
        let is_point = self.point_mass == Some(true);
        let shape = match (self.sides, self.points, is_point) {
            (Some(sides), None, false) => BodyShape::Box(sides.vector()),
            (None, Some(points), false) => {
                BodyShape::Points(points.into_iter().map(vector).collect())
            }
            (None, None, true) => BodyShape::Points(vec![Vector3::zeros()]),
            _ => {
                let needed = "body: one of `box`, `points` and `point_mass = true` is needed";
                return Err(needed.to_owned());
            }
        };
        settings.inertia = Some(match self.inertia.as_ref().and_then(InertiaValue::matrix) {
            Some(matrix) => Inertia::Matrix(matrix),
            // A point mass does not use its inertia; this value has the right scale.
            None if is_point => Inertia::Matrix(Matrix3::from_diagonal_element(self.mass)),
            None if self.inertia.is_none() && matches!(shape, BodyShape::Points(_)) => {
                return Err("body.inertia: required with `points`".to_owned());
            }
            None => Inertia::Solid,
        });
        settings.shape = Some(shape);
        settings.mass = Some(self.mass);
        Ok(())
    }
}

impl GroundTable {
    /// Sets the ground. `may_be_none` permits `none = true`, for scenes with `[[bodies]]`.
    pub fn set(self, settings: &mut Settings, may_be_none: bool) -> Result<(), String> {
        settings.mu = Some(self.friction);
        settings.restitution = self.restitution;
        settings.rebound_speed = self.rebound_speed;
        if self.none.is_some() && !may_be_none {
            return Err(
                "ground.none: only for scenes with [[bodies]]; for one body without a ground, \
                 leave the table [ground] out"
                    .to_owned(),
            );
        }
        if self.none == Some(true) {
            let place = [
                ("slope", self.slope.is_some()),
                ("normal", self.normal.is_some()),
                ("offset", self.offset.is_some()),
            ];
            return match place.into_iter().find(|(_, given)| *given) {
                Some((field, _)) => {
                    Err(format!("ground.{field}: it has no meaning with `none = true`"))
                }
                None => Ok(()),
            };
        }
        let offset = self.offset.unwrap_or(0.0);
        let plane = match (self.slope, self.normal) {
            (Some(_), Some(_)) => {
                return Err("ground: only one of `slope` and `normal` can be given".to_owned());
            }
            (Some(slope), None) => {
                let sloping =
                    Plane::sloping(slope).map_err(|why| format!("ground.slope: {why}"))?;
                Plane::new(*sloping.normal(), offset)
            }
            (None, normal) => Plane::new(normal.map_or(Vector3::z(), vector), offset),
        };
        settings.plane = Some(plane.map_err(|error| {
            let offset =
                matches!(error, Error::OutOfRange { field: "offset of the plane (m)", .. });
            format!("ground.{}: {error}", if offset { "offset" } else { "normal" })
        })?);
        Ok(())
    }
}

impl LoadTable {
    /// True if a point of application is given without a force.
    pub fn has_idle_point(&self) -> bool {
        self.at.is_some() && self.force.is_none()
    }

    pub fn set(self, settings: &mut Settings) -> Result<(), String> {
        settings.force = self.force.map(|value| value.polyline("load.force")).transpose()?;
        settings.torque = self.torque.map(|value| value.polyline("load.torque")).transpose()?;
        settings.force_at = self.at.map(vector);
        Ok(())
    }
}

impl SolverTable {
    pub fn set(self, settings: &mut Settings) {
        settings.solver = self.name;
        settings.preset = self.preset;
        settings.detection = self.detection;
        settings.tol = self.tolerance;
        settings.max_iter = self.max_iterations;
        settings.residual = self.residual;
        settings.on_failure = self.on_failure;
    }
}

impl LoadValue {
    fn polyline(self, field: &str) -> Result<Polyline, String> {
        match self {
            Self::Constant(value) => Polyline::constant(vector(value)),
            Self::Knots(knots) if knots.is_empty() => {
                return Err(format!(
                    "{field}: it has no knots; give at least one, or leave it out"
                ));
            }
            Self::Knots(knots) => {
                let knots =
                    knots.into_iter().map(|Exactly([t, x, y, z])| (t, Vector3::new(x, y, z)));
                Polyline::new(knots.collect())
            }
        }
        .map_err(|error| format!("{field}: {error}"))
    }
}
