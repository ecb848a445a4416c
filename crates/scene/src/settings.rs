//! Settings of a simulation, from flags, scenario files or the tutorial's scenes.

use super::choices::{
    Attitude, BodyShape, DetectionName, Inertia, OnFailure, Preset, SceneName, SolverName,
    StartFrame,
};
use nalgebra::{Matrix3, Vector3};
use std::path::PathBuf;
use tumble_core::error::Error;
use tumble_core::mechanics::Rotation;
use tumble_core::mechanics::load::Polyline;
use tumble_core::simulation::scene;
use tumble_core::world::Plane;
use tumble_model::failure::{Failure, refuse_flags};

/// Default seed.
pub const USUAL_SEED: u32 = 42;

/// Settings of a simulation; `None` for a setting that is not given.
#[derive(Debug, Default)]
pub struct Settings {
    /// Number of rows of the trajectory.
    pub steps: Option<u64>,
    /// Start index k.
    pub start_index: Option<u64>,
    /// Seed of random starts.
    pub seed: Option<u32>,
    /// Time step h (s).
    pub dt: Option<f64>,
    /// Discretisation of the rotational equations of motion in contact steps.
    pub rotation: Option<Rotation>,
    /// Coefficient of friction μ.
    pub mu: Option<f64>,
    /// Coefficient of restitution e of the world.
    pub restitution: Option<f64>,
    /// Approach speed below which contacts do not bounce (m/s).
    pub rebound_speed: Option<f64>,
    /// Mass (kg).
    pub mass: Option<f64>,
    /// Inertia of the body.
    pub inertia: Option<Inertia>,
    /// Gravitational acceleration (m/s²), world frame.
    pub gravity: Option<Vector3<f64>>,
    /// Contact points of the body.
    pub shape: Option<BodyShape>,
    /// Plane of the ground.
    pub plane: Option<Plane>,
    /// Initial position of the centre of mass (m).
    pub position: Option<Vector3<f64>>,
    /// Initial height (m), replaces the z coordinate of `position`.
    pub height: Option<f64>,
    /// Initial attitude, body → frame of the start.
    pub attitude: Option<Attitude>,
    /// Initial velocity (m/s).
    pub velocity: Option<Vector3<f64>>,
    /// Initial angular velocity (rad/s), body frame.
    pub spin: Option<Vector3<f64>>,
    /// Frame of the initial state.
    pub frame: Option<StartFrame>,
    /// Force (N), world frame.
    pub force: Option<Polyline>,
    /// Torque (N m), body frame.
    pub torque: Option<Polyline>,
    /// Point where the force acts (m), body frame, relative to the centre of mass.
    pub force_at: Option<Vector3<f64>>,
    /// Solver of contact steps.
    pub solver: Option<SolverName>,
    /// Preset of solver settings.
    pub preset: Option<Preset>,
    /// Criterion for the points that may touch.
    pub detection: Option<DetectionName>,
    /// Tolerance of Ipopt.
    pub tol: Option<f64>,
    /// Maximum number of Ipopt's iterations.
    pub max_iter: Option<u32>,
    /// Target residual of the native solver, m/s at speed scale 1.
    pub residual: Option<f64>,
    /// Action if a step is not solved.
    pub on_failure: Option<OnFailure>,
    /// Settings for a single robot file.
    pub robot: RobotSettings,
}

/// Import settings of a single robot file; `[[robots]]` has the same fields in a scenario.
#[derive(Debug, Default)]
pub struct RobotSettings {
    /// Folder that `package://` paths refer to.
    pub packages: Option<PathBuf>,
    /// Elements and attributes of the file to ignore.
    pub leave_out: Vec<String>,
    /// True if torsional and rolling friction are ignored.
    pub point_contacts: bool,
}

