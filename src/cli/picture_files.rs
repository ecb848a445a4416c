//! The names of the pictures that a run leaves beside its trajectory.

/// A GIF and an animated PNG.
pub const ANIMATIONS: [&str; 2] = ["animation.gif", "animation.png"];
pub const PLOTS: [&str; 4] = ["plot.png", "plot.svg", "plot-energy.png", "plot-energy.svg"];
pub const VIEW: &str = "view.html";

/// All of them.
pub fn all() -> impl Iterator<Item = &'static str> {
    ANIMATIONS.into_iter().chain(PLOTS).chain([VIEW])
}
