//! Bodies on surfaces of several pieces: tiles, bricks, plates in the ground, belts and terrains. A
//! body slides over flush joints as over one plane, and real steps, walls and edges stop it.

#![allow(clippy::disallowed_methods)]

#[path = "../common/campaign.rs"]
mod campaign;
#[path = "../common/mod.rs"]
mod common;
mod controls;
mod floors;
mod flush;
mod noise;
mod planted;
mod shapes;
mod sinking;
mod sizes;
mod sliding;
mod slots;
mod tumbling;
