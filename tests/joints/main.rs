//! Joints, their drives and limits, gears, driven bodies, whole mechanisms.

mod assembly;
mod balls;
mod driven;
mod gears;
mod gimbals;
mod joints;
mod mechanisms;
mod sums;
