//! Choice of the contact solver and its options.

use super::choices::{OnFailure, Preset, SolverName};
pub use super::tables::SolverTable;
use std::num::NonZeroUsize;
#[cfg(feature = "ipopt")]
use tumble::ipopt::Options;
#[cfg(feature = "ipopt")]
use tumble::solver::ipopt::IpoptSolver;
use tumble_core::contact::Detection;
use tumble_core::simulation::Motion;
use tumble_core::solver::native::{ACCEPTED_RESIDUAL, LARGEST_RESIDUAL, NativeSolver};
use tumble_core::step::StepSolver;
use tumble_core::world::World;
use tumble_model::failure::Failure;
use tumble_model::shown;

/// Solver of contact steps and its options.
#[derive(Clone)]
pub struct SolverChoice {
    /// Criterion for the points that may touch.
    pub detection: Detection,
    /// Action if a step is not solved.
    pub on_failure: OnFailure,
    /// Preset that set these options.
    pub preset: Option<Preset>,
    /// Options of Ipopt; `None` for the native solver.
    pub ipopt: Option<IpoptOptions>,
    /// Target residual of the native solver (m/s at speed scale 1), if not the default.
    residual: Option<f64>,
    /// Maximum number of threads of the native solver. Files cannot set it.
    threads: NonZeroUsize,
}

/// Options of Ipopt.
#[cfg(feature = "ipopt")]
pub type IpoptOptions = Options;

/// Uninhabited type in a build without Ipopt.
#[cfg(not(feature = "ipopt"))]
pub type IpoptOptions = std::convert::Infallible;

/// Version of Ipopt in this build; empty without Ipopt.
#[cfg(feature = "ipopt")]
pub const IPOPT_VERSION: &str = tumble::ipopt::VERSION;
/// Version of Ipopt in this build; empty without Ipopt.
#[cfg(not(feature = "ipopt"))]
pub const IPOPT_VERSION: &str = "";

impl SolverChoice {
    /// Choice made by `settings`. The default is the native solver.
    ///
    /// # Errors
    /// Settings that exclude each other; Ipopt without the feature `ipopt`.
    pub fn new(settings: &SolverTable) -> Result<Self, Failure> {
        let of_ipopt = [
            ("solver.tolerance", settings.tolerance.is_some()),
            ("solver.max_iterations", settings.max_iterations.is_some()),
        ];
        if let Some(preset) = settings.preset {
            let place = format!("the preset {}, which fixes all solver settings", preset.name());
            let others = [
                ("solver.name", settings.name.is_some()),
                ("solver.detection", settings.detection.is_some()),
                ("solver.residual", settings.residual.is_some()),
                ("solver.on_failure", settings.on_failure.is_some()),
            ];
            Failure::refuse_idle(&place, &[&others[..], &of_ipopt].concat())?;
            return ipopt::tutorial(preset);
        }
        let detection = settings.detection.unwrap_or_default();
        if settings.name == Some(SolverName::Ipopt) {
            let residual = [("solver.residual", settings.residual.is_some())];
            Failure::refuse_idle("Ipopt, which has a tolerance; use the native solver", &residual)?;
            return ipopt::choice(settings, detection);
        }
        let place = "the native solver, which works to rounding";
        let ladder = settings.on_failure == Some(OnFailure::Ladder);
        Failure::refuse_idle(place, &of_ipopt)?;
        let place = "the native solver, which has no ladder; use record or stop, or Ipopt";
        Failure::refuse_idle(place, &[("solver.on_failure", ladder)])?;
        let on_failure = settings.on_failure.unwrap_or(OnFailure::Record);
        let residual = settings.residual.map(known_residual).transpose()?;
        Ok(Self { detection, on_failure, residual, ..Self::native() })
    }

    /// The native solver with its default settings.
    pub fn native() -> Self {
        Self::by(Detection::default(), OnFailure::Record, None)
    }

    fn by(detection: Detection, on_failure: OnFailure, ipopt: Option<IpoptOptions>) -> Self {
        Self {
            detection,
            on_failure,
            preset: None,
            ipopt,
            residual: None,
            threads: NonZeroUsize::MIN,
        }
    }

