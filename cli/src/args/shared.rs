//! Arguments shared by several commands.

use crate::values::{self, LoadKnot};
use clap::{Args, ValueEnum};
use nalgebra::Vector3;
use std::path::PathBuf;
use tumble_core::mechanics::Rotation;
use tumble_core::world::Plane;
use tumble_scene::choices::Inertia;
use tumble_scene::settings::RobotSettings;
use tumble_view::animation::View;

/// A [`Rotation`] as a flag names it.
#[derive(Debug, Clone, Copy, ValueEnum)]
pub enum RotationName {
    /// P⁺(ω⁺) = P⁻(ω) + h τ: keeps angular momentum to rounding and energy without a trend.
    Momentum,
    /// I (ω⁺ − ω) + h ω⁺ × I ω⁺ = h τ, the tutorial's: keeps both to first order in h.
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

/// How a robot's file is read that is simulated alone.
#[derive(Debug, Args)]
pub struct RobotArgs {
    /// Of a robot's file: the folder in which `package://name/rest` is `name/rest` [default: the first folder with it, from that
    /// of the file upwards].
    #[arg(long, value_name = "DIR")]
    packages: Option<PathBuf>,
    /// Of a robot's file: what of it is as if it were not there, `tag` or `name` of elements, `tag:name` of one, `@attribute` of all;
    /// may be given more than once.
    #[arg(long, value_name = "WHAT")]
    leave_out: Vec<String>,
    /// Of an MJCF file: contacts that resist turning and rolling (condim 4 and 6) rub alone.
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

/// What residuals depend on: the constants of the model, and the load.
#[derive(Debug, Args)]
pub struct PhysicsArgs {
    /// Time step, s, 1e-6 to 0.1 [default: drop 0.002, floating 0.001].
    #[arg(long, value_name = "S", value_parser = values::number, allow_hyphen_values = true)]
    pub dt: Option<f64>,
    /// By which equation a step turns its bodies [default: tutorial, in scenario files momentum].
    #[arg(long, value_enum)]
    pub rotation: Option<RotationName>,
    /// Coefficient of friction, 0 to 10 [default: 0.3].
    #[arg(long, value_parser = values::number, allow_hyphen_values = true)]
    pub mu: Option<f64>,
    /// Coefficient of restitution, 0 to 1: how fast a contact leaves that arrives [default: 0].
    #[arg(long, value_name = "E", value_parser = values::number, allow_hyphen_values = true)]
    pub restitution: Option<f64>,
    /// The speed below which a contact that arrives does not bounce, m/s, 0 to 1000 [default: 2 |g| times the time step].
    #[arg(long, value_name = "M/S", value_parser = values::number, allow_hyphen_values = true)]
    pub rebound_speed: Option<f64>,
    /// Mass, kg, 1e-9 to 1e9 [default: 10].
    #[arg(long, value_name = "KG", value_parser = values::number, allow_hyphen_values = true)]
    pub mass: Option<f64>,
    /// Inertia, kg m², body frame: one number (times the unit matrix), three (diagonal),
    /// nine (the matrix by rows), or `solid`, that of a box of equal density. A principal moment
    /// is from 1e-6 to 1e6 times mass × length², the length a corner's largest distance from
    /// its axis [default: 0.01].
    #[arg(long, value_name = "I", value_parser = values::inertia, allow_hyphen_values = true)]
    pub inertia: Option<Inertia>,
    /// Sides of the box, m, 2e-6 to 2e4: one number (a cube) or three, along the body's axes
    /// [default: 2].
    #[arg(long = "box", value_name = "L", value_parser = values::sides, allow_hyphen_values = true)]
    pub sides: Option<Vector3<f64>>,
    /// The ground: its slope in degrees, falling towards +x, or its normal and, if it does not
    /// pass through the origin, its distance from there along the normal, m [default: 0].
    #[arg(long, value_name = "DEGREES|NX,NY,NZ[,D]", value_parser = values::plane, allow_hyphen_values = true)]
    pub plane: Option<Plane>,
    /// An external force, N, −1e9 to 1e9, world: constant, or, given once for each knot as T:X,Y,Z, linear
    /// between the times T in s [default: none].
    #[arg(long, value_name = "[T:]X,Y,Z", value_parser = values::load_knot, allow_hyphen_values = true)]
    pub force: Vec<LoadKnot>,
    /// An external torque, N m, −1e9 to 1e9, body frame; as --force [default: none].
    #[arg(long, value_name = "[T:]X,Y,Z", value_parser = values::load_knot, allow_hyphen_values = true)]
    pub torque: Vec<LoadKnot>,
    /// Where the external force acts, m, −1e4 to 1e4, body frame, from the centre of mass
    /// [default: 0,0,0].
    #[arg(long, value_name = "X,Y,Z", value_parser = values::vector, allow_hyphen_values = true)]
    pub force_at: Option<Vector3<f64>>,
    /// Gravity, m/s², −1000 to 1000: one number (downwards) or the vector X,Y,Z [default: drop
    /// 9.81, floating 0].
    #[arg(long, value_name = "G", value_parser = values::gravity, allow_hyphen_values = true)]
    pub gravity: Option<Vector3<f64>>,
}

impl PhysicsArgs {
    /// Names of the flags that are set.
    pub fn given(&self) -> Vec<&'static str> {
        let flags = [
            ("dt", self.dt.is_some()),
            ("rotation", self.rotation.is_some()),
            ("mu", self.mu.is_some()),
            ("restitution", self.restitution.is_some()),
            ("rebound-speed", self.rebound_speed.is_some()),
            ("mass", self.mass.is_some()),
            ("inertia", self.inertia.is_some()),
            ("box", self.sides.is_some()),
            ("plane", self.plane.is_some()),
            ("force", !self.force.is_empty()),
            ("torque", !self.torque.is_empty()),
            ("force-at", self.force_at.is_some()),
            ("gravity", self.gravity.is_some()),
        ];
        flags.into_iter().filter(|(_, given)| *given).map(|(name, _)| name).collect()
    }
}

/// How an animation looks, for `simulate` and `gif`.
#[derive(Debug, Args)]
pub struct AnimationArgs {
    /// Speed of the animation: 0.1 is ten times slower than real [default: 1].
    #[arg(long, value_name = "FACTOR", value_parser = values::speed, allow_hyphen_values = true)]
    pub gif_speed: Option<f64>,
    /// Width and height of the animation, pixels [default: 800].
    #[arg(long, value_name = "PIXELS", value_parser = values::pixels, allow_hyphen_values = true)]
    pub gif_size: Option<u16>,
    /// Where the animation is seen from: degrees about the vertical, from x towards y, and
    /// degrees above the horizon, 0 to 90 [default: -32,20, or higher where what stands still hides what moves].
    #[arg(long, value_name = "AZIMUTH,ELEVATION", value_parser = values::view, allow_hyphen_values = true)]
    pub camera: Option<View>,
}
