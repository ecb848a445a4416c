//! What Ipopt adds to a Hessian W whose inertia is not that of a minimum, added beforehand in the iterations after one that needed it.
//!
//! Ipopt factorises with W first, and then with W + σE, σ growing, until the inertia is right. The iteration after one that needed σ mostly
//! needs it again: it is begun with a third of that, as Ipopt would go on itself after its first try.
//!
//! ```text
//! W + s_k E in place of W,   s_{k+1} = (s_k + σ_k)/3                                         (P28)
//! ```

use crate::sparsity::SparsityPattern;

/// The pattern of W + sE, and s.
pub(super) struct Shift {
    pattern: SparsityPattern,
    /// Entries of W.
    own: usize,
    /// Where the diagonal stands.
    diagonal: Vec<usize>,
    size: f64,
}

/// What an iteration begins with, of what the last one had: Ipopt's own way down (`perturb_dec_fact`).
const AFTER: f64 = 1.0 / 3.0;
/// Less than this is none: steps are Newton's again.
const LEAST: f64 = 1e-10;

impl Shift {
    /// For a W of `size` rows with this lower triangle.
    pub(super) fn new(of: &SparsityPattern, size: usize) -> Self {
        let mut pattern = of.clone();
        let mut diagonal = vec![usize::MAX; size];
        for (slot, (row, column)) in of.positions().enumerate() {
            if row == column {
                diagonal[row] = slot;
            }
        }
        for (row, slot) in diagonal.iter_mut().enumerate().filter(|(_, slot)| **slot == usize::MAX)
        {
            *slot = pattern.len();
            pattern.push(row, row);
        }
        Self { pattern, own: of.len(), diagonal, size: 0.0 }
    }

    pub(super) fn pattern(&self) -> &SparsityPattern {
        &self.pattern
    }

    /// Goes on after an iteration to whose W + sE Ipopt added σ; of one of its restoration, whose Hessian is another, none.
    pub(super) fn follow(&mut self, added: Option<f64>) {
        let next = added.map_or(0.0, |added| (self.size + added) * AFTER);
        self.size = if next < LEAST { 0.0 } else { next };
    }

    /// The values of W + sE, of which `fill` writes those of W.
    pub(super) fn fill(&self, values: &mut [f64], fill: impl FnOnce(&mut [f64])) {
        let (own, others) = values.split_at_mut(self.own);
        fill(own);
        others.fill(0.0);
        for &slot in &self.diagonal {
            values[slot] += self.size;
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// What is given to Ipopt is W where nothing was added, with every entry of the diagonal once.
    #[test]
    fn the_diagonal_alone_is_shifted() {
        let mut lower = SparsityPattern::new();
        for (row, column) in [(1, 0), (1, 1), (2, 0)] {
            lower.push(row, column);
        }
        let mut shift = Shift::new(&lower, 3);
        let dense = |shift: &Shift| {
            let mut values = vec![f64::NAN; shift.pattern().len()];
            shift.fill(&mut values, |own| own.copy_from_slice(&[5.0, 6.0, 7.0]));
            let mut dense = [[0.0; 3]; 3];
            for ((row, column), value) in shift.pattern().positions().zip(values) {
                assert!(dense[row][column] == 0.0);
                dense[row][column] += value;
            }
            dense
        };
        shift.follow(Some(0.0));
        assert_eq!(dense(&shift), [[0.0; 3], [5.0, 6.0, 0.0], [7.0, 0.0, 0.0]]);
        shift.follow(Some(0.75));
        assert_eq!(dense(&shift), [[0.25, 0.0, 0.0], [5.0, 6.25, 0.0], [7.0, 0.0, 0.25]]);
        shift.follow(Some(0.5));
        assert_eq!(dense(&shift)[0][0], 0.25);
        shift.follow(None);
        assert_eq!(dense(&shift)[0][0], 0.0);
        shift.follow(Some(1.0));
        (0..30).for_each(|_| shift.follow(Some(0.0)));
        assert_eq!(dense(&shift)[1][1], 6.0);
    }
}
