//! What the settings of one body amount to, checked.

use super::choices::{Attitude, Frame, SolverName};
use super::contact::{self, Contact};
use super::failure::{Failure, refuse_flags};
use super::physics::Physics;
use super::settings::Settings;
use super::shown;
use crate::contact::rounding;
use crate::mechanics::state::State;
use crate::simulation::{Motion, Simulation};
use crate::world::World;
use std::sync::Arc;
use std::sync::atomic::AtomicBool;

/// A simulation of one body.
pub struct Job {
    /// What is simulated.
    pub name: String,
    /// The settings for which flags gave other values than the scene or scenario has.
    pub changed: Vec<String>,
    /// The seed, and whether the attitude at the start is drawn from it.
    pub seed: u32,
    /// Whether anything of the start is drawn from the seed.
    pub drawn: bool,
    /// Rows of the trajectory: one more than there are steps.
    pub rows: u64,
    /// World and load.
    pub physics: Physics,
    /// World.
    pub start: State,
    /// `None` without a ground.
    pub contact: Option<Contact>,
}

/// The seed where none is given.
pub const USUAL_SEED: u32 = 42;

impl Job {
    /// The job of complete settings, solved by `usual` where they name no solver.
    ///
    /// # Errors
    /// The first thing that cannot be.
    pub fn of(
        name: String,
        ground: bool,
        settings: Settings,
        usual: SolverName,
    ) -> Result<Self, Failure> {
        let physics = Physics::of_settings(&settings)?;
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
            Some(Frame::Ground) => {
                physics.world.ground().map_or(start, |ground| ground.state_to_world(&start))
            }
            Some(Frame::World) | None => start,
        };
        physics.refuse_violent_load()?;
        let idle_point = settings.force_at.is_some() && settings.force.is_none();
        refuse_flags("a body without --force", &[("--force-at", idle_point)])?;

        let contact = if ground {
            refuse_start_below_ground(&physics.world, &start, &settings)?;
            Some(Contact::new(&settings, usual)?)
        } else {
            None
        };
        let rows = settings.steps.ok_or_else(|| Failure::needed("steps"))?;
        let drawn = *attitude == Attitude::Random;
        let changed = Vec::new();
        Ok(Self { name, changed, seed, drawn, rows, physics, start, contact })
    }

    /// A simulation from the start, which ends when `interrupt` is raised.
    ///
    /// # Errors
    /// What the library refuses.
    pub fn simulation(&self, interrupt: &Arc<AtomicBool>) -> Result<Simulation<'static>, Failure> {
        let motion = match &self.contact {
            None => Motion::Floating,
            Some(contact) => contact.motion(&self.physics.world)?,
        };
        let Physics { world, load } = &self.physics;
        let mut simulation = Simulation::new(world.clone(), [self.start], motion)?;
        simulation.set_load(0, load.clone())?;
        simulation.interrupt_by(Arc::clone(interrupt));
        Ok(simulation)
    }

    /// The solver's name in run.json.
    pub fn solver_name(&self) -> &'static str {
        self.contact.as_ref().map_or("rk4", Contact::solver_name)
    }
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
    flags.extend(contact::solver_flags(settings));
    refuse_flags("a floating body, which has no contact", &flags)
}

/// A start inside the ground would be thrown out of it within one step. What rounding makes
/// of a start that lies on a slope is none.
fn refuse_start_below_ground(
    world: &World,
    start: &State,
    settings: &Settings,
) -> Result<(), Failure> {
    let lowest = world.lowest_height(&[*start]);
    let Some(ground) = world.ground() else { return Ok(()) };
    let arm = ground.normal() * world.reach();
    if lowest >= -rounding::gap(ground.normal(), &start.position, ground.offset(), &arm) {
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
