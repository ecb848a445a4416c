//! Disjoint sets of numbers (union–find).

/// Disjoint sets of the numbers 0, 1, …, each represented by its smallest number. The memory is reused.
#[derive(Debug, Clone, Default)]
pub(crate) struct DisjointSets {
    /// A number of the same set that is not larger; a set's smallest number itself.
    parents: Vec<usize>,
}

impl DisjointSets {
    /// Sets of one number each.
    pub(crate) fn new(count: usize) -> Self {
        Self { parents: (0..count).collect() }
    }

    /// Makes each of `count` numbers a set of its own.
    pub(crate) fn reset(&mut self, count: usize) {
        self.parents.clear();
        self.parents.extend(0..count);
    }

    /// Smallest number in the set of `number`.
    pub(crate) fn first(&mut self, mut number: usize) -> usize {
        while self.parents[number] != number {
            let above = self.parents[self.parents[number]];
            self.parents[number] = above;
            number = above;
        }
        number
    }

    /// Joins the sets of two numbers.
    pub(crate) fn join(&mut self, a: usize, b: usize) {
        let (a, b) = (self.first(a), self.first(b));
        self.parents[a.max(b)] = a.min(b);
    }

    /// All sets, ordered by their smallest numbers, each ascending.
    pub(crate) fn lists(&mut self) -> Vec<Vec<usize>> {
        let count = self.parents.len();
        let (mut lists, mut place) = (Vec::new(), vec![usize::MAX; count]);
        for number in 0..count {
            let first = self.first(number);
            if place[first] == usize::MAX {
                place[first] = lists.len();
                lists.push(Vec::new());
            }
            lists[place[first]].push(number);
        }
        lists
    }
}
