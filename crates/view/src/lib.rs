//! Motions of rigid bodies in contact as pictures: a film in, bytes out.
//!
//! A [`Film`] is plain data: bodies and their shapes, where they are in each frame, and the
//! contact forces between two frames. [`animation`] makes a GIF or an animated PNG of it, [`plot`] curves over time, [`view`] a
//! page that plays one film or two. [`plan`] makes a page of a plan, and [`page`] has the parts of pages. Nothing here
//! reads or writes a file, and the same input gives the same bytes.

#![forbid(unsafe_code)]

pub mod animation;
mod chart;
mod film;
mod font;
mod forces;
mod markup;
pub mod page;
pub mod plan;
pub mod plot;
#[cfg(test)]
mod samples;
mod shape;
pub mod view;

pub use film::{
    Fact, Film, FilmBody, FilmContact, FilmFixed, FilmFrame, FilmGround, FilmJoint, FilmLoad,
    FilmPartner, FilmPlace, FilmPose, FilmTie, Status,
};
pub use shape::{FilmHull, FilmMesh, FilmPiece};
