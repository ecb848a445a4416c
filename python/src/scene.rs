//! Scenes: parsed scenario files, ready for simulation.

use crate::arrays::{Array, Numbers, list, shaped, states_array, to_states};
use crate::errors::refused;
use crate::query::{Between, Hits, Placed};
use pyo3::prelude::*;
use std::fs::{self, File};
use std::io::{self, Read};
use std::path::{Path, PathBuf};
use std::sync::Arc;
use tumble_core::joint::{GearAxis, JointAxis, Motor};
use tumble_core::world::constants::extents;
use tumble_model::failure::Failure;
use tumble_scene::overrides::FieldOverride;
use tumble_scene::scene::Scene as Content;
use tumble_scene::settings::RobotSettings;
use tumble_scene::statics::{self, By, Load, Question};

/// Reads a regular file of at most `most` bytes.
pub fn read(path: &Path, most: u64) -> io::Result<Vec<u8>> {
    let invalid = |why: String| io::Error::new(io::ErrorKind::InvalidData, why);
    if !fs::metadata(path)?.is_file() {
        return Err(invalid("it is not a file".to_owned()));
    }
    let mut bytes = Vec::new();
    File::open(path)?.take(most + 1).read_to_end(&mut bytes)?;
    if bytes.len() as u64 > most {
        return Err(invalid(format!("it is longer than {most} bytes")));
    }
    Ok(bytes)
}

/// Remedy for a file that is neither a scene nor a robot, by its ending.
#[pyfunction]
pub fn remedy(path: PathBuf) -> Option<&'static str> {
    tumble_scene::remedy(&path)
}

/// Converts a failure to an exception.
pub fn in_python(failure: Failure) -> PyErr {
    refused(failure)
}

/// Position motor: joint, axis, target, stiffness, damping and force limit.
#[derive(FromPyObject)]
pub struct PositionMotor(usize, usize, f64, f64, f64, f64);

/// A scene. Created through its subclass in Python.
#[pyclass(frozen, subclass, name = "CoreScene", module = "tumble._tumble")]
pub struct PyScene {
    pub content: Arc<Content>,
}

