//! Arguments shared by several commands.

use crate::values;
use clap::{Args, ValueEnum};
use nalgebra::Vector3;
use std::path::PathBuf;
use tumble_core::mechanics::Rotation;
use tumble_core::world::{Impacts, Integrator};
use tumble_scene::settings::RobotSettings;
use tumble_view::animation::View;

/// Update equation of the rotation, see [`Rotation`].
#[derive(Debug, Clone, Copy, ValueEnum)]
pub enum RotationName {
    /// P⁺(ω⁺) = P⁻(ω) + h τ: conserves angular momentum to rounding, and energy without drift.
    Momentum,
    /// I (ω⁺ − ω) + h ω⁺ × I ω⁺ = h τ, the tutorial's: conserves both to first order in h.
    Tutorial,
}

impl From<RotationName> for Rotation {
    fn from(name: RotationName) -> Self {
        match name {
            RotationName::Momentum => Self::Momentum,
            RotationName::Tutorial => Self::Tutorial,
        }
    }
}

/// Meaning of the velocities of a run, see [`Integrator`].
#[derive(Debug, Clone, Copy, ValueEnum)]
pub enum IntegratorName {
    /// Velocities of the ends of steps, the tutorial's: errors of first order in the time step.
    Euler,
    /// Velocities of the middles of steps: errors of second order in smooth motion.
    Leapfrog,
}

impl From<IntegratorName> for Integrator {
    fn from(name: IntegratorName) -> Self {
        match name {
            IntegratorName::Euler => Self::Euler,
            IntegratorName::Leapfrog => Self::Leapfrog,
        }
    }
}

/// When impacts happen, see [`Impacts`].
#[derive(Debug, Clone, Copy, ValueEnum)]
pub enum ImpactsName {
    /// Within the step in which they happen.
    Stepped,
    /// At their time, where a substep begins.
    Located,
}

impl From<ImpactsName> for Impacts {
    fn from(name: ImpactsName) -> Self {
        match name {
            ImpactsName::Stepped => Self::Stepped,
            ImpactsName::Located => Self::Located,
        }
    }
}

/// Settings for the file of a robot that is simulated alone.
#[derive(Debug, Args)]
pub struct RobotArgs {
    /// Folder for `package://name/rest` in a robot file: DIR/name/rest is read [default: the
    /// nearest folder that has it, from the robot file upwards].
    #[arg(long, value_name = "DIR")]
    packages: Option<PathBuf>,
    /// Part of a robot file to ignore: `tag` or `name` of elements, `tag:name` of one element, or
    /// `@attribute` of all.
    ///
    /// Can be repeated.
    #[arg(long, value_name = "WHAT")]
    leave_out: Vec<String>,
    /// Treat contacts of an MJCF file with torsional and rolling friction (condim 4 and 6) as
    /// points with sliding friction only.
    #[arg(long)]
    point_contacts: bool,
}

impl RobotArgs {
    /// Settings of the flags.
    pub fn settings(&self) -> RobotSettings {
        RobotSettings {
            packages: self.packages.clone(),
            leave_out: self.leave_out.clone(),
            point_contacts: self.point_contacts,
        }
    }
}

/// Constants of the model.
#[derive(Debug, Args)]
pub struct PhysicsArgs {
    /// Time step, s, 1e-6 to 0.1 [default: drop 0.002, floating 0.001].
    #[arg(long, value_name = "S", value_parser = values::number, allow_hyphen_values = true)]
    pub dt: Option<f64>,
    /// Update equation of the rotation [default: tutorial; in scenario files momentum].
    #[arg(long, value_enum)]
    pub rotation: Option<RotationName>,
    /// Meaning of the velocities of a run [default: euler; in scenario files leapfrog].
    #[arg(long, value_enum)]
    pub integrator: Option<IntegratorName>,
    /// Error that the time step adds to the position of a body in a second, m, 1e-10 to 1: steps are
    /// taken in substeps that keep it, and that end at impacts.
    #[arg(long, value_name = "M", value_parser = values::number, allow_hyphen_values = true)]
    pub accuracy: Option<f64>,
    /// When impacts happen [default: stepped; with an accuracy located].
    #[arg(long, value_enum)]
    pub impacts: Option<ImpactsName>,
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
    #[arg(long, value_name = "PIXELS", value_parser = values::pixels, allow_hyphen_values = true)]
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
