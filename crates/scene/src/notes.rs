//! Notes on a valid scene: ignored content of its files, and what may be a mistake.

use super::locks::counted;
use super::scene::Scene;
use nalgebra::Vector3;
use std::f64::consts::TAU;
use tumble_core::geometry::terrain::TerrainShape;
use tumble_core::joint::{Drive, Motor};
use tumble_core::mechanics::RigidBody;
use tumble_core::world::constants::extents;
use tumble_model::joint::JointModel;
use tumble_model::{BodyModel, TerrainModel};

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
        let of_terrains = self.model.terrains.iter().filter_map(note_on_terrain);
        let mistakes = [
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

    fn note_on_gravity(&self) -> Option<String> {
        let (from, up) = match self.world.ground() {
            Some(ground) => ("away from the ground", *ground.normal()),
            None => ("up", Vector3::z()),
        };
        let rises = up.dot(self.world.gravity()) > 0.0;
        rises.then(|| format!("gravity points {from}; a positive number points down"))
    }

    fn note_on_degrees(&self) -> Option<String> {
        let joints = self.model.joints.iter().filter(|joint| seems_in_degrees(joint));
        let names = listed(joints.map(|joint| joint.name.as_str()))?;
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
            if self.model.bodies[index].touches && width > 0.0 && speed * h > width {
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
        let by_mass = |a: &&BodyModel, b: &&BodyModel| a.mass.total_cmp(&b.mass);
        let bodies = || self.model.bodies.iter();
        let light = bodies().min_by(by_mass)?;
        let heavy = bodies().max_by(by_mass)?;
        let ratio = heavy.mass / light.mass;
        (ratio > LARGEST_MASS_RATIO).then(|| {
            format!(
                "{} of {} kg is {ratio:.1e} times as heavy as {} of {} kg; steps are tested with \
                 ratios up to {LARGEST_MASS_RATIO:e}",
                heavy.name, heavy.mass, light.name, light.mass
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
        let bodies = self.model.bodies.iter().enumerate();
        let bodies = bodies
            .filter(|(index, body)| seems_so(body.start.attitude.as_ref()) && !is_of_robot(*index))
            .map(|(_, body)| body.name.as_str());
        let fixed = self.model.fixed.iter().filter(|fixed| seems_so(&fixed.piece.place.attitude));
        let names = listed(bodies.chain(fixed.map(|fixed| fixed.name.as_str())))?;
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
fn seems_in_degrees(joint: &JointModel) -> bool {
    let is_in_degrees =
        |angle: f64| (TAU..=MOST_DEGREES).contains(&angle.abs()) && (2.0 * angle).fract() == 0.0;
    let angles = |drive: &Drive| {
        let target = match drive.motor {
            Some(Motor::Position { target, .. }) => target,
            _ => 0.0,
        };
        let [low, high] = drive.limits.unwrap_or_default();
        [low, high, drive.rest, target].into_iter().any(is_in_degrees)
    };
    let mut drives = joint.kind.driven().iter().zip(&joint.drives);
    drives.any(|((_, axis), drive)| *axis >= 3 && angles(drive))
        || joint.cone.is_some_and(is_in_degrees)
}

fn is_impossible(body: &RigidBody) -> bool {
    let moments = body.inertia().symmetric_eigenvalues();
    2.0 * moments.max() > moments.sum() * (1.0 + ROUNDED_MOMENTS)
}

/// Note on vertices of a file that were joined.
fn note_on_terrain(model: &TerrainModel) -> Option<String> {
    let TerrainShape::Mesh(surface) = model.terrain.shape() else { return None };
    let name = &model.name;
    let count = surface.joined();
    (count > 0).then(|| {
        format!(
            "{name}: {count} vertices on borders are joined to others within 1e-6 of its extent"
        )
    })
}
