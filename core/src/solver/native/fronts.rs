//! A sparse linear system of nodes of any size, eliminated in fronts: nodes that have the same
//! neighbours left are eliminated together, by dense kernels on contiguous columns.
//!
//! The pattern is symmetric, the numbers are not. Pivots are sought inside a front's own rows.

use super::dense::{FrontView, Packed};
use super::pattern::Pattern;
use nalgebra::Matrix6;

/// Nodes whose fronts together stay this small are eliminated together, zeros and all.
const SMALL: usize = 24;
/// So are others where zeros are no more than this part of the front.
const PADDING: f64 = 0.15;

/// The order of elimination and the fronts. Numbers of vectors stand at the [place](Plan::place) of their
/// node.
#[derive(Debug, Clone, Default)]
pub(crate) struct Plan {
    /// The first number of each node.
    places: Vec<usize>,
    size: usize,
    fronts: Vec<Front>,
    /// The numbers behind each front, rising.
    behind: Vec<usize>,
    /// Where they are among the rows of the front that their front goes into, in runs.
    runs: Vec<Run>,
    /// The front of each number.
    front_of: Vec<usize>,
    /// How many entries the columns and the rows of all fronts have.
    entries: (usize, usize),
}

/// Rows of what a front leaves behind that follow each other in the front that it goes into too: the
/// first of them there and here, and how many.
#[derive(Debug, Clone, Copy)]
struct Run {
    from: usize,
    to: usize,
    count: usize,
}

/// A front: numbers that are eliminated together.
#[derive(Debug, Clone, Default)]
struct Front {
    /// Its own numbers.
    begin: usize,
    own: usize,
    /// Where those behind it are listed.
    list: (usize, usize),
    /// Where its columns and its rows are.
    low: usize,
    up: usize,
    /// Which fronts go into it.
    children: Vec<usize>,
    /// The runs of what it leaves behind.
    runs: (usize, usize),
}

impl Front {
    fn behind(&self) -> usize {
        self.list.1 - self.list.0
    }

    fn rows(&self) -> usize {
        self.own + self.behind()
    }

    fn numbers(&self) -> std::ops::Range<usize> {
        self.begin..self.begin + self.own
    }

    fn columns(&self) -> std::ops::Range<usize> {
        self.low..self.low + self.rows() * self.own
    }

    fn across(&self) -> std::ops::Range<usize> {
        self.up..self.up + self.own * self.behind()
    }
}

impl Plan {
    /// For nodes with so many numbers each and blocks at the `pairs` of different nodes, which may come
    /// more than once.
    pub(crate) fn new(sizes: &[usize], pairs: impl Iterator<Item = (usize, usize)>) -> Self {
        let mut pattern = Pattern::default();
        pattern.set_order(sizes.len(), pairs);
        Self::of(&pattern, sizes)
    }

    /// For nodes in an order that is known.
    pub(super) fn of(pattern: &Pattern, sizes: &[usize]) -> Self {
        Tree::of(pattern, sizes).merged().plan()
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
    fn within(&self, front: &Front, place: usize) -> usize {
        if front.numbers().contains(&place) {
            return place - front.begin;
        }
        let list = &self.behind[front.list.0..front.list.1];
        front.own + list.partition_point(|behind| *behind < place)
    }
}

/// The tree of elimination. Nodes are named by their places in the pattern; what is merged by the last
/// of its nodes.
struct Tree<'a> {
    pattern: &'a Pattern,
    /// How many numbers a node has, and which it is of those given.
    sizes: Vec<usize>,
    nodes: Vec<usize>,
    /// What goes into it first.
    children: Vec<Vec<usize>>,
    /// What is merged with it, and comes before it.
    merged: Vec<Vec<usize>>,
    roots: Vec<usize>,
}

impl<'a> Tree<'a> {
    fn of(pattern: &'a Pattern, node_sizes: &[usize]) -> Self {
        let count = node_sizes.len();
        let (mut sizes, mut nodes) = (vec![0; count], vec![0; count]);
        for (node, size) in node_sizes.iter().enumerate() {
            sizes[pattern.place(node)] = *size;
            nodes[pattern.place(node)] = node;
        }
        let (mut children, mut roots) = (vec![Vec::new(); count], Vec::new());
        for place in 0..count {
            match pattern.row(place).next() {
                // They rise: the first is what it goes into.
                Some(first) => children[pattern.column(first)].push(place),
                None => roots.push(place),
            }
        }
        Self { pattern, sizes, nodes, children, merged: vec![Vec::new(); count], roots }
    }

