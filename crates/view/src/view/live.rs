//! Parts of the page for a program that draws a moving scene itself.

use super::{DRAWER, DRAWER_LICENCE};
use crate::palette;

/// Style and scripts of the page's drawing.
#[derive(Debug)]
pub struct LiveParts {
    /// Style sheet with the palette.
    pub style: String,
    /// Scripts without a run: vectors, formatting, the class `Run`, colours, camera.
    pub base: String,
    /// Scripts that draw the global `runs`; the class `Stage` among them. They also need the globals
    /// `isPair`, `isCrowd`, `isPlaying`, `clock` and `tracked`.
    pub stage: String,
    /// three.js, and its licence.
    pub drawer: &'static str,
    /// Licence of three.js.
    pub drawer_licence: &'static str,
}

/// Parts of the page for a program that draws a moving scene itself.
#[must_use]
pub fn live_parts() -> LiveParts {
    let base = [
        include_str!("page/vectors.js"),
        include_str!("page/numbers.js"),
        include_str!("page/run.js"),
        include_str!("page/colours.js"),
        include_str!("page/camera.js"),
        include_str!("page/pace.js"),
        include_str!("page/graphics.js"),
    ];
    let stage = [
        include_str!("page/ground.js"),
        include_str!("page/trails.js"),
        include_str!("page/shapes.js"),
        include_str!("page/overlays.js"),
        include_str!("page/ambience.js"),
        include_str!("page/outline.js"),
        include_str!("page/solids.js"),
        include_str!("page/occlusion.js"),
        include_str!("page/light.js"),
        include_str!("page/floor.js"),
        include_str!("page/labels.js"),
        include_str!("page/forces.js"),
        include_str!("page/scenery.js"),
        include_str!("page/stage.js"),
    ];
    LiveParts {
        style: palette::style() + include_str!("page/style.css"),
        base: base.join("\n"),
        stage: stage.join("\n"),
        drawer: DRAWER,
        drawer_licence: DRAWER_LICENCE,
    }
}
