//! The tutorial's scenes. Flags of the command line can change their cube.

use super::bodies::entries::{AttitudeEntry, BodyEntry, Files};
use super::bodies::scene_entries::SceneEntries;
use super::bodies::{self, refuse_contact_settings};
use super::choices::{SceneName, SolverName, StartFrame};
use super::scene::Scene;
use super::settings::Settings;
use super::tables::{InertiaValue, LoadTable, Random, Sides, SolverTable};
use nalgebra::Vector3;
use std::io;
use std::path::Path;
use tumble_core::mechanics::Rotation;
use tumble_core::mechanics::load::{Load, Polyline};
use tumble_core::simulation::scene;
use tumble_core::world::Plane;
use tumble_model::failure::{Failure, refuse_flags};
use tumble_model::fields::{Exactly, numbers};

/// New values of the cube, its start, its load and its ground; `None` keeps the tutorial's value.
#[derive(Debug, Default)]
pub struct CubeChanges {
    /// Mass (kg).
    pub mass: Option<f64>,
    /// Inertia (kg m²).
    pub inertia: Option<InertiaValue>,
    /// Sides of the box (m).
    pub sides: Option<Vector3<f64>>,
    /// Plane of the ground.
    pub plane: Option<Plane>,
    /// Force (N), world frame.
    pub force: Option<Polyline>,
    /// Torque (N m), body frame.
    pub torque: Option<Polyline>,
    /// Point where the force acts (m), body frame, relative to the centre of mass.
    pub force_at: Option<Vector3<f64>>,
    /// Initial position of the centre of mass (m).
    pub position: Option<Vector3<f64>>,
    /// Initial height (m), replaces the z coordinate of `position`.
    pub height: Option<f64>,
    /// Initial attitude, body → frame of the start.
    pub attitude: Option<AttitudeEntry>,
    /// Initial velocity (m/s).
    pub velocity: Option<Vector3<f64>>,
    /// Initial angular velocity (rad/s), body frame.
    pub spin: Option<Vector3<f64>>,
    /// Frame of the initial state.
    pub frame: Option<StartFrame>,
}

/// Names of the changes of a scene.
struct Changed(Vec<String>);

impl Changed {
    /// Sets `value` to `new`, if it is given, and names a change.
    fn set<T: PartialEq>(&mut self, name: &str, value: &mut T, new: Option<T>) {
        let Some(new) = new else { return };
        if *value != new {
            self.0.push(name.to_owned());
            *value = new;
        }
    }
}

impl Scene {
    /// Scene of the tutorial; `flags` and `cube` take precedence.
    ///
    /// # Errors
    /// The first invalid value.
    pub fn from_tutorial(
        name: SceneName,
        flags: Settings,
        cube: CubeChanges,
    ) -> Result<Self, Failure> {
        let floats = name == SceneName::Floating;
        flags.robot.refuse()?;
        if floats {
            let in_ground = cube.frame == Some(StartFrame::Ground);
            let place = "a floating body, which has no contact";
            let idle = [("plane", cube.plane.is_some()), ("frame ground", in_ground)];
            refuse_flags(place, &idle)?;
            refuse_contact_settings(&flags)?;
        }
        let idle_point = cube.force_at.is_some() && cube.force.is_none();
        refuse_flags("a body without --force", &[("force-at", idle_point)])?;
        let mut below = settings(name, flags.restitution.unwrap_or(0.0) != 0.0);
        let mut changed = Changed(flags.changed(&below));
        let (entry, plane) = entry(name, cube, &mut changed)?;
        below.plane = (!floats).then_some(plane);
        let entries = SceneEntries { bodies: vec![entry], at: BODY, ..SceneEntries::default() };
        let none = |_: &Path, _: u64| Err(io::Error::other("there are no files"));
        let files = Files { folder: Path::new(""), read: &none };
        let title = name.scene().name.to_owned();
        let scene = bodies::scene(title, floats, &flags.over(below), entries, files);
        Ok(Self { changed: changed.0, trajectory: true, ..scene.map_err(as_flag_failure)? })
    }
}

