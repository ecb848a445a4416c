//! Scenario files: a simulation written down in TOML. `scenarios/README.md` describes every
//! field.

use super::Failure;
use super::args::{DetectionName, OnFailure, SolverName};
use super::settings::{Attitude, Frame, Inertia, Settings, Shape};
use nalgebra::{Matrix3, Vector3};
use serde::Deserialize;
use std::fs::File;
use std::io::Read;
use std::path::Path;
use tumble::load::Polyline;
use tumble::plane::Plane;

/// More bytes than this are no scenario.
const LARGEST_FILE: u64 = 1 << 20;

/// What a file says.
pub struct Scenario {
    pub name: String,
    /// Whether there is a ground.
    pub ground: bool,
    pub settings: Settings,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct ScenarioFile {
    name: Option<String>,
    steps: Option<u64>,
    time_step: Option<f64>,
    seed: Option<u32>,
    gravity: Option<Gravity>,
    body: BodyTable,
    ground: Option<GroundTable>,
    start: StartTable,
    load: Option<LoadTable>,
    solver: Option<SolverTable>,
}

#[derive(Deserialize)]
#[serde(untagged, expecting = "a number (downwards) or three are needed")]
enum Gravity {
    Downwards(f64),
    Vector([f64; 3]),
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct BodyTable {
    #[serde(rename = "box")]
    sides: Option<Sides>,
    points: Option<Vec<[f64; 3]>>,
    mass: f64,
    inertia: Option<InertiaValue>,
}

#[derive(Deserialize)]
#[serde(untagged, expecting = "one number (a cube) or three are needed")]
enum Sides {
    Cube(f64),
    Box([f64; 3]),
}

#[derive(Deserialize)]
#[serde(
    untagged,
    expecting = "\"solid\", one number, three (diagonal) or a 3 × 3 matrix are needed"
)]
enum InertiaValue {
    Word(Solid),
    Moment(f64),
    Diagonal([f64; 3]),
    Rows([[f64; 3]; 3]),
}

