//! Shapes and where they touch: pure geometry, in metres. Nothing here knows a body's mass,
//! a solver or a world.
//!
//! A [`Piece`] is a convex [`Hull`] (a point, a segment or a polyhedron) rounded by a radius.
//! A shape that is not convex is several pieces. [`MassProperties`] are those of pieces of
//! uniform density, exactly; a [`Mesh`](mesh::Mesh) becomes a piece if it is closed and convex.
//!
//! Which pairs of pieces may touch, [`Sweep`] says from boxes around them; how far two pieces
//! are apart, [`separation()`]; where on their ways they first meet, [`first_overlap`]; at which points
//! and planes they touch, [`manifold()`].

pub mod advance;
mod axes;
mod bound;
mod closest;
pub mod hull;
pub mod manifold;
pub mod mass;
pub mod mesh;
mod near;
mod overlap;
pub mod pair;
pub mod piece;
mod segment;
pub mod separation;
pub mod sweep;
pub mod touch;
mod triangles;

pub use advance::{Advance, Moving, bulge, first_overlap, stays_clear, travel};
pub use bound::bound;
pub use hull::Hull;
pub(crate) use manifold::edges_across;
pub use manifold::manifold;
pub use mass::MassProperties;
pub use pair::{Hint, PairScratch, PlacedPiece};
pub use piece::Piece;
pub use segment::nearest_shares;
pub use separation::{Separation, overlap, separation};
pub use sweep::{Aabb, Sweep};
pub use touch::{CorePart, Feature, PieceSide, Touch};
