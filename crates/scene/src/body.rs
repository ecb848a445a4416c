//! Short notation `[body]`: one body whose tables are also settings of the command line.
//!
//! The result is a scene with a model of one body.

use super::choices::{Attitude, SolverName, StartFrame};
use super::physics;
use super::scene::Scene;
use super::settings::Settings;
use super::settings::USUAL_SEED;
use super::solver_choice::{self, SolverChoice};
use nalgebra::Vector3;
use tumble_core::contact::detection::CONTACT_BAND;
use tumble_core::mechanics::body::box_corners;
use tumble_core::mechanics::{Load, RigidBody, State};
use tumble_core::world::World;
use tumble_model::failure::{Failure, refuse_flags};
use tumble_model::fields::by_rows;
use tumble_model::groups::GroupsModel;
use tumble_model::parameters::LoadParameters;
use tumble_model::shape::{ModelForm, ModelPlace, ModelShape, PlacedForm};
use tumble_model::shown;
use tumble_model::{BodyModel, BodyStart, DrawnModel, Model};

/// Scene of complete settings, with or without a ground; `usual` is the default solver.
///
/// # Errors
/// The first invalid value.
pub fn scene(
    name: String,
    ground: bool,
    settings: &Settings,
    usual: SolverName,
) -> Result<Scene, Failure> {
    let (world, load) = physics::of_settings(settings)?;
    let seed = settings.seed.unwrap_or(USUAL_SEED);
    let attitude = settings.attitude.as_ref().ok_or_else(|| Failure::needed("attitude"))?;
    let mut position = settings.position.ok_or_else(|| Failure::needed("position"))?;
    position[2] = settings.height.unwrap_or(position[2]);
    let start = State {
        position,
        attitude: attitude.quaternion(seed),
        velocity: settings.velocity.ok_or_else(|| Failure::needed("velocity"))?,
        spin: settings.spin.ok_or_else(|| Failure::needed("spin"))?,
    };
    let start = start.checked()?;
    let drawn = (*attitude == Attitude::Random).then(|| DrawnModel {
        position: position.into(),
        attitude: None,
        jitter: [0.0; 3],
        tutorial: true,
        ground: settings.frame == Some(StartFrame::Ground),
    });
    let start = match settings.frame {
        Some(StartFrame::Ground) => {
            world.ground().map_or(start, |ground| ground.state_to_world(&start))
        }
        Some(StartFrame::World) | None => start,
    };
    if let Some(why) = physics::violent_load(&world.bodies()[0], &load, world.time_step()) {
        return Err(Failure::setting("force or torque", why));
    }
    let idle_point = settings.force_at.is_some() && settings.force.is_none();
    refuse_flags("a body without --force", &[("--force-at", idle_point)])?;

    let contact = if ground {
        refuse_start_below_ground(&world, &start, settings)?;
        Some(SolverChoice::for_world(settings, usual, &world)?)
    } else {
        None
    };
    let model = model(&world, &load, &start, drawn);
    Ok(Scene {
        name,
        changed: Vec::new(),
        seed,
        drawn: *attitude == Attitude::Random,
        start_index: settings.start_index.unwrap_or(0),
        rows: settings.steps.ok_or_else(|| Failure::needed("steps"))?,
        substeps: 1,
        world,
        starts: vec![start],
        loads: vec![load],
        courses: Vec::new(),
        bodies: vec![NAME.to_owned()],
        fixed: Vec::new(),
        joints: Vec::new(),
        contact,
        usual_solver: settings.solver.is_none(),
        robots: Vec::new(),
        model,
        trajectory: true,
    })
}

/// Name of the body.
const NAME: &str = "body";