    /// Merges nodes with what they go into, where that costs little.
    fn merged(mut self) -> Self {
        let count = self.sizes.len();
        let mut own = self.sizes.clone();
        let numbers = |at| self.sizes[self.pattern.column(at)];
        let behind: Vec<usize> =
            (0..count).map(|place| self.pattern.row(place).map(numbers).sum()).collect();
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
    fn plan(&self) -> Plan {
        let count = self.sizes.len();
        let mut plan = Plan { places: vec![0; count], ..Plan::default() };
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
            for at in self.pattern.row(place) {
                let (first, end) = numbers_of[self.pattern.column(at)];
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
                        _ => plan.runs.push(Run { from, to, count: 1 }),
                    }
                }
                plan.fronts[child].runs = (begin, plan.runs.len());
            }
        }
        plan
    }
}

/// The numbers of a system of a [`Plan`], and their factors in their place after
/// [`Fronts::factorise`].
#[derive(Debug, Clone, Default)]
pub(crate) struct Fronts {
    /// The columns of all fronts, each with all its rows, and what its own rows have behind it.
    low: Vec<f64>,
    up: Vec<f64>,
    swaps: Vec<usize>,
    /// What fronts leave behind that did not go into another one yet, and that of the front at hand.
    stack: Vec<f64>,
    rest: Vec<f64>,
    packed: Packed,
}

impl Fronts {
    /// A matrix with ones on its diagonal.
    pub(crate) fn begin_unit(&mut self, plan: &Plan) {
        self.begin(plan);
        for front in &plan.fronts {
            for k in 0..front.own {
                self.low[front.low + k * front.rows() + k] = 1.0;
            }
        }
    }

    /// A matrix of zeros.
    pub(crate) fn begin(&mut self, plan: &Plan) {
        self.low.clear();
        self.low.resize(plan.entries.0, 0.0);
        self.up.clear();
        self.up.resize(plan.entries.1, 0.0);
        self.swaps.clear();
        self.swaps.resize(plan.size, 0);
    }

    /// Adds a block at the places `row` and `column`, which must be of the plan, its `rows` × `columns` numbers
    /// column after column.
    pub(crate) fn add(
        &mut self,
        plan: &Plan,
        (row, column): (usize, usize),
        rows: usize,
        block: &[f64],
    ) {
        let (first, stride, to) = self.at(plan, (row, column));
        for (k, column) in block.chunks_exact(rows).enumerate() {
            let to = &mut to[first + k * stride..][..rows];
            to.iter_mut().zip(column).for_each(|(entry, value)| *entry += value);
        }
    }

    /// Where the numbers of a block at the places `row` and `column` are: the first one, how far columns are apart, and in which
    /// list.
    fn at(&mut self, plan: &Plan, (row, column): (usize, usize)) -> (usize, usize, &mut [f64]) {
        let front = &plan.fronts[plan.front_of[row.min(column)]];
        if front.numbers().contains(&column) {
            let first = (column - front.begin) * front.rows() + plan.within(front, row);
            (first, front.rows(), &mut self.low[front.columns()])
        } else {
            let behind = plan.within(front, column) - front.own;
            (behind * front.own + row - front.begin, front.own, &mut self.up[front.across()])
        }
    }

    /// A block of six at places of the plan.
    pub(super) fn block(&mut self, plan: &Plan, at: (usize, usize)) -> Matrix6<f64> {
        let (first, stride, from) = self.at(plan, at);
        let mut block = Matrix6::zeros();
        for (k, column) in block.data.0.iter_mut().enumerate() {
            column.copy_from_slice(&from[first + k * stride..][..6]);
        }
        block
    }

    /// Makes it this one.
    pub(super) fn set_block(&mut self, plan: &Plan, at: (usize, usize), block: &Matrix6<f64>) {
        let (first, stride, to) = self.at(plan, at);
        for (k, column) in block.data.0.iter().enumerate() {
            to[first + k * stride..][..6].copy_from_slice(column);
        }
    }

    /// Factorises the matrix; `false` where a front is singular.
    pub(crate) fn factorise(&mut self, plan: &Plan) -> bool {
        let Self { low, up, swaps, stack, rest, packed } = self;
        stack.clear();
        for front in &plan.fronts {
            let behind = front.behind();
            rest.clear();
            rest.resize(behind * behind, 0.0);
            let mut view = FrontView {
                low: &mut low[front.columns()],
                up: &mut up[front.across()],
                own: front.own,
                behind,
                swaps: &mut swaps[front.numbers()],
            };
            // The last one is on top.
            for &child in front.children.iter().rev() {
                let (size, runs) = (plan.fronts[child].behind(), plan.fronts[child].runs);
                let left = stack.len() - size * size;
                view.assemble(rest, (&stack[left..], size), &plan.runs[runs.0..runs.1]);
                stack.truncate(left);
            }
            if !view.factorise(packed) {
                return false;
            }
            view.subtract_from(rest, packed);
            stack.extend_from_slice(rest);
        }
        true
    }

