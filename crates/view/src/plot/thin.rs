//! Thinning of curves to the resolution of a picture, with all extremes preserved.

/// Point of a curve, or `None` for a gap.
pub type PlotPoint = Option<(f64, f64)>;

/// First, lowest, highest and last point in a column of pixels, and its gaps.
struct PixelColumn {
    number: usize,
    /// True if the curve has a gap before the first point.
    gap_before: bool,
    /// True if it has a gap after the last point.
    gap_after: bool,
    first: usize,
    lowest: usize,
    highest: usize,
    last: usize,
}

/// Curve of `values` over `times`, thinned by [`thin_rows`].
pub fn thin(times: &[f64], values: &[f64], range: [f64; 2], columns: usize) -> Vec<PlotPoint> {
    let rows = thin_rows(times, values, range, columns).into_iter();
    rows.map(|row| row.map(|i| (times[i], values[i]))).collect()
}

/// Indices of the values that suffice to draw a curve of `values` over `times`. NaN is a gap and
/// yields `None`.
///
/// Up to four values per column are all kept. Otherwise each of the `columns` equal parts of
/// `range` keeps its first, lowest, highest and last value, in order of time. A gap within a column
/// is too narrow to draw and is dropped.
pub fn thin_rows(
    times: &[f64],
    values: &[f64],
    range: [f64; 2],
    columns: usize,
) -> Vec<Option<usize>> {
    let count = times.len().min(values.len());
    if count <= 4 * columns {
        return (0..count).map(|i| Some(i).filter(|&i| !values[i].is_nan())).collect();
    }
    let mut rows = Vec::with_capacity(4 * columns);
    let mut column: Option<PixelColumn> = None;
    let mut gap = false;
    let scale = columns as f64 / (range[1] - range[0]);
    for i in 0..count {
        let number = (((times[i] - range[0]) * scale) as usize).min(columns - 1);
        if let Some(full) = column.take_if(|column| column.number != number) {
            full.close(&mut rows);
            gap = full.gap_after;
        }
        if values[i].is_nan() {
            match &mut column {
                Some(column) => column.gap_after = true,
                None => gap = true,
            }
            continue;
        }
        match &mut column {
            None => column = Some(PixelColumn::new(number, gap, i)),
            Some(column) => column.add(i, values),
        }
        gap = false;
    }
    if let Some(full) = column {
        full.close(&mut rows);
    }
    rows
}

impl PixelColumn {
    fn new(number: usize, gap_before: bool, i: usize) -> Self {
        Self { number, gap_before, gap_after: false, first: i, lowest: i, highest: i, last: i }
    }

    fn add(&mut self, i: usize, values: &[f64]) {
        self.gap_after = false;
        self.last = i;
        if values[i] < values[self.lowest] {
            self.lowest = i;
        }
        if values[i] > values[self.highest] {
            self.highest = i;
        }
    }

    fn close(&self, rows: &mut Vec<Option<usize>>) {
        if self.gap_before {
            rows.push(None);
        }
        let mut kept = [self.first, self.lowest, self.highest, self.last];
        kept.sort_unstable();
        for (place, &i) in kept.iter().enumerate() {
            if place == 0 || kept[place - 1] != i {
                rows.push(Some(i));
            }
        }
    }
}

#[cfg(test)]
#[path = "tests/thin.rs"]
mod tests;