    /// Sets the maximum number of threads of the native solver; see [`NativeSolver::with_threads`].
    ///
    /// The default is one.
    ///
    /// # Errors
    /// A choice of Ipopt.
    pub fn set_threads(&mut self, count: NonZeroUsize) -> Result<(), Failure> {
        let place = "Ipopt, which solves all bodies as one problem";
        Failure::refuse_idle(place, &[("threads", self.is_ipopt())])?;
        self.threads = count;
        Ok(())
    }

    /// Solver for `world`.
    ///
    /// # Errors
    /// A setting that does not apply to this world.
    pub fn solver(&self, world: &World) -> Result<Box<dyn StepSolver>, Failure> {
        match &self.ipopt {
            None => self.native_for(world),
            Some(options) => ipopt::solver(self, options, world),
        }
    }

    /// Target residual of the native solver, m/s at speed scale 1; `None` for the default.
    pub fn residual(&self) -> Option<f64> {
        self.residual
    }

    fn native_for(&self, world: &World) -> Result<Box<dyn StepSolver>, Failure> {
        let mut solver = NativeSolver::new(world);
        if let Some(residual) = self.residual {
            solver = solver.with_residual(residual)?;
        }
        #[cfg(not(target_arch = "wasm32"))]
        let solver = solver.with_threads(self.threads).map_err(|error| match error {
            tumble_core::error::Error::Solver { .. } => Failure::Other(error.to_string()),
            _ => error.into(),
        })?;
        Ok(Box::new(solver))
    }

    /// Integrator of `world`.
    ///
    /// # Errors
    /// The errors of [`SolverChoice::solver`].
    pub fn motion(&self, world: &World) -> Result<Motion<'static>, Failure> {
        Ok(Motion::Contact { detection: self.detection, solver: self.solver(world)? })
    }

    /// True if Ipopt solves the contact steps.
    pub fn is_ipopt(&self) -> bool {
        self.ipopt.is_some()
    }

    /// True if Ipopt tries further initial points after a failure.
    pub fn climbs(&self) -> bool {
        self.is_ipopt() && self.on_failure == OnFailure::Ladder
    }

    /// Ipopt's tolerance and maximum number of iterations; `None` for the native solver.
    pub fn limits(&self) -> Option<(f64, u32)> {
        self.ipopt.as_ref().map(ipopt::limits)
    }

    /// Name of the solver: `native` or `ipopt`.
    pub fn solver_name(&self) -> &'static str {
        if self.is_ipopt() { "ipopt" } else { "native" }
    }

    /// Ipopt's program, with its settings that differ from the tutorial's. `None` for the native solver.
    pub fn program(&self) -> Option<&'static str> {
        let program = match self.preset {
            Some(Preset::Tutorial) => "the tutorial's program to the letter",
            Some(Preset::TutorialProduct) => {
                "the tutorial's program to the letter, with the normal force as a factor"
            }
            None if self.climbs() => {
                "the tutorial's program with contacts closed by free flight, scene units, adaptive \
                 barrier, weighted objective and a ladder of starts"
            }
            None => {
                "the tutorial's program with contacts closed by free flight, scene units and \
                 adaptive barrier"
            }
        };
        self.is_ipopt().then_some(program)
    }
}

/// Reason why Ipopt's program does not fit `world`; `None` if it does, or without Ipopt.
pub fn unsuitable(world: &World) -> Option<&'static str> {
    ipopt::unsuitable(world)
}

#[cfg(feature = "ipopt")]
mod ipopt {
    use super::*;
    use tumble::ipopt::IpoptError;
    use tumble::solver::ipopt::{MOST_ITERATIONS, TOLERANCE, ladder_for};
    use tumble::step_nlp::StepNlp;
    use tumble_core::error::Error;

    /// Minimum tolerance. Smaller values cost many more iterations and do not improve the solution.
    const LEAST_TOLERANCE: f64 = 1e-12;

    /// Largest iteration limit of a step.
    const LARGEST_LIMIT: u32 = 1_000_000;

    /// Failure of an option that Ipopt rejects, with the option's name.
    fn refused(error: IpoptError) -> Failure {
        match error {
            IpoptError::Option { name, .. } => {
                let field = if name == "tol" { "tolerance" } else { "max_iterations" };
                Failure::setting(&format!("solver.{field}"), &error)
            }
            other => Failure::Other(other.to_string()),
        }
    }

