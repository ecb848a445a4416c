//! The names of the pictures that a run leaves beside its trajectory.

pub const ANIMATION: &str = "animation.gif";
pub const PLOTS: [&str; 4] = ["plot.png", "plot.svg", "plot-energy.png", "plot-energy.svg"];
pub const VIEW: &str = "view.html";

/// All of them.
pub fn all() -> impl Iterator<Item = &'static str> {
    [ANIMATION].into_iter().chain(PLOTS).chain([VIEW])
}
