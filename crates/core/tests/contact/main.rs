//! Tests of contacts and their laws: pairs, round features, planes, fast bodies, restitution.

#![allow(clippy::disallowed_methods)]

mod adhesion;
mod apart;
#[path = "../common/mod.rs"]
mod common;
mod curved;
mod curved_common;
mod curved_departures;
mod elastic_symmetry;
mod fast;
mod friction_axes;
mod groups;
mod no_ground;
mod pairs;
mod posed_moments;
mod restitution;
mod rounded_points;
mod smooth_balls;
mod smooth_pairs;
mod smooth_shapes;
mod static_friction;
mod terrain;
#[path = "../common/toss.rs"]
mod toss;
mod turning_friction;
mod turning_surfaces;
mod whose_plane;
mod wild_steps;
