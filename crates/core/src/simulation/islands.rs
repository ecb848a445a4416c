//! Islands of a step: connected components of its bodies.

use crate::contact::{ContactKey, Partner};
use crate::sets::DisjointSets;
use crate::world::World;

/// Label of each body's island, the smallest body index in it. The memory is reused between steps.
#[derive(Debug, Clone, Default)]
pub(super) struct Islands {
    sets: DisjointSets,
    labels: Vec<usize>,
}

impl Islands {
    /// Connects `bodies` bodies by the contacts `keys` and by the joints and gears of `world`. The
    /// ground, fixed pieces and the world frame do not connect bodies.
    pub(super) fn find<'a>(
        &mut self,
        bodies: usize,
        keys: impl Iterator<Item = &'a ContactKey>,
        world: &World,
    ) {
        let Self { sets, labels } = self;
        sets.reset(bodies);
        for key in keys {
            if let Partner::Body(other) = key.partner {
                sets.join(key.body, other);
            }
        }
        let joints = world.joints();
        for joint in joints {
            if let Some(other) = joint.other() {
                sets.join(joint.body(), other);
            }
        }
        for gear in world.gears() {
            let [a, b] = gear.axes().map(|axis| joints[axis.joint].body());
            sets.join(a, b);
        }
        labels.clear();
        labels.extend((0..bodies).map(|body| sets.first(body)));
    }

    /// Label of the island of `body`.
    pub(super) fn label(&self, body: usize) -> usize {
        self.labels[body]
    }
}
