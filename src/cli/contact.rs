//! How contact steps are posed and solved, from the settings of one body or of several.

use super::choices::{OnFailure, Preset, SolverName};
use super::outcome::{Failure, refuse_flags};
use super::run_file::SolverSettings;
use super::settings::Settings;
use super::shown;
use tumble::contact::detection::Detection;
use tumble::error::Error;
use tumble::ipopt::Options;
use tumble::simulation::scene;
use tumble::solver::ipopt::{Formulation, IpoptSolver, alone_for, ladder_for};
use tumble::solver::native::NativeSolver;
use tumble::step::StepSolver;
use tumble::step_nlp::StepNlp;
use tumble::world::World;

/// How contact steps are posed and solved.
pub struct Contact {
    pub detection: Detection,
    pub on_failure: OnFailure,
    /// Ipopt's program and options; `None` for the native solver.
    ipopt: Option<(Formulation, Options)>,
}

/// Below this, Ipopt's steps take five to a hundred times the iterations and are no better.
const LEAST_TOLERANCE: f64 = 1e-12;

impl Contact {
    /// What `settings` say, by `usual` where they name no solver.
    pub fn new(settings: &Settings, usual: SolverName) -> Result<Self, Failure> {
        if let Some(Preset::Tutorial) = settings.preset {
            let place = "--preset tutorial, which is the tutorial's program to the letter";
            refuse_flags(place, &solver_flags(settings))?;
            return Ok(Self::tutorial());
        }
        let detection = settings.detection.map(Detection::from).unwrap_or_default();
        if settings.solver.unwrap_or(usual) == SolverName::Native {
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
        let options =
            IpoptSolver::options(tolerance, settings.max_iter.unwrap_or(scene::MOST_ITERATIONS));
        options.validate().map_err(Failure::of_ipopt)?;
        let on_failure = settings.on_failure.unwrap_or(OnFailure::Ladder);
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

    /// The solver for `world`, or which setting is not made for it.
    pub fn solver(&self, world: &World) -> Result<Box<dyn StepSolver>, Failure> {
        let Some((formulation, options)) = &self.ipopt else {
            return Ok(Box::new(NativeSolver::new(world)));
        };
        if *formulation == Formulation::Clamped
            && let Some(why) = StepNlp::unsuitable(world)
        {
            let why = format!("`clamped` is the tutorial's program: {why}, or `reduced`");
            return Err(Failure::setting("formulation", why));
        }
        let mut options = options.clone();
        let made = if self.climbs() {
            ladder_for(world, *formulation, options)
        } else {
            if StepNlp::unsuitable(world).is_none() {
                // Of one body it pays with the ladder's warm starts only (docs/ipopt-path.md).
                options.objective_scaling = 1.0;
            }
            alone_for(world, *formulation, options)
        };
        made.map_err(|error| match error {
            Error::Solver { why, .. } => Failure::setting("solver", why),
            other => other.into(),
        })
    }

    pub fn is_ipopt(&self) -> bool {
        self.ipopt.is_some()
    }

    /// Whether Ipopt has a ladder behind its first start.
    pub fn climbs(&self) -> bool {
        self.is_ipopt() && self.on_failure == OnFailure::Ladder
    }

    /// The solver's name in run.json.
    pub fn solver_name(&self) -> &'static str {
        if self.is_ipopt() { "ipopt" } else { "native" }
    }

    /// All that run.json says of it.
    pub fn settings(&self) -> SolverSettings {
        let ipopt = self.ipopt.as_ref();
        SolverSettings {
            name: self.solver_name().to_owned(),
            formulation: ipopt.map(|(formulation, _)| formulation.name().to_owned()),
            detection: Some(self.detection.name().to_owned()),
            on_failure: Some(self.on_failure.name().to_owned()),
            tol: ipopt.map(|(_, options)| options.tolerance),
            max_iter: ipopt.map(|(_, options)| options.max_iterations),
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
pub fn solver_flags(settings: &Settings) -> Vec<(&'static str, bool)> {
    let mut flags = vec![
        ("--solver", settings.solver.is_some()),
        ("--detection", settings.detection.is_some()),
        ("--on-failure", settings.on_failure.is_some()),
    ];
    flags.extend(ipopt_flags(settings));
    flags
}
