//! Poses of the pieces, at rest in a state or on their trajectories between two states.

use super::{Neighbours, has_pairs, is_still};
use crate::contact::memory::Memory;
use crate::mechanics::{Pose, State, Trajectory};
use crate::world::World;

impl Neighbours {
    /// Places the pieces at `states`. Returns false if only the ground can be touched, or if there
    /// is not one state per body.
    pub(super) fn stand(&mut self, world: &World, states: &[State]) -> bool {
        if !is_of(world, states) {
            return false;
        }
        let listed = self.lists(world);
        if listed && self.are_apart(world) {
            return false;
        }
        if listed && self.memory.end == states {
            return true;
        }
        self.set_end(states);
        self.memory.from.clear();
        if !listed {
            self.list(world);
        }
        self.begin.clone_from(&self.poses);
        self.trajectories.clear();
        self.trajectories.resize(states.len(), Trajectory::STILL);
        self.fit_boxes(world, true);
        true
    }

    /// Places the pieces at `next`, on their trajectories from `states`. Returns false like
    /// [`Self::stand`].
    pub(super) fn place(&mut self, world: &World, states: &[State], next: &[State]) -> bool {
        if !is_of(world, states) || next.len() != states.len() {
            return false;
        }
        let listed = self.lists(world);
        if listed && self.are_apart(world) {
            return false;
        }
        // Poses of the last search are inside their boxes.
        let Self { memory, begin, poses, .. } = self;
        let Memory { from, end, .. } = &mut **memory;
        let begun = listed && (*from == states || *end == states);
        if *from != states {
            if *end == states {
                begin.clone_from(poses);
            } else {
                set_poses(begin, states);
            }
            states.clone_into(from);
        }
        self.set_end(next);
        self.trajectories.clear();
        self.trajectories
            .extend(states.iter().zip(next).map(|(from, to)| Trajectory::between(from, to)));
        if !listed {
            self.list(world);
        }
        self.fit_boxes(world, begun);
        true
    }

    pub(super) fn set_end(&mut self, states: &[State]) {
        states.clone_into(&mut self.memory.end);
        std::mem::swap(&mut self.poses, &mut self.spare_poses);
        set_poses(&mut self.poses, states);
        // Separations were evaluated at the previous poses.
        let Self { memory, colliders, poses, spare_poses: before, .. } = self;
        let Memory { pairs, .. } = &mut **memory;
        if poses != before {
            let stays = |number: usize| is_still(colliders.at(number).owner, before, poses);
            for pair in pairs.iter_mut().filter(|pair| !pair.is_bound) {
                pair.is_bound = !(pair.colliders.into_iter().all(stays));
            }
        }
    }
}

/// True if pieces of `world` can touch anything but the ground, and `states` has one state per
/// body.
fn is_of(world: &World, states: &[State]) -> bool {
    let bodies = world.bodies();
    has_pairs(world)
        && states.len() == bodies.len()
        && bodies.iter().any(|body| !body.pieces().is_empty())
}

pub(super) fn set_poses(poses: &mut Vec<Pose>, states: &[State]) {
    poses.clear();
    poses.extend(states.iter().map(State::pose));
}
