//! Where a system of blocks has numbers: its pairs, the order of elimination, and the fill.

use super::fronts::Plan;
use std::cmp::Reverse;
use std::collections::BinaryHeap;

/// Fronts are worth it from so many updates of blocks for each body on: the first step of a wall of 1000 bricks takes two
/// thirds of the processor time with them, that of a pyramid of 1275 cubes nine tenths.
const HEAVY: usize = 60;

/// The pattern of a symmetric sparse matrix of blocks, one row a body: a block on every diagonal, and one
/// at (i, j) and (j, i) of every pair. Bodies are eliminated in the order of least degree, of several
/// the first; order and fill are kept as long as bodies and pairs are the same.
#[derive(Debug, Clone, Default)]
pub(super) struct Pattern {
    /// The pairs (i < j) that the order was made for, in ascending order.
    pairs: Vec<(usize, usize)>,
    wanted: Vec<(usize, usize)>,
    /// The place of each body in the order of elimination.
    places: Vec<usize>,
    /// For each place, where its list in `later` begins; one more at the end.
    starts: Vec<usize>,
    /// For each place, in ascending order, the later places that it is coupled to when its turn
    /// comes.
    later: Vec<usize>,
    neighbours: Vec<Vec<usize>>,
    /// Of each body, the body whose neighbours it was last found among.
    marks: Vec<usize>,
    /// Where so much is to be eliminated that it is worth it, the fronts of blocks of six.
    plan: Option<Box<Plan>>,
    /// Bodies that wait for their turn, by their degree; entries of a degree that has changed are stale.
    queue: BinaryHeap<Reverse<(usize, usize)>>,
}

impl Pattern {
    /// Makes this that of `bodies` rows with blocks at the `pairs` of different bodies, which may come
    /// more than once.
    pub(super) fn set(&mut self, bodies: usize, pairs: impl Iterator<Item = (usize, usize)>) {
        if self.set_order(bodies, pairs) {
            let each = (0..bodies).map(|place| self.row(place).len());
            let updates: usize = each.map(|blocks| blocks * blocks).sum();
            let is_worth_it = updates > HEAVY * bodies;
            self.plan = is_worth_it.then(|| Box::new(Plan::of(self, &vec![6; bodies])));
        }
    }

    /// The same without fronts. Returns whether anything changed.
    pub(super) fn set_order(
        &mut self,
        bodies: usize,
        pairs: impl Iterator<Item = (usize, usize)>,
    ) -> bool {
        self.wanted.clear();
        self.wanted.extend(pairs.map(|(i, j)| (i.min(j), i.max(j))));
        self.wanted.sort_unstable();
        self.wanted.dedup();
        if self.places.len() != bodies || self.wanted != self.pairs {
            std::mem::swap(&mut self.pairs, &mut self.wanted);
            self.order(bodies);
            return true;
        }
        false
    }

    /// The fronts of its blocks, where it is worth to eliminate in fronts.
    pub(super) fn plan(&self) -> Option<&Plan> {
        self.plan.as_deref()
    }

    /// Chooses the order of elimination and finds the fill.
    fn order(&mut self, bodies: usize) {
        const OPEN: usize = usize::MAX;
        for list in &mut self.neighbours {
            list.clear();
        }
        self.neighbours.resize(bodies.max(self.neighbours.len()), Vec::new());
        self.marks.clear();
        self.marks.resize(bodies, OPEN);
        for &(i, j) in &self.pairs {
            self.neighbours[i].push(j);
            self.neighbours[j].push(i);
        }
        self.places.clear();
        self.places.resize(bodies, OPEN);
        self.starts.clear();
        self.later.clear();
        self.queue.clear();
        self.queue.extend((0..bodies).map(|body| Reverse((self.neighbours[body].len(), body))));
        while let Some(Reverse((degree, body))) = self.queue.pop() {
            if self.places[body] != OPEN || self.neighbours[body].len() != degree {
                continue;
            }
            self.places[body] = self.starts.len();
            self.starts.push(self.later.len());
            let list = std::mem::take(&mut self.neighbours[body]);
            // The neighbours left become neighbours of each other.
            for &i in &list {
                let neighbours = &mut self.neighbours[i];
                neighbours.retain(|&j| j != body);
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
            self.neighbours[body] = list;
        }
        self.starts.push(self.later.len());
        for entry in &mut self.later {
            *entry = self.places[*entry];
        }
        for place in 0..bodies {
            self.later[self.starts[place]..self.starts[place + 1]].sort_unstable();
        }
    }

    /// How many bodies there are.
    pub(super) fn len(&self) -> usize {
        self.places.len()
    }

    /// How many blocks there are above the diagonal, fill and all.
    pub(super) fn blocks(&self) -> usize {
        self.later.len()
    }

    /// The place of a body in the order of elimination.
    pub(super) fn place(&self, body: usize) -> usize {
        self.places[body]
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
