//! Shapes and where they touch: pure geometry, in metres. Nothing here knows a body's mass,
//! a solver or a world.
//!
//! A [`Piece`] is a convex [`Hull`] (a point, a segment or a polyhedron) rounded by a radius.
//! A shape that is not convex is several pieces. [`MassProperties`] are those of pieces of
//! uniform density, exactly; a [`Mesh`](mesh::Mesh) becomes a piece if it is closed and convex.

pub mod hull;
pub mod mass;
pub mod mesh;
pub mod piece;
mod triangles;

pub use hull::Hull;
pub use mass::MassProperties;
pub use piece::Piece;
