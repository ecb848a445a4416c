//! Shapes alone: where they touch, how far they are apart, how they sweep.

#[path = "../common/mod.rs"]
mod common;
mod contact;
mod pieces;
mod planes;
mod shapes;
mod sweep;