    /// Solves the factorised system for a right-hand side by places, in its memory.
    /// What is behind a front is gathered in `behind`.
    pub(crate) fn solve(&self, plan: &Plan, values: &mut [f64], behind: &mut Vec<f64>) {
        self.solve_all::<1>(plan, values.as_chunks_mut().0, behind);
    }

    /// The same for several right-hand sides, the numbers of a place beside each other.
    pub(crate) fn solve_all<const C: usize>(
        &self,
        plan: &Plan,
        values: &mut [[f64; C]],
        behind: &mut Vec<f64>,
    ) {
        #[inline(always)]
        fn subtract<const C: usize>(from: &mut [f64; C], factor: f64, value: &[f64; C]) {
            from.iter_mut().zip(value).for_each(|(entry, value)| *entry -= factor * value);
        }
        let is_nothing = |value: &[f64; C]| value.iter().all(|number| *number == 0.0);
        let Self { low, up, swaps, .. } = self;
        for front in &plan.fronts {
            let low = &low[front.columns()];
            for (pivot, swap) in swaps[front.numbers()].iter().enumerate() {
                values.swap(front.begin + pivot, front.begin + swap);
            }
            let list = &plan.behind[front.list.0..front.list.1];
            behind.clear();
            behind.extend(list.iter().flat_map(|place| values[*place]));
            let behind = behind.as_chunks_mut::<C>().0;
            for (k, column) in low.chunks_exact(front.rows()).enumerate() {
                let value = values[front.begin + k];
                if is_nothing(&value) {
                    continue;
                }
                let own = values[front.begin + k + 1..][..front.own - k - 1].iter_mut();
                own.zip(&column[k + 1..])
                    .for_each(|(entry, factor)| subtract(entry, *factor, &value));
                let left = behind.iter_mut().zip(&column[front.own..]);
                left.for_each(|(entry, factor)| subtract(entry, *factor, &value));
            }
            list.iter().zip(&*behind).for_each(|(place, value)| values[*place] = *value);
        }
        for front in plan.fronts.iter().rev() {
            let (low, up) = (&low[front.columns()], &up[front.across()]);
            let list = &plan.behind[front.list.0..front.list.1];
            for (place, column) in list.iter().zip(up.chunks_exact(front.own)) {
                let value = values[*place];
                if !is_nothing(&value) {
                    let own = values[front.numbers()].iter_mut();
                    own.zip(column).for_each(|(entry, factor)| subtract(entry, *factor, &value));
                }
            }
            for (k, column) in low.chunks_exact(front.rows()).enumerate().rev() {
                let value = values[front.begin + k].map(|number| number / column[k]);
                values[front.begin + k] = value;
                let above = values[front.begin..front.begin + k].iter_mut();
                above.zip(column).for_each(|(entry, factor)| subtract(entry, *factor, &value));
            }
        }
    }
}

impl Fronts {
    /// The same for the transposed matrix: the ways there and back in the other order, each transposed.
    pub(super) fn solve_transposed(&self, plan: &Plan, values: &mut [f64]) {
        for front in &plan.fronts {
            let (low, up) = (&self.low[front.columns()], &self.up[front.across()]);
            for (k, column) in low.chunks_exact(front.rows()).enumerate() {
                let own = &values[front.begin..front.begin + k];
                let known: f64 = own.iter().zip(column).map(|(value, factor)| value * factor).sum();
                values[front.begin + k] = (values[front.begin + k] - known) / column[k];
            }
            let list = &plan.behind[front.list.0..front.list.1];
            for (place, column) in list.iter().zip(up.chunks_exact(front.own)) {
                let own = values[front.numbers()].iter().zip(column);
                let known: f64 = own.map(|(value, factor)| value * factor).sum();
                values[*place] -= known;
            }
        }
        for front in plan.fronts.iter().rev() {
            let low = &self.low[front.columns()];
            let list = &plan.behind[front.list.0..front.list.1];
            for (k, column) in low.chunks_exact(front.rows()).enumerate().rev() {
                let own = values[front.begin + k + 1..][..front.own - k - 1].iter();
                let inside: f64 =
                    own.zip(&column[k + 1..]).map(|(value, factor)| value * factor).sum();
                let behind = list.iter().zip(&column[front.own..]);
                let outside: f64 = behind.map(|(place, factor)| values[*place] * factor).sum();
                values[front.begin + k] -= inside + outside;
            }
            for (pivot, swap) in self.swaps[front.numbers()].iter().enumerate().rev() {
                values.swap(front.begin + pivot, front.begin + swap);
            }
        }
    }
}

