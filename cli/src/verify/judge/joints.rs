//! Checks of joint and gear rows against their bodies.

use super::{ROUNDED, StepJudge, is_near};
use tumble_core::joint::{Axis, Drive, JointForce};
use tumble_core::mechanics::State;
use tumble_scene::output::tables::{GearTableRow, IntervalRows, JointRow};

impl StepJudge {
    /// Finds a joint whose row does not follow from states and forces. `next` has the states at
    /// the end of the step and the joint forces of the rows, or is `None` for the last state. Both
    /// computations use the same doubles, so only rounding errors may differ.
    ///
    /// Coordinates, rates and residuals are compared. Force and torque are inputs: a wrong one
    /// shows in the residual of the bodies' motion. Full turns of angles are counted on from the
    /// previous step.
    pub(super) fn another_joint(
        &self,
        step: &IntervalRows,
        next: Option<(&[State], &[JointForce])>,
    ) -> Option<String> {
        let joints = self.world.joints().iter().zip(&step.joints).enumerate();
        let held = self.world.held_back(&step.states, next.map_or(&[], |(_, forces)| forces));
        joints.into_iter().find_map(|(number, (joint, row))| {
            let at = joint.coordinates(&step.states)?;
            let angles = joint.counted(&at, &self.angles[number]);
            let force = match next {
                Some((_, forces)) => forces[number],
                None => JointForce::none(angles),
            };
            let next = next.map(|(next, _)| next);
            let found = JointRow::between([&self.world, &held], number, &step.states, next, &force);
            // Forces are input.
            let found = JointRow { force: row.force, torque: row.torque, ..found };
            let h = self.world.time_step();
            let reach = self.world.reach() + step.states[joint.body()].position.amax();
            let lost = ROUNDED * reach.max(1.0);
            let scales = [lost, lost, lost / h, lost / h];
            let vectors = found.vectors().into_iter().zip(row.vectors()).zip(scales);
            let mut numbers = vectors.flat_map(|((found, row), lost)| {
                let pairs = [0, 1, 2].map(|k| (found[k], row[k], lost));
                pairs.into_iter()
            });
            let is_other = |(found, row, lost): (f64, f64, f64)| !is_near(found, row, lost);
            let other = joint.counted(&at, &row.turns);
            let turned = (0..3).any(|k| !is_near(angles[k], other[k], lost));
            let (a, b) = (found.residual, row.residual);
            let parts = [(a.locked, b.locked, lost / h), (a.drive, b.drive, lost / h)];
            let turns_freely = *joint.angular() == [Axis::Free(Drive::NONE); 3];
            let what = if numbers.any(is_other) || turned {
                "does not match the places or motion of its bodies"
            } else if parts.into_iter().any(is_other) {
                "has a different residual"
            } else if turns_freely && row.torque.amax() > 0.0 {
                "has a torque, but turns freely"
            } else {
                return None;
            };
            Some(format!("its joint {number} {what}"))
        })
    }

    /// Finds a gear whose row does not follow from states and forces.
    pub(super) fn another_gear(
        &self,
        step: &IntervalRows,
        next: Option<(&[State], &[JointForce])>,
    ) -> Option<String> {
        let gears = self.world.gears().iter().zip(&step.gears).enumerate();
        let held = self.world.held_back(&step.states, next.map_or(&[], |(_, forces)| forces));
        let at_end: Vec<_> = self.angles.iter().map(|angles| JointForce::none(*angles)).collect();
        gears.into_iter().find_map(|(number, (gear, row))| {
            let (next, joints) = match next {
                Some((next, joints)) => (Some(next), joints),
                None => (None, &at_end[..]),
            };
            let worlds = [&self.world, &*held];
            let force = step.gear_force(&self.world, number);
            let found = GearTableRow::between(worlds, number, &step.states, next, joints, force);
            let h = self.world.time_step();
            let reach = gear
                .axes()
                .map(|axis| step.states[self.world.joints()[axis.joint].body()].position.amax());
            let lost = ROUNDED * (self.world.reach() + reach[0].max(reach[1])).max(1.0);
            let is_other = (0..2).any(|k| !is_near(found.coordinates[k], row.coordinates[k], lost))
                || !is_near(found.residual, row.residual, lost * (1.0 + gear.ratio().abs()) / h)
                || next.is_none() && row.force != 0.0;
            is_other.then(|| format!("its gear {number} does not match its joints"))
        })
    }
}
