//! What a run was told: the constants of a model in the notation of one body, its start, and the solver.

use super::super::choices::{Inertia, Shape};
use super::super::failure::Failure;
use super::super::fields::{Exactly, Numbers, by_rows, matrix, numbers};
use super::super::parameters::{LoadParameters, PlaneParameters, unnamed_rotation};
use super::super::physics::plane;
use super::super::settings::Settings;
use super::super::solver_choice::SolverChoice;
use crate::mechanics::body::box_corners;
use crate::mechanics::{Load, Rotation, State};
use crate::step_nlp::SMOOTHING;
use crate::world::{Plane, World};
use nalgebra::Vector3;
use serde::{Deserialize, Serialize};

/// The constants of the model, SI units.
#[derive(Debug, Clone, Serialize, Deserialize)]
#[serde(expecting = "an object with the constants of the model")]
pub struct RunParameters {
    /// Rows asked for.
    pub steps: u64,
    /// h, s.
    pub dt: f64,
    /// By which equation the body turns.
    #[serde(default = "unnamed_rotation")]
    pub rotation: Rotation,
    /// The coefficient of friction.
    pub mu: f64,
    /// The coefficient of restitution.
    #[serde(default)]
    pub restitution: f64,
    /// m/s; null for the usual one.
    #[serde(default)]
    pub rebound_speed: Option<f64>,
    /// kg.
    pub mass: f64,
    /// By rows.
    pub inertia: Exactly<Numbers<3>, 3>,
    /// m/s², world.
    pub gravity: Numbers<3>,
    /// ε of the tutorial's program, N.
    pub epsilon: f64,
    /// The ground.
    #[serde(default)]
    pub plane: PlaneParameters,
    /// Body frame.
    pub contact_points: Vec<Numbers<3>>,
    /// Whether the body is the box whose corners they are, and not made of points.
    #[serde(default)]
    is_box: bool,
    /// Null without one.
    #[serde(default)]
    pub load: Option<LoadParameters>,
}

impl RunParameters {
    /// Those of `world`, whose one body is pushed by `load`, and of so many `rows`.
    #[must_use]
    pub fn of(world: &World, load: &Load, rows: u64) -> Self {
        let body = &world.bodies()[0];
        Self {
            steps: rows,
            dt: world.time_step(),
            rotation: world.rotation(),
            mu: world.friction(),
            restitution: world.restitution(),
            rebound_speed: world.given_rebound_speed(),
            mass: body.mass(),
            inertia: by_rows(body.inertia()),
            gravity: numbers(world.gravity()),
            epsilon: SMOOTHING,
            plane: plane(&world.ground().cloned().unwrap_or_default()),
            contact_points: body.contact_points().iter().map(|c| numbers(&c.position)).collect(),
            // A box is the only piece that a body of this notation may be.
            is_box: !body.pieces().is_empty(),
            load: (!load.is_none()).then(|| LoadParameters::of(load)),
        }
    }

    fn points(&self) -> Vec<Vector3<f64>> {
        self.contact_points.iter().map(|c| c.0.into()).collect()
    }

    /// Half of the sides of the box whose corners the points are, m, if the file says so of them and they are.
    fn half_sides(&self) -> Option<Vector3<f64>> {
        let points = self.points();
        let half = points.iter().fold(Vector3::zeros(), |half: Vector3<f64>, c| half.sup(&c.abs()));
        (self.is_box && points == box_corners(&half)).then_some(half)
    }

    /// Whether the points are said to be the corners of a box, and are not.
    #[must_use]
    pub fn is_no_box(&self) -> bool {
        self.is_box && self.half_sides().is_none()
    }

