//! Scenes in the notation `[[bodies]]`: any number of bodies, with fixed geometry, joints and
//! robots.
//!
//! A scene is made in three steps:
//!
//! 1. [`build`] converts the tables of the file to a [`Model`](tumble_model::Model), the data
//!    written to run.json.
//! 2. The robots' initial states are corrected, and the model makes a
//!    [`World`](tumble_core::world::World).
//! 3. The initial state is checked: loads, heights, overlaps, joints and gears.

mod build;
mod copies;
mod decomposed;
pub mod driven;
pub mod entries;
pub mod gears;
pub mod joints;
mod masses;
mod refused;
pub mod robots;
pub mod terrain;

use super::physics::violent_load;
use super::scene::Scene;
use super::settings::{Settings, USUAL_SEED};
use super::solver_choice::SolverChoice;
use crate::choices::SolverName;
use build::BuiltScene;
use driven::{DrivenEntry, SurfaceEntry};
use entries::{ApartEntry, BodyEntry, Files, FixedEntry, PairEntry, PieceEntry};
use gears::GearEntry;
use joints::{JointEntry, MotorEntry};
use terrain::TerrainEntry;
use tumble_core::contact::detection::CONTACT_BAND;
use tumble_core::contact::{Candidates, Overlap};
use tumble_core::error::Error;
use tumble_core::geometry::Piece;
use tumble_core::joint::GEAR_AT_THE_START;
use tumble_core::simulation::JOINT_AT_THE_START;
use tumble_model::failure::{Failure, refuse_flags};

/// Tables of a scenario file in this notation, as deserialised.
pub struct SceneEntries {
    /// Entries of `[[bodies]]`.
    pub bodies: Vec<BodyEntry>,
    /// Entries of `[[fixed]]`: static geometry.
    pub fixed: Vec<FixedEntry>,
    /// Entries of `[[terrain]]`: height fields and surfaces of triangles.
    pub terrain: Vec<TerrainEntry>,
    /// Entries of `[[friction]]`: coefficients of single pairs.
    pub friction: Vec<PairEntry>,
    /// Entries of `[[restitution]]`: coefficients of single pairs.
    pub restitution: Vec<PairEntry>,
    /// Entries of `[[joints]]`.
    pub joints: Vec<JointEntry>,
    /// Entries of `[[motors]]`, each on an axis of a joint.
    pub motors: Vec<MotorEntry>,
    /// Entries of `[[gears]]`.
    pub gears: Vec<GearEntry>,
    /// Entries of `[[driven]]`: bodies with a prescribed motion.
    pub driven: Vec<DrivenEntry>,
    /// Entries of `[[surfaces]]`: conveyor belts.
    pub surfaces: Vec<SurfaceEntry>,
    /// Entries of `[[apart]]`: pairs that do not collide.
    pub apart: Vec<ApartEntry>,
    /// Entries of `[[robots]]`: URDF and MJCF files.
    pub robots: Vec<robots::RobotEntry>,
}

/// Default solver of these scenes.
const USUAL_SOLVER: SolverName = SolverName::Native;

/// Makes the scene of a scenario file from its `settings` and its tables `entries`.
///
/// The settings are those of the file, overridden by the flags of the command line. `files` reads
/// mesh files.
///
/// # Errors
/// The first invalid value.
pub fn scene(
    name: String,
    settings: &Settings,
    entries: SceneEntries,
    files: Files<'_>,
) -> Result<Scene, Failure> {
    let built = build::build(entries, settings, files).map_err(Failure::Input)?;
    of_built(name, settings, built)
}

/// Makes the scene of a single robot file.
///
/// # Errors
/// The first invalid value.
pub fn scene_of_robot(
    name: String,
    settings: &Settings,
    robot: &tumble_robot::model::Robot,
) -> Result<Scene, Failure> {
    let built = robots::alone(robot, settings).map_err(Failure::Input)?;
    of_built(name, settings, built)
}

