//! Arguments shared by several commands.

use crate::values;
use clap::Args;
use tumble_view::animation::View;

/// Appearance of an animation, for `simulate` and `gif`.
#[derive(Debug, Clone, Args)]
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