    /// As settings, under which flags may be laid.
    ///
    /// # Errors
    /// A load or a plane that cannot be.
    pub fn settings(&self) -> Result<Settings, Failure> {
        let load = self.load.as_ref().map_or(Ok(Load::none()), LoadParameters::load)?;
        // Whatever is said of them, points that are no corners are points.
        let shape = self.half_sides().map(|half| Shape::Box(2.0 * half));
        let shape = shape.unwrap_or_else(|| Shape::Points(self.points()));
        Ok(Settings {
            dt: Some(self.dt),
            rotation: Some(self.rotation),
            mu: Some(self.mu),
            restitution: Some(self.restitution),
            rebound_speed: self.rebound_speed,
            mass: Some(self.mass),
            inertia: Some(Inertia::Matrix(matrix(&self.inertia))),
            gravity: Some(self.gravity.0.into()),
            shape: Some(shape),
            plane: Some(Plane::new(self.plane.normal.0.into(), self.plane.offset)?),
            force: Some(load.force.clone()),
            torque: Some(load.torque.clone()),
            force_at: Some(*load.point()),
            ..Settings::default()
        })
    }
}

/// Who solved the steps, and how.
#[derive(Debug, Serialize, Deserialize)]
#[serde(expecting = "an object with the solver's name and settings")]
pub struct SolverSettings {
    /// `native`, `ipopt` or `rk4`.
    pub name: String,
    /// What all of the others were said by, if a preset was.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub preset: Option<String>,
    /// Of Ipopt's program; null for others.
    #[serde(default)]
    pub formulation: Option<String>,
    /// Which points were candidates; null without contact.
    pub detection: Option<String>,
    /// What happened with a step that failed; null without contact.
    pub on_failure: Option<String>,
    /// Ipopt's tolerance; null for others.
    pub tol: Option<f64>,
    /// Ipopt's most iterations; null for others.
    pub max_iter: Option<u32>,
    /// What the native solver was asked to solve to, m/s at the speed scale 1, where it was not the usual.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub residual: Option<f64>,
    /// The residual that a contact step may have that counts as solved, m/s: what the solver
    /// promises. A file of before it was written has none.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub accepted_residual_m_s: Option<f64>,
}

impl SolverSettings {
    /// Those of a choice for `world`; of free motion without one.
    ///
    /// # Errors
    /// A solver that is not made for the world.
    pub fn of(contact: Option<&SolverChoice>, world: &World) -> Result<Self, Failure> {
        let program = contact.and_then(SolverChoice::program);
        let solver = contact.map(|contact| contact.solver(world)).transpose()?;
        Ok(Self {
            name: contact.map_or("rk4", SolverChoice::solver_name).to_owned(),
            preset: contact.and_then(|contact| Some(contact.preset?.name().to_owned())),
            formulation: program.map(|(name, ..)| name.to_owned()),
            detection: contact.map(|contact| contact.detection.name().to_owned()),
            on_failure: contact.map(|contact| contact.on_failure.name().to_owned()),
            tol: program.map(|(_, tolerance, _)| tolerance),
            max_iter: program.map(|(.., iterations)| iterations),
            residual: contact.and_then(SolverChoice::residual),
            accepted_residual_m_s: Some(solver.map_or(0.0, |solver| solver.accepted_residual())),
        })
    }
}

/// The state that one body started from.
#[derive(Debug, Serialize, Deserialize)]
#[serde(expecting = "an object with the state at the start")]
pub struct StartState {
    /// m, world.
    pub position: Numbers<3>,
    /// Whether the attitude is drawn from the seed.
    pub random: bool,
    /// Unit quaternion w, x, y, z, body → world.
    pub attitude: Numbers<4>,
    /// m/s, world.
    pub velocity: Numbers<3>,
    /// rad/s, body.
    pub spin: Numbers<3>,
}

impl StartState {
    pub(super) fn of(state: &State, random: bool) -> Self {
        Self {
            position: numbers(&state.position),
            random,
            attitude: Exactly(state.attitude.into()),
            velocity: numbers(&state.velocity),
            spin: numbers(&state.spin),
        }
    }

    pub(super) fn state(&self) -> State {
        State {
            position: self.position.0.into(),
            attitude: self.attitude.0.into(),
            velocity: self.velocity.0.into(),
            spin: self.spin.0.into(),
        }
    }
}
