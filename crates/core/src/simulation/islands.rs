//! Islands of a step: connected components of its bodies.

use crate::contact::{ContactKey, Partner};
use crate::world::World;

/// Label of each body's island, the smallest body index in it. The memory is reused between steps.
#[derive(Debug, Clone, Default)]
pub(super) struct Islands {
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
        self.labels.clear();
        self.labels.extend(0..bodies);
        for key in keys {
            if let Partner::Body(other) = key.partner {
                self.join(key.body, other);
            }
        }
        let joints = world.joints();
        for joint in joints {
            if let Some(other) = joint.other() {
                self.join(joint.body(), other);
            }
        }
        for gear in world.gears() {
            let [a, b] = gear.axes().map(|axis| joints[axis.joint].body());
            self.join(a, b);
        }
        // Labels are at most the body index, so the labels of smaller bodies are final.
        for body in 0..bodies {
            self.labels[body] = self.labels[self.labels[body]];
        }
    }

    fn join(&mut self, a: usize, b: usize) {
        let (a, b) = (self.root(a), self.root(b));
        self.labels[a.max(b)] = a.min(b);
    }

    fn root(&mut self, mut body: usize) -> usize {
        while self.labels[body] != body {
            let above = self.labels[self.labels[body]];
            self.labels[body] = above;
            body = above;
        }
        body
    }

    /// Label of the island of `body`.
    pub(super) fn of(&self, body: usize) -> usize {
        self.labels[body]
    }
}
