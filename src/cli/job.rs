//! What the arguments of a simulation amount to, checked.

use super::args::SimulateArgs;
use super::choices::{Attitude, Frame, SceneName, SolverName};
use super::contact::{Contact, solver_flags};
use super::fields::Exactly;
use super::names::FileKind;
use super::outcome::{Failure, refuse_flags};
use super::physics::{Physics, numbers};
use super::run::Run;
use super::run_file::{RunFile, SolverSettings, StartState, SummaryFile};
use super::scenario::Scenario;
use super::settings::Settings;
use super::shown;
use std::sync::Arc;
use std::sync::atomic::AtomicBool;
use tumble::contact::rounding;
use tumble::ipopt;
use tumble::mechanics::state::State;
use tumble::simulation::{Motion, Simulation};
use tumble::world::World;

/// What the arguments amount to.
pub struct Job {
    /// What is simulated.
    pub name: String,
    /// The settings for which flags gave other values than the scene or scenario has.
    pub changed: Vec<String>,
    /// The seed, and whether the attitude at the start is drawn from it.
    pub seed: u32,
    pub drawn: bool,
    pub rows: u64,
    pub physics: Physics,
    /// World.
    pub start: State,
    /// `None` without a ground.
    pub contact: Option<Contact>,
}

/// The seed where none is given.
pub const USUAL_SEED: u32 = 42;

/// With more contact points than this Ipopt takes more than 10 ms an iteration
/// (docs/ipopt-path.md).
const MANY_POINTS: usize = 100;

impl Job {
    pub fn new(args: &SimulateArgs) -> Result<Self, Failure> {
        let flags = Settings::of_flags(args)?;
        let Some(path) = &args.scenario else {
            let scene = args.scene.unwrap_or(SceneName::Drop);
            let (name, ground) = (scene.scene().name, scene == SceneName::Drop);
            refuse_idle_settings(ground, &flags)?;
            let usual = Settings::of_scene(scene);
            let changed = flags.changed(&usual);
            let job = Self::of(name.to_owned(), ground, flags.over(usual))?;
            return Ok(Self { changed, ..job });
        };
        let scenario = Scenario::read(path)?;
        refuse_idle_settings(scenario.ground, &flags)?;
        let seed_given = flags.seed.is_some();
        let changed = flags.changed(&scenario.settings);
        let settings = flags.over(scenario.settings);
        let job = Self::of(scenario.name, scenario.ground, settings);
        let given = args.given();
        let job = job.map_err(|failure| failure.in_file(path, FileKind::Scenario, &given))?;
        let idle_seed = seed_given && !job.drawn;
        refuse_flags("an attitude that is not random", &[("--seed", idle_seed)])?;
        Ok(Self { changed, ..job })
    }

    /// The job of complete settings.
    fn of(name: String, ground: bool, settings: Settings) -> Result<Self, Failure> {
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
            Some(Frame::Ground) => physics.world.ground().state_to_world(&start),
            Some(Frame::World) | None => start,
        };
        physics.refuse_violent_load()?;
        let idle_point = settings.force_at.is_some() && settings.force.is_none();
        refuse_flags("a body without --force", &[("--force-at", idle_point)])?;

        let contact = if ground {
            refuse_start_below_ground(&physics.world, &start, &settings)?;
            Some(Contact::new(&settings, SolverName::Ipopt)?)
        } else {
            None
        };
        let rows = settings.steps.ok_or_else(|| Failure::needed("steps"))?;
        let drawn = *attitude == Attitude::Random;
        let changed = Vec::new();
        Ok(Self { name, changed, seed, drawn, rows, physics, start, contact })
    }

    pub fn simulation(&self, interrupt: &Arc<AtomicBool>) -> Result<Simulation<'static>, Failure> {
        let motion = match &self.contact {
            None => Motion::Floating,
            Some(contact) => {
                let solver = contact.solver(&self.physics.world)?;
                Motion::Contact { detection: contact.detection, solver }
            }
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

    /// What must be said before a run that takes long.
    pub fn note(&self) -> Option<String> {
        let ipopt = self.contact.as_ref().is_some_and(Contact::is_ipopt);
        let points = self.physics.world.bodies()[0].contact_points().len();
        (ipopt && points > MANY_POINTS).then(|| {
            format!(
                "{points} contact points are many for Ipopt, which may take seconds a step with \
                 them: --solver native is made for this\n"
            )
        })
    }

    pub fn run_file(&self, run: &Run) -> RunFile {
        let climbs = self.contact.as_ref().is_some_and(Contact::climbs);
        let floating = || SolverSettings::without_contact(self.solver_name());
        RunFile {
            outcome: run.end.name().to_owned(),
            tumble_version: env!("CARGO_PKG_VERSION").to_owned(),
            ipopt_version: ipopt::VERSION.to_owned(),
            scene: self.name.clone(),
            changed: self.changed.clone(),
            seed: self.seed,
            parameters: self.physics.parameters(self.rows),
            solver: self.contact.as_ref().map_or_else(floating, Contact::settings),
            start: StartState {
                position: numbers(&self.start.position),
                random: self.drawn,
                attitude: Exactly(self.start.attitude.into()),
                velocity: numbers(&self.start.velocity),
                spin: numbers(&self.start.spin),
            },
            summary: SummaryFile::of(&run.summary, climbs, run.elapsed.as_secs_f64()),
        }
    }
}

/// Refuses what has a meaning for contact alone where there is no ground.
fn refuse_idle_settings(ground: bool, settings: &Settings) -> Result<(), Failure> {
    if ground {
        return Ok(());
    }
    let mut flags = vec![
        ("--mu", settings.mu.is_some()),
        ("--restitution", settings.restitution.is_some()),
        ("--rebound-speed", settings.rebound_speed.is_some()),
        ("--plane", settings.plane.is_some()),
        ("--frame ground", settings.frame == Some(Frame::Ground)),
        ("--preset", settings.preset.is_some()),
    ];
    flags.extend(solver_flags(settings));
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
    let ground = world.ground();
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
