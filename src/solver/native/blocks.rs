//! A sparse linear system of 6 × 6 blocks, one row of blocks a body, with a block where two
//! bodies touch.
//!
//! The pattern is symmetric, the numbers are not. Bodies are eliminated in the order of least
//! degree; the order and the fill that it makes are kept as long as the pattern stays. Pivots are
//! sought inside a body's own block. Between the bodies none are needed as a rule, because the
//! block of a body holds its own mass and every spring that holds it; where one fails all the same
//! the system counts as singular, and the caller looks for another direction.

use nalgebra::{Matrix6, Vector6};

/// The system, its factors and its memory.
#[derive(Debug, Clone, Default)]
pub(super) struct BlockSystem {
    /// The pairs (i < j) that the pattern was made for, in ascending order.
    pattern: Vec<(usize, usize)>,
    wanted: Vec<(usize, usize)>,
    /// The place of each body in the order of elimination.
    places: Vec<usize>,
    /// For each place, where its list in `later` begins; one more at the end.
    starts: Vec<usize>,
    /// For each place, in ascending order, the later places that it is coupled to when its turn
    /// comes.
    later: Vec<usize>,
    diagonal: Vec<Matrix6<f64>>,
    /// The blocks (place, later) and (later, place), as in `later`.
    upper: Vec<Matrix6<f64>>,
    lower: Vec<Matrix6<f64>>,
    /// The right-hand side, and the solution after it.
    values: Vec<Vector6<f64>>,
    neighbours: Vec<Vec<usize>>,
}

impl BlockSystem {
    /// A system of `bodies` rows without numbers, with blocks at the `pairs` of different bodies,
    /// which may come more than once.
    pub(super) fn begin(&mut self, bodies: usize, pairs: impl Iterator<Item = (usize, usize)>) {
        self.wanted.clear();
        self.wanted.extend(pairs.map(|(i, j)| (i.min(j), i.max(j))));
        self.wanted.sort_unstable();
        self.wanted.dedup();
        if self.places.len() != bodies || self.wanted != self.pattern {
            std::mem::swap(&mut self.pattern, &mut self.wanted);
            self.order(bodies);
        }
        self.diagonal.clear();
        self.diagonal.resize(bodies, Matrix6::zeros());
        self.upper.clear();
        self.upper.resize(self.later.len(), Matrix6::zeros());
        self.lower.clear();
        self.lower.resize(self.later.len(), Matrix6::zeros());
        self.values.clear();
        self.values.resize(bodies, Vector6::zeros());
    }

