//! Plan of a multifrontal elimination with nodes of any size. Nodes with the same remaining
//! neighbours share a front.

use super::ordering::Order;

/// Total size up to which fronts are merged regardless of zeros.
const SMALL: usize = 24;
/// Largest fraction of zeros in a merged front.
const PADDING: f64 = 0.15;

/// Elimination order and fronts. Vectors store the values of a node at its
/// [place](SymbolicFactorisation::place).
#[derive(Debug, Clone, Default)]
pub(crate) struct SymbolicFactorisation {
    /// First index of each node.
    places: Vec<usize>,
    size: usize,
    pub(super) fronts: Vec<Front>,
    /// Indices behind each front, in ascending order.
    pub(super) behind: Vec<usize>,
    /// Positions of these indices among the rows of the parent front, as runs.
    pub(super) runs: Vec<RowRun>,
    /// Front of each index.
    pub(super) front_of: Vec<usize>,
    /// Number of entries of `low` and of `up` over all fronts.
    pub(super) entries: (usize, usize),
}

/// Run of contribution rows that are also contiguous in the parent front: first row in the child
/// and in the parent, and length.
#[derive(Debug, Clone, Copy)]
pub(super) struct RowRun {
    pub from: usize,
    pub to: usize,
    pub count: usize,
}

/// Front: indices that are eliminated together.
#[derive(Debug, Clone, Default)]
pub(super) struct Front {
    /// First own index; `own` is their number.
    pub begin: usize,
    pub own: usize,
    /// Range of the indices behind it in `SymbolicFactorisation::behind`.
    pub list: (usize, usize),
    /// Start of its columns in `low`; `up` likewise for its rows.
    pub low: usize,
    pub up: usize,
    /// Child fronts.
    pub children: Vec<usize>,
    /// Range of the runs of its contribution block.
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

impl SymbolicFactorisation {
    /// Plan for nodes of the given sizes with blocks at the `pairs` of different nodes. Pairs may
    /// repeat.
    pub(crate) fn new(sizes: &[usize], pairs: impl Iterator<Item = (usize, usize)>) -> Self {
        let mut order = Order::default();
        order.set(sizes.len(), pairs);
        Self::from_order(&order, sizes)
    }

    /// Plan for nodes with a known elimination order.
    pub(super) fn from_order(order: &Order, sizes: &[usize]) -> Self {
        FrontTree::new(order, sizes).merged().plan()
    }

    /// Total number of values.
    pub(crate) fn size(&self) -> usize {
        self.size
    }

    /// Place of the first value of a node. The others follow.
    pub(crate) fn place(&self, node: usize) -> usize {
        self.places[node]
    }

    /// Position of a place among the rows of a front.
    pub(super) fn within(&self, front: &Front, place: usize) -> usize {
        if front.numbers().contains(&place) {
            return place - front.begin;
        }
        let list = &self.behind[front.list.0..front.list.1];
        front.own + list.partition_point(|behind| *behind < place)
    }
}

/// Elimination tree. Nodes are named by their place in the order, merged nodes by their last one.
struct FrontTree<'a> {
    order: &'a Order,
    /// Size of each node; `nodes` has the original index.
    sizes: Vec<usize>,
    nodes: Vec<usize>,
    /// Children of each node.
    children: Vec<Vec<usize>>,
    /// Earlier nodes merged into each node.
    merged: Vec<Vec<usize>>,
    roots: Vec<usize>,
}

impl<'a> FrontTree<'a> {
    fn new(order: &'a Order, node_sizes: &[usize]) -> Self {
        let count = node_sizes.len();
        let (mut sizes, mut nodes) = (vec![0; count], vec![0; count]);
        for (node, size) in node_sizes.iter().enumerate() {
            sizes[order.place(node)] = *size;
            nodes[order.place(node)] = node;
        }
        let mut children = vec![Vec::new(); count];
        let mut roots = Vec::new();
        for place in 0..count {
            match order.row(place).next() {
                // The row is ascending: its first entry is the parent.
                Some(first) => children[order.column(first)].push(place),
                None => roots.push(place),
            }
        }
        Self { order, sizes, nodes, children, merged: vec![Vec::new(); count], roots }
    }

    /// Merges nodes with their parents where that costs little.
    fn merged(mut self) -> Self {
        let count = self.sizes.len();
        let mut own = self.sizes.clone();
        let numbers = |at| self.sizes[self.order.column(at)];
        let behind: Vec<usize> =
            (0..count).map(|place| self.order.row(place).map(numbers).sum()).collect();
        for place in 0..count {
            // Children of a merged child are not considered again here.
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

    /// Builds the fronts, children before parents.
    fn plan(&self) -> SymbolicFactorisation {
        let count = self.sizes.len();
        let mut plan =
            SymbolicFactorisation { places: vec![0; count], ..SymbolicFactorisation::default() };
        let mut lasts = Vec::new();
        let mut numbers_of = vec![(0, 0); count];
        // Open nodes with their finished child fronts.
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
        // Numbers behind each front, and its share of the entries
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
        // Runs of consecutive rows by which a child's front is added to its parent
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
