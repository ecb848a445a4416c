//! Checks of initial states: depth below the ground, overlaps, and errors of joints and gears.

use crate::contact::detection::CONTACT_BAND;
use crate::contact::{Candidates, Overlap};
use crate::error::Error;
use crate::joint::GEAR_AT_THE_START;
use crate::mechanics::State;
use crate::world::World;
use nalgebra::Vector3;

impl World {
    /// Checks initial states of all bodies: depths below the ground, overlaps, joints and gears.
    ///
    /// # Errors
    /// The first violation, which the first step would correct at high speed.
    pub fn check_start(&self, states: &[State]) -> Result<(), Error> {
        check(self, states, &[], true, &mut Candidates::new(), |_| true)
    }
}

/// Rejects `states` if a body selected by `asked` overlaps another one too deeply. If `touches` is
/// true, depths below the ground, joints and gears are checked too. `near` holds the last known
/// joint angles (rad), or is empty at first.
pub(super) fn check(
    world: &World,
    states: &[State],
    near: &[Vector3<f64>],
    touches: bool,
    candidates: &mut Candidates,
    asked: impl Fn(usize) -> bool,
) -> Result<(), Error> {
    if touches {
        if let Some(between) = world.touching_friction_axes() {
            return Err(Error::FrictionAxes { between });
        }
        if let Some(owner) = world.loose_friction_axis() {
            return Err(Error::LooseFrictionAxis { owner });
        }
        check_ground(world, states, &asked)?;
    }
    if let Some(Overlap { depth, allowed, between }) =
        candidates.overlap_at_start(world, states, &asked)
    {
        return Err(Error::Overlap { between, depth, allowed });
    }
    if let Some(between) = candidates.crowded() {
        return Err(Error::Crowded { between: between.into() });
    }
    if touches {
        let angles = world.angles_near(states, near);
        check_joints(world, states, &angles, &asked)?;
        check_gears(world, states, &angles, &asked)?;
    }
    Ok(())
}

/// Largest joint error, and largest excess over a joint limit, of an initial state (m and rad). The
/// first step corrects it, at the speed error/h.
pub const JOINT_AT_THE_START: f64 = 1e-6;

fn check_joints(
    world: &World,
    states: &[State],
    angles: &[Vector3<f64>],
    asked: impl Fn(usize) -> bool,
) -> Result<(), Error> {
    for (joint, of) in world.joints().iter().enumerate() {
        if !asked(of.body()) && !of.other().is_some_and(&asked) {
            continue;
        }
        let allowed = JOINT_AT_THE_START;
        // A NaN is an error too. `f64::max` would drop it.
        let fits = |place: f64, turn: f64| place <= allowed && turn <= allowed;
        let (place, turn) = of.error(states).unwrap_or((f64::NAN, f64::NAN));
        if !fits(place, turn) {
            return Err(Error::JointApart { joint, place, turn, allowed });
        }
        let beyond = of.beyond_limits(states, &angles[joint]);
        let (place, turn) = beyond.unwrap_or((f64::NAN, f64::NAN));
        if !fits(place, turn) {
            return Err(Error::JointBeyond { joint, place, turn, allowed });
        }
        if of.is_folded(states) {
            return Err(Error::Unsupported {
                what: "gimbal with parallel first and last axes at the start",
                why: "its first and last angles are not unique there; turn its middle axis",
            });
        }
    }
    Ok(())
}

fn check_gears(
    world: &World,
    states: &[State],
    angles: &[Vector3<f64>],
    asked: impl Fn(usize) -> bool,
) -> Result<(), Error> {
    for (gear, of) in world.gears().iter().enumerate() {
        let tied = of.axes().map(|axis| &world.joints()[axis.joint]);
        if !tied.iter().any(|joint| asked(joint.body()) || joint.other().is_some_and(&asked)) {
            continue;
        }
        let off = of.error(world.joints(), states, angles).abs();
        let fits = off <= GEAR_AT_THE_START;
        if !fits {
            return Err(Error::GearApart { gear, off, allowed: GEAR_AT_THE_START });
        }
    }
    Ok(())
}

fn check_ground(
    world: &World,
    states: &[State],
    asked: impl Fn(usize) -> bool,
) -> Result<(), Error> {
    let bodies = world.bodies().iter().zip(states).enumerate();
    for (index, (body, state)) in bodies.filter(|(index, _)| asked(*index)) {
        let allowed = CONTACT_BAND * body.reach();
        let depth = -world.heights(index, &state.pose()).fold(f64::INFINITY, f64::min);
        let is_above = depth <= allowed;
        if !is_above {
            return Err(Error::StartBelowGround { body: index, depth, allowed });
        }
    }
    Ok(())
}