#[derive(Deserialize)]
#[serde(rename_all = "lowercase")]
enum Solid {
    Solid,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct GroundTable {
    friction: f64,
    slope: Option<f64>,
    normal: Option<[f64; 3]>,
    offset: Option<f64>,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct StartTable {
    position: [f64; 3],
    attitude: Option<AttitudeValue>,
    velocity: Option<[f64; 3]>,
    spin: Option<[f64; 3]>,
    frame: Option<Frame>,
}

#[derive(Deserialize)]
#[serde(untagged, expecting = "\"random\" or four numbers (w, x, y, z) are needed")]
enum AttitudeValue {
    Word(Random),
    Quaternion([f64; 4]),
}

#[derive(Deserialize)]
#[serde(rename_all = "lowercase")]
enum Random {
    Random,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct LoadTable {
    force: Option<LoadValue>,
    torque: Option<LoadValue>,
    at: Option<[f64; 3]>,
}

#[derive(Deserialize)]
#[serde(untagged, expecting = "three numbers, or a list of knots [t, x, y, z], are needed")]
enum LoadValue {
    Constant([f64; 3]),
    Knots(Vec<[f64; 4]>),
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct SolverTable {
    name: Option<SolverName>,
    detection: Option<DetectionName>,
    tolerance: Option<f64>,
    max_iterations: Option<u32>,
    on_failure: Option<OnFailure>,
}

impl Scenario {
    /// Reads and checks a file. Numbers that the model itself judges are left to it.
    pub fn read(path: &Path) -> Result<Self, Failure> {
        let odd = |why: String| Failure::Input(format!("{}: {why}", path.display()));
        let mut text = String::new();
        File::open(path)
            .and_then(|file| file.take(LARGEST_FILE + 1).read_to_string(&mut text))
            .map_err(|error| odd(format!("cannot be read as a scenario: {error}")))?;
        if text.len() as u64 > LARGEST_FILE {
            return Err(odd(format!("is longer than {LARGEST_FILE} bytes, it is no scenario")));
        }
        let file: ScenarioFile =
            toml::from_str(&text).map_err(|error| odd(sentence(&text, &error)))?;
        let stem = path.file_stem().map(|stem| stem.to_string_lossy().into_owned());
        file.scenario(stem.unwrap_or_default()).map_err(odd)
    }
}

/// What is wrong, and in which line.
fn sentence(text: &str, error: &toml::de::Error) -> String {
    let Some(span) = error.span() else { return plain(error.message()) };
    let before = &text.as_bytes()[..span.start.min(text.len())];
    let line = before.iter().filter(|byte| **byte == b'\n').count();
    let shown: String = text.lines().nth(line).unwrap_or("").trim().chars().take(60).collect();
    let message = plain(error.message());
    // A table that is missing is missing nowhere.
    if shown.is_empty() || (span.start == 0 && message.starts_with("missing field")) {
        return message;
    }
    format!("line {}, `{shown}`: {message}", line + 1)
}

/// A message without the names of our own types.
fn plain(message: &str) -> String {
    let types = [
        ("expected f64", "a number is needed"),
        ("expected u64", "a whole number is needed"),
        ("expected u32", "a whole number from 0 to 4294967295 is needed"),
        (" as i128", ""),
        ("expected struct BodyTable", "a table [body] is needed"),
        ("expected struct GroundTable", "a table [ground] is needed"),
        ("expected struct StartTable", "a table [start] is needed"),
        ("expected struct LoadTable", "a table [load] is needed"),
        ("expected struct SolverTable", "a table [solver] is needed"),
    ];
    types.iter().fold(message.to_owned(), |text, (name, plain)| text.replace(name, plain))
}

impl ScenarioFile {
    /// A field that would do nothing is refused rather than ignored.
    fn refuse_idle_fields(&self) -> Result<(), String> {
        let floating = self.ground.is_none();
        let pushed = self.load.as_ref().is_none_or(|load| load.force.is_some());
        let placed = self.load.as_ref().is_some_and(|load| load.at.is_some());
        let idle = [
            ("solver", "a [ground] table", floating && self.solver.is_some()),
            ("start.frame \"ground\"", "a [ground] table", floating && self.start.is_in_ground()),
            ("load.at", "load.force", placed && !pushed),
        ];
        match idle.into_iter().find(|(.., idle)| *idle) {
            Some((field, need, _)) => {
                Err(format!("{field} has no meaning without {need}; leave it out"))
            }
            None => Ok(()),
        }
    }

    fn scenario(self, stem: String) -> Result<Scenario, String> {
        self.refuse_idle_fields()?;
        let name = self.name.unwrap_or(stem);
        if name.is_empty() || name.chars().count() > 80 || name.chars().any(char::is_control) {
            return Err("name: 1 to 80 characters in one line are needed".to_owned());
        }
        let steps = self.steps.unwrap_or(1000);
        if !(1..=10_000_000).contains(&steps) {
            return Err(format!("steps is {steps}; allowed is 1 to 10000000"));
        }
        let ground = self.ground.is_some();
        let (friction, plane) = match self.ground {
            Some(table) => (Some(table.friction), Some(table.plane()?)),
            None => (None, None),
        };
        let (shape, mass, inertia) = self.body.shape()?;
        let start = self.start;
        let attitude = match start.attitude {
            None => Attitude::Given([1.0, 0.0, 0.0, 0.0].into()),
            Some(AttitudeValue::Word(Random::Random)) => Attitude::Random,
            Some(AttitudeValue::Quaternion(quaternion)) => Attitude::given(quaternion.into())
                .map_err(|why| format!("start.attitude: {why}"))?,
        };
        let (force, torque, force_at) = match self.load {
            None => (None, None, None),
            Some(table) => (
                table.force.map(|value| value.polyline("load.force")).transpose()?,
                table.torque.map(|value| value.polyline("load.torque")).transpose()?,
                table.at.map(Vector3::from),
            ),
        };
        let gravity = match self.gravity {
            None => Vector3::new(0.0, 0.0, -9.81),
            Some(Gravity::Downwards(g)) => Vector3::new(0.0, 0.0, -g),
            Some(Gravity::Vector(vector)) => vector.into(),
        };
        let solver = self.solver.as_ref();
        let settings = Settings {
            steps: Some(steps),
            seed: self.seed,
            dt: Some(self.time_step.unwrap_or(0.002)),
            mu: friction,
            mass: Some(mass),
            inertia: Some(inertia),
            gravity: Some(gravity),
            shape: Some(shape),
            plane,
            position: Some(start.position.into()),
            height: None,
            attitude: Some(attitude),
            velocity: Some(start.velocity.map_or(Vector3::zeros(), Vector3::from)),
            spin: Some(start.spin.map_or(Vector3::zeros(), Vector3::from)),
            frame: start.frame,
            force,
            torque,
            force_at,
            solver: solver.and_then(|table| table.name),
            detection: solver.and_then(|table| table.detection),
            tol: solver.and_then(|table| table.tolerance),
            max_iter: solver.and_then(|table| table.max_iterations),
            on_failure: solver.and_then(|table| table.on_failure),
        };
        Ok(Scenario { name, ground, settings })
    }
}

impl StartTable {
    fn is_in_ground(&self) -> bool {
        self.frame == Some(Frame::Ground)
    }
}

impl BodyTable {
    fn shape(self) -> Result<(Shape, f64, Inertia), String> {
        let shape = match (self.sides, self.points) {
            (Some(Sides::Cube(side)), None) => Shape::Box(Vector3::repeat(side)),
            (Some(Sides::Box(sides)), None) => Shape::Box(sides.into()),
            (None, Some(points)) => Shape::Points(points.into_iter().map(Vector3::from).collect()),
            _ => return Err("body: either `box` or `points` is needed".to_owned()),
        };
        let inertia = match self.inertia {
            None if matches!(shape, Shape::Points(_)) => {
                return Err("body.inertia: it is needed with `points`".to_owned());
            }
            None | Some(InertiaValue::Word(Solid::Solid)) => Inertia::Solid,
            Some(InertiaValue::Moment(moment)) => {
                Inertia::Matrix(Matrix3::from_diagonal_element(moment))
            }
            Some(InertiaValue::Diagonal(moments)) => {
                Inertia::Matrix(Matrix3::from_diagonal(&moments.into()))
            }
            Some(InertiaValue::Rows(rows)) => Inertia::Matrix(Matrix3::from(rows).transpose()),
        };
        Ok((shape, self.mass, inertia))
    }
}

impl GroundTable {
    fn plane(&self) -> Result<Plane, String> {
        let offset = self.offset.unwrap_or(0.0);
        match (self.slope, self.normal) {
            (Some(_), Some(_)) => {
                return Err("ground: either `slope` or `normal` can be given".to_owned());
            }
            (Some(slope), None) => {
                Plane::sloping(slope).and_then(|plane| Plane::new(*plane.normal(), offset))
            }
            (None, normal) => Plane::new(normal.map_or(Vector3::z(), Vector3::from), offset),
        }
        .map_err(|error| format!("ground: {error}"))
    }
}

impl LoadValue {
    fn polyline(self, field: &str) -> Result<Polyline, String> {
        match self {
            Self::Constant(value) => Polyline::constant(value.into()),
            Self::Knots(knots) if knots.is_empty() => {
                return Err(format!(
                    "{field}: it has no knots; give one at least, or leave it out"
                ));
            }
            Self::Knots(knots) => {
                let knots = knots.into_iter().map(|[t, x, y, z]| (t, Vector3::new(x, y, z)));
                Polyline::new(knots.collect())
            }
        }
        .map_err(|error| format!("{field}: {error}"))
    }
}
