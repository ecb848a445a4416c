//! Tests of joints with drives and limits, gears, driven bodies and complete mechanisms.

mod assembly;
mod balls;
mod driven;
mod gears;
mod gimbals;
mod joints;
mod mechanisms;
mod passive;
mod sums;
#[allow(dead_code)]
#[path = "../common/turning.rs"]
mod turning;
