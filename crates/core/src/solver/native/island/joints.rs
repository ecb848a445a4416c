//! Joints of an island as couplings: one for the anchor and one for the rotation.
//!
//! A coupling has three rows. For each row k the joint supplies
//!
//! - its motion u_k as a function of the new velocities, zero for a locked axis that holds,
//! - its graph of impulse against speed: locked, or the sum of the drive's forces,
//! - its response, the speed caused by a unit impulse, which scales the row.
//!
//! A coupling whose axes are all free without drives is left out. Couplings of joints follow the
//! contacts in the lists of the island, in the order in which they are added.
//!
//! Equation numbers refer to `docs/joints.md`.

use super::{CouplingKind, CouplingLink, Island, Other, Source};
use crate::contact::torque_map_of;
use crate::joint::{AxisStart, Coordinates, Joint, JointForce, Turn, TurnKind};
use crate::solver::native::coupling::{Coupling, Lever};
use crate::solver::native::law::{AxesLaw, CouplingLaw};
use crate::step::{Step, StepSolution};
use nalgebra::Vector3;

/// Couplings and initial coordinates of a joint of the island.
#[derive(Debug, Clone, Copy)]
pub(crate) struct JointPlace {
    /// Index of the joint in the world.
    pub(crate) joint: usize,
    /// Index of the coupling of the anchor, if it has one.
    pub(crate) place: Option<usize>,
    /// Index of the coupling of the rotation, if it has one.
    pub(crate) turn: Option<usize>,
    /// Length scale ℓ of the rotation (J2) (m).
    pub(crate) length: f64,
    /// True for a joint between two bodies.
    pub(super) is_of_two: bool,
    /// Coordinates of the linear axes at the start of the step (m).
    pub(crate) along: Vector3<f64>,
    /// Angles at the start of the step, with full turns (rad).
    pub(crate) angles: Vector3<f64>,
}

impl Island {
    /// Adds joint `index` of the world. `place` maps a body of the world to its index in the
    /// island.
    pub(crate) fn admit_joint(
        &mut self,
        step: &Step<'_>,
        index: usize,
        place: impl Fn(usize) -> usize,
    ) {
        let joint = &step.world.joints()[index];
        let Some(at) = joint.coordinates(step.states) else { return };
        let before = step.previous.joints.get(index).map_or(Vector3::zeros(), |last| last.angles);
        let angles = joint.counted(&at, &before);
        let length = joint.length(step.world.bodies());
        let sides = (place(joint.body()), joint.other().map(place));
        let [along, about] = joint.starts(step.states, &at, &angles, &step.world.step_map());
        let place = joint.holds_place().then(|| self.admit_place(joint, &along, sides));
        let turn = (joint.turning() != TurnKind::Free)
            .then(|| self.admit_turn(joint, (&at, &angles), (&about, length), sides));
        let joint = index;
        let is_of_two = sides.1.is_some();
        let along = at.place;
        self.joints.push(JointPlace { joint, place, turn, length, is_of_two, along, angles });
    }

    /// Adds the coupling of the anchor, with rows along the axes of B's joint frame. Returns its
    /// index. `starts` are the linear axes at the start, `a` and `b` indices in the island.
    fn admit_place(
        &mut self,
        joint: &Joint,
        starts: &[AxisStart; 3],
        (a, b): (usize, Option<usize>),
    ) -> usize {
        let [of_a, of_b] = joint.frames();
        let member = &self.members[a];
        let arm = member.rotation * of_a.anchor;
        let torque_map = torque_map_of(&of_a.anchor, &member.rotation);
        let lever = Lever { centre: of_a.anchor, arm, radius: 0.0, torque_map };
        let mut frame = of_b.rotation();
        let mut response = Vector3::zeros();
        let b = b.map(|index| {
            let other = &self.members[index];
            let arm = member.position + arm - other.position;
            frame = other.rotation * frame;
            let torque_map = torque_map_of(&other.rotation.tr_mul(&arm), &other.rotation);
            response += other.response(&(torque_map * frame), true);
            Other { index, torque_map, arm }
        });
        response += member.response(&(torque_map * frame), true);
        let (h, unit) = (self.time_step, self.mass);
        let graph = |k: usize| joint.linear()[k].free_graph(&starts[k], h, 1.0, unit);
        let axes = AxesLaw::new(&mut self.setting.graphs, true, graph);
        let offset = Vector3::from_fn(|k, _| joint.linear()[k].offset(starts[k].coordinate, h));
        let source = Source::new(joint.active_axes()[0], joint.moves());
        self.links.push(CouplingLink { a, kind: CouplingKind::Point, b, source });
        let law = CouplingLaw::Axes(axes);
        self.setting.admit(Coupling::from_place(lever, frame, offset, &response, law));
        self.links.len() - 1
    }

