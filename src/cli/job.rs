//! What the arguments of a simulation amount to, and what its run.json says.

use super::args::SimulateArgs;
use super::choices::{SceneName, SolverName};
use super::contact;
use super::fields::Exactly;
use super::names::FileKind;
use super::outcome::{Failure, refuse_flags};
use super::physics::{numbers, parameters};
use super::run::Run;
use super::run_file::{RunFile, SolverSettings, StartState, SummaryFile};
use super::scenario;
use super::settings::{Settings, of_flags};
use tumble::ipopt;
use tumble::scenario::contact::Contact;
pub use tumble::scenario::job::Job;
use tumble::scenario::job::refuse_idle_settings;

/// With more contact points than this Ipopt takes more than 10 ms an iteration
/// (docs/ipopt-path.md).
const MANY_POINTS: usize = 100;

/// Where threads have nothing to do.
pub const ONE_BODY: &str = "one body, whose steps are one problem each";

/// The job that the arguments amount to, checked.
pub fn new(args: &SimulateArgs) -> Result<Job, Failure> {
    refuse_flags(ONE_BODY, &[("--threads", args.threads.is_some())])?;
    let flags = of_flags(args)?;
    let Some(path) = &args.scenario else {
        let scene = args.scene.unwrap_or(SceneName::Drop);
        let (name, ground) = (scene.scene().name, scene == SceneName::Drop);
        refuse_idle_settings(ground, &flags)?;
        let usual = Settings::of_scene(scene);
        let changed = flags.changed(&usual);
        let job = Job::of(name.to_owned(), ground, flags.over(usual), SolverName::Ipopt)?;
        return Ok(Job { changed, ..job });
    };
    let scenario = scenario::read(path)?;
    refuse_idle_settings(scenario.ground, &flags)?;
    let seed_given = flags.seed.is_some();
    let changed = flags.changed(&scenario.settings);
    let settings = flags.over(scenario.settings);
    let job = Job::of(scenario.name, scenario.ground, settings, SolverName::Ipopt);
    let given = args.given();
    let job = job.map_err(|failure| failure.in_file(path, FileKind::Scenario, &given))?;
    let idle_seed = seed_given && !job.drawn;
    refuse_flags("an attitude that is not random", &[("--seed", idle_seed)])?;
    Ok(Job { changed, ..job })
}

/// What must be said before a run that takes long.
pub fn note(job: &Job) -> Option<String> {
    let ipopt = job.contact.as_ref().is_some_and(Contact::is_ipopt);
    let points = job.physics.world.bodies()[0].contact_points().len();
    (ipopt && points > MANY_POINTS).then(|| {
        format!(
            "{points} contact points are many for Ipopt, which may take seconds a step with \
             them: --solver native is made for this\n"
        )
    })
}

pub fn run_file(job: &Job, run: &Run) -> RunFile {
    let climbs = job.contact.as_ref().is_some_and(Contact::climbs);
    let floating = || SolverSettings::without_contact(job.solver_name());
    RunFile {
        outcome: run.end.name().to_owned(),
        tumble_version: env!("CARGO_PKG_VERSION").to_owned(),
        ipopt_version: ipopt::VERSION.to_owned(),
        scene: job.name.clone(),
        changed: job.changed.clone(),
        seed: job.seed,
        parameters: parameters(&job.physics, job.rows),
        solver: job.contact.as_ref().map_or_else(floating, contact::settings),
        start: StartState {
            position: numbers(&job.start.position),
            random: job.drawn,
            attitude: Exactly(job.start.attitude.into()),
            velocity: numbers(&job.start.velocity),
            spin: numbers(&job.start.spin),
        },
        summary: SummaryFile::of(&run.summary, climbs, run.elapsed.as_secs_f64()),
    }
}
