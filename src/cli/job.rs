//! What the arguments of a simulation amount to, checked.

use super::Failure;
use super::args::{OnFailure, SceneName, SimulateArgs, SolverName};
use super::run_file::{RunFile, RunParameters, SolverSettings, StartState, SummaryFile};
use super::simulate::Run;
use nalgebra::{Matrix3, Vector3};
use std::sync::Arc;
use std::sync::atomic::AtomicBool;
use tumble::body::RigidBody;
use tumble::detection::Detection;
use tumble::ipopt::{self, Options};
use tumble::model::{ContactModel, Parameters};
use tumble::scene;
use tumble::simulation::{Motion, Simulation};
use tumble::solver::StepSolver;
use tumble::solver::ipopt::{Formulation, IpoptSolver, Ladder, Rung};
use tumble::solver::native::NativeSolver;
use tumble::state::State;

/// What the arguments amount to.
pub struct Job {
    pub rows: u64,
    pub model: ContactModel,
    pub start: State,
    /// `None` for the floating scene.
    pub contact: Option<Contact>,
}

/// How contact steps are posed and solved.
pub struct Contact {
    detection: Detection,
    pub on_failure: OnFailure,
    /// Ipopt's options; `None` for the native solver.
    ipopt: Option<Options>,
}

impl Job {
    pub fn new(args: &SimulateArgs) -> Result<Self, Failure> {
        let mut scene = args.scene.scene();
        let physics = &args.physics;
        let inertia =
            physics.inertia.unwrap_or_else(|| Matrix3::from_diagonal_element(scene::CUBE_INERTIA));
        let body = RigidBody::with_box_corners(
            physics.mass.unwrap_or(scene::CUBE_MASS),
            inertia,
            args.sides.map_or(Vector3::repeat(scene::CUBE_HALF_SIDE), |sides| 0.5 * sides),
        )?;
        let model = ContactModel::new(Parameters {
            body,
            gravity: physics.gravity.unwrap_or(scene.gravity),
            friction: physics.mu.unwrap_or(scene::FRICTION),
            time_step: physics.dt.unwrap_or(scene.time_step),
            smoothing: scene::SMOOTHING,
        })?;
        scene.height = args.height.unwrap_or(scene.height);
        scene.velocity = args.velocity.unwrap_or(scene.velocity);
        scene.spin = args.spin.unwrap_or(scene.spin);
        let start = scene.start(scene.attitude(args.seed));
        start.validate()?;

        let contact = match args.scene {
            SceneName::Floating => {
                refuse_flags("the floating scene, which has no contact", &contact_flags(args))?;
                None
            }
            SceneName::Drop => {
                refuse_start_below_ground(&model, &start)?;
                Some(Contact::new(args)?)
            }
        };
        Ok(Self { rows: args.steps.unwrap_or(scene.rows), model, start, contact })
    }

    pub fn simulation(&self, interrupt: &Arc<AtomicBool>) -> Result<Simulation<'static>, Failure> {
        let motion = match &self.contact {
            None => Motion::Floating,
            Some(contact) => Motion::Contact {
                detection: contact.detection,
                solver: self.solver(contact, interrupt)?,
            },
        };
        Ok(Simulation::new(self.model.clone(), self.start, motion)?)
    }

    fn solver(
        &self,
        contact: &Contact,
        interrupt: &Arc<AtomicBool>,
    ) -> Result<Box<dyn StepSolver>, Failure> {
        let Some(options) = &contact.ipopt else {
            return Ok(Box::new(NativeSolver::new(&self.model)));
        };
        let mut ipopt = IpoptSolver::new(&self.model, Formulation::default(), options.clone())?;
        ipopt.interrupt_by(Arc::clone(interrupt));
        Ok(match contact.on_failure {
            OnFailure::Ladder => Box::new(Ladder::new(&self.model, ipopt, &Rung::ALL)),
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

    pub fn run_file(&self, args: &SimulateArgs, run: &Run) -> RunFile {
        let contact = self.contact.as_ref();
        let ipopt = contact.and_then(|contact| contact.ipopt.as_ref());
        RunFile {
            outcome: run.end.name().to_owned(),
            tumble_version: env!("CARGO_PKG_VERSION").to_owned(),
            ipopt_version: ipopt::VERSION.to_owned(),
            scene: args.scene.scene().name.to_owned(),
            seed: args.seed,
            parameters: RunParameters::of(&self.model, self.rows),
            solver: SolverSettings {
                name: self.solver_name().to_owned(),
                detection: contact.map(|contact| contact.detection.name().to_owned()),
                on_failure: contact.map(|contact| contact.on_failure.name().to_owned()),
                tol: ipopt.map(|options| options.tolerance),
                max_iter: ipopt.map(|options| options.max_iterations),
            },
            start: StartState {
                height: self.start.position[2],
                attitude: self.start.attitude.into(),
                velocity: self.start.velocity.into(),
                spin: self.start.spin.into(),
            },
            summary: SummaryFile::of(&run.summary, run.elapsed.as_secs_f64()),
        }
    }
}

impl Contact {
    fn new(args: &SimulateArgs) -> Result<Self, Failure> {
        let detection = args.detection.map(Detection::from).unwrap_or_default();
        if args.solver == Some(SolverName::Native) {
            let ladder = args.on_failure == Some(OnFailure::Ladder);
            let mut flags = ipopt_flags(args);
            flags.push(("--on-failure ladder", ladder));
            refuse_flags("the native solver, which works to rounding", &flags)?;
            let on_failure = args.on_failure.unwrap_or(OnFailure::Record);
            return Ok(Self { detection, on_failure, ipopt: None });
        }
        let options = IpoptSolver::options(
            args.tol.unwrap_or(scene::TOLERANCE),
            args.max_iter.unwrap_or(scene::MOST_ITERATIONS),
        );
        options.validate().map_err(tumble::error::Error::from)?;
        let on_failure = args.on_failure.unwrap_or(OnFailure::Ladder);
        Ok(Self { detection, on_failure, ipopt: Some(options) })
    }
}

/// Flags with a meaning for Ipopt alone, and whether they are given.
fn ipopt_flags(args: &SimulateArgs) -> Vec<(&'static str, bool)> {
    vec![("--tol", args.tol.is_some()), ("--max-iter", args.max_iter.is_some())]
}

/// Flags with a meaning for contact alone, and whether they are given.
fn contact_flags(args: &SimulateArgs) -> Vec<(&'static str, bool)> {
    let mut flags = vec![
        ("--mu", args.physics.mu.is_some()),
        ("--detection", args.detection.is_some()),
        ("--solver", args.solver.is_some()),
        ("--on-failure", args.on_failure.is_some()),
    ];
    flags.extend(ipopt_flags(args));
    flags
}

/// An option that would do nothing is refused rather than ignored.
pub fn refuse_flags(place: &str, flags: &[(&str, bool)]) -> Result<(), Failure> {
    match flags.iter().find(|(_, given)| *given) {
        Some((flag, _)) => {
            Err(Failure::Input(format!("{flag} has no meaning with {place}; leave it out")))
        }
        None => Ok(()),
    }
}

/// A start inside the ground would be thrown out of it within one step.
fn refuse_start_below_ground(model: &ContactModel, start: &State) -> Result<(), Failure> {
    let lowest = model.lowest_height(start);
    if lowest >= 0.0 {
        return Ok(());
    }
    Err(Failure::Input(format!(
        "--height {}: the lowest corner would start {:.4} m below the ground; {:.4} or more is \
         needed for this attitude",
        start.position[2],
        -lowest,
        ((start.position[2] - lowest) * 1e4).ceil() / 1e4
    )))
}
