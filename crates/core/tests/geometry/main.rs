//! Tests of shapes: contact points, distances, sweeps and queries.

#[path = "../common/mod.rs"]
mod common;
mod contact;
mod distances;
mod many_corners;
mod pieces;
mod planes;
mod queried;
mod rays;
mod rays_in_worlds;
mod shapes;
mod smooth_pairs;
mod sweep;
