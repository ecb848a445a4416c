//! Pictures of rigid-body motion: converts a film to bytes.
//!
//! A [`Film`] is plain data: bodies with shapes, their poses in each frame, and the contact forces
//! between frames.
//!
//! - [`animation`] draws a film as a GIF.
//! - [`plot`] draws its curves over time.
//! - [`view`] writes an HTML page that plays one or two films.
//! - [`plan`] writes the page of a plan.
//! - [`triangles()`] makes triangle meshes for other viewers.
//!
//! Nothing in this crate accesses files. Output is deterministic, byte for byte.

#![forbid(unsafe_code)]

pub mod animation;
mod chart;
mod film;
mod font;
mod forces;
mod markup;
mod page;
mod palette;
pub mod plan;
pub mod plot;
#[cfg(test)]
mod samples;
mod shape;
mod skeleton;
mod triangles;
pub mod view;

pub use film::{
    Fact, Film, FilmBody, FilmContact, FilmFixed, FilmFrame, FilmGround, FilmJoint, FilmLoad,
    FilmPartner, FilmPose, FilmTie, Status, Takeover,
};
pub use shape::{FilmHull, FilmMesh, FilmPiece};
pub use triangles::{FilmTriangles, Triangles, triangles};
