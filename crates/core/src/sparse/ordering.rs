//! Elimination order of a sparse symmetric pattern and the resulting fill.

use std::cmp::Reverse;
use std::collections::BinaryHeap;

/// Minimum-degree elimination order with fill. Ties go to the first node.
///
/// Order and fill are kept while nodes and pairs are unchanged.
#[derive(Debug, Clone, Default)]
pub(super) struct Order {
    /// Pairs (i < j) of the current order, in ascending order.
    pairs: Vec<(usize, usize)>,
    wanted: Vec<(usize, usize)>,
    /// Place of each node in the elimination order.
    places: Vec<usize>,
    /// Start of each place's list in `later`, with one more entry at the end.
    starts: Vec<usize>,
    /// Later places coupled to each place at its elimination, in ascending order.
    later: Vec<usize>,
    /// Off-diagonal blocks updated by the elimination of each place, for all pairs of its row.
    /// `first_updates` has the start of each list.
    updates: Vec<usize>,
    first_updates: Vec<usize>,
    neighbours: Vec<Vec<usize>>,
    /// Last node in whose neighbourhood each node was found.
    marks: Vec<usize>,
    /// Uneliminated nodes by degree. Entries with an outdated degree are stale.
    queue: BinaryHeap<Reverse<(usize, usize)>>,
}

impl Order {
    /// Sets the order for `nodes` nodes with off-diagonal blocks at the `pairs`. Returns true if
    /// anything changed.
    ///
    /// Pairs may repeat. Pairs of a node with itself are ignored.
    pub(super) fn set(
        &mut self,
        nodes: usize,
        pairs: impl Iterator<Item = (usize, usize)>,
    ) -> bool {
        self.wanted.clear();
        self.wanted.extend(pairs.filter(|(i, j)| i != j).map(|(i, j)| (i.min(j), i.max(j))));
        self.wanted.sort_unstable();
        self.wanted.dedup();
        if self.places.len() != nodes || self.wanted != self.pairs {
            std::mem::swap(&mut self.pairs, &mut self.wanted);
            self.order(nodes);
            return true;
        }
        false
    }

    /// Computes the elimination order and the fill.
    fn order(&mut self, nodes: usize) {
        const OPEN: usize = usize::MAX;
        for list in &mut self.neighbours {
            list.clear();
        }
        self.neighbours.resize(nodes.max(self.neighbours.len()), Vec::new());
        self.marks.clear();
        self.marks.resize(nodes, OPEN);
        for &(i, j) in &self.pairs {
            self.neighbours[i].push(j);
            self.neighbours[j].push(i);
        }
        self.places.clear();
        self.places.resize(nodes, OPEN);
        self.starts.clear();
        self.later.clear();
        self.queue.clear();
        self.queue.extend((0..nodes).map(|node| Reverse((self.neighbours[node].len(), node))));
        // Minimum degree. Entries of the queue with an outdated degree are skipped.
        while let Some(Reverse((degree, node))) = self.queue.pop() {
            if self.places[node] != OPEN || self.neighbours[node].len() != degree {
                continue;
            }
            self.places[node] = self.starts.len();
            self.starts.push(self.later.len());
            let list = std::mem::take(&mut self.neighbours[node]);
            // The remaining neighbours become neighbours of each other.
            for &i in &list {
                let neighbours = &mut self.neighbours[i];
                neighbours.retain(|&j| j != node);
                self.marks[i] = i;
                for &j in &*neighbours {
                    self.marks[j] = i;
                }
                for &j in &list {
                    if self.marks[j] != i {
                        neighbours.push(j);
                    }
                }
                self.queue.push(Reverse((neighbours.len(), i)));
            }
            self.later.extend_from_slice(&list);
            self.neighbours[node] = list;
        }
        self.starts.push(self.later.len());
        // Rows by their places in the order
        for entry in &mut self.later {
            *entry = self.places[*entry];
        }
        for place in 0..nodes {
            self.later[self.starts[place]..self.starts[place + 1]].sort_unstable();
        }
        self.updates.clear();
        self.first_updates.clear();
    }

    /// Finds the [updates](Self::updated) of all places.
    pub(super) fn find_updates(&mut self) {
        self.updates.clear();
        self.first_updates.clear();
        for place in 0..self.len() {
            self.first_updates.push(self.updates.len());
            let row = self.row(place);
            for i in row.clone() {
                for j in i + 1..row.end {
                    self.updates.push(self.find(self.later[i], self.later[j]));
                }
            }
        }
    }

    /// Indices of the off-diagonal blocks updated by the elimination of a place. They belong to the
    /// pairs of its row: first and second, first and third, and so on.
    pub(super) fn updated(&self, place: usize) -> impl Iterator<Item = usize> + '_ {
        self.updates[self.first_updates[place]..].iter().copied()
    }

    /// Number of nodes.
    pub(super) fn len(&self) -> usize {
        self.places.len()
    }

    /// Number of blocks above the diagonal, including fill.
    pub(super) fn blocks(&self) -> usize {
        self.later.len()
    }

    /// Place of a node in the elimination order.
    pub(super) fn place(&self, node: usize) -> usize {
        self.places[node]
    }

    /// Range of the [`blocks`](Self::blocks) in the row of a place.
    pub(super) fn row(&self, place: usize) -> std::ops::Range<usize> {
        self.starts[place]..self.starts[place + 1]
    }

    /// Later place that block `index` couples its row to.
    pub(super) fn column(&self, index: usize) -> usize {
        self.later[index]
    }

    /// Index of the block of two places (first < second).
    pub(super) fn find(&self, first: usize, second: usize) -> usize {
        let row = self.row(first);
        row.start + self.later[row].partition_point(|&place| place < second)
    }
}
