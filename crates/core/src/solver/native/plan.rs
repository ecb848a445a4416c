//! The fronts of a sparse system of nodes of any size: nodes that have the same neighbours left are eliminated
//! together.

use super::order::Order;

/// Nodes whose fronts together stay this small are eliminated together, zeros and all.
const SMALL: usize = 24;
/// So are others where zeros are no more than this part of the front.
const PADDING: f64 = 0.15;

/// The order of elimination and the fronts. Numbers of vectors stand at the [place](FrontPlan::place) of their
/// node.
#[derive(Debug, Clone, Default)]
pub(crate) struct FrontPlan {
    /// The first number of each node.
    places: Vec<usize>,
    size: usize,
    pub(super) fronts: Vec<Front>,
    /// The numbers behind each front, rising.
    pub(super) behind: Vec<usize>,
    /// Where they are among the rows of the front that their front goes into, in runs.
    pub(super) runs: Vec<RowRun>,
    /// The front of each number.
    pub(super) front_of: Vec<usize>,
    /// How many entries the columns and the rows of all fronts have.
    pub(super) entries: (usize, usize),
}

/// Rows of what a front leaves behind that follow each other in the front that it goes into too: the
/// first of them there and here, and how many.
#[derive(Debug, Clone, Copy)]
pub(super) struct RowRun {
    pub from: usize,
    pub to: usize,
    pub count: usize,
}

/// A front: numbers that are eliminated together.
#[derive(Debug, Clone, Default)]
pub(super) struct Front {
    /// Its own numbers.
    pub begin: usize,
    pub own: usize,
    /// Where those behind it are listed.
    pub list: (usize, usize),
    /// Where its columns and its rows are.
    pub low: usize,
    pub up: usize,
    /// Which fronts go into it.
    pub children: Vec<usize>,
    /// The runs of what it leaves behind.
    pub runs: (usize, usize),
}

impl Front {
    pub fn behind(&self) -> usize {
        self.list.1 - self.list.0
    }

    pub fn rows(&self) -> usize {
        self.own + self.behind()
    }

    pub fn numbers(&self) -> std::ops::Range<usize> {
        self.begin..self.begin + self.own
    }

    pub fn columns(&self) -> std::ops::Range<usize> {
        self.low..self.low + self.rows() * self.own
    }

    pub fn across(&self) -> std::ops::Range<usize> {
        self.up..self.up + self.own * self.behind()
    }
}

impl FrontPlan {
    /// For nodes with so many numbers each and blocks at the `pairs` of different nodes, which may come
    /// more than once.
    pub(crate) fn new(sizes: &[usize], pairs: impl Iterator<Item = (usize, usize)>) -> Self {
        let mut order = Order::default();
        order.set(sizes.len(), pairs);
        Self::of(&order, sizes)
    }

    /// For nodes in an order that is known.
    pub(super) fn of(order: &Order, sizes: &[usize]) -> Self {
        FrontTree::of(order, sizes).merged().plan()
    }

    /// How many numbers there are.
    pub(crate) fn size(&self) -> usize {
        self.size
    }

    /// The place of the first number of a node; the others follow.
    pub(crate) fn place(&self, node: usize) -> usize {
        self.places[node]
    }

    /// Where a place is among the rows of a front.
    pub(super) fn within(&self, front: &Front, place: usize) -> usize {
        if front.numbers().contains(&place) {
            return place - front.begin;
        }
        let list = &self.behind[front.list.0..front.list.1];
        front.own + list.partition_point(|behind| *behind < place)
    }
}

/// The tree of elimination. Nodes are named by their places in the order; what is merged by the last
/// of its nodes.
struct FrontTree<'a> {
    order: &'a Order,
    /// How many numbers a node has, and which it is of those given.
    sizes: Vec<usize>,
    nodes: Vec<usize>,
    /// What goes into it first.
    children: Vec<Vec<usize>>,
    /// What is merged with it, and comes before it.
    merged: Vec<Vec<usize>>,
    roots: Vec<usize>,
}

