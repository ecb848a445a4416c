//! Pictures of rigid-body motion: converts a film to bytes.
//!
//! A [`Film`] is a world with the looks of its objects and the rows of a run: states, and the forces
//! between them.
//!
//! - [`animation`] draws a film as a GIF.
//! - [`plot`] draws its curves over time.
//! - [`view`] writes an HTML page that plays one or two films.
//! - [`page`] and [`chart`] are building blocks of other pages.
//! - [`triangles()`] makes triangle meshes for other viewers.
//!
//! Nothing in this crate accesses files. Output is deterministic, byte for byte.

#![forbid(unsafe_code)]

pub mod animation;
pub mod chart;
mod film;
mod font;
mod forces;
mod markup;
pub mod page;
mod palette;
pub mod plot;
mod png;
#[cfg(test)]
#[path = "tests/samples.rs"]
mod samples;
mod shape;
mod skeleton;
mod triangles;
pub mod view;

/// Mark in every picture and video, within its first or last kilobyte. A file with it may be replaced.
pub const MARK: &str = "Written by tumble";

pub use film::{Fact, Film, Object, Takeover, is_loaded};
pub use shape::{Mesh, Shape};
pub use triangles::{FilmTriangles, Triangles, triangles};
