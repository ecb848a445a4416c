//! Tests of shapes: contact points, distances, sweeps and queries.

#![allow(clippy::disallowed_methods)]

#[path = "../common/campaign.rs"]
mod campaign;
#[path = "../common/mod.rs"]
mod common;
mod contact;
mod distances;
mod many_corners;
mod noisy_meshes;
mod pieces;
mod planes;
mod queried;
mod rays;
mod rays_in_worlds;
mod shapes;
mod smooth_pairs;
mod sweep;
