//! Tests of joints with drives and limits, gears, driven bodies and complete mechanisms.

#![allow(clippy::disallowed_methods)]

mod assembly;
mod balls;
#[path = "../common/campaign.rs"]
mod campaign;
#[path = "../common/mod.rs"]
mod common;
mod driven;
mod gears;
mod gimbals;
mod joints;
mod laws_of_axes;
mod mechanisms;
mod sums;
