//! Which bodies of a step are joined: the islands by which it is judged.

use crate::contact::{ContactKey, Partner};

/// Of each body, the label of its island: the smallest index in it. Memory that steps use again.
#[derive(Debug, Clone, Default)]
pub(super) struct Islands {
    labels: Vec<usize>,
}

impl Islands {
    /// Joins `bodies` bodies by the contacts `keys`. What is fixed joins nothing.
    pub(super) fn find<'a>(&mut self, bodies: usize, keys: impl Iterator<Item = &'a ContactKey>) {
        self.labels.clear();
        self.labels.extend(0..bodies);
        for key in keys {
            let Partner::Body(other) = key.partner else { continue };
            let (a, b) = (self.root(key.body), self.root(other));
            self.labels[a.max(b)] = a.min(b);
        }
        // A label is not above its body's index, so that the labels of smaller ones are final.
        for body in 0..bodies {
            self.labels[body] = self.labels[self.labels[body]];
        }
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
