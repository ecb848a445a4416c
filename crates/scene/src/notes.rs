//! Notes on a valid scene: ignored content of its files, and what may be a mistake.

use super::bodies::entries::{FixedEntry, PieceEntry};
use super::bodies::joints::{JointEntry, MotorEntry};
use super::bodies::terrain::TerrainEntry;
use super::locks::counted;
use super::scene::Scene;
use nalgebra::Vector3;
use std::f64::consts::TAU;
use std::sync::Arc;
use tumble_core::geometry::Terrain;
use tumble_core::geometry::terrain::TerrainShape;
use tumble_core::joint::{Drive, Motor};
use tumble_core::mechanics::RigidBody;
use tumble_core::world::constants::extents;
use tumble_model::shown;

/// Largest angle that may be meant in degrees: two turns.
const MOST_DEGREES: f64 = 720.0;

/// Largest tested ratio of two masses.
const LARGEST_MASS_RATIO: f64 = 1e6;

/// Relative excess of a principal moment over the sum of the others that rounded input explains.
const ROUNDED_MOMENTS: f64 = 1e-3;

impl Scene {
    /// Notes, one sentence each. `run`, `check`, `convert` and Python show them.
    pub fn notes(&self) -> Vec<String> {
        let of_robots = self.robots.iter().flat_map(|robot| {
            let name = format!("{}{}", robot.prefix(), robot.robot().name);
            let name = if name.is_empty() { "the robot".to_owned() } else { name };
            robot.robot().notes.iter().map(move |note| format!("{name}: {note}"))
        });
        let of_terrains =
            self.world.terrains().iter().zip(&self.document.terrain).filter_map(note_on_terrain);
        let mistakes = [
            self.note_on_ground(),
            self.note_on_gravity(),
            self.note_on_degrees(),
            self.note_on_speeds(),
            self.note_on_masses(),
            self.note_on_inertias(),
            self.note_on_attitudes(),
        ];
        let of_files = of_robots.chain(self.file_notes.iter().cloned()).chain(of_terrains);
        of_files.chain(self.notes_on_joints()).chain(mistakes.into_iter().flatten()).collect()
    }

    fn note_on_ground(&self) -> Option<String> {
        let document = &self.document;
        let has_support = document.ground.is_some() || !document.fixed.is_empty();
        let is_held = !document.joints.is_empty() || !document.driven.is_empty();
        let gravity = self.world.gravity().norm();
        let time = self.rows.saturating_sub(1) as f64 * self.world.time_step();
        let name = self.bodies.first()?;
        let falls = gravity > 0.0 && !has_support && document.terrain.is_empty() && !is_held;
        falls.then(|| {
            let [fall, time] = [0.5 * gravity * time * time, time].map(shown::rounded);
            format!("there is no [ground]; {name} falls by {fall} m in {time} s")
        })
    }

    fn note_on_gravity(&self) -> Option<String> {
        let (from, up) = match self.world.ground() {
            Some(ground) => ("away from the ground", *ground.normal()),
            None => ("up", Vector3::z()),
        };
        let rises = up.dot(self.world.gravity()) > 0.0;
        rises.then(|| format!("gravity points {from}; a positive number points down"))
    }

    fn note_on_degrees(&self) -> Option<String> {
        let joints = self
            .document
            .joints
            .iter()
            .filter(|joint| seems_in_degrees(joint, &self.document.motors));
        let names = listed(joints.filter_map(JointEntry::name))?;
        Some(format!("angles of {names} look like degrees; angles of joints are in rad"))
    }

    fn note_on_speeds(&self) -> Option<String> {
        self.contact.as_ref()?;
        let h = self.world.time_step();
        let mut names = Vec::new();
        let mut longest = h;
        for (index, (body, start)) in self.world.bodies().iter().zip(&self.starts).enumerate() {
            let width = 2.0 * extents(body).min();
            let speed = start.velocity.norm();
            if self.document.bodies[index].touches() && width > 0.0 && speed * h > width {
                names.push(self.bodies[index].as_str());
                longest = longest.min(width / speed);
            }
        }
        let names = listed(names.into_iter())?;
        Some(format!(
            "the motion of {names} in a step exceeds the body's thickness; use a time step of at most \
             {longest:.1e} s"
        ))
    }

