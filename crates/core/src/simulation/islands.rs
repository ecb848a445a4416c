//! Which bodies of a step are joined: the islands by which it is judged.

use crate::contact::{ContactKey, Partner};
use crate::world::World;

/// Of each body, the label of its island: the smallest index in it. Memory that steps use again.
#[derive(Debug, Clone, Default)]
pub(super) struct Islands {
    labels: Vec<usize>,
}

impl Islands {
    /// Joins `bodies` bodies by the contacts `keys` and by the joints and gears of `world`. What is fixed joins nothing.
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
        // A label is not above its body's index, so that the labels of smaller ones are final.
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

    /// The label of the island of `body`.
    pub(super) fn of(&self, body: usize) -> usize {
        self.labels[body]
    }
}
