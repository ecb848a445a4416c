//! What the arguments of a simulation amount to, checked.

use super::args::SimulateArgs;
use super::choices::{Attitude, Frame, OnFailure, Preset, SceneName, SolverName};
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
use tumble::contact::detection::Detection;
use tumble::contact::rounding;
use tumble::ipopt::{self, Options};
use tumble::mechanics::state::State;
use tumble::simulation::scene;
use tumble::simulation::{Motion, Simulation};
use tumble::solver::ipopt::{Formulation, IpoptSolver, Ladder, Rung};
use tumble::solver::native::NativeSolver;
use tumble::step::StepSolver;
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

/// Below this, Ipopt's steps take five to a hundred times the iterations and are no better.
const LEAST_TOLERANCE: f64 = 1e-12;

/// The seed where none is given.
pub const USUAL_SEED: u32 = 42;

/// With more contact points than this Ipopt takes more than 10 ms an iteration
/// (docs/ipopt-path.md).
const MANY_POINTS: usize = 100;

/// How contact steps are posed and solved.
pub struct Contact {
    pub detection: Detection,
    pub on_failure: OnFailure,
    /// Ipopt's program and options; `None` for the native solver.
    ipopt: Option<(Formulation, Options)>,
}

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
            Some(Contact::new(&settings)?)
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
                Motion::Contact { detection: contact.detection, solver: self.solver(contact)? }
            }
        };
        let Physics { world, load } = &self.physics;
        let mut simulation = Simulation::new(world.clone(), [self.start], motion)?;
        simulation.set_load(0, load.clone())?;
        simulation.interrupt_by(Arc::clone(interrupt));
        Ok(simulation)
    }

    fn solver(&self, contact: &Contact) -> Result<Box<dyn StepSolver>, Failure> {
        let world = &self.physics.world;
        let Some((formulation, options)) = &contact.ipopt else {
            return Ok(Box::new(NativeSolver::new(world)));
        };
        let ipopt = IpoptSolver::new(world, *formulation, options.clone())?;
        Ok(match contact.on_failure {
            OnFailure::Ladder => Box::new(Ladder::new(world, ipopt, &Rung::ALL)),
            OnFailure::Record | OnFailure::Stop => Box::new(ipopt),
        })
    }

    /// The solver's name in run.json.
    pub fn solver_name(&self) -> &'static str {
        match &self.contact {
            None => "rk4",
            Some(Contact { ipopt: Some(_), .. }) => "ipopt",
            Some(Contact { ipopt: None, .. }) => "native",
        }
    }

    /// What must be said before a run that takes long.
    pub fn note(&self) -> Option<String> {
        let ipopt = self.contact.as_ref().is_some_and(|contact| contact.ipopt.is_some());
        let points = self.physics.world.bodies()[0].contact_points().len();
        (ipopt && points > MANY_POINTS).then(|| {
            format!(
                "{points} contact points are many for Ipopt, which may take seconds a step with \
                 them: --solver native is made for this\n"
            )
        })
    }

    pub fn run_file(&self, run: &Run) -> RunFile {
        let contact = self.contact.as_ref();
        let ipopt = contact.and_then(|contact| contact.ipopt.as_ref());
        let climbs = contact.is_some_and(|contact| contact.on_failure == OnFailure::Ladder);
        RunFile {
            outcome: run.end.name().to_owned(),
            tumble_version: env!("CARGO_PKG_VERSION").to_owned(),
            ipopt_version: ipopt::VERSION.to_owned(),
            scene: self.name.clone(),
            changed: self.changed.clone(),
            seed: self.seed,
            parameters: self.physics.parameters(self.rows),
            solver: SolverSettings {
                name: self.solver_name().to_owned(),
                formulation: ipopt.map(|(formulation, _)| formulation.name().to_owned()),
                detection: contact.map(|contact| contact.detection.name().to_owned()),
                on_failure: contact.map(|contact| contact.on_failure.name().to_owned()),
                tol: ipopt.map(|(_, options)| options.tolerance),
                max_iter: ipopt.map(|(_, options)| options.max_iterations),
            },
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

impl Contact {
    pub fn new(settings: &Settings) -> Result<Self, Failure> {
        if let Some(Preset::Tutorial) = settings.preset {
            let place = "--preset tutorial, which is the tutorial's program to the letter";
            refuse_flags(place, &solver_flags(settings))?;
            return Ok(Self::tutorial());
        }
        let detection = settings.detection.map(Detection::from).unwrap_or_default();
        if settings.solver == Some(SolverName::Native) {
            let ladder = settings.on_failure == Some(OnFailure::Ladder);
            let mut flags = ipopt_flags(settings);
            flags.push(("--on-failure ladder", ladder));
            refuse_flags("the native solver, which works to rounding", &flags)?;
            let on_failure = settings.on_failure.unwrap_or(OnFailure::Record);
            return Ok(Self { detection, on_failure, ipopt: None });
        }
        let tolerance = settings.tol.unwrap_or(scene::TOLERANCE);
        if tolerance > 0.0 && tolerance < LEAST_TOLERANCE {
            return Err(Failure::setting(
                "tol",
                format!(
                    "{} is below {LEAST_TOLERANCE:e}, where rounding keeps Ipopt from ever coming \
                     to it; the native solver works to rounding",
                    shown::number(tolerance)
                ),
            ));
        }
        let mut options =
            IpoptSolver::options(tolerance, settings.max_iter.unwrap_or(scene::MOST_ITERATIONS));
        options.validate().map_err(Failure::of_ipopt)?;
        let on_failure = settings.on_failure.unwrap_or(OnFailure::Ladder);
        if on_failure != OnFailure::Ladder {
            // It pays with the ladder's warm starts only (docs/ipopt-path.md).
            options.objective_scaling = 1.0;
        }
        let formulation = settings.formulation.map(Formulation::from).unwrap_or_default();
        Ok(Self { detection, on_failure, ipopt: Some((formulation, options)) })
    }

    /// The tutorial's program and settings to the letter.
    fn tutorial() -> Self {
        let options = IpoptSolver::tutorial_options();
        Self {
            detection: Detection::Height,
            on_failure: OnFailure::Record,
            ipopt: Some((Formulation::Clamped, options)),
        }
    }
}

/// Settings with a meaning for Ipopt alone, and whether they are given.
fn ipopt_flags(settings: &Settings) -> Vec<(&'static str, bool)> {
    vec![
        ("--formulation", settings.formulation.is_some()),
        ("--tol", settings.tol.is_some()),
        ("--max-iter", settings.max_iter.is_some()),
    ]
}

/// Settings of the contact steps' solver, the preset apart, and whether they are given.
fn solver_flags(settings: &Settings) -> Vec<(&'static str, bool)> {
    let mut flags = vec![
        ("--solver", settings.solver.is_some()),
        ("--detection", settings.detection.is_some()),
        ("--on-failure", settings.on_failure.is_some()),
    ];
    flags.extend(ipopt_flags(settings));
    flags
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
