//! Shapes and the contact points between them: pure geometry in metres, without masses, solvers or
//! worlds.
//!
//! A [`Piece`] is a convex [`Hull`] (a point, a segment or a polyhedron) rounded by a radius, or a
//! [`Smooth`] shape with an inscribed hull. A non-convex shape consists of several pieces. [`MassProperties`] holds the exact moments of
//! pieces of uniform density. A closed and convex [`Mesh`](mesh::Mesh) can become a piece.
//!
//! - [`Sweep`] is the broad phase: it finds the pairs of pieces whose boxes overlap.
//! - [`signed_distance`] returns the signed distance of two pieces.
//! - [`closest_points()`] returns the points between which the distance is measured.
//! - [`RayCaster`] intersects a ray with a piece.
//! - [`first_overlap`] returns the time of impact of two moving pieces.
//! - [`manifold()`] returns their contact points and planes.

pub mod advance;
mod axes;
mod candidate_features;
mod closest_features;
mod closest_points;
mod contact_point;
mod distance_lower_bound;
mod edge_axes;
mod ellipsoid;
mod facet;
mod features;
mod gjk;
mod hint;
pub mod hull;
pub mod manifold;
mod manifold_pair;
pub mod mass;
pub mod mesh;
mod overlap;
pub mod pair;
pub mod piece;
mod planar;
mod polygons;
mod portal;
mod ray;
mod scratch;
mod segment;
mod separating_axis;
pub mod separation;
pub mod smooth;
mod smooth_axis;
mod smooth_manifold;
mod smooth_side;
mod support;
mod surface;
pub mod sweep;
pub mod terrain;
pub mod touch;
mod tree;
mod triangles;

pub use advance::{Advance, Moving, bulge, first_overlap, stays_clear, travel};
pub use closest_points::{ClosestPoints, closest_points};
pub use contact_point::ContactPoint;
pub use distance_lower_bound::distance_lower_bound;
pub use ellipsoid::Ellipsoid;
pub use features::{CorePart, Feature, PieceSide};
pub use hint::Hint;
pub use hull::Hull;
pub use manifold::manifold;
pub(crate) use manifold::{edges_across, flat_faces, manifold_across};
pub use mass::MassProperties;
pub use pair::PlacedPiece;
pub use piece::Piece;
pub use ray::{RayCaster, RayEntry};
pub use scratch::PairScratch;
pub(crate) use segment::closest_on_segment;
pub use segment::closest_segment_parameters;
pub use separation::{Separation, overlap, signed_distance};
pub use smooth::Smooth;
pub use sweep::{Aabb, Sweep};
pub use terrain::Terrain;
pub use touch::ManifoldPoint;
pub(crate) use tree::Tree;
