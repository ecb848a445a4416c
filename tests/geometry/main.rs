//! Tests of shapes: contact points, distances and sweeps.

#[path = "../common/mod.rs"]
mod common;
mod contact;
mod pieces;
mod planes;
mod shapes;
mod sweep;