    pub fn choice(settings: &SolverTable, detection: Detection) -> Result<SolverChoice, Failure> {
        let tolerance = settings.tolerance.unwrap_or(TOLERANCE);
        if tolerance > 0.0 && tolerance < LEAST_TOLERANCE {
            return Err(Failure::setting(
                "solver.tolerance",
                format!(
                    "{} is below {LEAST_TOLERANCE:e}, which Ipopt cannot reach because of \
                     rounding; use the native solver, which solves to rounding",
                    shown::number(tolerance)
                ),
            ));
        }
        let options =
            IpoptSolver::options(tolerance, settings.max_iterations.unwrap_or(MOST_ITERATIONS));
        options.validate().map_err(refused)?;
        if !(1..=LARGEST_LIMIT).contains(&options.max_iterations) {
            let why = format!("it is {}; allowed: 1 to {LARGEST_LIMIT}", options.max_iterations);
            return Err(Failure::setting("solver.max_iterations", why));
        }
        let on_failure = settings.on_failure.unwrap_or(OnFailure::Ladder);
        Ok(SolverChoice::by(detection, on_failure, Some(options)))
    }

    pub fn limits(options: &IpoptOptions) -> (f64, u32) {
        (options.tolerance, options.max_iterations)
    }

    pub fn unsuitable(world: &World) -> Option<&'static str> {
        StepNlp::unsuitable(world)
    }

    /// The tutorial's settings, with the program of `preset`.
    pub fn tutorial(preset: Preset) -> Result<SolverChoice, Failure> {
        let options = Some(IpoptSolver::tutorial_options());
        let contact = SolverChoice::by(Detection::Height, OnFailure::Record, options);
        Ok(SolverChoice { preset: Some(preset), ..contact })
    }

    pub fn solver(
        contact: &SolverChoice,
        options: &IpoptOptions,
        world: &World,
    ) -> Result<Box<dyn StepSolver>, Failure> {
        let tutorials = contact.preset.map(|preset| match preset {
            Preset::Tutorial => IpoptSolver::tutorial,
            Preset::TutorialProduct => IpoptSolver::tutorial_product,
        });
        let made: Result<Box<dyn StepSolver>, Error> = if let Some(new) = tutorials {
            new(world, options.clone()).map(|solver| Box::new(solver) as _)
        } else if contact.climbs() {
            ladder_for(world, options.clone())
        } else {
            // The scaling only helps with the ladder's warm starts (docs/ipopt-path.md).
            let options = Options { objective_scaling: 1.0, ..options.clone() };
            IpoptSolver::new(world, options).map(|solver| Box::new(solver) as _)
        };
        made.map_err(|error| match error {
            Error::Solver { why, .. } => {
                let field = if contact.preset.is_some() { "solver.preset" } else { "solver.name" };
                Failure::setting(field, why)
            }
            other => other.into(),
        })
    }
}

#[cfg(not(feature = "ipopt"))]
mod ipopt {
    use super::*;

    pub fn tutorial(_: Preset) -> Result<SolverChoice, Failure> {
        Err(Failure::setting("solver.preset", MISSING))
    }

    pub fn limits(options: &IpoptOptions) -> (f64, u32) {
        match *options {}
    }

    pub fn choice(_: &SolverTable, _: Detection) -> Result<SolverChoice, Failure> {
        Err(Failure::setting("solver.name", MISSING))
    }

    pub fn unsuitable(_: &World) -> Option<&'static str> {
        None
    }

    pub fn solver(
        _: &SolverChoice,
        options: &IpoptOptions,
        _: &World,
    ) -> Result<Box<dyn StepSolver>, Failure> {
        match *options {}
    }

    const MISSING: &str = "it needs Ipopt, which this build does not have; use `native`";
}

/// Checks the target residual of the native solver (m/s).
fn known_residual(residual: f64) -> Result<f64, Failure> {
    if (ACCEPTED_RESIDUAL..=LARGEST_RESIDUAL).contains(&residual) {
        return Ok(residual);
    }
    let why = format!("it is {} m/s; allowed: 1e-9 to 1e-2", shown::number(residual));
    Err(Failure::setting("solver.residual", why))
}