/// Makes the scene of a built model and checks its initial state.
fn of_built(name: String, settings: &Settings, mut built: BuiltScene) -> Result<Scene, Failure> {
    let world = tumble_robot::settled(&mut built.model, &mut built.robots)?;
    let BuiltScene { model, drawn, .. } = built;
    let place = "several bodies: the tutorial's program has one";
    refuse_flags(place, &[("--preset", settings.preset.is_some())])?;
    let contact = SolverChoice::for_world(settings, USUAL_SOLVER, &world)?;
    let scene = Scene {
        name,
        changed: Vec::new(),
        seed: settings.seed.unwrap_or(USUAL_SEED),
        drawn,
        start_index: settings.start_index.unwrap_or(0),
        rows: settings.steps.ok_or_else(|| Failure::needed("steps"))?,
        substeps: 1,
        world,
        courses: model.courses()?,
        starts: model.states(),
        loads: model.loads()?,
        bodies: model.bodies.iter().map(|body| body.name.clone()).collect(),
        fixed: model.fixed_names().cloned().collect(),
        joints: model.joints.iter().map(|joint| joint.name.clone()).collect(),
        contact: Some(contact),
        usual_solver: settings.solver.is_none(),
        robots: built.robots,
        model,
        trajectory: false,
    };
    (0..scene.bodies.len()).try_for_each(|index| refuse_violent_load(&scene, index))?;
    refuse_start_below_ground(&scene)?;
    refuse_overlap(&scene)?;
    refuse_joints_apart(&scene)?;
    scene.refuse_contradiction()?;
    Ok(scene)
}

/// Returns `scene` with the body described by `entry` added at the end. Overlaps of its start with
/// other bodies are not checked.
///
/// # Errors
/// The first invalid value; a scene with `[body]`.
pub fn with_body(scene: &Scene, entry: BodyEntry, files: Files<'_>) -> Result<Scene, Failure> {
    refuse_trajectory(scene)?;
    let model = build::with_body(scene.model.clone(), entry, files).map_err(Failure::Input)?;
    let scene = scene.clone().with_model(model)?;
    let last = scene.bodies.len() - 1;
    refuse_violent_load(&scene, last)?;
    Ok(scene)
}

/// Convex piece that the table `entry` describes.
///
/// # Errors
/// The first invalid value.
pub fn piece(entry: PieceEntry, files: Files<'_>) -> Result<Piece, Failure> {
    let placed = build::placed_piece("piece", entry, &files).map_err(Failure::Input)?;
    Ok(placed.piece()?)
}

/// Returns `scene` without the body `index` and its joints.
///
/// # Errors
/// The only body; a scene with `[body]`; a body of a robot, or one before it.
pub fn without_body(scene: &Scene, index: usize) -> Result<Scene, Failure> {
    if scene.robots.iter().any(|robot| index < robot.bodies_end()) {
        let name = scene.bodies.get(index).map_or("body", String::as_str);
        return Err(Failure::Input(format!(
            "{name} cannot be removed: in a scene with robots, only bodies added later can be \
             removed"
        )));
    }
    refuse_trajectory(scene)?;
    let mut model = scene.model.clone();
    model.leave_out(index);
    scene.clone().with_model(model)
}

/// Rejects a scene of the notation `[body]`. Its run writes trajectory.csv, which has columns for
/// one body only.
fn refuse_trajectory(scene: &Scene) -> Result<(), Failure> {
    if scene.trajectory { Err(Failure::Input(ONE_FOR_GOOD.to_owned())) } else { Ok(()) }
}

const ONE_FOR_GOOD: &str = "a scene with [body] always has one body; use [[bodies]] for others";

/// Rejects a load on the body `index` that would change its velocity too much in one step.
fn refuse_violent_load(scene: &Scene, index: usize) -> Result<(), Failure> {
    let (body, load) = (&scene.world.bodies()[index], &scene.loads[index]);
    match violent_load(body, load, scene.world.time_step()) {
        Some(why) => Err(Failure::Input(format!("load of {}: {why}", scene.bodies[index]))),
        None => Ok(()),
    }
}