    /// Adds the coupling of the rotation with the rows (J4), and returns its index. `at` are the
    /// coordinates and angles at the start, `starts` the angular axes, `a` and `b` indices in the
    /// island.
    fn admit_turn(
        &mut self,
        joint: &Joint,
        at: (&Coordinates, &Vector3<f64>),
        (starts, length): (&[AxisStart; 3], f64),
        (a, b): (usize, Option<usize>),
    ) -> usize {
        let h = self.time_step;
        let member = &self.members[a];
        let map = member.map();
        let other = b.map(|index| &self.members[index].old().spin);
        let turn = Turn::new(joint, at.0, at.1, &map, length).with_stop(&member.old().spin, other);
        let torque_map = turn.torque_map();
        let mut response = member.response(&torque_map, false);
        let b = b.map(|index| {
            let other = &self.members[index];
            let torque_map = other.rotation.tr_mul(&(member.rotation * torque_map));
            response += other.response(&torque_map, false);
            Other { index, torque_map, arm: Vector3::zeros() }
        });
        // The row of an idle axis may have no response. It takes the scale of z.
        for k in (0..2).filter(|k| joint.angular()[*k].is_idle()) {
            response[k] = response[2];
        }
        let (unit, acting) = (self.mass, joint.acting_axes());
        let graph = |k: usize| acting[k].free_graph(&starts[k], h, length, unit);
        let axes = AxesLaw::new(&mut self.setting.graphs, false, graph);
        self.turns.push(turn);
        let source = Source::new(joint.active_axes()[1], joint.moves());
        let kind = CouplingKind::Turn(self.turns.len() - 1);
        self.links.push(CouplingLink { a, kind, b, source });
        self.setting.admit(Coupling::from_turn(torque_map, &response, CouplingLaw::Axes(axes)));
        self.links.len() - 1
    }

    /// Impulses p̂ of the couplings of all joints from the joint `forces` of an earlier step (m/s).
    ///
    /// `forces` has one entry per joint of the world, in order.
    pub(crate) fn joint_impulses<'a>(
        &'a self,
        forces: &'a [JointForce],
    ) -> impl Iterator<Item = Vector3<f64>> + 'a {
        let to_impulse = self.time_step / self.mass;
        self.joints.iter().flat_map(move |at| {
            let before = forces.get(at.joint);
            let force = before.map_or(Vector3::zeros(), |before| before.force);
            let torque = before.map_or(Vector3::zeros(), |before| before.torque);
            let along = at.place.map(|k| self.setting.couplings[k].rows.frame * force * to_impulse);
            let about = at.turn.map(|_| torque * (to_impulse / at.length));
            along.into_iter().chain(about)
        })
    }

    /// Writes the forces of the joints from the impulses of all couplings, those of the last step if it
    /// `keeps` them. `solution` has the final states.
    pub(crate) fn write_joints(
        &self,
        step: &Step<'_>,
        impulses: &[Vector3<f64>],
        keeps: bool,
        solution: &mut StepSolution,
    ) {
        let to_force = self.mass / self.time_step;
        for at in &self.joints {
            let of = &step.world.joints()[at.joint];
            // The angles of a free rotation are not counted.
            let end = match at.turn {
                Some(_) => of.coordinates(&solution.states),
                None => None,
            };
            let end = end.map_or(at.angles, |end| of.counted(&end, &at.angles));
            let mut force = JointForce::none(end);
            let known = step.previous.joints.get(at.joint).filter(|_| keeps);
            if let Some(k) = at.place {
                let frame = &self.setting.couplings[k].rows.frame;
                let made = || frame.tr_mul(&impulses[k]) * to_force;
                force.force = known.map_or_else(made, |known| known.force);
            }
            if let Some(k) = at.turn {
                let made = || impulses[k] * (to_force * at.length);
                force.torque = known.map_or_else(made, |known| known.torque);
            }
            if let Some(of_joint) = solution.joints.get_mut(at.joint) {
                *of_joint = force;
            }
        }
    }
}
