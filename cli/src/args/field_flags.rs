//! Flags that stand for a field of the scene.

use clap::builder::PossibleValuesParser;
use clap::error::Error;
use clap::{Arg, ArgMatches, Args, Command, FromArgMatches};
use tumble_scene::overrides::FieldOverride;

/// A flag, and the field of the scene that it sets.
struct FieldFlag {
    flag: &'static str,
    path: &'static str,
    value: &'static str,
    /// Allowed words; empty for other values.
    words: &'static [&'static str],
    help: &'static str,
}

const fn number(
    flag: &'static str,
    path: &'static str,
    value: &'static str,
    help: &'static str,
) -> FieldFlag {
    FieldFlag { flag, path, value, words: &[], help }
}

const fn word(
    flag: &'static str,
    path: &'static str,
    words: &'static [&'static str],
    help: &'static str,
) -> FieldFlag {
    FieldFlag { flag, path, value: "NAME", words, help }
}

/// Flags under their headings.
const FLAGS: [(&str, &[FieldFlag]); 3] = [
    (
        "Scene",
        &[
            number(
                "steps",
                "steps",
                "N",
                "Number of rows, one more than steps, 1 to 10000000 [default: 1000]",
            ),
            number("seed", "seed", "SEED", "Seed of random initial states [default: 42]"),
            number(
                "start-index",
                "start_index",
                "K",
                "Index k of the first row; its time is k h, which also shifts the times of loads [default: 0]",
            ),
        ],
    ),
    (
        "Solver",
        &[
            word(
                "preset",
                "solver",
                &["tutorial", "tutorial-product"],
                "Ipopt with exactly the program and the settings of the tutorial, or with the normal force as a factor of maximum dissipation. A step that is not solved is kept with status failed",
            ),
            word(
                "solver",
                "solver.name",
                &["native", "ipopt"],
                "Solver of the contact steps: tumble's own, which is exact, or Ipopt as in the tutorial, a thousand times slower [default: native; without a file ipopt]",
            ),
            number(
                "residual",
                "solver.residual",
                "M/S",
                "Residual at which the native solver accepts a contact step, m/s, 1e-9 to 1e-2, for bodies of about one metre. A larger value saves time in large scenes [default: 1e-9]",
            ),
            word(
                "on-failure",
                "solver.on_failure",
                &["ladder", "record", "stop"],
                "Action if a step is not solved: try other initial points (Ipopt), record the failure and continue, or stop [default: record; with Ipopt ladder]",
            ),
            number(
                "tol",
                "solver.tolerance",
                "TOL",
                "Ipopt's tolerance, 1e-12 to below 1 [default: 1e-6]",
            ),
            number(
                "max-iter",
                "solver.max_iterations",
                "N",
                "Ipopt's iteration limit per step, 1 to 1000000 [default: 300]",
            ),
            word(
                "detection",
                "solver.detection",
                &["height", "predictive"],
                "Points that may carry a force: those at most 5 mm high at step k (the tutorial's), or also those that free flight would bring to the ground in this step [default: predictive]",
            ),
        ],
    ),
    (
        "Constants, instead of the scene's",
        &[
            number("dt", "time_step", "S", "Time step, s, 1e-6 to 0.1 [default: 0.002]"),
            word(
                "rotation",
                "rotation",
                &["momentum", "tutorial"],
                "Update equation of the rotation: P⁺(ω⁺) = P⁻(ω) + h τ conserves angular momentum to rounding and energy without drift; the tutorial's conserves both to first order in h [default: momentum]",
            ),
            word(
                "integrator",
                "integrator",
                &["euler", "leapfrog"],
                "Velocities of a run: of the ends of steps, with errors of first order, or of their middles, with errors of second order in smooth motion [default: leapfrog]",
            ),
            number(
                "accuracy",
                "accuracy",
                "M",
                "Error that the time step adds to the position of a body in a second, m, 1e-10 to 1: steps are taken in substeps that keep it, and that end at impacts",
            ),
            word(
                "impacts",
                "impacts",
                &["stepped", "located"],
                "When impacts happen: within the step, or at their time, where a substep begins [default: stepped; with an accuracy located]",
            ),
            number("mu", "ground.friction", "MU", "Coefficient of friction, 0 to 10"),
            number(
                "restitution",
                "ground.restitution",
                "E",
                "Coefficient of restitution, 0 to 1: rebound speed over impact speed [default: 0]",
            ),
            number(
                "rebound-speed",
                "ground.rebound_speed",
                "M/S",
                "Impact speed below which a contact does not bounce, m/s, 0 to 1000 [default: 2 |g| times the time step]",
            ),
            number(
                "gravity",
                "gravity",
                "G|X,Y,Z",
                "Gravity, m/s², −1000 to 1000: one number (downwards) or the vector X,Y,Z [default: 9.81]",
            ),
        ],
    ),
];

/// Fields of the scene given by flags.
#[derive(Debug, Clone, Default)]
pub struct FieldFlags {
    /// Fields in the order of the help.
    pub given: Vec<FieldOverride>,
}

impl FieldFlags {
    /// Names of the flags that are set.
    pub fn names(&self) -> Vec<&'static str> {
        let all = FLAGS.iter().flat_map(|(_, flags)| *flags);
        all.map(|of| of.flag).filter(|flag| self.get(flag).is_some()).collect()
    }

    /// Field set by the flag `name`.
    pub fn get(&self, name: &str) -> Option<&FieldOverride> {
        let is_meant = |label: &str| label.strip_prefix("--") == Some(name);
        self.given.iter().find(|field| field.label().is_some_and(is_meant))
    }
}

/// Value of a flag. It may begin with a minus, but is not another flag.
fn value_of(text: &str) -> Result<String, &'static str> {
    if text.starts_with("--") { Err("a value is needed") } else { Ok(text.to_owned()) }
}

impl Args for FieldFlags {
    fn augment_args(mut command: Command) -> Command {
        for (heading, flags) in FLAGS {
            for FieldFlag { flag, value, words, help, .. } in flags {
                let arg = Arg::new(*flag).long(*flag).value_name(*value).help(*help);
                let arg = arg.help_heading(heading).allow_hyphen_values(true);
                let arg = if *flag == "steps" { arg.short('s') } else { arg };
                command = command.arg(match words {
                    [] => arg.value_parser(value_of),
                    words => arg.value_parser(PossibleValuesParser::new(*words)),
                });
            }
        }
        command
    }

    fn augment_args_for_update(command: Command) -> Command {
        Self::augment_args(command)
    }
}

impl FromArgMatches for FieldFlags {
    fn from_arg_matches(matches: &ArgMatches) -> Result<Self, Error> {
        let all = FLAGS.iter().flat_map(|(_, flags)| *flags);
        let given = all.filter_map(|FieldFlag { flag, path, .. }| {
            let value = matches.get_one::<String>(flag)?;
            // A preset replaces all settings of the solver.
            let preset = (*flag == "preset").then(|| format!("{{ preset = \"{value}\" }}"));
            let value = preset.as_ref().unwrap_or(value);
            Some(FieldOverride::labelled(&format!("--{flag}"), path, value))
        });
        Ok(Self { given: given.collect() })
    }

    fn update_from_arg_matches(&mut self, matches: &ArgMatches) -> Result<(), Error> {
        *self = Self::from_arg_matches(matches)?;
        Ok(())
    }
}
