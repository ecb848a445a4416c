//! Streaming median in bounded memory.
//!
//! The exact median of a stream needs all its numbers. Equal numbers are counted together here, and
//! the median is exact up to [`MOST_CLASSES`] different numbers. Beyond that, all numbers drop as
//! many binary digits as necessary and are represented by the middle of their class. They are then
//! accurate to a thousandth if they span at most eighteen decades.

use std::num::FpCategory;

/// Largest number of different numbers stored, and size of the buffer of uncounted ones.
const MOST_CLASSES: usize = 1 << 16;

/// Counted numbers.
#[derive(Debug, Clone, Default, PartialEq)]
#[cfg_attr(feature = "save", derive(serde::Serialize, serde::Deserialize))]
pub(super) struct Median {
    /// Distinct numbers with their counts, ascending.
    classes: Vec<(f64, u64)>,
    /// Numbers not counted yet.
    recent: Vec<f64>,
    /// Number of dropped binary digits.
    dropped: u32,
}

impl Median {
    pub(super) fn add(&mut self, number: f64) {
        self.recent.push(number);
        if self.recent.len() == MOST_CLASSES {
            self.count();
        }
    }

    /// Median of all numbers; the mean of the middle two if their count is even. `None` if empty.
    pub(super) fn get(&self) -> Option<f64> {
        let mut all = self.clone();
        all.count();
        let total = all.classes.iter().map(|(_, count)| count).sum::<u64>();
        let last = total.checked_sub(1)?;
        Some(match (all.at(last / 2), all.at(total / 2)) {
            (below, _) if last % 2 == 0 => below,
            (below, above) => 0.5 * (below + above),
        })
    }

    /// Number at the index `place` of the sorted sequence.
    fn at(&self, place: u64) -> f64 {
        let mut before = 0;
        let mut ends = self.classes.iter().map(|(number, count)| {
            before += count;
            (number, before)
        });
        ends.find(|(_, end)| *end > place).map_or(f64::NAN, |(number, _)| *number)
    }

    /// Counts the numbers in the buffer.
    fn count(&mut self) {
        let dropped = self.dropped;
        let recent = self.recent.drain(..).map(|number| (rounded(number, dropped), 1));
        self.classes.extend(recent);
        self.merge();
        while self.classes.len() > MOST_CLASSES {
            self.dropped += 1;
            for (number, _) in &mut self.classes {
                *number = rounded(*number, self.dropped);
            }
            self.merge();
        }
    }

    /// Merges equal numbers.
    fn merge(&mut self) {
        self.classes.sort_unstable_by(|(x, _), (y, _)| x.total_cmp(y));
        self.classes.dedup_by(|(next, more), (number, count)| {
            let is_same = next.total_cmp(number).is_eq();
            *count += if is_same { *more } else { 0 };
            is_same
        });
    }
}

/// Middle of the class of numbers that agree with this one except for the last `dropped` binary
/// digits.
fn rounded(number: f64, dropped: u32) -> f64 {
    match number.classify() {
        _ if dropped == 0 => number,
        FpCategory::Nan => f64::NAN.copysign(number),
        FpCategory::Infinite | FpCategory::Zero => number,
        FpCategory::Normal | FpCategory::Subnormal => {
            let width = 1_u64 << dropped;
            f64::from_bits(number.to_bits() & !(width - 1) | (width >> 1))
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn median_of(numbers: &[f64]) -> Option<f64> {
        let mut median = Median::default();
        numbers.iter().for_each(|number| median.add(*number));
        assert!(median.classes.len() + median.recent.len() <= 2 * MOST_CLASSES);
        median.get()
    }

    fn exact(numbers: &[f64]) -> f64 {
        let mut sorted = numbers.to_vec();
        sorted.sort_by(f64::total_cmp);
        let middle = sorted.len() / 2;
        let even = sorted.len().is_multiple_of(2);
        if even { 0.5 * (sorted[middle - 1] + sorted[middle]) } else { sorted[middle] }
    }

    /// `count` numbers from 10⁻¹⁸ to 1, with `different` distinct values.
    fn spread(count: u64, different: u64) -> Vec<f64> {
        let number = |i: u64| {
            let part = (i % different).wrapping_mul(0x9E37_79B9_7F4A_7C15) >> 11;
            10_f64.powf(-18.0 * part as f64 / (1_u64 << 53) as f64)
        };
        (0..count).map(number).collect()
    }

    #[test]
    fn is_exact_while_few_numbers_are_different() {
        assert_eq!(median_of(&[]), None);
        assert_eq!(median_of(&[3.0]), Some(3.0));
        assert_eq!(median_of(&[3.0, 1.0]), Some(2.0));
        assert_eq!(median_of(&[0.0, 1.0, f64::INFINITY, 0.0]), Some(0.5));
        for (count, different) in [(1000, 1000), (65_536, 65_536), (300_001, 5000), (400_000, 777)]
        {
            let numbers = spread(count, different);
            assert_eq!(median_of(&numbers), Some(exact(&numbers)), "{count} {different}");
        }
    }

    #[test]
    fn is_within_a_thousandth_in_bounded_memory_where_many_are() {
        let mut numbers = spread(1_000_000, u64::MAX);
        let found = median_of(&numbers).unwrap();
        let wanted = exact(&numbers);
        assert!((found / wanted - 1.0).abs() <= 1e-3, "{found} {wanted}");
        // Most are zero, and some are not numbers.
        numbers.extend(std::iter::repeat_n(0.0, 1_500_000));
        numbers.extend([f64::NAN, f64::INFINITY]);
        assert_eq!(median_of(&numbers), Some(0.0));
    }
}
