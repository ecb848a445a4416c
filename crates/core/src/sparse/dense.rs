//! Dense kernels of a front, with column-major storage and pivoting in the leading rows.

use std::ops::Range;

/// Tile size of the matrix product.
const TILE: usize = 4;
/// Number of columns eliminated before the rest is updated.
const PANEL: usize = 24;

/// Packed factors of a product with their pivots and columns, and the triangle of a panel.
#[derive(Debug, Clone, Default)]
pub(super) struct PackedBlocks {
    left: Vec<f64>,
    right: Vec<f64>,
    pivots: Vec<usize>,
    columns: Vec<usize>,
    triangle: Vec<f64>,
}

impl PackedBlocks {
    /// Packs rows `rows` of the nonzero columns `pivots` of `from`, which has `stride` rows.
    fn pack_left(&mut self, from: &[f64], stride: usize, rows: Range<usize>, pivots: Range<usize>) {
        let column = |k: usize| &from[k * stride + rows.start..k * stride + rows.end];
        self.pivots.clear();
        self.pivots.extend(pivots.filter(|&k| column(k).iter().any(|value| *value != 0.0)));
        self.left.clear();
        self.left.resize(rows.len().div_ceil(TILE) * TILE * self.pivots.len(), 0.0);
        let count = self.pivots.len();
        for (at, &k) in self.pivots.iter().enumerate() {
            for (tile, part) in column(k).chunks(TILE).enumerate() {
                let to = (tile * count + at) * TILE;
                self.left[to..to + part.len()].copy_from_slice(part);
            }
        }
    }

    /// Packs the pivot rows of `from`, which has `stride` rows, for the columns where they are not
    /// all zero.
    fn pack_right(&mut self, from: &[f64], stride: usize, columns: Range<usize>) {
        let Self { right, pivots, columns: taken, .. } = self;
        taken.clear();
        let taking = |j: &usize| pivots.iter().any(|k| from[j * stride + k] != 0.0);
        taken.extend(columns.filter(taking));
        right.clear();
        right.resize(taken.len().div_ceil(TILE) * TILE * pivots.len(), 0.0);
        for (place, j) in taken.iter().enumerate() {
            let (tile, lane) = (place / TILE, place % TILE);
            for (at, k) in pivots.iter().enumerate() {
                right[(tile * pivots.len() + at) * TILE + lane] = from[j * stride + k];
            }
        }
    }

    /// Computes to −= left · right in the rows `rows` of a matrix with `stride` rows. These rows
    /// are the first of the left factor.
    fn subtract(&self, to: &mut [f64], stride: usize, rows: Range<usize>) {
        let step = TILE * self.pivots.len();
        if step == 0 || rows.is_empty() {
            return;
        }
        for (right, columns) in self.right.chunks_exact(step).zip(self.columns.chunks(TILE)) {
            for (tile, left) in self.left.chunks_exact(step).enumerate() {
                let first = rows.start + tile * TILE;
                if first >= rows.end {
                    break;
                }
                let sums = product(left, right);
                let last = (first + TILE).min(rows.end);
                for (sum, j) in sums.iter().zip(columns) {
                    let column = &mut to[j * stride + first..j * stride + last];
                    column.iter_mut().zip(sum).for_each(|(value, sum)| *value -= sum);
                }
            }
        }
    }
}

/// Tile of a product: four rows of packed columns times four columns of packed rows.
#[inline(always)]
fn product(left: &[f64], right: &[f64]) -> [[f64; TILE]; TILE] {
    let mut sums = [[0.0; TILE]; TILE];
    for (a, b) in left.chunks_exact(TILE).zip(right.chunks_exact(TILE)) {
        for (sum, b) in sums.iter_mut().zip(b) {
            for (sum, a) in sum.iter_mut().zip(a) {
                *sum += a * b;
            }
        }
    }
    sums
}

/// View of a front. `low` has its own columns with all rows, `up` its own rows in the columns
/// behind.
#[derive(Debug)]
pub(super) struct FrontView<'a> {
    pub(super) low: &'a mut [f64],
    pub(super) up: &'a mut [f64],
    /// Numbers of its own rows and columns, and of those behind.
    pub(super) own: usize,
    pub(super) behind: usize,
    /// Row exchanged with each own row.
    pub(super) swaps: &'a mut [usize],
}

