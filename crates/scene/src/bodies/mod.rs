//! Scenes of any number of bodies, with fixed geometry, joints and robots.
//!
//! A scene is made in three steps:
//!
//! 1. [`build`] makes the exact form of the document, which run.json has.
//! 2. The robots' initial states are corrected, and the document makes a
//!    [`World`](tumble_core::world::World).
//! 3. The initial state is checked: loads, heights, overlaps, joints and gears.

pub mod build;
pub mod copies;
mod decomposed;
pub mod drawn;
pub mod driven;
pub mod entries;
pub mod exact;
pub mod gears;
mod groups;
pub mod joints;
pub mod masses;
pub mod place;
pub mod shape;
pub mod terrain;
mod world;

use super::document::Document;
use super::scene::Scene;
use super::solver_choice::SolverChoice;
use crate::robots;
use build::BuiltDocument;
use entries::{BodyEntry, Files, PieceEntry};
use tumble_core::error::Error;
use tumble_core::geometry::Piece;
use tumble_core::mechanics::load::Polyline;
use tumble_model::failure::Failure;

/// Makes the scene of the document `run`. `files` reads mesh files.
///
/// # Errors
/// The first invalid value.
pub fn scene(name: String, mut run: Document, files: Files<'_>) -> Result<Scene, Failure> {
    let built = build::build(&mut run, files).map_err(Failure::Input)?;
    let Document { bodies, fixed, terrain, joints, driven, .. } = &built.document;
    let is_alone = bodies.len() == 1 && fixed.is_empty() && terrain.is_empty();
    if built.document.ground.is_none() && !(is_alone && joints.is_empty() && driven.is_empty()) {
        let why = "a table [ground] is needed; set `none = true` in it for no ground, with \
                   `friction` for all bodies";
        return Err(Failure::setting("ground", why));
    }
    scene_from_built(name, &run, built)
}

/// Makes the scene of a single robot file, whose settings are those of `document`.
///
/// # Errors
/// The first invalid value.
pub fn scene_from_robot(
    name: String,
    document: &Document,
    robot: &tumble_robot::model::Robot,
) -> Result<Scene, Failure> {
    let built = robots::entry::alone(robot, document).map_err(Failure::Input)?;
    scene_from_built(name, document, built)
}

/// Makes the scene of a built document with the settings of the document `run`, and checks its initial
/// state.
fn scene_from_built(name: String, run: &Document, built: BuiltDocument) -> Result<Scene, Failure> {
    let BuiltDocument { mut document, drawn, mut robots, notes } = built;
    let world = robots::starts::settled(&mut document, &mut robots)?;
    let has_ground = document.ground.is_some();
    let contact = has_ground.then(|| SolverChoice::new(&run.solver())).transpose()?;
    if let Some(contact) = &contact {
        // Reports a solver that does not support this world before any file is written.
        contact.solver(&world)?;
    }
    let scene = Scene {
        seed: run.seed(),
        drawn,
        start_index: run.first_index(),
        rows: run.rows(),
        robots,
        file_notes: notes,
        trajectory: run.solver().preset.is_some(),
        ..Scene::from_document(name, document, world, contact)?
    };
    (0..scene.bodies.len()).try_for_each(|index| refuse_violent_load(&scene, index))?;
    refuse_violent_start(&scene)?;
    scene.refuse_contradiction()?;
    Ok(scene)
}

/// Returns `scene` with the body described by `entry` added at the end. Overlaps of its start with
/// other bodies are not checked.
///
/// # Errors
/// The first invalid value.
pub fn with_body(scene: &Scene, entry: BodyEntry, files: Files<'_>) -> Result<Scene, Failure> {
    let document = build::with_body(scene.document.clone(), entry, files);
    let scene = scene.clone().with_document(document.map_err(Failure::Input)?)?;
    let last = scene.bodies.len() - 1;
    refuse_violent_load(&scene, last)?;
    Ok(scene)
}

/// Convex piece that the table `entry` describes.
///
/// # Errors
/// The first invalid value.
pub fn piece(entry: PieceEntry, files: Files<'_>) -> Result<Piece, Failure> {
    let exact = entry.exact(&files).map_err(|why| Failure::Input(format!("piece{why}")))?;
    Ok(exact.piece()?)
}

/// Returns `scene` without the body `index` and its joints.
///
/// # Errors
/// The only body; a body of a robot, or one before it.
pub fn without_body(scene: &Scene, index: usize) -> Result<Scene, Failure> {
    if scene.robots.iter().any(|robot| index < robot.bodies_end()) {
        let name = scene.bodies.get(index).map_or("body", String::as_str);
        return Err(Failure::Input(format!(
            "{name} cannot be removed: in a scene with robots, only bodies added later can be \
             removed"
        )));
    }
    let mut document = scene.document.clone();
    document.leave_out(index);
    scene.clone().with_document(document)
}

/// Rejects a load on the body `index` that would change its velocity too much in one step.
fn refuse_violent_load(scene: &Scene, index: usize) -> Result<(), Failure> {
    let (body, load) = (&scene.world.bodies()[index], &scene.loads[index]);
    let h = scene.world.time_step();
    let size = |line: &Polyline| line.knots().iter().map(|(_, v)| v.amax()).fold(0.0, f64::max);
    let arm = 2.0 * load.point().amax();
    let (force, torque) = (size(&load.force), size(&load.torque));
    let turning = body.inertia_inverse().amax() * (torque + arm * force);
    let gained = [("m/s", h * force / body.mass()), ("rad/s", h * turning)];
    let Some((unit, gained)) = gained.into_iter().find(|(_, gained)| *gained > MOST_GAINED) else {
        return Ok(());
    };
    let is_turned = unit == "rad/s" && torque > 0.0;
    Err(Failure::setting(
        if is_turned { "load.torque" } else { "load.force" },
        format!(
            "one step of the load of {} would change its velocity by {gained:.1e} {unit}; allowed: \
             up to {MOST_GAINED:e} {unit}",
            scene.bodies[index]
        ),
    ))
}

/// Maximum change of velocity in one step (m/s or rad/s): a tenth of the limit for an initial
/// state.
const MOST_GAINED: f64 = 1e4;

/// Rejects a start that the first step would correct at high speed.
fn refuse_violent_start(scene: &Scene) -> Result<(), Failure> {
    scene.world.check_start(&scene.starts).map_err(|error| {
        let why = error.display(scene);
        match error {
            Error::FrictionAxes { .. } | Error::LooseFrictionAxis { .. } => {
                Failure::Input(format!("surfaces: {why}"))
            }
            Error::StartBelowGround { .. } => Failure::setting("position", why),
            Error::Overlap { .. } | Error::Crowded { .. } => {
                Failure::Input(format!("position: {why}"))
            }
            Error::GearApart { .. } => Failure::Input(why),
            _ => Failure::Input(format!("joints: {why}")),
        }
    })
}