impl FrontView<'_> {
    /// Adds what a front before left behind it, `size` rows and columns, to the front's own rows and columns and to
    /// `rest` behind them.
    fn assemble(&mut self, rest: &mut [f64], (left, size): (&[f64], usize), runs: &[Run]) {
        let (own, rows) = (self.own, self.own + self.behind);
        for columns in runs {
            for k in 0..columns.count {
                let column = &left[(columns.from + k) * size..][..size];
                let to = columns.to + k;
                for run in runs {
                    let target = if to < own {
                        &mut self.low[to * rows + run.to..]
                    } else if run.to < own {
                        &mut self.up[(to - own) * own + run.to..]
                    } else {
                        &mut rest[(to - own) * self.behind + run.to - own..]
                    };
                    let part = &column[run.from..run.from + run.count];
                    let target = target[..run.count].iter_mut().zip(part);
                    target.for_each(|(entry, value)| *entry += value);
                }
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use nalgebra::{DMatrix, DVector};

    /// Random patterns of nodes of one to six numbers, with numbers of a fixed sequence, some columns of them
    /// those of a unit matrix, against a dense factorisation.
    #[test]
    fn the_solution_is_that_of_a_dense_system() {
        let mut twister = rand_mt::Mt::new(7);
        let mut uniform = || f64::from(twister.next_u32()) / f64::from(u32::MAX);
        let mut fronts = Fronts::default();
        for (nodes, odds) in [(1, 0.0), (5, 0.5), (12, 0.2), (30, 0.1), (60, 0.05), (40, 1.0)] {
            let sizes: Vec<usize> = (0..nodes).map(|_| 1 + (6.0 * uniform()) as usize).collect();
            let mut pairs = Vec::new();
            for i in 0..nodes {
                for j in 0..i {
                    if uniform() < odds {
                        pairs.push((i, j));
                    }
                }
            }
            let plan = Plan::new(&sizes, pairs.iter().copied());
            let size = plan.size();
            assert_eq!(size, sizes.iter().sum::<usize>());
            fronts.begin_unit(&plan);
            let mut dense = DMatrix::identity(size, size);
            let is_unit: Vec<bool> = (0..nodes).map(|_| uniform() < 0.3).collect();
            let both = pairs.iter().flat_map(|&(i, j)| [(i, j), (j, i)]);
            for (i, j) in (0..nodes).map(|i| (i, i)).chain(both).filter(|(_, j)| !is_unit[*j]) {
                let block: Vec<f64> = (0..sizes[i] * sizes[j]).map(|_| uniform() - 0.5).collect();
                let at = (plan.place(i), plan.place(j));
                fronts.add(&plan, at, sizes[i], &block);
                let mut view = dense.view_mut(at, (sizes[i], sizes[j]));
                view += DMatrix::from_column_slice(sizes[i], sizes[j], &block);
            }
            // Its diagonal outweighs the rest, so that pivots inside a front do.
            for k in 0..size {
                let more = 0.5 * size as f64;
                fronts.add(&plan, (k, k), 1, &[more]);
                dense[(k, k)] += more;
            }
            assert!(fronts.factorise(&plan));
            let rhs = DVector::from_fn(size, |_, _| uniform() - 0.5);
            let mut values = rhs.as_slice().to_vec();
            fronts.solve(&plan, &mut values, &mut Vec::new());
            let mut transposed = rhs.as_slice().to_vec();
            fronts.solve_transposed(&plan, &mut transposed);
            for (found, matrix) in [(values, dense.clone()), (transposed, dense.transpose())] {
                let expected = matrix.lu().solve(&rhs).unwrap();
                let apart = (DVector::from_vec(found) - expected).amax();
                assert!(apart < 1e-12, "{nodes} nodes: {apart}");
            }
        }
    }

    #[test]
    fn a_singular_system_is_none() {
        let plan = Plan::new(&[2, 2], [(0, 1)].into_iter());
        let mut fronts = Fronts::default();
        fronts.begin(&plan);
        assert!(!fronts.factorise(&plan));
    }
}