impl FrontView<'_> {
    /// Factorises the front in place, with pivoting in its own rows:
    ///
    /// ```text
    /// P ⎡ low's own rows   up ⎤ = ⎡ L ⎤ (U   L⁻¹ P up)
    ///   ⎣ low's last rows   · ⎦   ⎣ B ⎦
    /// ```
    ///
    /// Returns false if a pivot is zero.
    pub(super) fn factorise(&mut self, packed: &mut PackedBlocks) -> bool {
        let (own, rows) = (self.own, self.own + self.behind);
        let mut begin = 0;
        while begin < own {
            let end = (begin + PANEL).min(own);
            if !self.factorise_panel(begin..end) {
                return false;
            }
            let panel = begin..end;
            packed.pack_triangle(self.low, rows, panel.clone());
            packed.pack_left(self.low, rows, end..rows, begin..end);
            // The row exchanges also apply to earlier panels.
            for column in self.low.chunks_exact_mut(rows).take(begin) {
                exchange(column, self.swaps, panel.clone());
            }
            for column in self.low.chunks_exact_mut(rows).skip(end) {
                exchange(column, self.swaps, panel.clone());
                packed.solve_triangle(column, panel.clone());
            }
            for column in self.up.chunks_exact_mut(own) {
                exchange(column, self.swaps, panel.clone());
                packed.solve_triangle(column, panel.clone());
            }
            packed.pack_right(self.low, rows, end..own);
            packed.subtract(self.low, rows, end..rows);
            packed.pack_right(self.up, own, 0..self.behind);
            packed.subtract(self.up, own, end..own);
            begin = end;
        }
        true
    }

    /// Subtracts the contribution of the front, B L⁻¹ P up, from the rows and columns behind in
    /// `rest`.
    pub(super) fn subtract_from(&self, rest: &mut [f64], packed: &mut PackedBlocks) {
        let rows = self.own + self.behind;
        packed.pack_left(self.low, rows, self.own..rows, 0..self.own);
        packed.pack_right(self.up, self.own, 0..self.behind);
        packed.subtract(rest, self.behind, 0..self.behind);
    }

    /// Eliminates the columns of a panel within the panel.
    fn factorise_panel(&mut self, panel: Range<usize>) -> bool {
        let rows = self.own + self.behind;
        let own = self.own;
        for pivot in panel.clone() {
            let column = &self.low[pivot * rows..(pivot + 1) * rows];
            let mut best = pivot;
            for row in pivot + 1..own {
                if column[row].abs() > column[best].abs() {
                    best = row;
                }
            }
            let value = column[best];
            if value == 0.0 || !value.is_finite() {
                return false;
            }
            self.swaps[pivot] = best;
            if best != pivot {
                for k in panel.clone() {
                    self.low.swap(k * rows + pivot, k * rows + best);
                }
            }
            let (before, after) = self.low.split_at_mut((pivot + 1) * rows);
            let column = &mut before[pivot * rows + pivot + 1..];
            if column.iter().all(|value| *value == 0.0) {
                continue;
            }
            column.iter_mut().for_each(|entry| *entry /= value);
            for other in after.chunks_exact_mut(rows).take(panel.end - pivot - 1) {
                let factor = other[pivot];
                if factor != 0.0 {
                    let below = other[pivot + 1..].iter_mut().zip(&*column);
                    below.for_each(|(entry, multiplier)| *entry -= factor * multiplier);
                }
            }
        }
        true
    }
}

/// Applies the row exchanges of a panel to a column.
fn exchange(column: &mut [f64], swaps: &[usize], panel: Range<usize>) {
    for (pivot, other) in swaps.iter().enumerate().take(panel.end).skip(panel.start) {
        column.swap(pivot, *other);
    }
}

impl PackedBlocks {
    /// Stores the triangle below the diagonal of a panel.
    fn pack_triangle(&mut self, from: &[f64], stride: usize, panel: Range<usize>) {
        self.triangle.clear();
        for k in panel.clone() {
            let column = &from[k * stride..];
            self.triangle.extend_from_slice(&column[panel.clone()]);
        }
    }

    /// Applies L⁻¹ of the panel to its rows of a column.
    fn solve_triangle(&self, column: &mut [f64], panel: Range<usize>) {
        let count = panel.len();
        let part = &mut column[panel];
        for (k, multipliers) in self.triangle.chunks_exact(count).enumerate() {
            let value = part[k];
            if value != 0.0 {
                let below = part[k + 1..].iter_mut().zip(&multipliers[k + 1..]);
                below.for_each(|(entry, multiplier)| *entry -= value * multiplier);
            }
        }
    }
}
