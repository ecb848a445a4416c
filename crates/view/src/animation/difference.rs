//! Changed part of a picture.

use std::ops::Range;

/// Smallest rectangle with all differences between two pictures of `size` by `size` pixels. It is
/// one pixel if there are none, since a GIF frame cannot be empty.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Changed {
    pub columns: Range<usize>,
    pub rows: Range<usize>,
    size: usize,
}

impl Changed {
    /// Difference between two pictures. The whole picture if `before` is empty.
    pub fn between<T: PartialEq>(before: &[T], now: &[T], size: usize) -> Self {
        if before.is_empty() {
            return Self { columns: 0..size, rows: 0..size, size };
        }
        let differs = |y: usize| {
            let row = y * size..(y + 1) * size;
            before[row.clone()].iter().zip(&now[row]).map(|(a, b)| a != b)
        };
        let (mut left, mut right, mut top, mut bottom) = (size, 0, size, 0);
        for y in 0..size {
            let Some(first) = differs(y).position(|differs| differs) else { continue };
            let last = differs(y).rposition(|differs| differs).unwrap_or(first);
            (left, right) = (left.min(first), right.max(last + 1));
            (top, bottom) = (top.min(y), y + 1);
        }
        if right == 0 {
            (left, right, top, bottom) = (0, 1, 0, 1);
        }
        Self { columns: left..right, rows: top..bottom, size }
    }

    /// Pixels of the rectangle row by row, with `None` for unchanged ones.
    pub fn pixels<'a, T: PartialEq + Copy>(
        &self,
        before: &'a [T],
        now: &'a [T],
    ) -> impl Iterator<Item = Option<T>> + use<'a, T> {
        let Self { columns, rows, size } = self.clone();
        let places = rows.flat_map(move |y| columns.clone().map(move |x| y * size + x));
        places.map(|place| (before.get(place) != Some(&now[place])).then(|| now[place]))
    }
}

#[cfg(test)]
#[path = "tests/difference.rs"]
mod tests;