#[pymethods]
impl PyScene {
    /// Parses the scenario `text`. `path` is its name in errors, and the folder of its meshes. `fields` are
    /// keywords with the path and the value (TOML) of the field that they set. The bodies of `model`, which a
    /// simulation writes, replace those of the text, at the step `start_index`.
    #[new]
    #[allow(clippy::too_many_arguments)]
    #[pyo3(signature = (
        text, path, fields, *, packages=None, leave_out=None, point_contacts=None, model=None, start_index=None
    ))]
    fn new(
        text: &str,
        path: PathBuf,
        fields: Vec<(String, String, String)>,
        packages: Option<PathBuf>,
        leave_out: Option<Vec<String>>,
        point_contacts: Option<bool>,
        model: Option<&str>,
        start_index: Option<u64>,
    ) -> PyResult<Self> {
        let labelled = |(keyword, path, value): &(String, String, String)| {
            FieldOverride::labelled(keyword, path, value)
        };
        let fields: Vec<_> = fields.iter().map(labelled).collect();
        let robot = RobotSettings {
            packages,
            leave_out: leave_out.unwrap_or_default(),
            point_contacts: point_contacts.unwrap_or(false),
        };
        let mut content =
            Content::parse_with(text, &path, &fields, &robot, &read).map_err(in_python)?;
        if let Some(model) = model {
            content = content.with_text(model).map_err(|why| refused(format!("model: {why}")))?;
            content.start_index = start_index.unwrap_or(content.start_index);
        }
        Ok(Self { content: Arc::new(content) })
    }

    /// Name of the scene.
    #[getter]
    fn name(&self) -> &str {
        &self.content.name
    }

    /// Notes on its content, one sentence each.
    #[getter]
    fn notes(&self) -> Vec<String> {
        self.content.notes()
    }

    /// Random seed of its start; None if nothing was random.
    #[getter]
    fn seed(&self) -> Option<u32> {
        self.content.drawn_seed()
    }

    /// Names of its N bodies.
    #[getter]
    fn bodies(&self) -> Vec<String> {
        self.content.bodies.clone()
    }

    /// Names of its fixed pieces.
    #[getter]
    fn fixed(&self) -> Vec<String> {
        self.content.fixed.clone()
    }

    /// Names of its J joints.
    #[getter]
    fn joints(&self) -> Vec<String> {
        self.content.joints.clone()
    }

    /// Axes of `joint_forces` and of the constants of joints, as pairs of joint name and number: 0,
    /// 1, 2 along x, y, z and 3, 4, 5 about them.
    #[getter]
    fn driven_axes(&self) -> Vec<(String, usize)> {
        self.axes(self.content.world.driven_axes())
    }

    /// Driven axes with motors, used by `motors` and the constants of motors.
    #[getter]
    fn motor_axes(&self) -> Vec<(String, usize)> {
        self.axes(self.content.world.motors())
    }

    /// Indices in `gears` of the gears whose sum has a motor.
    #[getter]
    fn motor_gears(&self) -> Vec<usize> {
        self.content.world.gear_motors()
    }

    /// Names of the following and the leading joint of each gear.
    #[getter]
    fn gears(&self) -> Vec<(String, String)> {
        let name = |axis: &GearAxis| self.content.joints[axis.joint].clone();
        let gears = self.content.world.gears().iter();
        gears.map(|gear| (name(&gear.axes()[0]), name(&gear.axes()[1]))).collect()
    }

    /// Axes of each joint that can have drives: 0, 1, 2 along x, y, z and 3, 4, 5 about them.
    #[getter]
    fn joint_axes(&self) -> Vec<Vec<usize>> {
        let axes = |joint| {
            let driven = self.content.document.joint_kind(joint).driven();
            driven.iter().map(|(_, axis)| *axis).collect()
        };
        (0..self.content.joints.len()).map(axes).collect()
    }

    /// Model with position motors on joint axes, as text. They replace other motors of these axes.
    fn motored(&self, motors: Vec<PositionMotor>) -> PyResult<String> {
        let mut content = (*self.content).clone();
        for PositionMotor(joint, axis, target, stiffness, damping, max_force) in motors {
            let motor = Motor::Position { target, stiffness, damping, max_force };
            content.document.set_motor(joint, axis, &motor).map_err(refused)?;
        }
        content.model_text().map_err(in_python)
    }

    /// Step index k of its start.
    #[getter]
    fn start_index(&self) -> u64 {
        self.content.start_index
    }

    /// Prefixes of its robots.
    #[getter]
    fn robots(&self) -> Vec<String> {
        self.content.robots.iter().map(|robot| robot.prefix().to_owned()).collect()
    }

    /// Number of steps of a whole run.
    #[getter]
    fn steps(&self) -> u64 {
        self.content.rows - 1
    }

    /// Time step h, s.
    #[getter]
    fn time_step(&self) -> f64 {
        self.content.world.time_step()
    }

    /// Discretisation of the rotation: "momentum" or "tutorial".
    #[getter]
    fn rotation(&self) -> &'static str {
        self.content.world.rotation().name()
    }

    /// Meaning of the velocities of a run: "leapfrog" or "euler".
    #[getter]
    fn integrator(&self) -> &'static str {
        self.content.world.integrator().name()
    }

    /// True if contacts have rolling or torsional friction.
    #[getter]
    fn has_turning_friction(&self) -> bool {
        self.content.world.has_turning_friction()
    }

    /// Error of the time step that runs keep, m in a second; None if they keep none.
    #[getter]
    fn accuracy(&self) -> Option<f64> {
        self.content.world.accuracy()
    }

    /// When impacts happen: "stepped" or "located".
    #[getter]
    fn impacts(&self) -> &'static str {
        self.content.world.impacts().name()
    }

    /// Coefficient of friction of the world.
    #[getter]
    fn friction(&self) -> f64 {
        self.content.world.friction()
    }

    /// Coefficient of restitution of the world.
    #[getter]
    fn restitution(&self) -> f64 {
        self.content.world.restitution()
    }

    /// Gravity, m/s², world frame: (3,).
    #[getter]
    fn gravity<'py>(&self, py: Python<'py>) -> PyResult<Array<'py>> {
        list(py, self.content.world.gravity().as_slice().to_vec())
    }

    /// Mass of each body, kg: (N,).
    #[getter]
    fn masses<'py>(&self, py: Python<'py>) -> PyResult<Array<'py>> {
        list(py, self.content.world.bodies().iter().map(|body| body.mass()).collect())
    }

    /// Inertia of each body, kg m², body frame: (N, 3, 3).
    #[getter]
    fn inertias<'py>(&self, py: Python<'py>) -> PyResult<Array<'py>> {
        let bodies = self.content.world.bodies();
        // The matrix is symmetric, so row and column order agree.
        let numbers = bodies.iter().flat_map(|body| body.inertia().as_slice().to_vec());
        shaped(py, numbers.collect(), &[bodies.len(), 3, 3])
    }

    /// Half the extents of each body along its own axes, m: (N, 3).
    #[getter]
    fn extents<'py>(&self, py: Python<'py>) -> PyResult<Array<'py>> {
        let bodies = self.content.world.bodies();
        let numbers = bodies.iter().flat_map(|body| extents(body).as_slice().to_vec());
        shaped(py, numbers.collect(), &[bodies.len(), 3])
    }

    /// States nearest to `states` (N, 13) at which all joints are closed, at the scene's first
    /// step.
    fn assembled<'py>(&self, py: Python<'py>, states: Numbers<'_>) -> PyResult<Array<'py>> {
        let world = self.content.world_at(self.content.start_index);
        let (found, _) = world
            .assemble(&to_states("states", &states)?)
            .map_err(|error| refused(error.display(&*self.content)))?;
        states_array(py, &found)
    }

    /// Initial states of the bodies: (N, 13).
    #[getter]
    fn states<'py>(&self, py: Python<'py>) -> PyResult<Array<'py>> {
        states_array(py, &self.content.starts)
    }

    /// Answer of statics as JSON: see `Scene.stands`. A load has its kind, a body, a vector and a point.
    fn stands(
        &self,
        py: Python<'_>,
        load: Option<(String, String, [f64; 3], [f64; 3])>,
        least_friction: bool,
        friction: Option<[f64; 2]>,
        moves: Vec<(String, [f64; 3])>,
    ) -> PyResult<String> {
        let load = load.map(|(kind, body, vector, at)| match &*kind {
            "push" => Load::Push { body, force: vector, at },
            "mass" => Load::Mass { body, at },
            "tilt" => Load::Tilt(vector),
            _ => Load::Base(vector),
        });
        let slopes = moves.into_iter().map(|(body, along)| By::Move(body, along)).collect();
        let question = Question { load, least_friction, friction, slopes };
        let content = &*self.content;
        // No question has a field.
        let with = |_| Ok(content.clone());
        let report = py.detach(|| statics::answer(content, &question, &with)).map_err(in_python)?;
        report.text().map_err(in_python)
    }

    /// Hits of rays (R, 3): see [`Placed::cast`].
    fn hits<'py>(
        &self,
        py: Python<'py>,
        origins: Numbers<'_>,
        directions: Numbers<'_>,
        most: f64,
        ignored: Vec<String>,
        all: bool,
    ) -> PyResult<Hits<'py>> {
        self.placed().cast(py, [&origins, &directions], most, &ignored, all)
    }

    /// Distance of two objects: see [`Placed::distance`].
    fn between<'py>(&self, py: Python<'py>, first: &str, second: &str) -> PyResult<Between<'py>> {
        self.placed().distance(py, first, second)
    }

    /// Objects near a piece: see [`Placed::near`].
    fn near(
        &self,
        text: &str,
        path: PathBuf,
        within: f64,
        ignored: Vec<String>,
    ) -> PyResult<Vec<(String, f64)>> {
        self.placed().near(text, &path, within, &ignored)
    }

    /// Near pairs: see [`Placed::pairs`].
    fn near_pairs(&self, within: f64, excluded: bool) -> PyResult<Vec<(String, String, f64)>> {
        self.placed().pairs(within, excluded)
    }

    /// Solver of contact steps: native, ipopt, or rk4 without a ground.
    #[getter]
    fn solver(&self) -> &'static str {
        self.content.solver()
    }
}

impl PyScene {
    /// The scene at its start.
    fn placed(&self) -> Placed<'_> {
        let content = &*self.content;
        Placed { content, world: &content.world, states: &content.starts }
    }

    /// Names and numbers of joint axes.
    fn axes(&self, axes: Vec<(usize, JointAxis)>) -> Vec<(String, usize)> {
        let number = |axis| match axis {
            JointAxis::Linear(k) => k,
            JointAxis::Angular(k) => 3 + k,
        };
        let name = |joint: usize| self.content.joints[joint].clone();
        axes.into_iter().map(|(joint, axis)| (name(joint), number(axis))).collect()
    }
}