/// Model of the only body of `world`.
fn model(world: &World, load: &Load, start: &State, drawn: Option<DrawnModel>) -> Model {
    let body = &world.bodies()[0];
    Model {
        dt: world.time_step(),
        rotation: world.rotation(),
        gravity: (*world.gravity()).into(),
        mu: world.friction(),
        restitution: world.restitution(),
        rebound_speed: world.given_rebound_speed(),
        plane: world.ground().map(tumble_model::parameters::plane),
        shapes: vec![shape(body)],
        looks: Vec::new(),
        bodies: vec![BodyModel {
            name: NAME.to_owned(),
            shape: 0,
            centre: [0.0; 3],
            mass: body.mass(),
            inertia: by_rows(body.inertia()).0.map(|row| row.0),
            friction: None,
            restitution: None,
            touches: true,
            groups: GroupsModel::default(),
            load: (!load.is_none()).then(|| LoadParameters::of(load)),
            colour: None,
            label: None,
            look: None,
            start: BodyStart::of(start),
            drawn,
        }],
        fixed: Vec::new(),
        terrains: Vec::new(),
        frictions: Vec::new(),
        restitutions: Vec::new(),
        joints: Vec::new(),
        gears: Vec::new(),
        surfaces: Vec::new(),
        apart: Vec::new(),
        groups: Vec::new(),
    }
}

/// Shape of the body: a box, if its contact points are the corners of one, or points.
fn shape(body: &RigidBody) -> ModelShape {
    let points: Vec<_> = body.contact_points().iter().map(|point| point.position).collect();
    let half = points.iter().fold(Vector3::zeros(), |half: Vector3<f64>, c| half.sup(&c.abs()));
    if body.pieces().is_empty() || points != box_corners(&half) {
        return ModelShape::Points(points.iter().map(|point| (*point).into()).collect());
    }
    let form = ModelForm::Box { sides: (2.0 * half).into() };
    ModelShape::Pieces(vec![PlacedForm { form, place: ModelPlace::ORIGIN }])
}

/// Rejects settings that only affect contact if there is no ground.
pub fn refuse_idle_settings(ground: bool, settings: &Settings) -> Result<(), Failure> {
    if ground {
        return Ok(());
    }
    let mut flags = vec![
        ("--rotation", settings.rotation.is_some()),
        ("--mu", settings.mu.is_some()),
        ("--restitution", settings.restitution.is_some()),
        ("--rebound-speed", settings.rebound_speed.is_some()),
        ("--plane", settings.plane.is_some()),
        ("--frame ground", settings.frame == Some(StartFrame::Ground)),
        ("--preset", settings.preset.is_some()),
    ];
    flags.extend(solver_choice::solver_flags(settings));
    refuse_flags("a floating body, which has no contact", &flags)
}

/// Rejects a start below the ground by more than the contact band.
///
/// The body would otherwise leave the ground at high speed in the first step.
fn refuse_start_below_ground(
    world: &World,
    start: &State,
    settings: &Settings,
) -> Result<(), Failure> {
    let lowest = world.lowest_height(&[*start]);
    let Some(ground) = world.ground() else { return Ok(()) };
    if lowest >= -CONTACT_BAND * world.reach() {
        return Ok(());
    }
    let depth = -lowest;
    if settings.frame != Some(StartFrame::Ground) && !ground.is_level() {
        return Err(Failure::setting(
            "position",
            format!(
                "the lowest corner would start {} m below the plane; use the ground's frame \
                 (--frame ground, or start.frame of a scenario), whose z is the height above the \
                 plane",
                rounded(depth)
            ),
        ));
    }
    let height = ground.state_to_ground(start).position[2];
    let name = if settings.height.is_some() { "height" } else { "position" };
    Err(Failure::setting(
        name,
        format!(
            "with z = {} the lowest corner would start {} m below the ground; {} or more is needed \
             for this attitude",
            shown::number(height),
            rounded(depth),
            rounded_up(height + depth)
        ),
    ))
}

/// Length with four significant digits, without trailing zeros.
fn rounded(length: f64) -> String {
    shown::number(format!("{length:.3e}").parse().unwrap_or(length))
}

/// Length rounded up to four significant digits.
fn rounded_up(length: f64) -> String {
    let unit = 10.0_f64.powi(length.abs().log10().floor() as i32 - 3);
    rounded((length / unit).ceil() * unit)
}
