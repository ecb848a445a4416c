//! What a simulation can be told, by flags, by a scenario file or by the names of the
//! tutorial's scenes: the same list, one laid over the other.

use super::choices::{
    Attitude, BodyShape, DetectionName, FormulationName, Inertia, OnFailure, Preset, SceneName,
    SolverName, StartFrame,
};
use nalgebra::{Matrix3, Vector3};
use std::path::PathBuf;
use tumble_core::error::Error;
use tumble_core::mechanics::Rotation;
use tumble_core::mechanics::load::Polyline;
use tumble_core::simulation::scene;
use tumble_core::world::Plane;
use tumble_model::failure::{Failure, refuse_flags};

/// The seed where none is given.
pub const USUAL_SEED: u32 = 42;

/// All that can be told; `None` where it is not.
#[derive(Debug, Default)]
pub struct Settings {
    /// Rows of the trajectory.
    pub steps: Option<u64>,
    /// k of the start.
    pub start_index: Option<u64>,
    /// The seed of what is drawn.
    pub seed: Option<u32>,
    /// h, s.
    pub dt: Option<f64>,
    /// By which equation bodies turn in a step that knows contact.
    pub rotation: Option<Rotation>,
    /// μ.
    pub mu: Option<f64>,
    /// e of the world.
    pub restitution: Option<f64>,
    /// m/s: below it nothing bounces.
    pub rebound_speed: Option<f64>,
    /// kg.
    pub mass: Option<f64>,
    /// Of the body.
    pub inertia: Option<Inertia>,
    /// m/s², world.
    pub gravity: Option<Vector3<f64>>,
    /// Of the body.
    pub shape: Option<BodyShape>,
    /// The ground.
    pub plane: Option<Plane>,
    /// m, of the centre of mass.
    pub position: Option<Vector3<f64>>,
    /// m, in the place of the position's z.
    pub height: Option<f64>,
    /// Body → frame.
    pub attitude: Option<Attitude>,
    /// m/s.
    pub velocity: Option<Vector3<f64>>,
    /// rad/s, body.
    pub spin: Option<Vector3<f64>>,
    /// Which frame the start is given in.
    pub frame: Option<StartFrame>,
    /// N, world.
    pub force: Option<Polyline>,
    /// N m, body.
    pub torque: Option<Polyline>,
    /// m, body, from the centre of mass.
    pub force_at: Option<Vector3<f64>>,
    /// Who solves contact steps.
    pub solver: Option<SolverName>,
    /// A preset of the solver.
    pub preset: Option<Preset>,
    /// Of Ipopt's program.
    pub formulation: Option<FormulationName>,
    /// Which points may touch.
    pub detection: Option<DetectionName>,
    /// Ipopt's tolerance.
    pub tol: Option<f64>,
    /// Ipopt's limit of iterations.
    pub max_iter: Option<u32>,
    /// What the native solver solves contact steps to, m/s at the speed scale 1.
    pub residual: Option<f64>,
    /// What happens with a step that fails.
    pub on_failure: Option<OnFailure>,
    /// Of a robot's file that is simulated alone.
    pub robot: RobotSettings,
}

/// How a robot's file is read that is simulated alone: what `[[robots]]` says of others.
#[derive(Debug, Default)]
pub struct RobotSettings {
    /// The folder of packages.
    pub packages: Option<PathBuf>,
    /// What is as if it were not there.
    pub leave_out: Vec<String>,
    /// Whether contacts that would resist turning and rolling rub alone.
    pub point_contacts: bool,
}

impl RobotSettings {
    /// Its flags, and whether they are given.
    pub fn given(&self) -> [(&'static str, bool); 3] {
        [
            ("packages", self.packages.is_some()),
            ("leave-out", !self.leave_out.is_empty()),
            ("point-contacts", self.point_contacts),
        ]
    }

    /// Refuses them of what is no robot's file.
    ///
    /// # Errors
    /// The first one that is given.
    pub fn refuse(&self) -> Result<(), Failure> {
        refuse_flags("anything but a robot's file; in a scenario [[robots]] says it", &self.given())
    }
}

impl Settings {
    /// A scene of the tutorial; nothing is left open but the solver.
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

    /// What this says, and where it says nothing, what `below` says. A preset goes before all
    /// that `below` says of the solver.
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
            formulation: self.formulation.or(below.formulation),
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
    /// This, with nothing said of the solver.
    fn without_solver(self) -> Self {
        Self {
            solver: None,
            preset: None,
            formulation: None,
            detection: None,
            tol: None,
            max_iter: None,
            residual: None,
            on_failure: None,
            ..self
        }
    }
}

/// A value of a load, and its time (s) where there is one.
pub type LoadKnot = (Option<f64>, Vector3<f64>);

/// The polyline through the knots that a flag was given for; `None` if it was not.
pub fn polyline(flag: &str, knots: &[LoadKnot]) -> Result<Option<Polyline>, Failure> {
    let named = |error: Error| Failure::setting(flag, error);
    match knots {
        [] => Ok(None),
        [(None, value)] => Polyline::constant(*value).map(Some).map_err(named),
        _ => {
            let timed = knots.iter().map(|(time, value)| time.map(|time| (time, *value)));
            let knots = timed.collect::<Option<Vec<_>>>().ok_or_else(|| {
                Failure::setting(flag, "given more than once, each needs a time, T:X,Y,Z")
            })?;
            Polyline::new(knots).map(Some).map_err(named)
        }
    }
}
