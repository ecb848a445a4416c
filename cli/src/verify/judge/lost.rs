//! Rounding errors of a recomputed step.

use super::{JudgedStep, ROUNDED, StepJudge};
use tumble_core::contact::{Contact, ContactLoad, rounding};
use tumble_core::joint::{Gear, GearAxis, Joint, JointForce};
use tumble_core::mechanics::State;
use tumble_scene::output::tables::ContactRow;

impl StepJudge {
    /// Rounding error of a residual, m/s: that of the step itself (eq. 22), plus the one of contacts
    /// rebuilt from tables. A contact's plane is rebuilt from a gap, and a gap computed from the
    /// plane, which adds two rounding errors of a gap (eq. 21).
    pub(super) fn lost(&self, contacts: &[Contact], states: &[State], next: &[State]) -> f64 {
        let lost = rounding::residual(&self.world, states, next);
        let of_gaps = contacts.iter().map(|contact| {
            let position = &states[contact.key.body].position;
            let offset = contact.features.offset;
            rounding::gap(&contact.normal(), position, offset, &contact.arm)
        });
        let of_gap = of_gaps.fold(0.0, f64::max);
        (lost + 2.0 * of_gap / self.world.time_step()).min(rounding::largest(&self.world))
    }

    /// Rounding error of a residual with large forces, m/s. A force has an error of 16 ε of itself.
    /// The arm of its torque has an error of 16 ε of the coordinates whose difference it is:
    ///
    /// ```text
    /// δu ≤ h Σ |f| (16 ε (1/m + ‖I⁻¹‖ (|r| + ℓ) ℓ) + ‖I⁻¹‖ ℓ |δx|)
    /// ```
    ///
    /// The sum is over both bodies of each contact and joint. A torque counts as a force at the
    /// joint's length. δx is the distance of a touching point from that of its row, above rounding where
    /// the end of a cylinder lies nearly flat. Two computations of one residual may differ by this much;
    /// it never makes a step exact.
    pub(super) fn lost_of_forces(&self, judged: &JudgedStep<'_>) -> f64 {
        let JudgedStep { contacts, loads, joints, gears, step, .. } = judged;
        let (rows, states) = (&*step.contacts, &step.states);
        let gives = self.world.bodies().iter().zip(states).map(|(body, state)| {
            let reach = body.reach();
            let turning = body.inertia_inverse().norm() * (state.position.norm() + reach) * reach;
            1.0 / body.mass() + turning
        });
        let gives: Vec<_> = gives.collect();
        let give = |index: usize| gives[index];
        let of_one = |((contact, row), load): ((&Contact, &ContactRow), &ContactLoad)| {
            let moved = (states[contact.key.body].position + contact.arm - row.point).norm();
            let turns = |index: usize| {
                let body = &self.world.bodies()[index];
                body.inertia_inverse().norm() * body.reach() * moved
            };
            load.force.norm()
                * contact
                    .key
                    .bodies()
                    .map(|index| ROUNDED * give(index) + turns(index))
                    .sum::<f64>()
        };
        let of_joint = |(joint, force): (&Joint, &JointForce)| {
            let length = joint.length(self.world.bodies());
            let size = force.force.norm() + force.torque.norm() / length;
            size * [Some(joint.body()), joint.other()].into_iter().flatten().map(give).sum::<f64>()
        };
        let of_gear = |(gear, force): (&Gear, &f64)| {
            let length = gear.length(self.world.joints(), self.world.bodies());
            let sizes = [force.abs() / length, (gear.ratio() * force).abs() / length];
            let of = |(at, size): (&GearAxis, f64)| {
                let joint = &self.world.joints()[at.joint];
                let bodies = [Some(joint.body()), joint.other()].into_iter().flatten();
                size * bodies.map(give).sum::<f64>()
            };
            gear.axes().iter().zip(sizes).map(of).sum::<f64>()
        };
        let of_contacts = contacts.iter().zip(rows).zip(loads).map(of_one).sum::<f64>();
        let of_joints = self.world.joints().iter().zip(joints).map(of_joint).sum::<f64>();
        let of_gears = self.world.gears().iter().zip(gears).map(of_gear).sum::<f64>();
        self.world.time_step() * (of_contacts + ROUNDED * (of_joints + of_gears))
    }
}
