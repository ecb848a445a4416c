//! The order in which the nodes of a sparse symmetric pattern are eliminated, and the fill that this makes.

use std::cmp::Reverse;
use std::collections::BinaryHeap;

/// Nodes are eliminated in the order of least degree, of several the first; order and fill are kept as long as nodes and pairs
/// are the same.
#[derive(Debug, Clone, Default)]
pub(super) struct Order {
    /// The pairs (i < j) that the order was made for, in ascending order.
    pairs: Vec<(usize, usize)>,
    wanted: Vec<(usize, usize)>,
    /// The place of each node in the order of elimination.
    places: Vec<usize>,
    /// For each place, where its list in `later` begins; one more at the end.
    starts: Vec<usize>,
    /// For each place, in ascending order, the later places that it is coupled to when its turn
    /// comes.
    later: Vec<usize>,
    /// Which blocks the elimination of a place updates beside the diagonal: those of every two of its row; and where they begin.
    updates: Vec<usize>,
    first_updates: Vec<usize>,
    neighbours: Vec<Vec<usize>>,
    /// Of each node, the node whose neighbours it was last found among.
    marks: Vec<usize>,
    /// Nodes that wait for their turn, by their degree; entries of a degree that has changed are stale.
    queue: BinaryHeap<Reverse<(usize, usize)>>,
}

impl Order {
    /// Makes this that of so many `nodes` with blocks at the `pairs`, which may come
    /// more than once; those of a node with itself are no others than its own. Returns whether anything changed.
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

    /// Chooses the order of elimination and finds the fill.
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
        while let Some(Reverse((degree, node))) = self.queue.pop() {
            if self.places[node] != OPEN || self.neighbours[node].len() != degree {
                continue;
            }
            self.places[node] = self.starts.len();
            self.starts.push(self.later.len());
            let list = std::mem::take(&mut self.neighbours[node]);
            // The neighbours left become neighbours of each other.
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

    /// Which blocks the elimination of a place updates beside those of the diagonal: that of the first two of its row, of the first
    /// and third, and so on.
    pub(super) fn updated(&self, place: usize) -> impl Iterator<Item = usize> + '_ {
        self.updates[self.first_updates[place]..].iter().copied()
    }

    /// How many nodes there are.
    pub(super) fn len(&self) -> usize {
        self.places.len()
    }

    /// How many blocks there are above the diagonal, fill and all.
    pub(super) fn blocks(&self) -> usize {
        self.later.len()
    }

    /// The place of a node in the order of elimination.
    pub(super) fn place(&self, node: usize) -> usize {
        self.places[node]
    }

    /// Which of the [`blocks`](Self::blocks) are in the row of a place.
    pub(super) fn row(&self, place: usize) -> std::ops::Range<usize> {
        self.starts[place]..self.starts[place + 1]
    }

    /// The later place that block `index` couples its row to.
    pub(super) fn column(&self, index: usize) -> usize {
        self.later[index]
    }

    /// Which block is that of these places (first < second).
    pub(super) fn find(&self, first: usize, second: usize) -> usize {
        let row = self.row(first);
        row.start + self.later[row].partition_point(|&place| place < second)
    }
}
