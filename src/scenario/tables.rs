//! The tables of a scenario file, and what their fields say.

use crate::error::Error;
use crate::mechanics::Rotation;
use crate::mechanics::load::Polyline;
use crate::scenario::choices::{
    Attitude, DetectionName, FormulationName, Frame, Inertia, OnFailure, Preset, Shape, SolverName,
};
use crate::scenario::fields::matrix;
use crate::scenario::fields::{Exactly, Numbers, table, table_if_any};
use crate::scenario::settings::Settings;
use crate::world::Plane;
use nalgebra::{Matrix3, Vector3};
use serde::Deserialize;

#[derive(Deserialize)]
#[serde(expecting = "a scenario")]
#[serde(deny_unknown_fields)]
pub struct ScenarioFile {
    pub name: Option<String>,
    steps: Option<u64>,
    time_step: Option<f64>,
    rotation: Option<Rotation>,
    seed: Option<u32>,
    gravity: Option<Gravity>,
    #[serde(deserialize_with = "table")]
    body: BodyTable,
    #[serde(default, deserialize_with = "table_if_any")]
    pub ground: Option<GroundTable>,
    #[serde(deserialize_with = "table")]
    start: StartTable,
    #[serde(default, deserialize_with = "table_if_any")]
    load: Option<LoadTable>,
    #[serde(default, deserialize_with = "table_if_any")]
    solver: Option<SolverTable>,
}

#[derive(Deserialize)]
#[serde(untagged, expecting = "a number (downwards) or three are needed")]
pub enum Gravity {
    Downwards(f64),
    Vector(Numbers<3>),
}

#[derive(Deserialize)]
#[serde(expecting = "a table [body]")]
#[serde(deny_unknown_fields)]
struct BodyTable {
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
    Word(Solid),
    Moment(f64),
    Diagonal(Numbers<3>),
    Rows(Exactly<Numbers<3>, 3>),
}

#[derive(Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum Solid {
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
struct StartTable {
    position: Numbers<3>,
    attitude: Option<AttitudeValue>,
    velocity: Option<Numbers<3>>,
    spin: Option<Numbers<3>>,
    frame: Option<Frame>,
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
    formulation: Option<FormulationName>,
    detection: Option<DetectionName>,
    tolerance: Option<f64>,
    max_iterations: Option<u32>,
    on_failure: Option<OnFailure>,
}

impl ScenarioFile {
    /// A field that would do nothing is refused rather than ignored.
    pub fn refuse_idle_fields(&self) -> Result<(), String> {
        let floating = self.ground.is_none();
        let placed = self.load.as_ref().is_some_and(LoadTable::has_idle_point);
        let idle = [
            ("rotation", "a [ground] table", floating && self.rotation.is_some()),
            ("solver", "a [ground] table", floating && self.solver.is_some()),
            ("start.frame \"ground\"", "a [ground] table", floating && self.start.is_in_ground()),
            ("load.at", "load.force", placed),
        ];
        match idle.into_iter().find(|(.., idle)| *idle) {
            Some((field, need, _)) => {
                Err(format!("{field} has no meaning without {need}; leave it out"))
            }
            None => Ok(()),
        }
    }

    /// What the fields say. Those of a ground are open where there is none.
    pub fn settings(self) -> Result<Settings, String> {
        let steps = self.steps.unwrap_or(1000);
        if !(1..=10_000_000).contains(&steps) {
            return Err(format!("steps is {steps}; allowed is 1 to 10000000"));
        }
        let mut settings = Settings {
            steps: Some(steps),
            seed: self.seed,
            dt: Some(self.time_step.unwrap_or(0.002)),
            gravity: Some(self.gravity.map_or(Vector3::new(0.0, 0.0, -9.81), Gravity::vector)),
            ..Settings::default()
        };
        if let Some(table) = self.ground {
            settings.rotation = Some(self.rotation.unwrap_or(Rotation::Momentum));
            table.set(&mut settings)?;
        }
        self.body.set(&mut settings)?;
        self.start.set(&mut settings)?;
        if let Some(table) = self.load {
            table.set(&mut settings)?;
        }
        if let Some(table) = self.solver {
            table.set(&mut settings);
        }
        Ok(settings)
    }
}

