//! Arguments shared by several commands.

use crate::values;
use clap::Args;
use clap::builder::{PossibleValue, PossibleValuesParser, TypedValueParser};
use nalgebra::Vector3;
use tumble_core::mechanics::Rotation;
use tumble_core::world::{Impacts, Integrator};
use tumble_view::animation::View;

/// Updates of the rotation, with their help.
const ROTATIONS: [(Rotation, &str); 2] = [
    (
        Rotation::Momentum,
        "P⁺(ω⁺) = P⁻(ω) + h τ: conserves angular momentum to rounding, and energy without drift",
    ),
    (
        Rotation::Tutorial,
        "I (ω⁺ − ω) + h ω⁺ × I ω⁺ = h τ, the tutorial's: conserves both to first order in h",
    ),
];

/// Meanings of the velocities of a run, with their help.
const INTEGRATORS: [(Integrator, &str); 2] = [
    (
        Integrator::Euler,
        "Velocities of the ends of steps, the tutorial's: errors of first order in the time step",
    ),
    (
        Integrator::Leapfrog,
        "Velocities of the middles of steps: errors of second order in smooth motion",
    ),
];

/// Times of impacts, with their help.
const IMPACTS: [(Impacts, &str); 2] = [
    (Impacts::Stepped, "Within the step in which they happen"),
    (Impacts::Located, "At their time, where a substep begins"),
];

/// Parser of the names of values.
fn words<T: Copy + Send + Sync + 'static>(
    all: [(T, &'static str); 2],
    name: fn(T) -> &'static str,
) -> impl TypedValueParser<Value = T> {
    let values = all.map(|(value, help)| PossibleValue::new(name(value)).help(help));
    PossibleValuesParser::new(values)
        .map(move |word| if word == name(all[1].0) { all[1].0 } else { all[0].0 })
}

/// Constants of the model.
#[derive(Debug, Args)]
pub struct PhysicsArgs {
    /// Time step, s, 1e-6 to 0.1 [default: drop 0.002, floating 0.001].
    #[arg(long, value_name = "S", value_parser = values::number, allow_hyphen_values = true)]
    pub dt: Option<f64>,
    /// Update equation of the rotation [default: tutorial; in scenario files momentum].
    #[arg(long, value_parser = words(ROTATIONS, Rotation::name))]
    pub rotation: Option<Rotation>,
    /// Meaning of the velocities of a run [default: euler; in scenario files leapfrog].
    #[arg(long, value_parser = words(INTEGRATORS, Integrator::name))]
    pub integrator: Option<Integrator>,
    /// Error that the time step adds to the position of a body in a second, m, 1e-10 to 1: steps are
    /// taken in substeps that keep it, and that end at impacts.
    #[arg(long, value_name = "M", value_parser = values::number, allow_hyphen_values = true)]
    pub accuracy: Option<f64>,
    /// When impacts happen [default: stepped; with an accuracy located].
    #[arg(long, value_parser = words(IMPACTS, Impacts::name))]
    pub impacts: Option<Impacts>,
    /// Coefficient of friction, 0 to 10 [default: 0.3].
    #[arg(long, value_parser = values::number, allow_hyphen_values = true)]
    pub mu: Option<f64>,
    /// Coefficient of restitution, 0 to 1: rebound speed over impact speed [default: 0].
    #[arg(long, value_name = "E", value_parser = values::number, allow_hyphen_values = true)]
    pub restitution: Option<f64>,
    /// Impact speed below which a contact does not bounce, m/s, 0 to 1000 [default: 2 |g| times the
    /// time step].
    #[arg(long, value_name = "M/S", value_parser = values::number, allow_hyphen_values = true)]
    pub rebound_speed: Option<f64>,
    /// Gravity, m/s², −1000 to 1000: one number (downwards) or the vector X,Y,Z [default: drop
    /// 9.81, floating 0].
    #[arg(long, value_name = "G|X,Y,Z", value_parser = values::gravity, allow_hyphen_values = true)]
    pub gravity: Option<Vector3<f64>>,
}

impl PhysicsArgs {
    /// Names of the flags that are set.
    pub fn given(&self) -> Vec<&'static str> {
        let flags = [
            ("dt", self.dt.is_some()),
            ("rotation", self.rotation.is_some()),
            ("integrator", self.integrator.is_some()),
            ("accuracy", self.accuracy.is_some()),
            ("impacts", self.impacts.is_some()),
            ("mu", self.mu.is_some()),
            ("restitution", self.restitution.is_some()),
            ("rebound-speed", self.rebound_speed.is_some()),
            ("gravity", self.gravity.is_some()),
        ];
        flags.into_iter().filter(|(_, given)| *given).map(|(name, _)| name).collect()
    }
}

/// Appearance of an animation, for `simulate` and `gif`.
#[derive(Debug, Args)]
pub struct AnimationArgs {
    /// Speed of the animation: 0.1 is ten times slower than real time [default: 1].
    #[arg(long, value_name = "FACTOR", value_parser = values::speed, allow_hyphen_values = true)]
    pub gif_speed: Option<f64>,
    /// Width and height of the animation, pixels [default: 800].
    #[arg(long, value_name = "PIXELS", value_parser = values::whole::<u16>(100, 2000), allow_hyphen_values = true)]
    pub gif_size: Option<u16>,
    /// Dark background.
    #[arg(long)]
    pub gif_dark: bool,
    /// Camera angles: degrees about the vertical, from x towards y, and degrees above the horizon,
    /// 0 to 90 [default: -32,20, or -62 along x, and higher for flat scenes and fixed shapes in
    /// the way].
    #[arg(long, value_name = "AZIMUTH,ELEVATION", value_parser = values::view, allow_hyphen_values = true)]
    pub camera: Option<View>,
}