/// Rejects joints and gears that the initial poses violate, and poses beyond joint limits.
///
/// Constraints hold at the end of every step. The first step would move the bodies by the whole
/// error.
fn refuse_joints_apart(scene: &Scene) -> Result<(), Failure> {
    let angles = scene.world.angles_near(&scene.starts, &[]);
    for ((joint, name), angles) in scene.world.joints().iter().zip(&scene.joints).zip(&angles) {
        let (place, turn) = joint.error(&scene.starts).unwrap_or((f64::NAN, f64::NAN));
        // Written so that a NaN is rejected.
        let fits = place.max(turn) <= JOINT_AT_THE_START;
        if !fits {
            return Err(Failure::Input(format!(
                "joints: {name} is {place:.3e} m and {turn:.3e} rad off at the start; allowed: \
                 {JOINT_AT_THE_START:.0e} of each; move its bodies, or remove it"
            )));
        }
        let beyond = joint.beyond_limits(&scene.starts, angles);
        let (place, turn) = beyond.unwrap_or((f64::NAN, f64::NAN));
        let fits = place.max(turn) <= JOINT_AT_THE_START;
        if !fits {
            return Err(Failure::Input(format!(
                "joints: {name} is {place:.3e} m and {turn:.3e} rad beyond its limits at the \
                 start; allowed: {JOINT_AT_THE_START:.0e} of each"
            )));
        }
    }
    for (index, gear) in scene.world.gears().iter().enumerate() {
        let off = gear.error(scene.world.joints(), &scene.starts, &angles).abs();
        let fits = off <= GEAR_AT_THE_START;
        if !fits {
            let [first, second] = gear.axes().map(|axis| &scene.joints[axis.joint]);
            return Err(Failure::Input(format!(
                "gears[{index}] ({first}, {second}): {first} is {off:.3e} m or rad off at the \
                 start; allowed: {GEAR_AT_THE_START:.0e}"
            )));
        }
    }
    Ok(())
}

/// Rejects a start below the ground by more than the contact band.
///
/// The body would otherwise leave the ground at high speed in the first step.
fn refuse_start_below_ground(scene: &Scene) -> Result<(), Failure> {
    for (index, state) in scene.starts.iter().enumerate() {
        let heights = scene.world.heights(index, &state.pose());
        let lowest = heights.fold(f64::INFINITY, f64::min);
        let allowed = CONTACT_BAND * scene.world.bodies()[index].reach();
        // Written so that a NaN is rejected.
        let is_above = lowest >= -allowed;
        if !is_above {
            return Err(Failure::Input(format!(
                "position: {} would start {:.3e} m below the ground; allowed: {allowed:.1e} m",
                scene.bodies[index], -lowest
            )));
        }
    }
    Ok(())
}

/// Rejects deep overlaps, which would separate at high speed in the first step.
fn refuse_overlap(scene: &Scene) -> Result<(), Failure> {
    let deepest = Candidates::new().overlap_at_start(&scene.world, &scene.starts, |_| true);
    let Some(Overlap { depth, allowed, between }) = deepest else { return Ok(()) };
    let overlap = scene.naming(&Error::Overlap { between, depth, allowed });
    Err(Failure::Input(format!("position: {overlap}")))
}

/// Rejects flags that set properties of a single body. Here the tables of the file have them.
pub fn refuse_idle_settings(settings: &Settings) -> Result<(), Failure> {
    refuse_flags(
        "several bodies, which the scenario file describes",
        &[
            ("--mass", settings.mass.is_some()),
            ("--inertia", settings.inertia.is_some()),
            ("--box", settings.shape.is_some()),
            ("--plane", settings.plane.is_some()),
            ("--force", settings.force.is_some()),
            ("--torque", settings.torque.is_some()),
            ("--force-at", settings.force_at.is_some()),
            ("--position", settings.position.is_some()),
            ("--height", settings.height.is_some()),
            ("--attitude", settings.attitude.is_some()),
            ("--velocity", settings.velocity.is_some()),
            ("--spin", settings.spin.is_some()),
            ("--frame", settings.frame.is_some()),
        ],
    )
}
