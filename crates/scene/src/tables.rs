//! Tables of a document: the ground, the solver, loads and inertias.

use crate::choices::{OnFailure, Preset, SolverName};
use crate::coefficients::{table, with_coefficients};
use nalgebra::{Matrix3, Vector3};
use serde::{Deserialize, Deserializer, Serialize};
use tumble_core::contact::Detection;
use tumble_core::error::Error;
use tumble_core::mechanics::body::solid_box_inertia;
use tumble_core::mechanics::load::{Load, Polyline};
use tumble_core::world::{Plane, StickSpeed};
use tumble_model::fields::{Exactly, Numbers, matrix, numbers};

#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
#[serde(untagged, expecting = "one number (a cube) or three are needed")]
pub enum Sides {
    Cube(f64),
    Box(Numbers<3>),
}

/// Inertia of a body (kg m²).
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
#[serde(
    untagged,
    expecting = "\"solid\", one number, three (diagonal) or a 3 × 3 matrix are needed"
)]
pub enum InertiaValue {
    /// Inertia of the solid shape.
    Word(SolidInertia),
    /// Multiple of the unit matrix.
    Moment(f64),
    /// Principal moments about the body's axes.
    Diagonal(Numbers<3>),
    /// Inertia tensor by rows.
    Rows(Exactly<Numbers<3>, 3>),
}

/// Inertia of the solid shape.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
#[serde(rename_all = "lowercase")]
pub enum SolidInertia {
    /// Uniform density.
    Solid,
}

with_coefficients!(table, f64, GroundTable, "a table [ground]" {
    /// Coefficient of friction.
    #[serde(deserialize_with = "given")]
    #[cfg_attr(feature = "schema", schemars(required))]
    friction: Option<f64>,
    /// Largest slip with static friction (m/s), or its share over the slip.
    stick_speed: Option<StickSpeed>,
    /// Speed below which approaches do not bounce (m/s).
    rebound_speed: Option<f64>,
    /// Angle by which the plane descends towards +x (degrees).
    slope: Option<f64>,
    /// Normal of the plane, instead of a slope.
    normal: Option<Numbers<3>>,
    /// Distance of the plane from the origin along its normal (m).
    offset: Option<f64>,
    /// True for a world without a ground.
    none: Option<bool>,
});

/// Random attitude.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
#[serde(rename_all = "lowercase")]
pub enum Random {
    /// Uniformly distributed.
    Random,
    /// Drawn by the tutorial's method; `"random"` in the short form of one body.
    #[serde(skip)]
    Tutorial,
}

#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
#[serde(expecting = "a table [load]")]
#[serde(deny_unknown_fields)]
pub struct LoadTable {
    /// Force (N), world frame.
    force: Option<LoadValue>,
    /// Torque (N m), body frame.
    torque: Option<LoadValue>,
    /// Point of action of the force (m), body frame.
    at: Option<Numbers<3>>,
}

#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
#[serde(untagged, expecting = "three numbers, or a list of knots [t, x, y, z], are needed")]
pub enum LoadValue {
    Constant(Numbers<3>),
    Knots(Vec<Numbers<4>>),
}

/// Solver of contact steps and its settings; `None` for a setting that is not given.
#[derive(Debug, Clone, Copy, Default, PartialEq, Serialize, Deserialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
#[serde(expecting = "a table [solver]")]
#[serde(deny_unknown_fields)]
pub struct SolverTable {
    /// Solver.
    pub name: Option<SolverName>,
    /// Preset of all settings.
    pub preset: Option<Preset>,
    /// Criterion for the points that may touch.
    pub detection: Option<Detection>,
    /// Tolerance of Ipopt.
    pub tolerance: Option<f64>,
    /// Maximum number of Ipopt's iterations.
    pub max_iterations: Option<u32>,
    /// Target residual of the native solver, m/s at speed scale 1.
    pub residual: Option<f64>,
    /// Action if a step is not solved.
    pub on_failure: Option<OnFailure>,
}

/// Reads a field that is required.
fn given<'de, D: Deserializer<'de>>(reader: D) -> Result<Option<f64>, D::Error> {
    f64::deserialize(reader).map(Some)
}

fn vector(numbers: Numbers<3>) -> Vector3<f64> {
    numbers.0.into()
}

impl Sides {
    pub fn vector(&self) -> Vector3<f64> {
        match self {
            Self::Cube(side) => Vector3::repeat(*side),
            Self::Box(sides) => vector(*sides),
        }
    }
}

impl InertiaValue {
    /// This inertia, in numbers, of a box with the given mass (kg) and sides (m).
    pub fn for_box(self, mass: f64, sides: &Vector3<f64>) -> Self {
        match self {
            Self::Word(SolidInertia::Solid) => {
                let moments = solid_box_inertia(mass, &(0.5 * sides)).diagonal();
                Self::Diagonal(Exactly(moments.into()))
            }
            given => given,
        }
    }

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

impl GroundTable {
    /// Table of a world without a ground.
    pub fn none() -> Self {
        Self { friction: Some(0.0), none: Some(true), ..Self::default() }
    }

    /// Sets the plane of the ground in numbers; `None` for no ground.
    pub fn set_plane(&mut self, plane: Option<&Plane>) {
        self.none = plane.is_none().then_some(true);
        self.slope = None;
        self.normal = plane.map(|plane| numbers(plane.normal()));
        self.offset = plane.map(Plane::offset);
    }

    /// Plane of the ground; `None` without one.
    pub fn plane(&self) -> Result<Option<Plane>, String> {
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
                None => Ok(None),
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
        let plane = plane.map_err(|error| {
            let offset =
                matches!(error, Error::OutOfRange { field: "offset of the plane (m)", .. });
            format!("ground.{}: {error}", if offset { "offset" } else { "normal" })
        })?;
        Ok(Some(plane))
    }
}

impl LoadTable {
    /// Table of a load; `None` without one.
    pub fn new(load: &Load) -> Option<Self> {
        let knots = |line: &Polyline| {
            let knots = line.knots().iter().map(|(time, v)| Exactly([*time, v[0], v[1], v[2]]));
            Some(knots.collect::<Vec<_>>()).filter(|knots| !knots.is_empty()).map(LoadValue::Knots)
        };
        let force = knots(&load.force);
        let at = force.as_ref().map(|_| numbers(load.point()));
        (!load.is_none()).then(|| Self { force, torque: knots(&load.torque), at })
    }

    /// The load.
    pub fn load(&self) -> Result<Load, String> {
        if self.at.is_some() && self.force.is_none() {
            return Err("load.at has no meaning without load.force; leave it out".to_owned());
        }
        let line = |value: &Option<LoadValue>, field| {
            value.as_ref().map_or(Ok(Polyline::default()), |value| value.polyline(field))
        };
        let (force, torque) =
            (line(&self.force, "load.force")?, line(&self.torque, "load.torque")?);
        let load = Load::new(force, torque, self.at.map(vector).unwrap_or_default());
        load.map_err(|error| format!("load: {error}"))
    }
}

impl LoadValue {
    fn polyline(&self, field: &str) -> Result<Polyline, String> {
        match self {
            Self::Constant(value) => Polyline::constant(vector(*value)),
            Self::Knots(knots) if knots.is_empty() => {
                return Err(format!(
                    "{field}: it has no knots; give at least one, or leave it out"
                ));
            }
            Self::Knots(knots) => {
                let knots =
                    knots.iter().map(|Exactly([t, x, y, z])| (*t, Vector3::new(*x, *y, *z)));
                Polyline::new(knots.collect())
            }
        }
        .map_err(|error| format!("{field}: {error}"))
    }
}