/// Name of the body, and its place in error messages.
pub const BODY: &str = "body";

/// Settings of a scene of the tutorial. The thrown cube has Ipopt as its solver, in a build with
/// Ipopt and if it does not bounce, which Ipopt's program does not support.
fn settings(name: SceneName, bounces: bool) -> Settings {
    let (scene, drops) = (name.scene(), name == SceneName::Drop);
    let takes_ipopt = drops && !bounces && cfg!(feature = "ipopt");
    Settings {
        steps: Some(scene.rows),
        dt: Some(scene.time_step),
        rotation: drops.then_some(Rotation::Tutorial),
        mu: drops.then_some(scene::FRICTION),
        gravity: Some(scene.gravity),
        solver: SolverTable {
            name: takes_ipopt.then_some(SolverName::Ipopt),
            ..SolverTable::default()
        },
        ..Settings::default()
    }
}

/// Table of the cube with its changes, and the plane of the ground.
fn entry(
    name: SceneName,
    cube: CubeChanges,
    changed: &mut Changed,
) -> Result<(BodyEntry, Plane), Failure> {
    let scene = name.scene();
    let mut mass = scene::CUBE_MASS;
    let mut inertia = InertiaValue::Moment(scene::CUBE_INERTIA);
    let mut sides = Vector3::repeat(2.0 * scene::CUBE_HALF_SIDE);
    let mut plane = Plane::default();
    let mut load = Load::default();
    let mut position = Vector3::new(0.0, 0.0, scene.height);
    let mut attitude = match name {
        SceneName::Drop => AttitudeEntry::Word(Random::Tutorial),
        SceneName::Floating => AttitudeEntry::Quaternion(Exactly([1.0, 0.0, 0.0, 0.0])),
    };
    let (mut velocity, mut spin, mut frame) = (scene.velocity, scene.spin, StartFrame::World);
    changed.set("mass", &mut mass, cube.mass);
    changed.set("inertia", &mut inertia, cube.inertia);
    changed.set("box", &mut sides, cube.sides);
    changed.set("plane", &mut plane, cube.plane);
    changed.set("force", &mut load.force, cube.force);
    changed.set("torque", &mut load.torque, cube.torque);
    let mut point = *load.point();
    changed.set("force-at", &mut point, cube.force_at);
    // Names the flag of a point out of range.
    let load = Load::new(load.force, load.torque, point)?;
    changed.set("position", &mut position, cube.position);
    changed.set("height", &mut position.z, cube.height);
    changed.set("attitude", &mut attitude, cube.attitude);
    changed.set("velocity", &mut velocity, cube.velocity);
    changed.set("spin", &mut spin, cube.spin);
    changed.set("frame", &mut frame, cube.frame);
    let entry = BodyEntry {
        name: Some(BODY.to_owned()),
        inertia: Some(inertia.for_box(mass, &sides)),
        cuboid: Some(Sides::Box(numbers(&sides))),
        mass: Some(mass),
        load: Some(LoadTable::from_load(&load)),
        position: numbers(&position),
        attitude: Some(attitude),
        velocity: Some(numbers(&velocity)),
        spin: Some(numbers(&spin)),
        frame: Some(frame),
        ..BodyEntry::default()
    };
    Ok((entry, plane))
}

/// Failure of the flag that set a field of the body.
fn as_flag_failure(failure: Failure) -> Failure {
    let Failure::Input(text) = &failure else { return failure };
    let Some(text) = text.strip_prefix("body.") else { return failure };
    let is_of_word = |letter: char| letter.is_ascii_lowercase() || letter == '_';
    let (field, rest) = text.split_at(text.find(|letter| !is_of_word(letter)).unwrap_or(0));
    let why = rest.strip_prefix(": ").unwrap_or(text);
    Failure::setting(if field == "load" { "force or torque" } else { field }, why)
}
