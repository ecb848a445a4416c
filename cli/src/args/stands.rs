//! Arguments of `tumble stands`.

use super::simulate::SetupArgs;
use crate::values;
use clap::{ArgGroup, Args};
use tumble_scene::statics::{By, Load, Question};

/// A body with a vector.
type BodyVector = (String, [f64; 3]);

#[derive(Debug, Args)]
#[command(
    group = ArgGroup::new("load"),
    after_help = "Exit codes: 0 it stands, and what was asked for was found; 2 bad input; 3 it does not \
                  stand, or a certificate is missing; 1 any other error."
)]
pub struct StandsArgs {
    #[command(flatten)]
    pub setup: SetupArgs,
    #[command(flatten, next_help_heading = "Questions")]
    pub asked: AskedArgs,
    /// Print the answer as one JSON object, with forces, velocities and certificates.
    #[arg(long, help_heading = "Output")]
    pub json: bool,
}

/// Question about a scene at rest.
#[derive(Debug, Args)]
pub struct AskedArgs {
    /// Find the largest factor on this force on a body, N: --push brick=1,0,0.
    #[arg(long, value_name = "BODY=X,Y,Z", value_parser = values::body_vector, group = "load")]
    push: Option<BodyVector>,
    /// Find the largest mass on a body, kg.
    #[arg(long, value_name = "BODY", group = "load")]
    mass: Option<String>,
    /// Find the largest tilt of gravity about a horizontal axis.
    #[arg(long, value_name = "X,Y,Z", value_parser = values::vector, group = "load", allow_hyphen_values = true)]
    tilt: Option<[f64; 3]>,
    /// Find the largest factor on this acceleration of the base, m/s².
    #[arg(long, value_name = "X,Y,Z", value_parser = values::vector, group = "load", allow_hyphen_values = true)]
    base: Option<[f64; 3]>,
    /// Point of --push or --mass from the body's centre of mass, m, along the world's axes [default: 0,0,0].
    #[arg(long, value_name = "X,Y,Z", value_parser = values::vector, allow_hyphen_values = true)]
    at: Option<[f64; 3]>,
    /// Find the smallest factor on all coefficients of friction.
    #[arg(long)]
    least_friction: bool,
    /// Judge the worst case of coefficients of friction in this range.
    #[arg(long, value_name = "LOW..HIGH", value_parser = values::range)]
    friction: Option<[f64; 2]>,
    /// Derivative of the largest factor by a field of the scene, at this value: --by ground.friction=0.5.
    ///
    /// Can be repeated.
    #[arg(long, value_name = "FIELD=VALUE", value_parser = values::field, requires = "load",
        conflicts_with = "friction")]
    by: Vec<(String, f64)>,
    /// Derivative of the largest factor by a translation of a body along X,Y,Z, per metre.
    ///
    /// Can be repeated.
    #[arg(long = "move", value_name = "BODY=X,Y,Z", value_parser = values::body_vector, requires = "load",
        conflicts_with = "friction")]
    moved: Vec<BodyVector>,
}

impl AskedArgs {
    /// The question.
    pub fn question(&self) -> Question {
        let at = self.at.unwrap_or_default();
        let push = self.push.clone().map(|(body, force)| Load::Push { body, force, at });
        let mass = || self.mass.clone().map(|body| Load::Mass { body, at });
        let load = push
            .or_else(mass)
            .or_else(|| self.tilt.map(Load::Tilt))
            .or_else(|| self.base.map(Load::Base));
        let fields = self.by.iter().map(|(field, value)| By::Field(field.clone(), *value));
        let moved = self.moved.iter().map(|(body, along)| By::Move(body.clone(), *along));
        Question {
            load,
            least_friction: self.least_friction,
            friction: self.friction,
            slopes: fields.chain(moved).collect(),
        }
    }

    /// True if a point is given without a load that has one.
    pub fn has_idle_point(&self) -> bool {
        self.at.is_some() && self.push.is_none() && self.mass.is_none()
    }
}
