//! Tables `[[robots]]`, and scenes of a single robot file.

use super::table::RobotEntry;
use super::{Assembled, Placing};
use crate::bodies::build::{BuiltDocument, head};
use crate::bodies::copies::MOST_BODIES;
use crate::bodies::entries::{Files, placed};
use crate::document::Document;
use crate::settings::RobotSettings;
use nalgebra::Vector3;
use std::path::Path;
use tumble_core::geometry::smooth::USUAL_SIDES;
use tumble_core::world::Plane;
use tumble_model::failure::Failure;
use tumble_model::shown;
use tumble_robot::model::{Moves, Robot};
use tumble_robot::{LARGEST_FILE, LinkFrame, Reading, read};

/// Coefficient of friction on the ground for a robot file without one.
const USUAL_FRICTION: f64 = 1.0;

impl RobotEntry {
    /// Prefix of the robot's names.
    pub fn prefix(&self) -> &str {
        self.prefix.as_deref().unwrap_or("")
    }

    /// Adds the robot to a `document` in exact form.
    pub fn add(&self, files: &Files<'_>, document: &mut Document) -> Result<Assembled, String> {
        let path = files.folder.join(&self.file);
        let invalid = |why: &dyn std::fmt::Display| format!("file: {}: {why}", shown::path(&path));
        let bytes = (files.read)(&path, LARGEST_FILE).map_err(|error| invalid(&error))?;
        let text = String::from_utf8(bytes)
            .map_err(|_| invalid(&"it is not UTF-8 text; save it as UTF-8"))?;
        let packages = self.packages.as_ref().map(|packages| files.folder.join(packages));
        let reading = Reading {
            folder: path.parent().unwrap_or(Path::new("")),
            read: files.read,
            packages: packages.as_deref(),
            left_out: self.leave_out.as_deref().unwrap_or(&[]),
            pieces: self.meshes.as_ref().unwrap_or(Reading::none().pieces),
            is_fixed: self.fixed.unwrap_or(false),
            points_rub: self.point_contacts.unwrap_or(false),
        };
        let robot = read(&text, &reading).map_err(|why| invalid(&why))?;
        if self.fixed.is_some() && robot.options.has_world {
            return Err(
                "fixed: only for URDF and SDF; a world of the file defines which bodies are free; leave it out"
                    .to_owned(),
            );
        }
        let place = placed(self.position, self.attitude.as_ref())?;
        let placing = Placing {
            frame: LinkFrame { position: place.position.into(), attitude: place.attitude.into() },
            prefix: self.prefix().to_owned(),
            key: self.pose.clone(),
            coordinates: self
                .coordinates
                .iter()
                .flatten()
                .map(|(name, x)| (name.clone(), *x))
                .collect(),
            touches_itself: self.self_collision.unwrap_or(true),
            merges: self.merge_fixed.unwrap_or(true),
            sides: self.sides.unwrap_or(USUAL_SIDES),
            has_ground: false,
        };
        let room = MOST_BODIES - document.bodies.len();
        if robot.links.len() > room + 1 {
            return Err(format!("file: with its links there are more than {MOST_BODIES} bodies"));
        }
        Assembled::new(robot, &placing, document).map_err(|why| invalid(&why))
    }
}

/// Document without bodies for a single robot file: its settings, with level ground if it has no world.
pub fn document_of(robot: &Robot) -> String {
    let options = &robot.options;
    let gravity = <[f64; 3]>::from(options.gravity);
    format!(
        "time_step = {:?}\ngravity = {gravity:?}\n[ground]\nfriction = {USUAL_FRICTION:?}\nnone = {}\n",
        options.time_step, options.has_world
    )
}

/// Parses a robot file with the given import settings. Returns the robot and the name of the scene.
pub fn read_alone(
    text: &str,
    path: &Path,
    requested: &RobotSettings,
    read_file: tumble_model::ReadFile<'_>,
) -> Result<(Robot, String), Failure> {
    let invalid = |why: String| Failure::Input(format!("{}: {why}", shown::path(path)));
    let folder = path.parent().unwrap_or(Path::new(""));
    let reading = Reading {
        folder,
        read: read_file,
        packages: requested.packages.as_deref(),
        left_out: &requested.leave_out,
        points_rub: requested.point_contacts,
        ..Reading::none()
    };
    let robot = read(text, &reading).map_err(invalid)?;
    let stem =
        || path.file_stem().map_or(String::new(), |stem| stem.to_string_lossy().into_owned());
    let name = if shown::is_name(&robot.name) { robot.name.clone() } else { stem() };
    let name = if shown::is_name(&name) { name } else { "robot".to_owned() };
    Ok((robot, name))
}

/// Document of a single robot file. A floating robot without a ground in its file is placed on the
/// ground.
pub fn alone(robot: &Robot, document: &Document) -> Result<BuiltDocument, String> {
    let mut placing = Placing { has_ground: robot.options.has_world, ..Placing::default() };
    if robot.joints.is_empty() {
        let remedy = if robot.options.has_world {
            "add a <freejoint/> or a joint"
        } else {
            "give the root a mass and do not fix it"
        };
        return Err(format!(
            "nothing in it can move; {remedy}, or use it with other bodies by [[robots]]"
        ));
    }
    let head = head(document)?;
    let mut document = head.clone();
    let mut assembled = Assembled::new(robot.clone(), &placing, &mut document)?;
    if let Some(plane) = &head.plane()? {
        let lowest = lowest(&document, plane)?;
        let flies = robot.joints_of(1).iter().any(|joint| joint.moves == Moves::Free);
        // A robot fixed to the world keeps its place unless it would be below the ground.
        let lowest = if flies { lowest } else { lowest.min(0.0) };
        placing.frame.position -= plane.normal() * lowest;
        document = head;
        assembled = Assembled::new(robot.clone(), &placing, &mut document)?;
    }
    Ok(BuiltDocument { document, drawn: false, robots: vec![assembled], notes: Vec::new() })
}

/// Smallest height of the colliding bodies above the plane (m).
fn lowest(document: &Document, plane: &Plane) -> Result<f64, String> {
    let mut lowest = f64::INFINITY;
    for body in document.bodies.iter().filter(|body| body.touches()) {
        let made = body.rigid_body(&document.shape_of(body)?).map_err(|error| error.to_string())?;
        let pose = body.start().pose();
        for point in made.contact_points() {
            let at: Vector3<f64> = pose.position + pose.rotation * point.position;
            let normal = pose.rotation.tr_mul(plane.normal());
            let width = point.smooth().map_or(0.0, |one| one.half_width(&normal));
            lowest = lowest.min(plane.normal().dot(&at) - plane.offset() - point.radius - width);
        }
    }
    Ok(if lowest.is_finite() { lowest } else { 0.0 })
}
