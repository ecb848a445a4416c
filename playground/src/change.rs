//! Changes of a running scene: a new text that starts at the present state.

use crate::scenes;
use crate::session::Session;
use nalgebra::Vector3;
use serde::Deserialize;
use std::path::Path;
use tumble_core::mechanics::{Load, RigidBody};
use tumble_core::world::{Coefficient, Integrator};
use tumble_model::failure::Failure;
use tumble_scene::scene::Scene;

/// A change of a scene.
#[derive(Debug, Clone, Copy, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Change {
    /// Coefficient of friction of everything.
    Friction(f64),
    /// Coefficient of restitution of everything.
    Restitution(f64),
    /// Gravity, tilted as on a slope.
    Gravity {
        /// Size (m/s²).
        size: f64,
        /// Slope towards +x (°).
        slope: f64,
    },
    /// Time step (s).
    TimeStep(f64),
    /// Mass of a body, with its inertia.
    Mass {
        /// Index of the body.
        body: usize,
        /// Mass (kg).
        mass: f64,
    },
    /// A new body above all others.
    Add(NewShape),
    /// Removal of a body with its joints.
    Remove(usize),
}

/// Shape of a new body.
#[derive(Debug, Clone, Copy, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum NewShape {
    /// Cube.
    Box,
    /// Ball.
    Ball,
    /// Cylinder.
    Cylinder,
}

/// Size of new bodies over the median of the others, and gap above them.
const NEW_SIZE: f64 = 0.8;
const NEW_GAP: f64 = 0.25;

impl Session {
    /// Session of the changed scene, from the present state on.
    ///
    /// # Errors
    /// A value out of range; a scene that no text can hold at this state.
    pub fn changed(&self, change: Change) -> Result<Self, String> {
        let scene = self.present().map_err(|failure| failure.to_string())?;
        let scene = changed(scene, change).map_err(|failure| failure.to_string())?;
        self.continued(scenes::text(&scene).map_err(|failure| failure.to_string())?)
    }

    /// Session of the same scene from the present state on, in a text of the page, with loads that act
    /// over whole steps.
    pub(crate) fn rewritten(&self) -> Result<Self, String> {
        let mut scene = self.present().map_err(|failure| failure.to_string())?;
        scene.use_integrator(Integrator::Euler);
        self.continued(scenes::text(&scene).map_err(|failure| failure.to_string())?)
    }

    /// Scene whose start is the present state, in the notation `[[bodies]]`.
    fn present(&self) -> Result<Scene, Failure> {
        let (mut scene, simulation) = (self.scene().clone(), self.simulation());
        let time = simulation.index() as f64 * scene.world.time_step();
        scene.document.start_at(simulation.states(), time)?;
        scene.start_index = simulation.index();
        if scene.contact.is_none() {
            scene = scene.with_native_solver();
        }
        for (load, body) in scene.loads.iter().zip(&mut scene.document.bodies) {
            if has_ended(load, time) {
                body.load = None;
            }
        }
        Ok(scene)
    }
}

/// True if a load is zero from `time` (s) on.
pub(crate) fn has_ended(load: &Load, time: f64) -> bool {
    let mut last = [&load.force, &load.torque].into_iter().filter_map(|line| line.knots().last());
    last.all(|(end, value)| *end <= time && *value == Vector3::zeros())
}

fn changed(mut scene: Scene, change: Change) -> Result<Scene, Failure> {
    let document = &mut scene.document;
    match change {
        Change::Friction(friction) => {
            document.set_coefficient(Coefficient::Friction, Some(friction));
            document.set_coefficient(Coefficient::StaticFriction, None);
        }
        Change::Restitution(restitution) => {
            document.set_coefficient(Coefficient::Restitution, Some(restitution));
        }
        Change::Gravity { size, slope } => {
            let slope = slope.to_radians();
            let gravity = Vector3::new(size * slope.sin(), 0.0, -size * slope.cos());
            document.set_gravity(&gravity);
        }
        Change::TimeStep(time_step) => {
            let time = scene.start_index as f64 * document.time_step();
            document.time_step = Some(time_step);
            // Loads and prescribed motions follow the time.
            scene.start_index = (time / time_step).round().clamp(0.0, 1e15) as u64;
        }
        Change::Mass { body, mass } => {
            let body = document.bodies.get_mut(body).ok_or_else(no_body)?;
            let share = mass / body.mass();
            body.set_mass(mass, &(share * body.inertia()));
        }
        Change::Add(shape) => {
            let table = new_body(&scene, shape);
            return scene.with_body(&table, Path::new(""), &|_, _| Ok(Vec::new()));
        }
        Change::Remove(body) => {
            document.bodies.get(body).ok_or_else(no_body)?;
            if document.bodies.len() == 1 {
                return Err(Failure::Input("The last body cannot be removed.".to_owned()));
            }
            document.leave_out(body);
        }
    }
    Ok(scene)
}

fn no_body() -> Failure {
    Failure::Input("Touch a body first.".to_owned())
}

/// Radius of a ball about the centre of mass that contains a body (m).
fn radius(body: &RigidBody) -> f64 {
    let points = body.contact_points().iter().map(|point| point.position.norm() + point.radius);
    let pieces = body.pieces().iter().map(|piece| {
        let corners = piece.core().vertices().iter().map(|vertex| vertex.norm());
        corners.fold(0.0, f64::max) + piece.radius()
    });
    points.chain(pieces).fold(0.0, f64::max)
}

/// Table of a new body, above all bodies and near their middle.
fn new_body(scene: &Scene, shape: NewShape) -> String {
    let bodies = scene.world.bodies();
    let median = |mut numbers: Vec<f64>| {
        numbers.sort_by(f64::total_cmp);
        numbers[numbers.len() / 2]
    };
    let reach = NEW_SIZE * median(bodies.iter().map(radius).collect());
    let mass = median(bodies.iter().map(|body| body.mass()).collect());
    let starts: Vec<_> = scene.document.states().iter().map(|start| start.position).collect();
    let middle = starts.iter().sum::<Vector3<f64>>() / starts.len() as f64;
    let tops = starts.iter().zip(bodies).map(|(start, body)| start[2] + radius(body));
    let height = tops.fold(f64::NEG_INFINITY, f64::max) + (1.0 + NEW_GAP) * reach;
    let form = match shape {
        NewShape::Box => format!("box = {:?}", 2.0 * reach / 3.0_f64.sqrt()),
        NewShape::Ball => format!("sphere = {:?}", 0.7 * reach),
        NewShape::Cylinder => {
            format!("cylinder = {{ length = {:?}, radius = {:?} }}", 1.2 * reach, 0.6 * reach)
        }
    };
    format!("{form}\nmass = {mass:?}\nposition = {:?}\n", [middle[0], middle[1], height])
}