    fn note_on_masses(&self) -> Option<String> {
        let by_mass = |a: &(f64, &String), b: &(f64, &String)| a.0.total_cmp(&b.0);
        let masses = self.world.bodies().iter().map(RigidBody::mass);
        let bodies = || masses.clone().zip(&self.bodies);
        let (light, light_name) = bodies().min_by(by_mass)?;
        let (heavy, heavy_name) = bodies().max_by(by_mass)?;
        let ratio = heavy / light;
        (ratio > LARGEST_MASS_RATIO).then(|| {
            format!(
                "{heavy_name} of {heavy} kg is {ratio:.1e} times as heavy as {light_name} of {light} kg; \
                 steps are tested with ratios up to {LARGEST_MASS_RATIO:e}"
            )
        })
    }

    fn note_on_inertias(&self) -> Option<String> {
        let bodies = self.world.bodies().iter().zip(&self.bodies);
        let names =
            listed(bodies.filter(|(body, _)| is_impossible(body)).map(|(_, name)| &**name))?;
        Some(format!(
            "inertia of {names}: a principal moment exceeds the sum of the others, as in no solid"
        ))
    }

    /// A half turn about an axis across x is more likely no turn, or one about z, as x, y, z, w.
    fn note_on_attitudes(&self) -> Option<String> {
        let seems_so = |[w, x, _, z]: &[f64; 4]| *w == 0.0 && *x == 0.0 && *z != 0.0;
        let is_of_robot = |body: usize| {
            let robots = self.robots.iter();
            robots
                .flat_map(|robot| (0..robot.robot().links.len()).map(|link| robot.body(link)))
                .any(|of_link| of_link == Some(body))
        };
        let bodies = self.starts.iter().zip(&self.bodies).enumerate();
        let bodies = bodies
            .filter(|(index, (start, _))| seems_so(start.attitude.as_ref()) && !is_of_robot(*index))
            .map(|(_, (_, name))| name.as_str());
        let is_turned = |piece: &PieceEntry| seems_so(&piece.place().attitude);
        let fixed = self.document.fixed.iter();
        let fixed = fixed.filter(|fixed| fixed.pieces.iter().flatten().any(is_turned));
        let names = listed(bodies.chain(fixed.map(FixedEntry::name)))?;
        Some(format!(
            "the attitude of {names} is a half turn; quaternions are w, x, y, z, and [1, 0, 0, 0] is \
             no turn"
        ))
    }
}

/// List of different names in a row; `None` without any.
fn listed<'a>(names: impl Iterator<Item = &'a str>) -> Option<String> {
    let mut names: Vec<_> = names.map(str::to_owned).collect();
    names.dedup();
    (!names.is_empty()).then(|| counted(names))
}

/// True if an angle of the joint is a multiple of half a degree and more than a turn in rad.
fn seems_in_degrees(joint: &JointEntry, motors: &[MotorEntry]) -> bool {
    let is_in_degrees =
        |angle: f64| (TAU..=MOST_DEGREES).contains(&angle.abs()) && (2.0 * angle).fract() == 0.0;
    let angles = |drive: &Drive| {
        let [low, high] = drive.limits.unwrap_or_default();
        [low, high, drive.rest].into_iter().any(is_in_degrees)
    };
    let (driven, drives) = (joint.kind.driven(), joint.drives());
    let turns = |motor: &&MotorEntry| {
        let place = motor.place(joint.kind, joint.name().unwrap_or_default());
        Some(&*motor.joint) == joint.name() && place.is_ok_and(|place| driven[place].1 >= 3)
    };
    let is_target = |motor: &MotorEntry| matches!(motor.motor(), Ok(Motor::Position { target, .. }) if is_in_degrees(target));
    driven.iter().zip(&drives).any(|((_, axis), drive)| *axis >= 3 && angles(drive))
        || motors.iter().filter(turns).any(is_target)
        || joint.cone.is_some_and(is_in_degrees)
}

fn is_impossible(body: &RigidBody) -> bool {
    let moments = body.inertia().symmetric_eigenvalues();
    2.0 * moments.max() > moments.sum() * (1.0 + ROUNDED_MOMENTS)
}

/// Note on vertices of a file that were joined.
fn note_on_terrain((terrain, entry): (&Arc<Terrain>, &TerrainEntry)) -> Option<String> {
    let TerrainShape::Mesh(surface) = terrain.shape() else { return None };
    let name = entry.name.as_deref().unwrap_or_default();
    let count = surface.joined();
    (count > 0).then(|| {
        format!(
            "{name}: {count} vertices on borders are joined to others within 1e-6 of its extent"
        )
    })
}
