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
#[path = "tests/median.rs"]
mod tests;