impl<'a> FrontTree<'a> {
    fn of(order: &'a Order, node_sizes: &[usize]) -> Self {
        let count = node_sizes.len();
        let (mut sizes, mut nodes) = (vec![0; count], vec![0; count]);
        for (node, size) in node_sizes.iter().enumerate() {
            sizes[order.place(node)] = *size;
            nodes[order.place(node)] = node;
        }
        let (mut children, mut roots) = (vec![Vec::new(); count], Vec::new());
        for place in 0..count {
            match order.row(place).next() {
                // They rise: the first is what it goes into.
                Some(first) => children[order.column(first)].push(place),
                None => roots.push(place),
            }
        }
        Self { order, sizes, nodes, children, merged: vec![Vec::new(); count], roots }
    }

    /// Merges nodes with what they go into, where that costs little.
    fn merged(mut self) -> Self {
        let count = self.sizes.len();
        let mut own = self.sizes.clone();
        let numbers = |at| self.sizes[self.order.column(at)];
        let behind: Vec<usize> =
            (0..count).map(|place| self.order.row(place).map(numbers).sum()).collect();
        for place in 0..count {
            // What did not fit a child is not asked again.
            let mut adopted = Vec::new();
            loop {
                let front = own[place] + behind[place];
                let candidates = self.children[place].iter().enumerate();
                let zeros = |child: usize| own[child] * (front - behind[child]);
                let least = candidates.map(|(at, &child)| (zeros(child), child, at)).min();
                let Some((zeros, child, at)) = least else { break };
                let small = own[child] + own[place] <= SMALL;
                let allowed = PADDING * (own[child] * (own[child] + front)) as f64;
                if !small && zeros as f64 > allowed {
                    break;
                }
                own[place] += own[child];
                self.children[place].swap_remove(at);
                let inner = std::mem::take(&mut self.merged[child]);
                self.merged[place].extend(inner.into_iter().chain([child]));
                adopted.append(&mut self.children[child]);
            }
            self.children[place].append(&mut adopted);
        }
        self
    }

    /// The fronts, each behind those that go into it.
    fn plan(&self) -> FrontPlan {
        let count = self.sizes.len();
        let mut plan = FrontPlan { places: vec![0; count], ..FrontPlan::default() };
        let mut lasts = Vec::new();
        let mut numbers_of = vec![(0, 0); count];
        // Each with the fronts that went into it so far.
        let mut open: Vec<(usize, Vec<usize>)> = Vec::new();
        for &root in &self.roots {
            open.push((root, Vec::new()));
            while let Some((place, ended)) = open.last_mut() {
                if let Some(&child) = self.children[*place].get(ended.len()) {
                    open.push((child, Vec::new()));
                    continue;
                }
                let (place, children) = (*place, std::mem::take(ended));
                open.pop();
                let begin = plan.size;
                for &node in self.merged[place].iter().chain([&place]) {
                    plan.places[self.nodes[node]] = plan.size;
                    numbers_of[node] = (plan.size, plan.size + self.sizes[node]);
                    plan.size += self.sizes[node];
                }
                if let Some((_, ended)) = open.last_mut() {
                    ended.push(plan.fronts.len());
                }
                plan.front_of.resize(plan.size, plan.fronts.len());
                let own = plan.size - begin;
                plan.fronts.push(Front { begin, own, children, ..Front::default() });
                lasts.push(place);
            }
        }
        for (front, place) in plan.fronts.iter_mut().zip(lasts) {
            let begin = plan.behind.len();
            for at in self.order.row(place) {
                let (first, end) = numbers_of[self.order.column(at)];
                plan.behind.extend(first..end);
            }
            plan.behind[begin..].sort_unstable();
            front.list = (begin, plan.behind.len());
            (front.low, front.up) = plan.entries;
            plan.entries.0 += front.rows() * front.own;
            plan.entries.1 += front.own * front.behind();
        }
        for parent in 0..plan.fronts.len() {
            for at in 0..plan.fronts[parent].children.len() {
                let child = plan.fronts[parent].children[at];
                let begin = plan.runs.len();
                let (first, end) = plan.fronts[child].list;
                for (from, number) in (first..end).enumerate() {
                    let front = &plan.fronts[parent];
                    let to = plan.within(front, plan.behind[number]);
                    match plan.runs[begin..].last_mut() {
                        Some(run) if run.to + run.count == to && to != front.own => run.count += 1,
                        _ => plan.runs.push(RowRun { from, to, count: 1 }),
                    }
                }
                plan.fronts[child].runs = (begin, plan.runs.len());
            }
        }
        plan
    }
}
