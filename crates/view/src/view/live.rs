//! Parts of the page for a program that draws a moving scene itself.

use super::scripts::{BASE, STAGE, joined};
use super::{DRAWER, DRAWER_LICENCE};
use crate::palette;

/// Style and scripts of the page's drawing.
#[derive(Debug)]
pub struct LiveParts {
    /// Style sheet with the palette.
    pub style: String,
    /// Scripts without a run: vectors, formatting, the class `Run`, colours, camera, speed and toggles.
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
pub fn live_parts() -> LiveParts {
    LiveParts {
        style: palette::style() + include_str!("page/style.css"),
        base: joined(&BASE),
        stage: joined(&STAGE),
        drawer: DRAWER,
        drawer_licence: DRAWER_LICENCE,
    }
}
