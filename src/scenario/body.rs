//! The notation `[body]`: one body, whose tables are settings that flags have too.

use super::choices::{Attitude, Frame, SolverName};
use super::failure::{Failure, refuse_flags};
use super::scene::{OutputFormat, Scene};
use super::settings::Settings;
use super::settings::USUAL_SEED;
use super::solver_choice::{self, SolverChoice};
use super::{physics, shown};
use crate::contact::detection::CONTACT_BAND;
use crate::mechanics::State;
use crate::world::World;

/// The scene of complete settings, with a ground or without, solved by `usual` where they name no
/// solver.
///
/// # Errors
/// The first thing that cannot be.
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
    let start = match settings.frame {
        Some(Frame::Ground) => world.ground().map_or(start, |ground| ground.state_to_world(&start)),
        Some(Frame::World) | None => start,
    };
    if let Some(why) = physics::violent_load(&world.bodies()[0], &load, world.time_step()) {
        return Err(Failure::setting("force or torque", why));
    }
    let idle_point = settings.force_at.is_some() && settings.force.is_none();
    refuse_flags("a body without --force", &[("--force-at", idle_point)])?;

    let contact = if ground {
        refuse_start_below_ground(&world, &start, settings)?;
        Some(SolverChoice::new(settings, usual)?)
    } else {
        None
    };
    Ok(Scene {
        name,
        changed: Vec::new(),
        seed,
        drawn: *attitude == Attitude::Random,
        start_index: settings.start_index.unwrap_or(0),
        rows: settings.steps.ok_or_else(|| Failure::needed("steps"))?,
        world,
        starts: vec![start],
        loads: vec![load],
        courses: Vec::new(),
        bodies: vec!["body".to_owned()],
        fixed: Vec::new(),
        joints: Vec::new(),
        contact,
        usual_solver: settings.solver.is_none(),
        #[cfg(feature = "robot")]
        robots: Vec::new(),
        format: OutputFormat::Trajectory,
    })
}

/// Refuses what has a meaning for contact alone where there is no ground.
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
        ("--frame ground", settings.frame == Some(Frame::Ground)),
        ("--preset", settings.preset.is_some()),
    ];
    flags.extend(solver_choice::solver_flags(settings));
    refuse_flags("a floating body, which has no contact", &flags)
}

/// A start deeper in the ground than the contact band would be thrown out of it within one step.
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
    if settings.frame != Some(Frame::Ground) && !ground.is_level() {
        return Err(Failure::setting(
            "position",
            format!(
                "the lowest corner would start {} m below the plane; in the ground's frame \
                 (--frame ground, or start.frame of a scenario) its z is the height above the plane",
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

/// A length with four digits, as few as say the same.
fn rounded(length: f64) -> String {
    shown::number(format!("{length:.3e}").parse().unwrap_or(length))
}

/// The same, not less than the length.
fn rounded_up(length: f64) -> String {
    let unit = 10.0_f64.powi(length.abs().log10().floor() as i32 - 3);
    rounded((length / unit).ceil() * unit)
}
