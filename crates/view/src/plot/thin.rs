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
mod tests {
    use super::*;

    const COLUMNS: usize = 100;

    fn thinned(values: &[f64]) -> Vec<PlotPoint> {
        let times: Vec<f64> = (0..values.len()).map(|i| i as f64).collect();
        thin(&times, values, [0.0, values.len() as f64], COLUMNS)
    }

    #[test]
    fn few_points_stay_as_they_are() {
        let points = thinned(&[1.0, f64::NAN, 3.0]);
        assert_eq!(points, [Some((0.0, 1.0)), None, Some((2.0, 3.0))]);
        assert_eq!(thinned(&[]), []);
    }

    #[test]
    fn every_column_keeps_its_extremes_and_its_ends() {
        // One spike up and one down in each column of 1000, never at its ends.
        let value = |i: usize| match i % 1000 {
            137 => 5.0 + i as f64,
            731 => -5.0 - i as f64,
            within => within as f64 * 1e-3,
        };
        let values: Vec<f64> = (0..1000 * COLUMNS).map(value).collect();
        let points: Vec<_> = thinned(&values).into_iter().flatten().collect();
        assert_eq!(points.len(), 4 * COLUMNS);
        assert!(points.is_sorted_by(|a, b| a.0 < b.0));
        for column in 0..COLUMNS {
            for within in [0, 137, 731, 999] {
                let i = 1000 * column + within;
                assert!(points.contains(&(i as f64, value(i))), "{i}");
            }
        }
    }

    #[test]
    fn gaps_as_wide_as_a_column_stay_and_the_number_of_points_is_bounded() {
        let half = |i: usize| if i < 25_000 { 1.0 } else { 2.0 };
        let open = |i: usize| !(20_000..30_000).contains(&i);
        let values: Vec<f64> =
            (0..50_000).map(|i| if open(i) { half(i) } else { f64::NAN }).collect();
        let points = thinned(&values);
        assert_eq!(points.iter().filter(|point| point.is_none()).count(), 1);

        let flicker: Vec<f64> =
            (0..50_000).map(|i| if i % 2 == 0 { 1.0 } else { f64::NAN }).collect();
        assert!(thinned(&flicker).len() <= 5 * COLUMNS);
    }
}
