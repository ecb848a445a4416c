//! A tree of bounding boxes.

use super::Aabb;
use nalgebra::Vector3;

/// Largest number of boxes in a leaf.
const LEAF: usize = 4;

/// Boxes in depth-first order. A visit that leaves out a node continues at its `skip`.
#[derive(Debug, Clone, Default)]
pub(crate) struct Tree {
    nodes: Vec<Node>,
    /// Indices of the boxes, leaf by leaf.
    items: Vec<u32>,
}

#[derive(Debug, Clone)]
struct Node {
    bounds: Aabb,
    /// Index of the next node that is not below this one.
    skip: u32,
    /// First item and number of items of a leaf; no items otherwise.
    items: (u32, u32),
}

impl Tree {
    /// Tree of `boxes`, split at the median of their middles. It takes a time of n log² n.
    pub(crate) fn new(boxes: &[Aabb]) -> Self {
        let mut tree = Self { nodes: Vec::new(), items: (0..boxes.len() as u32).collect() };
        let mut items = std::mem::take(&mut tree.items);
        tree.add(boxes, &mut items, 0);
        tree.items = items;
        tree
    }

    /// Adds the node of `items`, which begin at the index `first`.
    fn add(&mut self, boxes: &[Aabb], items: &mut [u32], first: u32) {
        let of = |item: &u32| &boxes[*item as usize];
        let Some(bounds) = items.iter().map(of).copied().reduce(|a, b| a.joined(&b)) else {
            return;
        };
        let at = self.nodes.len();
        let count = items.len();
        self.nodes.push(Node { bounds, skip: 0, items: (first, 0) });
        if count <= LEAF {
            self.nodes[at].items.1 = count as u32;
        } else {
            let middle = |item: &u32| of(item).low + of(item).high;
            let start = Vector3::repeat(f64::INFINITY);
            let extent = items
                .iter()
                .map(middle)
                .fold((start, -start), |(low, high), at| (low.inf(&at), high.sup(&at)));
            let axis = (extent.1 - extent.0).imax();
            items.sort_unstable_by(|a, b| {
                middle(a)[axis].total_cmp(&middle(b)[axis]).then(a.cmp(b))
            });
            let (low, high) = items.split_at_mut(count / 2);
            let half = low.len() as u32;
            self.add(boxes, low, first);
            self.add(boxes, high, first + half);
        }
        self.nodes[at].skip = self.nodes.len() as u32;
    }

    /// Largest absolute coordinate of all boxes (m).
    pub(crate) fn reach(&self) -> f64 {
        let bounds = self.nodes.first().map(|node| &node.bounds);
        bounds.map_or(0.0, |bounds| bounds.low.amax().max(bounds.high.amax()))
    }

    /// Calls `visit` on the indices of all boxes in the leaves that `enters` accepts.
    ///
    /// `state` is passed to both, so that a visit can narrow the search.
    pub(crate) fn visit<S>(
        &self,
        state: &mut S,
        enters: impl Fn(&S, &Aabb) -> bool,
        mut visit: impl FnMut(&mut S, usize),
    ) {
        let mut at = 0;
        while let Some(node) = self.nodes.get(at) {
            let is_inside = enters(state, &node.bounds);
            let (first, count) = node.items;
            if is_inside {
                let items = &self.items[first as usize..(first + count) as usize];
                items.iter().for_each(|item| visit(state, *item as usize));
            }
            at = if is_inside && count == 0 { at + 1 } else { node.skip as usize };
        }
    }
}

impl Aabb {
    /// Distances at which a ray from `origin` (m) along the unit vector `direction` enters and leaves
    /// this box, wider by `margin` (m) on each side, within `length` (m); `None` if it misses.
    pub(crate) fn entry(
        &self,
        origin: &Vector3<f64>,
        direction: &Vector3<f64>,
        length: f64,
        margin: f64,
    ) -> Option<(f64, f64)> {
        let (mut from, mut to) = (0.0_f64, length);
        for axis in 0..3 {
            let (origin, direction) = (origin[axis], direction[axis]);
            let low = self.low[axis] - margin - origin;
            let high = self.high[axis] + margin - origin;
            if direction == 0.0 {
                if low > 0.0 || high < 0.0 {
                    return None;
                }
                continue;
            }
            let (one, other) = (low / direction, high / direction);
            (from, to) = (from.max(one.min(other)), to.min(one.max(other)));
        }
        (from <= to).then_some((from, to))
    }
}