    /// Chooses the order of elimination, always the body with the fewest neighbours left (of
    /// several the first), and finds the fill.
    fn order(&mut self, bodies: usize) {
        for list in &mut self.neighbours {
            list.clear();
        }
        self.neighbours.resize(bodies.max(self.neighbours.len()), Vec::new());
        for &(i, j) in &self.pattern {
            self.neighbours[i].push(j);
            self.neighbours[j].push(i);
        }
        const OPEN: usize = usize::MAX;
        self.places.clear();
        self.places.resize(bodies, OPEN);
        self.starts.clear();
        self.later.clear();
        for place in 0..bodies {
            let open = (0..bodies).filter(|&body| self.places[body] == OPEN);
            let Some(body) = open.min_by_key(|&body| self.neighbours[body].len()) else { break };
            self.places[body] = place;
            self.starts.push(self.later.len());
            let list = std::mem::take(&mut self.neighbours[body]);
            // The neighbours left become neighbours of each other.
            for &i in &list {
                let neighbours = &mut self.neighbours[i];
                neighbours.retain(|&j| j != body);
                for &j in &list {
                    if j != i && !neighbours.contains(&j) {
                        neighbours.push(j);
                    }
                }
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

    /// Adds to the block (row, column), which must be of the pattern.
    pub(super) fn add(&mut self, row: usize, column: usize, block: &Matrix6<f64>) {
        let (row, column) = (self.places[row], self.places[column]);
        if row == column {
            self.diagonal[row] += block;
        } else if row < column {
            let index = self.find(row, column);
            self.upper[index] += block;
        } else {
            let index = self.find(column, row);
            self.lower[index] += block;
        }
    }

    /// Adds to the right-hand side of a row.
    pub(super) fn add_rhs(&mut self, row: usize, part: &Vector6<f64>) {
        self.values[self.places[row]] += part;
    }

    /// Where the block of these places (first < second) is kept.
    fn find(&self, first: usize, second: usize) -> usize {
        let start = self.starts[first];
        let list = &self.later[start..self.starts[first + 1]];
        start + list.partition_point(|&place| place < second)
    }

    /// Solves the system; `false` where a pivot block is singular.
    pub(super) fn solve(&mut self) -> bool {
        let bodies = self.places.len();
        for pivot in 0..bodies {
            let factors = self.diagonal[pivot].lu();
            let range = self.starts[pivot]..self.starts[pivot + 1];
            if !factors.solve_mut(&mut self.values[pivot]) {
                return false;
            }
            for index in range.clone() {
                if !factors.solve_mut(&mut self.upper[index]) {
                    return false;
                }
            }
            let value = self.values[pivot];
            for i in range.clone() {
                let (row, lower) = (self.later[i], self.lower[i]);
                self.values[row] -= lower * value;
                for j in range.clone() {
                    let column = self.later[j];
                    let update = lower * self.upper[j];
                    if row == column {
                        self.diagonal[row] -= update;
                    } else if row < column {
                        let index = self.find(row, column);
                        self.upper[index] -= update;
                    } else {
                        let index = self.find(column, row);
                        self.lower[index] -= update;
                    }
                }
            }
        }
        for pivot in (0..bodies).rev() {
            let mut value = self.values[pivot];
            for index in self.starts[pivot]..self.starts[pivot + 1] {
                value -= self.upper[index] * self.values[self.later[index]];
            }
            self.values[pivot] = value;
        }
        true
    }

    /// The solution, in the order of the rows.
    pub(super) fn solution(&self) -> impl Iterator<Item = &Vector6<f64>> {
        self.places.iter().map(|&place| &self.values[place])
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use nalgebra::{DMatrix, DVector};

    /// A few patterns, with numbers of a fixed sequence, against a dense factorisation.
    #[test]
    fn the_solution_is_that_of_a_dense_system() {
        let patterns: [(usize, &[(usize, usize)]); 4] = [
            (1, &[]),
            (4, &[(0, 1), (2, 1), (3, 2), (1, 0)]),
            (5, &[(0, 1), (0, 2), (0, 3), (0, 4)]),
            (6, &[(0, 1), (1, 2), (2, 3), (3, 4), (4, 5), (5, 0), (1, 4)]),
        ];
        let mut system = BlockSystem::default();
        let mut twister = rand_mt::Mt::new(5);
        let mut number = || f64::from(twister.next_u32()) / f64::from(u32::MAX) - 0.5;
        for (bodies, pairs) in patterns {
            let mut dense = DMatrix::zeros(6 * bodies, 6 * bodies);
            let mut rhs = DVector::zeros(6 * bodies);
            system.begin(bodies, pairs.iter().copied());
            let both = pairs.iter().flat_map(|&(i, j)| [(i, j), (j, i)]);
            for (i, j) in (0..bodies).map(|i| (i, i)).chain(both) {
                let mut block = Matrix6::from_fn(|_, _| number());
                if i == j {
                    block += 4.0 * Matrix6::identity();
                }
                system.add(i, j, &block);
                let mut view = dense.fixed_view_mut::<6, 6>(6 * i, 6 * j);
                view += block;
            }
            for i in 0..bodies {
                let part = Vector6::from_fn(|_, _| number());
                system.add_rhs(i, &part);
                rhs.fixed_rows_mut::<6>(6 * i).copy_from(&part);
            }
            assert!(system.solve());
            let expected = dense.lu().solve(&rhs).unwrap();
            for (i, x) in system.solution().enumerate() {
                // Condition numbers are below 100.
                assert!((expected.fixed_rows::<6>(6 * i) - x).amax() < 1e-13, "{bodies} {i}");
            }
        }
    }
}