impl RobotSettings {
    /// Names of the flags, and whether each is given.
    pub fn given(&self) -> [(&'static str, bool); 3] {
        [
            ("packages", self.packages.is_some()),
            ("leave-out", !self.leave_out.is_empty()),
            ("point-contacts", self.point_contacts),
        ]
    }

    /// Rejects these flags for a file that is not a robot's.
    ///
    /// # Errors
    /// The first given flag.
    pub fn refuse(&self) -> Result<(), Failure> {
        refuse_flags("anything but a robot file; in a scenario, use [[robots]]", &self.given())
    }
}

impl Settings {
    /// Settings of a scene of the tutorial, complete except for the solver.
    pub fn of_scene(name: SceneName) -> Self {
        let scene = name.scene();
        let attitude = match name {
            SceneName::Drop => Attitude::Random,
            SceneName::Floating => Attitude::Given(scene.attitude(0)),
        };
        Self {
            steps: Some(scene.rows),
            dt: Some(scene.time_step),
            rotation: (name == SceneName::Drop).then_some(Rotation::Tutorial),
            mu: Some(scene::FRICTION),
            mass: Some(scene::CUBE_MASS),
            inertia: Some(Inertia::Matrix(Matrix3::from_diagonal_element(scene::CUBE_INERTIA))),
            gravity: Some(scene.gravity),
            shape: Some(BodyShape::Box(Vector3::repeat(2.0 * scene::CUBE_HALF_SIDE))),
            position: Some(Vector3::new(0.0, 0.0, scene.height)),
            attitude: Some(attitude),
            velocity: Some(scene.velocity),
            spin: Some(scene.spin),
            ..Self::default()
        }
    }

    /// Merges two layers of settings: values of `self` take precedence over those of `below`.
    ///
    /// A preset in `self` replaces all solver settings of `below`.
    pub fn over(self, below: Self) -> Self {
        let below = if self.preset.is_some() { below.without_solver() } else { below };
        Self {
            steps: self.steps.or(below.steps),
            start_index: self.start_index.or(below.start_index),
            seed: self.seed.or(below.seed),
            dt: self.dt.or(below.dt),
            rotation: self.rotation.or(below.rotation),
            mu: self.mu.or(below.mu),
            restitution: self.restitution.or(below.restitution),
            rebound_speed: self.rebound_speed.or(below.rebound_speed),
            mass: self.mass.or(below.mass),
            inertia: self.inertia.or(below.inertia),
            gravity: self.gravity.or(below.gravity),
            shape: self.shape.or(below.shape),
            plane: self.plane.or(below.plane),
            position: self.position.or(below.position),
            height: self.height.or(below.height),
            attitude: self.attitude.or(below.attitude),
            velocity: self.velocity.or(below.velocity),
            spin: self.spin.or(below.spin),
            frame: self.frame.or(below.frame),
            force: self.force.or(below.force),
            torque: self.torque.or(below.torque),
            force_at: self.force_at.or(below.force_at),
            solver: self.solver.or(below.solver),
            preset: self.preset.or(below.preset),
            detection: self.detection.or(below.detection),
            tol: self.tol.or(below.tol),
            max_iter: self.max_iter.or(below.max_iter),
            residual: self.residual.or(below.residual),
            on_failure: self.on_failure.or(below.on_failure),
            robot: self.robot,
        }
    }
}

impl Settings {
    /// These settings without the solver settings.
    fn without_solver(self) -> Self {
        Self {
            solver: None,
            preset: None,
            detection: None,
            tol: None,
            max_iter: None,
            residual: None,
            on_failure: None,
            ..self
        }
    }
}

/// Value of a load, and its time (s) if given.
pub type LoadKnot = (Option<f64>, Vector3<f64>);

/// Polyline through the knots of a flag; `None` without knots.
pub fn polyline(flag: &str, knots: &[LoadKnot]) -> Result<Option<Polyline>, Failure> {
    let named = |error: Error| Failure::setting(flag, error);
    match knots {
        [] => Ok(None),
        [(None, value)] => Polyline::constant(*value).map(Some).map_err(named),
        _ => {
            let timed = knots.iter().map(|(time, value)| time.map(|time| (time, *value)));
            let knots = timed.collect::<Option<Vec<_>>>().ok_or_else(|| {
                Failure::setting(flag, "it is given more than once; each needs a time, T:X,Y,Z")
            })?;
            Polyline::new(knots).map(Some).map_err(named)
        }
    }
}