fn vector(numbers: Numbers<3>) -> Vector3<f64> {
    numbers.0.into()
}

impl Gravity {
    pub fn vector(self) -> Vector3<f64> {
        match self {
            Self::Downwards(g) => Vector3::new(0.0, 0.0, -g),
            Self::Vector(vector) => self::vector(vector),
        }
    }
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
    /// The matrix that is given in numbers.
    pub fn matrix(&self) -> Option<Matrix3<f64>> {
        match self {
            Self::Word(Solid::Solid) => None,
            Self::Moment(moment) => Some(Matrix3::from_diagonal_element(*moment)),
            Self::Diagonal(moments) => Some(Matrix3::from_diagonal(&vector(*moments))),
            Self::Rows(rows) => Some(matrix(rows)),
        }
    }
}

impl StartTable {
    fn is_in_ground(&self) -> bool {
        self.frame == Some(Frame::Ground)
    }

    fn set(self, settings: &mut Settings) -> Result<(), String> {
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
    fn set(self, settings: &mut Settings) -> Result<(), String> {
        let is_point = self.point_mass == Some(true);
        let shape = match (self.sides, self.points, is_point) {
            (Some(sides), None, false) => Shape::Box(sides.vector()),
            (None, Some(points), false) => Shape::Points(points.into_iter().map(vector).collect()),
            (None, None, true) => Shape::Points(vec![Vector3::zeros()]),
            _ => {
                let needed = "body: one of `box`, `points` and `point_mass = true` is needed";
                return Err(needed.to_owned());
            }
        };
        settings.inertia = Some(match self.inertia.as_ref().and_then(InertiaValue::matrix) {
            Some(matrix) => Inertia::Matrix(matrix),
            // Without effect, and of the point's own scale.
            None if is_point => Inertia::Matrix(Matrix3::from_diagonal_element(self.mass)),
            None if self.inertia.is_none() && matches!(shape, Shape::Points(_)) => {
                return Err("body.inertia: it is needed with `points`".to_owned());
            }
            None => Inertia::Solid,
        });
        settings.shape = Some(shape);
        settings.mass = Some(self.mass);
        Ok(())
    }
}

impl GroundTable {
    /// Of several bodies, which may have no ground.
    pub fn set_if_any(self, settings: &mut Settings) -> Result<(), String> {
        if self.none != Some(true) {
            return Self { none: None, ..self }.set(settings);
        }
        let place = [("slope", self.slope.is_some()), ("normal", self.normal.is_some())];
        let place = place.into_iter().chain([("offset", self.offset.is_some())]);
        if let Some((field, _)) = place.into_iter().find(|(_, given)| *given) {
            return Err(format!("ground.{field}: it has no meaning with `none = true`"));
        }
        settings.plane = None;
        self.set_coefficients(settings);
        Ok(())
    }

    fn set_coefficients(&self, settings: &mut Settings) {
        settings.mu = Some(self.friction);
        settings.restitution = self.restitution;
        settings.rebound_speed = self.rebound_speed;
    }

    /// Of one body.
    pub fn set(self, settings: &mut Settings) -> Result<(), String> {
        if self.none.is_some() {
            return Err(
                "ground.none: it is of scenes with [[bodies]]; leave the table [ground] out \
                        for one body without a ground"
                    .to_owned(),
            );
        }
        let offset = self.offset.unwrap_or(0.0);
        let plane = match (self.slope, self.normal) {
            (Some(_), Some(_)) => {
                return Err("ground: either `slope` or `normal` can be given".to_owned());
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
        self.set_coefficients(settings);
        Ok(())
    }
}

impl LoadTable {
    /// Whether a point is given for a force that is not.
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
        settings.formulation = self.formulation;
        settings.detection = self.detection;
        settings.tol = self.tolerance;
        settings.max_iter = self.max_iterations;
        settings.on_failure = self.on_failure;
    }
}

impl LoadValue {
    fn polyline(self, field: &str) -> Result<Polyline, String> {
        match self {
            Self::Constant(value) => Polyline::constant(vector(value)),
            Self::Knots(knots) if knots.is_empty() => {
                return Err(format!(
                    "{field}: it has no knots; give one at least, or leave it out"
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
